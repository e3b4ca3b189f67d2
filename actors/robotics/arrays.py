"""Arrays of a few floats, for which NumPy is slow, and how they enter numba's kernels.

``arrays.pyx`` does the same in C, in a tenth of the time, if a compiler was available.
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

_FLOAT = np.dtype(np.float64)  # NumPy searches for it at each call if the type is given instead


def read_only(value: ArrayLike) -> Array:
    """A read-only copy, contiguous as kernels need it."""
    array = np.array(value, _FLOAT, order="C")
    array.setflags(False)  # type: ignore[call-arg]  # write=False takes as long as the copy
    return array


def array_of(numbers: Sequence[float]) -> Array:
    """An array of one dimension."""
    return np.array(numbers, _FLOAT)


def pair(values: ArrayLike) -> Pair:
    """The two floats of an array."""
    x, y = np.asarray(values, dtype=_FLOAT).tolist()
    return x, y


def floats(values: ArrayLike) -> tuple[float, ...]:
    """The floats of an array of one dimension."""
    return tuple(np.asarray(values, dtype=_FLOAT).tolist())


def all_finite(numbers: Sequence[float]) -> bool:
    """Whether every number is finite; for the few of a token, ten times as fast as ``np.isfinite(array).all()``."""
    return math.isfinite(sum(numbers)) or all(map(math.isfinite, numbers))  # finite numbers can add up to infinity


def finite(array: Array) -> bool:
    """The same for the numbers of an array."""
    return all_finite((array if array.ndim == 1 else array.ravel()).tolist())


def joined(numbers: Sequence[float], array: Array) -> Array:
    """The numbers, followed by those of an array."""
    made = np.empty(len(numbers) + array.size)
    made[: len(numbers)] = numbers
    made[len(numbers) :] = array.ravel()
    return made


def stacked(rows: Iterable[Array], columns: int) -> Array:
    """A table of rows, padded with zeros to a number of columns or to the longest row."""
    kept = list(rows)
    table = np.zeros((len(kept), max(columns, *map(len, kept)) if kept else columns))
    for place, row in enumerate(kept):
        table[place, : len(row)] = row
    return table


def entered(jitted: Function, compiled: Callable[[], Any], takes: str, gives: str) -> Function:
    """A kernel as Python calls it: by numba's own way, which takes long to check each array.

    In C it is called by its address, which is in the object that ``compiled`` returns, with the address of a row of
    words: first a function that makes an array from an address and its shape; then the arguments that the kernel
    ``takes``, a float (d), an int (i), a bool (b), or an array of 1 to 9 dimensions, as its address and a word for each
    length. If it returns 1, the results it ``gives`` are in the same place.
    """
    return jitted
