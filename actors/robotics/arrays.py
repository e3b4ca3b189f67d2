"""Arrays of a few floats, of which NumPy looks at none without taking its time, and their way into numba's kernels.

``arrays.pyx`` does the same in C, where there was a compiler, and takes a tenth of that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
# Of floats: arithmetic on arrays of two takes ten times as long.
Pair = tuple[float, float]
Function = TypeVar("Function", bound=Callable[..., object])

_FLOAT = np.dtype(np.float64)  # NumPy looks for it at each call where the type is given instead


def read_only(value: ArrayLike) -> Array:
    """A copy that nobody can write to."""
    array = np.array(value, _FLOAT)
    array.setflags(False)  # type: ignore[call-arg]  # write=False takes as long as the copy
    return array


def array_of(numbers: Sequence[float]) -> Array:
    """An array of one dimension."""
    return np.array(numbers, _FLOAT)


def pair(values: ArrayLike) -> Pair:
    """The two floats of an array."""
    x, y = np.asarray(values, dtype=_FLOAT).tolist()
    return x, y


def all_finite(numbers: Sequence[float]) -> bool:
    """Whether every number is finite; for the few of a token, ten times as fast as ``np.isfinite(array).all()``."""
    return math.isfinite(sum(numbers)) or all(map(math.isfinite, numbers))  # finite ones can add up to infinity


def finite(array: Array) -> bool:
    """The same of the numbers of an array."""
    return all_finite((array if array.ndim == 1 else array.ravel()).tolist())


def joined(numbers: Sequence[float], array: Array) -> Array:
    """The numbers, and behind them those of an array."""
    made = np.empty(len(numbers) + array.size)
    made[: len(numbers)] = numbers
    made[len(numbers) :] = array.ravel()
    return made


def stacked(rows: Iterable[Array], columns: int) -> Array:
    """A table of rows, with zeros where they end; it has so many columns, or as many as the longest row."""
    kept = list(rows)
    table = np.zeros((len(kept), max(columns, *map(len, kept)) if kept else columns))
    for place, row in enumerate(kept):
        table[place, : len(row)] = row
    return table


def entered(jitted: Function, compiled: Callable[[], Any], takes: str, gives: str) -> Function:
    """A kernel as Python calls it: by numba's own way, which looks at each array for long.

    In C it is called by its address, which the object has that ``compiled`` returns, and given that of a row of words:
    first a function that makes an array of an address and its shape; then what the kernel ``takes``, a float (d), an
    int (i), a bool (b), or an array of so many dimensions (1 to 9), which is its address and a word for each length.
    What it ``gives`` stands there when it returns 1.
    """
    return jitted
