"""Replay: tokens from a recorded table."""

from __future__ import annotations

import math
from bisect import bisect_left
from pathlib import Path
from typing import Any

from .core import (
    Actor,
    EpicycleError,
    OutputPort,
    Parameter,
    ParameterError,
    did_you_mean,
    read_table,
    texts_parameter,
    to_nanoseconds,
)


class ReplayError(EpicycleError):
    """A table that cannot be replayed; the message names the file."""


class Replay(Actor):
    """Sends the rows of a CSV or Parquet table, each at its time.

    A table with one value column gives plain values, and nothing for an empty cell; with several columns, a token is a
    mapping from column to value, with None for an empty cell.  Rows with equal times come at successive microsteps.
    The file must be in or below the folder of the YAML file that names it.
    """

    output = OutputPort(doc="the value of a row, or a mapping of its values")

    file = Parameter(Path, doc="a .csv file with a header line, or a .parquet file")
    time = Parameter(str, "time", doc="the column of times, in s, ascending and >= 0")
    columns: Parameter[Any] = texts_parameter(None, doc="the columns to send; all except the time if left out")

    def check(self) -> None:
        if self.file.suffix.lower() not in (".csv", ".parquet"):
            raise ParameterError(f"file: {self.file.name!r} must end in .csv or .parquet")

    def initialize(self) -> None:
        self._times, self._values = self._read()
        self._row = 0
        self._wake_up()

    def restart(self) -> None:
        self._row = bisect_left(self._times, self.tag.time)
        self._wake_up()

    def _wake_up(self) -> None:
        if self._row < len(self._times):
            self.context.wake(self, self._times[self._row])

    def fire(self) -> None:
        token = self._values[self._row]
        self._row += 1
        self._wake_up()
        if token is not None:
            self.output.send(token)

    def _read(self) -> tuple[list[int], list[Any]]:
        """The times in ns and the tokens."""
        try:
            table = read_table(self.file)
        except OSError as error:
            raise self._error(str(error.strerror)) from None
        names = list(dict.fromkeys(table.column_names))
        if len(names) != table.num_columns:
            raise self._error(f"two of its columns have the same name: {', '.join(table.column_names)}")
        columns = [name for name in names if name != self.time] if self.columns is None else list(self.columns)
        for name in (self.time, *columns):
            if name not in names:
                guess = did_you_mean(name, names)
                raise self._error(f"it has no column {name!r}{guess}; columns: {', '.join(names)}")
        if not columns:
            raise self._error(f"it has no column of values, only {self.time!r}")
        times = self._check_times(table.column(self.time).to_pylist())
        values = [table.column(name).to_pylist() for name in columns]
        if len(columns) == 1:
            return times, values[0]
        return times, [dict(zip(columns, row, strict=True)) for row in zip(*values, strict=True)]

    def _check_times(self, times: list[Any]) -> list[int]:
        result: list[int] = []
        for row, time in enumerate(times, 1):
            if isinstance(time, bool) or not isinstance(time, (int, float)) or not math.isfinite(time) or time < 0:
                shown = "empty" if time is None else repr(time)
                raise self._error(f"row {row}: {self.time} is {shown}, expected a time in s >= 0")
            if result and to_nanoseconds(time) < result[-1]:
                raise self._error(f"row {row}: {self.time} is {time!r}, which is before the row above")
            result.append(to_nanoseconds(time))
        return result

    def _error(self, reason: str) -> ReplayError:
        return ReplayError(f"{self.file} cannot be replayed: {reason}")
