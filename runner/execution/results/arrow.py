"""Columns of an Arrow table, made of buffers, and the file of recorded signals.

``pyarrow.array`` would do, but imports all of pandas to check for its types, which takes longer than anything else in a
short run (0.5 s of 1.4 s).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from ...support.files import replacing
from .results import Results


def numbers(values: Sequence[float | None], kind: DTypeLike) -> Any:
    """A column of numbers of a NumPy type; None is null."""
    import pyarrow as pa

    nulls = _nulls(values)
    array = np.asarray(values if nulls is None else [0 if each is None else each for each in values], dtype=kind)
    return pa.Array.from_buffers(pa.from_numpy_dtype(array.dtype), len(array), [nulls, pa.py_buffer(array)])


def texts(values: Sequence[str | None]) -> Any:
    """A column of texts; None is null.  Lone surrogates, which are not characters, are escaped."""
    import pyarrow as pa

    encoded = [(value or "").encode(errors="backslashreplace") for value in values]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int64)
    kind, size = (pa.string(), np.int32) if ends[-1] < 2**31 else (pa.large_string(), np.int64)
    buffers = [_nulls(values), pa.py_buffer(ends.astype(size)), pa.py_buffer(b"".join(encoded))]
    return pa.Array.from_buffers(kind, len(encoded), buffers)


def _nulls(values: Sequence[object]) -> Any:
    """Which values are present, a bit for each; None if all are."""
    import pyarrow as pa

    present = np.fromiter((value is not None for value in values), bool, len(values))
    return None if present.all() else pa.py_buffer(np.packbits(present, bitorder="little"))


def categories(values: Sequence[str]) -> Any:
    """A column with few different texts, each stored once."""
    import pyarrow as pa

    known = {value: number for number, value in enumerate(dict.fromkeys(values))}
    return pa.DictionaryArray.from_arrays(numbers([known[value] for value in values], np.int32), texts(list(known)))


def write_signals(results: Results, path: Path) -> None:
    """The recorded signals, as in ``Results.table``."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    made = {"time": np.float64, "time_ns": np.int64, "microstep": np.int64, "value": np.float64}
    columns = results.table()
    table = pa.table(
        {
            name: numbers(values, made[name])
            if name in made
            else texts(values)
            if name == "text"
            else categories(values)
            for name, values in columns.items()
        }
    )
    # Most times are close to the one before; using that, Parquet needs two thirds of the space for both columns.
    encoding = dict.fromkeys(("time", "value"), "BYTE_STREAM_SPLIT") | {"time_ns": "DELTA_BINARY_PACKED"}
    few = [name for name in columns if name not in encoding]
    with replacing(path) as file:
        pq.write_table(table, file, compression="zstd", use_dictionary=few, column_encoding=encoding)
