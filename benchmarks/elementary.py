"""The elementary functions: worst error in units in the last place over a million points each, and time against math.

    python -m benchmarks.elementary [points [function ...]]

Errors are measured twice: long doubles (of 64 bits) find the worst points, and mpmath says how bad these are.  Where
long doubles are no longer than doubles, mpmath measures all of them, which takes a quarter of an hour.
"""

from __future__ import annotations

import math
import sys
import timeit
from collections.abc import Callable, Iterator
from time import process_time
from typing import Any

import mpmath
import numba
import numpy as np
from numpy.typing import NDArray

from epicycle.actors.core import elementary
from epicycle.actors.core.elementary.in_numba import register

Points = tuple[NDArray[np.float64], ...]
LONG = np.finfo(np.longdouble).eps < 1e-18
WORST = 300  # points of each function that mpmath checks
TRUTH: dict[str, Any] = {
    "exp": mpmath.exp, "log": mpmath.log, "log1p": mpmath.log1p, "expm1": mpmath.expm1, "sin": mpmath.sin,
    "cos": mpmath.cos, "tan": mpmath.tan, "asin": mpmath.asin, "acos": mpmath.acos, "atan": mpmath.atan,
    "atan2": mpmath.atan2, "pow": mpmath.power, "hypot": mpmath.hypot, "sinh": mpmath.sinh, "cosh": mpmath.cosh,
    "tanh": mpmath.tanh, "log2": lambda x: mpmath.log(x, 2), "log10": mpmath.log10,
}  # fmt: skip
UFUNCS = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "pow": "power"}
TYPICAL = {  # usual arguments of each, for the time
    "exp": (-3.0, 3.0), "log": (0.0, 100.0), "log1p": (-0.9, 9.0), "expm1": (-1.0, 1.0), "asin": (-1.0, 1.0),
    "acos": (-1.0, 1.0), "pow": (0.0, 10.0), "log2": (0.0, 100.0), "log10": (0.0, 100.0),
}  # fmt: skip


def points(name: str, count: int, seed: int = 1) -> Points:
    """Arguments of all sizes, of usual sizes, and hard ones."""
    random = np.random.default_rng(seed)

    def sizes(low: int, high: int, n: int) -> NDArray[np.float64]:
        """Of any sign, with exponents between two."""
        return np.ldexp(random.uniform(1, 2, n), random.integers(low, high, n)) * random.choice([-1, 1], n)

    third = count // 3
    low, high = TYPICAL.get(name, (-10.0, 10.0))
    usual = random.uniform(low, high, third)
    rest = count - 2 * third
    if name in ("exp", "expm1", "sinh", "cosh", "tanh"):
        few = np.round(random.uniform(-1100, 1100, rest)) * (math.log(2) / 256) + sizes(-60, -20, rest)  # ends of steps
        wide = np.concatenate([random.uniform(-745, 709, third // 2), sizes(-60, 9, third - third // 2)])
        if name in ("sinh", "cosh"):
            wide = np.clip(wide, -709.0, 709.0)
        return (np.concatenate([usual, wide, few]),)
    if name in ("log", "log2", "log10", "log1p"):
        near = 1 + sizes(-52, -3, rest) if name != "log1p" else random.uniform(-1, 1, rest) ** 9
        wide = np.abs(sizes(-1074, 1023, third))
        if name == "log1p":
            wide[::3] = -random.uniform(0, 1, len(wide[::3]))
        return (np.concatenate([usual, wide, near]),)
    if name in ("sin", "cos", "tan"):
        near = np.round(sizes(0, 23, rest)) * (math.pi / 2)  # next to the multiples of pi/2
        near[::2] *= 1.0 + random.integers(-3, 4, len(near[::2])) * 2.0**-52
        return (np.concatenate([usual, sizes(-30, 1023, third), near]),)
    if name in ("asin", "acos"):
        near = (1.0 - np.abs(sizes(-53, -2, rest))) * random.choice([-1, 1], rest)
        return (np.concatenate([usual, sizes(-40, 0, third), near]),)
    if name == "atan":
        near = np.round(random.uniform(0, 64, rest)) / 64 + 1 / 128 + sizes(-50, -20, rest)
        near[::2] = 1.0 / near[::2]
        return (np.concatenate([usual, sizes(-60, 60, third), near]),)
    if name in ("atan2", "hypot"):
        x = sizes(-960, 960, third)
        far = x * sizes(-30, 30, third)
        other = random.uniform(low, high, third)
        near = sizes(-10, 10, rest)
        return np.concatenate([usual, far, near]), np.concatenate([other, x, near * random.uniform(0, 2, rest)])
    x = np.concatenate([usual, np.abs(sizes(-1074, 1023, third)), 1.0 + sizes(-52, -2, rest)])
    # powers of any size: y so that x**y is a double
    y = random.uniform(-744, 709, count) / np.log(x)
    y[:third] = random.uniform(-10, 10, third)
    few = np.isfinite(y) & (np.abs(y * np.log(x)) < 744) & (y * np.log(x) < 709)
    return np.where(few, x, 2.0), np.where(few, y, 0.5)


def compiled_by(library: Any, name: str, arguments: int) -> Callable[..., NDArray[np.float64]]:
    """A function of elementary or math over arrays, as numba compiles it."""
    function = getattr(library, name)
    if arguments == 1:

        def each(x: Any) -> Any:
            result = np.empty(len(x))
            for i in range(len(x)):
                result[i] = function(x[i])
            return result

        return numba.njit(each)  # type: ignore[no-any-return]

    def pairs(x: Any, y: Any) -> Any:
        result = np.empty(len(x))
        for i in range(len(x)):
            result[i] = function(x[i], y[i])
        return result

    return numba.njit(pairs)  # type: ignore[no-any-return]


def error(name: str, at: tuple[float, ...], value: float) -> float:
    """The error of a value in units in the last place."""
    with mpmath.workprec(1300 if name in ("sin", "cos", "tan") else 200):
        truth = TRUTH[name](*map(mpmath.mpf, at))
        return float(abs(mpmath.mpf(value) - truth) / math.ulp(float(truth)))


def worst(name: str, at: Points, values: NDArray[np.float64]) -> tuple[float, tuple[float, ...]]:
    """The worst error and its place."""
    chosen: Any = range(len(values))
    if LONG:
        truth = getattr(np, UFUNCS.get(name, name))(*(x.astype(np.longdouble) for x in at))
        off = np.abs(values - truth) / np.spacing(np.abs(truth).astype(np.float64))
        chosen = np.argsort(np.where(np.isnan(off), np.inf, off))[-WORST:]
    found = [(error(name, tuple(float(x[i]) for x in at), float(values[i])), int(i)) for i in chosen]
    size, where = max(found)
    return size, tuple(float(x[where]) for x in at)


def times(name: str, arguments: int) -> Iterator[float]:
    """ns of one call: interpreted ours and math's, compiled ours and math's."""
    low, high = TYPICAL.get(name, (-10.0, 10.0))
    at = [np.random.default_rng(k).uniform(low, high, 1000) for k in range(arguments)]
    lists = list(zip(*(x.tolist() for x in at), strict=True))
    theirs = getattr(math, name)
    for function in (getattr(elementary, name), theirs):

        def run(function: Any = function) -> None:
            for one in lists:
                function(*one)

        yield min(timeit.repeat(run, number=1, repeat=30, timer=process_time)) / 1000 * 1e9
    for library in (elementary, math):
        function = compiled_by(library, name, arguments)
        large = [np.resize(x, 100_000) for x in at]
        function(*large)
        calls = timeit.repeat(lambda f=function, x=large: f(*x), number=1, repeat=20, timer=process_time)
        yield min(calls) / 100_000 * 1e9


def main() -> None:
    """Print the table."""
    register()
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    names = sys.argv[2:] or list(TRUTH)
    print("| function | worst error [ulp] | at | Python [ns] | math | compiled [ns] | math |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in names:
        at = points(name, count)
        values = compiled_by(elementary, name, len(at))(*at)
        size, where = worst(name, at, values)
        cells = " | ".join(f"{each:.0f}" if each > 20 else f"{each:.1f}" for each in times(name, len(at)))
        print(f"| {name} | {size:.3f} | {', '.join(map(repr, where))} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
