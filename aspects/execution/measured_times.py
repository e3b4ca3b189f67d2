"""Execution times that were measured, read from a table."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, did_you_mean, read_table


class MeasuredTimes:
    """A file of execution times (s): the signals of a run, or a table with a column ``value`` for all actors alike."""

    def __init__(self, file: Path) -> None:
        if file.suffix.lower() not in (".csv", ".parquet"):
            raise EpicycleError(f"times: {file.name!r} ends neither in .csv nor in .parquet")
        self.file = file

    def of(self, actor: str, number: int) -> float:
        """The time of an actor's firing of that number, from 0 on; raises ``EpicycleError``."""
        times = self._times.get("") or self._times.get(actor)
        if times is None:
            raise self._error(
                f"it has no times of {actor}{did_you_mean(actor, self._times)}; it has those of "
                f"{', '.join(self._times) or 'no actor'}"
            )
        return times[number % len(times)]

    @cached_property
    def _times(self) -> dict[str, list[float]]:
        """The times of each actor; under no name, if they are for all."""
        table = self._table()
        if "value" not in table.column_names:
            raise self._error(f"there is no column 'value'; columns: {', '.join(table.column_names)}")
        values = table.column("value").to_pylist()
        is_for_all = "signal" not in table.column_names
        names = [""] * len(values) if is_for_all else map(str, table.column("signal").to_pylist())
        found: dict[str, list[float]] = {}
        for row, (name, value) in enumerate(zip(names, values, strict=True), 1):
            _, at, actor = name.partition("@")
            if not at and not is_for_all:
                continue  # another signal
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < float("inf"):
                raise self._error(f"row {row}: {value!r} is not a time in s from 0 on")
            found.setdefault(actor, []).append(float(value))
        if is_for_all and not found:
            raise self._error("it has no rows")
        return found

    def _table(self) -> Any:
        try:
            return read_table(self.file)
        except OSError as error:
            raise self._error(str(error.strerror)) from None

    def _error(self, reason: str) -> EpicycleError:
        return EpicycleError(f"the execution times in {self.file} cannot be used: {reason}")
