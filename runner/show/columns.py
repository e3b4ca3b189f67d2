"""Columns of an Arrow table, made of buffers.

``pyarrow.array`` would do, but imports all of pandas to ask whether the values are of its kinds, which takes longer
than anything else that a short run does (0.5 s of 1.4 s).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike


def numbers(values: Sequence[float], kind: DTypeLike) -> Any:
    """A column of numbers of a NumPy type."""
    import pyarrow as pa

    array = np.asarray(values, dtype=kind)
    return pa.Array.from_buffers(pa.from_numpy_dtype(array.dtype), len(array), [None, pa.py_buffer(array)])


def texts(values: Iterable[str]) -> Any:
    """A column of texts."""
    import pyarrow as pa

    encoded = [value.encode() for value in values]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    return pa.Array.from_buffers(pa.string(), len(encoded), [None, pa.py_buffer(ends), pa.py_buffer(b"".join(encoded))])


def categories(values: Sequence[str]) -> Any:
    """A column of texts of which there are few, each stored once."""
    import pyarrow as pa

    known = {value: number for number, value in enumerate(dict.fromkeys(values))}
    return pa.DictionaryArray.from_arrays(numbers([known[value] for value in values], np.int32), texts(known))
