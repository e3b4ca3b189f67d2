"""The elementary functions: near the truth, as the module math where a value is none, and the same when compiled."""

from __future__ import annotations

import itertools
import math
import os
import subprocess
import sys
from collections.abc import Callable

import mpmath
import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.elementary import TRUTH, UFUNCS, compiled_by, error, points, worst
from epicycle.actors.core import elementary
from epicycle.actors.core.elementary.in_numba import register

register()
SPECIAL = [0.0, 5e-324, 1e-310, 2.2250738585072014e-308, 1e-200, 1e-17, 1e-9, 0.25, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 20.0]
SPECIAL += [39.0, 41.0, 307.5, 709.5, 709.79, 711.0, 745.2, 800.0, 1e6, 2.0**53 - 1.0, 2.0**53, 1e22, 1e200, 1.7e308]
SPECIAL += [math.inf]
SPECIAL = [math.nan, *SPECIAL, *(-x for x in SPECIAL)]


def answer(function: Callable[..., float], *at: float) -> float | str:
    """What a function returns, or raises."""
    try:
        return function(*at)
    except (ValueError, OverflowError) as error:
        return type(error).__name__


def same(one: float | str, other: float | str, ulps: float = 0.0) -> bool:
    """Equal with sign and type, NaN being itself, or nearly equal."""
    if isinstance(one, str) or isinstance(other, str) or math.isnan(one) or math.isnan(other):
        return repr(one) == repr(other)
    if one == other:
        return math.copysign(1.0, one) == math.copysign(1.0, other)
    return abs(one - other) <= ulps * math.ulp(other)


def arguments(name: str) -> list[tuple[float, ...]]:
    """All special values, or pairs of them."""
    return list(itertools.product(SPECIAL, repeat=2 if name in ("atan2", "pow", "hypot") else 1))


@pytest.mark.parametrize("name", TRUTH)
def test_special_values_are_those_of_math(name: str) -> None:
    wrong = []
    for at in arguments(name):
        ours, theirs = answer(getattr(elementary, name), *at), answer(getattr(math, name), *at)
        if not same(ours, theirs, 1.0):
            wrong.append((at, ours, theirs))
    assert not wrong


@pytest.mark.parametrize(
    ("name", "angle", "value"),
    [
        ("cos", 91553.86390724055, 2.260440600708132e-16), ("cos", 229174.47169039503, 3.1615741620973803e-16),
        ("cos", 245403.9393388399, -1.362519568595878e-14), ("sin", 183107.7278144811, 4.520881201416264e-16),
        ("cos", 168893.59185331408, 5.209832608140709e-14), ("cos", 390256.4934105581, 1.9688653317865783e-14),
    ],
)  # fmt: skip
def test_near_quarter_turns(name: str, angle: float, value: float) -> None:
    """There nearly all digits of an angle cancel; with fewer of pi, the last one of these would be another."""
    assert getattr(elementary, name)(angle) == value
    with mpmath.workdps(60):
        assert value == float(getattr(mpmath, name)(mpmath.mpf(angle)))


def test_powers_near_the_ends_of_what_floats_can_be() -> None:
    assert elementary.pow(2.0, 1023.5) == 1.2711610061536464e308
    assert elementary.pow(2.0, 1023.9999999999998) == 1.7976931348620325e308
    assert answer(elementary.pow, 2.0, 1024.0) == "OverflowError"
    assert elementary.pow(2.0, -1074.0) == 5e-324
    assert elementary.pow(2.0, -1074.9) == 5e-324
    assert elementary.pow(2.0, -1075.1) == 0.0
    assert elementary.pow(0.5, 1e18) == 0.0
    assert answer(elementary.pow, 0.5, -1e18) == "OverflowError"


@pytest.mark.slow
@pytest.mark.parametrize("name", TRUTH)
def test_compiled_code_gives_the_same_bits_and_no_exception(name: str) -> None:
    function = getattr(elementary, name)
    at = points(name, 3_000, seed=2)
    special = np.array(arguments(name)).T
    at = tuple(np.concatenate(both) for both in zip(at, special, strict=True))
    found = compiled_by(elementary, name, len(at))(*at)
    for one, value in zip(zip(*(x.tolist() for x in at), strict=True), found.tolist(), strict=True):
        interpreted = answer(function, *one)
        if isinstance(interpreted, str):  # an exception: compiled, NaN or the infinity that C99 has there
            with np.errstate(all="ignore"):
                interpreted = float(getattr(np, UFUNCS.get(name, name))(*one))
            assert not math.isfinite(value), one
        assert same(interpreted, value), one


@pytest.mark.slow
@pytest.mark.parametrize("name", TRUTH)
def test_within_an_ulp_of_the_truth(name: str) -> None:
    at = points(name, 10_000, seed=3)
    off, where = worst(name, at, compiled_by(elementary, name, len(at))(*at))
    assert off < 0.9, where


def test_angles_that_come_closest_to_multiples_of_half_a_pi() -> None:
    hard = [6381956970095103.0 * 2.0**797, 92133.48775182787, 45.553093477052, 1e22, 1.7e308]
    hard += [11.0, 22.0, 333.0, 355.0, 52174.0, 103993.0, 104348.0, 312689.0, 833719.0, 1146408.0, 80143857.0]
    hard += [n * (math.pi / 2) for n in (1, 2, 3, 4, 10, 1000, 58654, 636619, 10**6, 10**9)]
    for name in ("sin", "cos", "tan"):
        for x in hard:
            for at in (x, math.nextafter(x, 0.0), -x):
                assert error(name, (at,), getattr(elementary, name)(at)) < 0.9, (name, at)


def test_lengths_in_space() -> None:
    assert elementary.hypot(2.0, 3.0, 6.0) == 7.0
    assert elementary.hypot(1e300, 1e300, 1e300, 1e300) == 2e300
    assert elementary.hypot(1e-320, 0.0, 0.0) == 1e-320
    assert elementary.hypot(-3.0) == 3.0
    assert elementary.hypot(1.0, math.nan, math.inf) == math.inf
    assert math.isnan(elementary.hypot(1.0, 2.0, math.nan))
    assert elementary.distance((1.0, 2.0, 3.0), (3.0, 5.0, 9.0)) == 7.0
    assert elementary.distance([1.0, 1.0], [4.0, 5.0]) == 5.0
    random = np.random.default_rng(1)
    for vector in random.normal(0.0, 10.0, (1000, 5)).tolist():
        assert same(elementary.hypot(*vector), math.hypot(*vector), 1.0)


def test_the_logarithm_of_the_gamma_function() -> None:
    random = np.random.default_rng(1)
    for x in [1.0, 2.0, 1e-300, 0.5, 9.9, 10.0, 171.0, 1e15, 1e300, *(10.0 ** random.uniform(-3, 6, 2000)).tolist()]:
        truth = float(mpmath.loggamma(x))
        assert abs(elementary.log_gamma(x) - truth) <= 1e-14 * max(1.0, abs(truth)), x
    assert elementary.log_gamma(math.inf) == math.inf
    with pytest.raises(ValueError, match=r"^math domain error$"):
        elementary.log_gamma(0.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", TRUTH)
def test_within_an_ulp_of_the_truth_at_a_million_points(name: str) -> None:
    at = points(name, 1_000_000, seed=4)
    off, where = worst(name, at, compiled_by(elementary, name, len(at))(*at))
    assert off < 0.9, where


@given(st.floats(-1e300, 1e300))
def test_symmetries(x: float) -> None:
    for name in ("sin", "tan", "atan", "tanh"):
        function = getattr(elementary, name)
        assert same(function(-x), -function(x))
    assert elementary.cos(-x) == elementary.cos(x)
    assert elementary.hypot(-x, 1.5) == elementary.hypot(1.5, x)
    assert elementary.atan2(-1.5, x) == -elementary.atan2(1.5, x)


@given(st.floats(-700.0, 700.0), st.floats(1e-12, 1.0))
def test_growing_functions_grow(x: float, step: float) -> None:
    y = x + step * max(1.0, abs(x))
    for name in ("exp", "expm1", "sinh", "atan", "tanh"):
        function = getattr(elementary, name)
        assert function(x) <= function(min(y, 700.0)) if x < y <= 700.0 else True
    assert x <= 0.0 or elementary.log(x) <= elementary.log(y)


@given(st.floats(1e-300, 1e300), st.integers(-1020, 1020))
def test_exact_powers_and_logarithms(x: float, n: int) -> None:
    assert elementary.pow(x, 1.0) == x
    assert elementary.pow(2.0, n) == math.ldexp(1.0, n)
    assert elementary.log2(math.ldexp(1.0, n)) == n
    assert elementary.pow(x, 2.0) == x * x if x < 1e150 else True
    assert n < 0 or n > 22 or elementary.log10(10.0**n) == n


def test_powers_of_whole_numbers_are_whole() -> None:
    assert repr(elementary.power(3, 40)) == str(3**40)
    assert repr(elementary.power(2, -1)) == "0.5"
    assert elementary.power(-8.0, 3) == -512.0
    with pytest.raises(ValueError, match=r"^the result is not a real number$"):
        elementary.power(-8, 1 / 3)
    with pytest.raises(ZeroDivisionError, match=r"^0 cannot be raised to a negative power$"):
        elementary.power(0.0, -1)
    with pytest.raises(OverflowError, match=r"^math range error$"):
        elementary.power(1e200, 2)


def test_a_total_is_added_up_in_order() -> None:
    assert elementary.total([1e16, 1.0, -1e16]) == 0.0  # which the built-in sum of Python 3.12 says is 1
    assert repr(elementary.total(iter([1, 2, 3]))) == "6"
    assert repr(elementary.total([])) == "0"


OTHER_PROCESSOR = """
import hashlib, re
import numba, numpy as np
from epicycle.actors import elementary

@numba.njit
def fused(a, b, c):
    for i in range(len(a)):
        c[i] = c[i] + a[i] * b[i]

fused(np.ones(9), np.ones(9), np.ones(9))
assert not re.search(r"\\bv?fn?m(add|sub)", "".join(fused.inspect_asm().values()))

@numba.njit
def bits(x):
    result = np.empty((len(x), 8))
    for i in range(len(x)):
        result[i, 0], result[i, 1] = elementary.exp(x[i]), elementary.log(abs(x[i]))
        result[i, 2], result[i, 3] = elementary.sin(x[i]), elementary.tanh(x[i])
        result[i, 4], result[i, 5] = elementary.atan2(x[i], 2.0), elementary.pow(abs(x[i]), 1.5)
        result[i, 6], result[i, 7] = elementary.hypot(x[i], 1.5), elementary.expm1(x[i])
    return result

x = np.ldexp(np.arange(-5000, 5000) / 3.0, np.arange(10000) % 40 - 33)
print(hashlib.sha256(bits(x).tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_compiled_for_other_processors_the_bits_are_the_same_and_nothing_is_fused() -> None:
    found, features = set(), numba.core.codegen.get_host_cpu_features().split(",")
    for processor, needed in {"": "", "generic": "", "haswell": "+avx2", "skylake-avx512": "+avx512f"}.items():
        if needed and needed not in features:
            continue
        settings = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""} if processor else {}
        code = [sys.executable, "-c", OTHER_PROCESSOR]
        made = subprocess.run(code, env=os.environ | settings, capture_output=True, text=True, check=True)
        found.add(made.stdout)
    assert len(found) == 1
