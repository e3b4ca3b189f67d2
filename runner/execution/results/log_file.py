"""LogFile: an event log that is written during the run, so that it takes no memory."""

from __future__ import annotations

import csv
import io
import json
import logging
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Self

import numpy as np

from ...support.interrupt import held
from .arrow import numbers, texts
from .log import COLUMNS, LogError, Record

FORMATS = (".parquet", ".csv", ".jsonl")
_LOGGER = logging.getLogger("epicycle")
_ROWS = 10_000  # rows that are written together
_Row = tuple[Any, ...]


class LogFile:
    """Parquet, CSV or JSON lines, by the suffix of the file's name; raises ``LogError``.

    All its records are in the file once it is closed, however the run has ended.  A file that can no longer be written,
    as on a full disk, does not end the run: the error is reported when the file is closed.

    >>> with LogFile(Path("log.csv")) as file:
    ...     Simulation(model, keep_log=True, log_to=file.add).run()
    """

    def __init__(self, path: Path) -> None:
        check_log_path(path)
        self.path = path
        self._rows: list[_Row] = []
        self._failure: OSError | None = None

    def __enter__(self) -> Self:
        open_file = {".parquet": _parquet, ".csv": _csv}.get(self.path.suffix, _json_lines)
        try:
            self._write, self._close = open_file(self.path)
        except OSError as error:
            raise self._error(error) from error
        return self

    def add(self, record: Record) -> None:
        """Append a record."""
        self._rows.append(record.row())
        if len(self._rows) >= _ROWS:
            with held():
                self._flush()

    def __exit__(self, *raised: object) -> None:
        with held():
            self._flush()
            try:
                self._close()
            except OSError as error:
                self._failure = self._failure or error
        if self._failure is not None:
            if raised[0] is None:
                raise self._error(self._failure) from self._failure
            _LOGGER.warning("error: %s", self._error(self._failure))

    def _flush(self) -> None:
        rows, self._rows = self._rows, []
        if self._failure is None and rows:
            try:
                self._write(rows)
            except OSError as error:
                self._failure = error

    def _error(self, error: OSError) -> LogError:
        return LogError(f"{self.path} cannot be written: {error.strerror or error}")


def check_log_path(path: Path) -> None:
    """Raise ``LogError`` early, before a run whose log could not be written."""
    if path.suffix not in FORMATS:
        raise LogError(f"{path} is not a log file: its name must end in {', '.join(FORMATS)}")
    if not path.parent.is_dir():
        raise LogError(f"{path} cannot be written: there is no folder {path.parent}")


def write_log(records: Iterable[Record], path: Path) -> None:
    """Write kept records."""
    with LogFile(path) as file:
        for record in records:
            file.add(record)


# -- formats: functions that write many rows, and that end the file ---------------------------------------------------

_Opened = tuple[Callable[[list[_Row]], None], Callable[[], None]]


def _json_lines(path: Path) -> _Opened:
    file = path.open("wb", buffering=0)

    def line(row: _Row) -> str:
        head = json.dumps(dict(zip(COLUMNS[:-1], row[:-1], strict=True)))
        return f'{head[:-1]}, "value": {row[-1]}}}\n'

    return lambda rows: _put(file, "".join(map(line, rows))), file.close


def _csv(path: Path) -> _Opened:
    file = path.open("wb", buffering=0)

    def write(rows: Iterable[_Row]) -> None:
        text = io.StringIO()
        csv.writer(text).writerows(rows)
        _put(file, text.getvalue())

    write([COLUMNS])
    return write, file.close


def _put(file: io.FileIO, text: str) -> None:
    """Write everything at once, so that a kill leaves few incomplete lines."""
    data = memoryview(text.encode())
    while data:
        data = data[file.write(data) or 0 :]


def _parquet(path: Path) -> _Opened:
    import pyarrow as pa
    import pyarrow.parquet as pq

    kinds = {"time": np.float64, "microstep": np.int64, "channel": np.int64}
    fields = [(name, pa.from_numpy_dtype(kinds[name]) if name in kinds else pa.string()) for name in COLUMNS]
    schema = pa.schema(fields)
    writer = pq.ParquetWriter(path, schema)

    def write(rows: list[_Row]) -> None:
        columns = (
            numbers(column, kinds[name]) if name in kinds else texts(column)
            for name, column in zip(COLUMNS, zip(*rows, strict=True), strict=True)
        )
        writer.write_table(pa.Table.from_arrays(list(columns), schema=schema))

    return write, writer.close
