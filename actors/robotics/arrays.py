"""Arrays of a few floats, for which NumPy is slow, and how they enter numba's kernels.

``arrays.pyx`` does the same in C, in a tenth of the time, if a compiler was available.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
_FLOAT = np.dtype(np.float64)  # NumPy searches for it at each call if the type is given instead


def read_only(value: ArrayLike) -> Array:
    """A read-only copy, contiguous as kernels need it."""
    array = np.array(value, _FLOAT, order="C")
    array.setflags(False)  # type: ignore[call-arg]  # write=False takes as long as the copy
    return array


def array_of(numbers: Sequence[float]) -> Array:
    """An array of one dimension."""
    return np.array(numbers, _FLOAT)


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


Entry: Any = None  # in C, what calls a kernel by its address, see ``numerics.entry``
