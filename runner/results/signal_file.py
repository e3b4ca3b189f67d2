"""The recorded signals of a run in a Parquet file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from .arrow import categories, numbers, texts
from .results import Results


def write_signals(results: Results, path: Path) -> None:
    """The recorded signals as ``Results.table`` has them."""
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
    aside = path.with_name(f".{path.name}")
    # Numbers are mostly near to the one before: told that, Parquet takes two thirds of the place for both times.
    encoding = dict.fromkeys(("time", "value"), "BYTE_STREAM_SPLIT") | {"time_ns": "DELTA_BINARY_PACKED"}
    few = [name for name in columns if name not in encoding]
    pq.write_table(table, aside, compression="zstd", use_dictionary=few, column_encoding=encoding)
    os.replace(aside, path)
