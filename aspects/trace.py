"""Measured channels: traces of losses and delays, and the aspect that replays them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, ClassVar

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import Configurable, EpicycleError, Parameter, did_you_mean, open_regular, to_seconds

from .core import CommunicationAspect, JoinPoint

MOST = 10_000_000  # rows
LONGEST = 1_000_000_000_000_000_000  # ns, of a trace and of a delay
_BACK = 1_000  # sequence numbers by which a message may come late
_EXACT = 9007199254740992.0  # floats up to here hold every whole number
UNITS = {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1.0}  # in ns
TOKEN, TIME = "token", "time"
REPEAT, PASS, STOP = "repeat", "pass", "stop"
FIRST, RANDOM = "first", "random"


class TraceError(EpicycleError):
    """A file that holds no trace of a channel; the message names the file."""


@dataclass(frozen=True)
class Trace:
    """What happened to each message of a measured channel, in order.  Times are in ns since the first message."""

    lost: NDArray[np.bool_]
    delays: NDArray[np.int64] | None  # 0 for lost ones
    times: NDArray[np.int64] | None

    def __len__(self) -> int:
        return len(self.lost)


class TraceFile(Configurable):
    """A file with a row for each message that was sent, or for each that arrived, with a ``sequence`` number.

    Columns that have their usual names need not be mentioned, and those that the file lacks are left out.
    """

    file = Parameter(Path, doc="a .csv file with a header line, or a .parquet file")
    time = Parameter(str, "time", doc="the column of the times of sending, in s, ascending")
    lost = Parameter(str, "lost", doc="the column that says whether a message was lost: true or false, or 1 or 0")
    received = Parameter(str, "received", doc="the column that says whether it arrived, in place of lost")
    delay = Parameter(
        str, "delay", doc="the column of delays; without lost and received, a message with an empty delay was lost"
    )
    delay_unit = Parameter(str, "s", choices=tuple(UNITS), doc="the unit of the delays")
    sequence = Parameter(
        str, None, doc="the column of sequence numbers, if there is one: messages whose numbers are missing were lost"
    )
    wraps = Parameter(
        int, None, min=2, max=2**53, doc="how many sequence numbers there are before they start again, such as 65536"
    )

    def read(self) -> Trace:
        """The trace in the file; raises ``TraceError``."""
        if self.file.suffix.lower() not in (".csv", ".parquet"):
            raise self._error("its name must end in .csv or .parquet")
        try:
            with open_regular(self.file) as file:
                columns = self._columns(file)
        except OSError as error:
            raise self._error(str(error.strerror or error)) from None
        return self._trace(columns)

    def _error(self, reason: str) -> TraceError:
        return TraceError(f"{self.file} is not a trace: {reason}")

    # -- columns --------------------------------------------------------------------------------------------------

    def _columns(self, file: BinaryIO) -> dict[str, NDArray[np.float64]]:
        """The columns by what they mean, as numbers; an empty cell is NaN."""
        import pyarrow as arrow  # heavy, and needed by few models

        try:
            names, batches = (self._csv if self.file.suffix.lower() == ".csv" else self._parquet)(file)
            found = self._found(names)
            parts: dict[str, list[NDArray[np.float64]]] = {what: [] for what in found}
            rows = 0
            for batch in batches(list(dict.fromkeys(found.values()))):
                rows += batch.num_rows
                if rows > MOST:
                    raise self._error(f"it has more than {MOST:,} rows; take a part of it")
                for what, name in found.items():
                    parts[what].append(self._numbers(name, batch.column(name)))
        except (arrow.ArrowException, UnicodeDecodeError) as error:
            raise self._error(" ".join(str(error).split())[:500]) from None
        if rows == 0:
            raise self._error("it has no rows")
        return {what: np.concatenate(each) for what, each in parts.items()}

    def _csv(self, file: BinaryIO) -> tuple[list[str], Any]:
        from pyarrow import csv, float64

        names = csv.open_csv(file).schema.names

        def batches(wanted: list[str]) -> Any:
            file.seek(0)
            # Read from the first block, a type would be too narrow for later ones.
            numbers = {each: float64() for each in wanted if each not in (self.lost, self.received)}
            return csv.open_csv(file, convert_options=csv.ConvertOptions(include_columns=wanted, column_types=numbers))

        return names, batches

    def _parquet(self, file: BinaryIO) -> tuple[list[str], Any]:
        from pyarrow import parquet

        opened = parquet.ParquetFile(file)
        if opened.metadata.num_rows > MOST:
            raise self._error(f"it has {opened.metadata.num_rows:,} rows, more than {MOST:,}; take a part of it")
        schema = opened.schema_arrow

        def batches(wanted: list[str]) -> Iterator[Any]:
            for name in wanted:  # before anything is read, which may be large
                self._check_type(name, schema.field(name).type)
            yield from opened.iter_batches(columns=wanted)

        return schema.names, batches

    def _found(self, names: list[str]) -> dict[str, str]:
        """The columns of the file by what they mean."""
        if len(set(names)) != len(names):
            raise self._error(f"two of its columns have the same name: {_listed(names)}")
        found = {}
        for what in ("time", "lost", "received", "delay", "sequence"):
            name = getattr(self, what)
            if name in names:
                found[what] = name
            elif name not in (None, what):
                raise self._error(f"it has no column {name!r}{did_you_mean(name, names)}; columns: {_listed(names)}")
        if not found.keys() & {"lost", "received", "delay", "sequence"}:
            raise self._error(
                f"it has no column {self.lost!r}, {self.received!r} or {self.delay!r}, and no sequence is named; "
                f"columns: {_listed(names)}"
            )
        return found

    def _check_type(self, name: str, kind: Any) -> None:
        from pyarrow import types

        if not any(is_it(kind) for is_it in (types.is_integer, types.is_floating, types.is_boolean, types.is_null)):
            raise self._error(f"its column {name!r} holds {kind} values, expected numbers, or true and false")

    def _numbers(self, name: str, column: Any) -> NDArray[np.float64]:
        from pyarrow import float64, int8, types

        self._check_type(name, column.type)
        if types.is_boolean(column.type):
            column = column.cast(int8())
        numbers: NDArray[np.float64] = column.cast(float64(), safe=False).to_numpy(zero_copy_only=False)
        return numbers

    # -- what they say --------------------------------------------------------------------------------------------

    def _trace(self, columns: dict[str, NDArray[np.float64]]) -> Trace:
        times = self._times(columns["time"]) if "time" in columns else None
        said = [
            self._truths(what, columns[what]) ^ (what == "received") for what in ("lost", "received") if what in columns
        ]
        if len(said) == 2:
            self._refuse(said[0] != said[1], f"{self.lost} and {self.received} contradict each other")
        delays = columns.get("delay")
        if said:
            lost = said[0]
        else:
            lost = np.isnan(delays) if delays is not None else np.zeros(len(columns["sequence"]), bool)
        late = None if delays is None else self._delays(delays, lost)
        if "sequence" in columns:
            places = self._places(columns["sequence"])
            lost = _in_sequence(places, lost, True)
            late = None if late is None else _in_sequence(places, late, 0)
            times = None  # those of the missing ones are unknown
        for array in (lost, late, times):
            if array is not None:
                array.flags.writeable = False
        return Trace(lost, late, times)

    def _times(self, seconds: NDArray[np.float64]) -> NDArray[np.int64]:
        self._refuse(~np.isfinite(seconds), f"{self.time} is not a time in s")
        since = seconds - seconds[0]
        self._refuse(np.diff(since, prepend=0.0) < 0.0, f"{self.time} is before that of the row above")
        self._refuse(since * 1e9 > LONGEST, f"{self.time} is more than 1e9 s after the first")
        times: NDArray[np.int64] = np.rint(since * 1e9).astype(np.int64)
        return times

    def _truths(self, what: str, numbers: NDArray[np.float64]) -> NDArray[np.bool_]:
        self._refuse(~((numbers == 0.0) | (numbers == 1.0)), f"{getattr(self, what)} is neither true (1) nor false (0)")
        truths: NDArray[np.bool_] = numbers == 1.0
        return truths

    def _delays(self, numbers: NDArray[np.float64], lost: NDArray[np.bool_]) -> NDArray[np.int64]:
        late = np.where(lost, 0.0, numbers * UNITS[self.delay_unit])
        self._refuse(np.isnan(late), f"{self.delay} is empty, but the message was not lost")
        self._refuse((late < 0.0) | (late > LONGEST), f"{self.delay} is not from 0 s to 1e9 s")
        return np.rint(late).astype(np.int64)

    def _places(self, numbers: NDArray[np.float64]) -> NDArray[np.int64]:
        """The places of messages with these sequence numbers, from 0 on."""
        wrong = ~(np.abs(numbers) <= _EXACT) | (np.rint(numbers) != numbers)
        self._refuse(wrong, f"{self.sequence} is not a whole number")
        steps: Any = np.diff(numbers.astype(np.int64), prepend=int(numbers[0]))
        if self.wraps is None:
            self._refuse(steps < -_BACK, f"{self.sequence} falls by more than {_BACK}; if it starts again, set 'wraps'")
        else:
            half = self.wraps // 2
            steps = (steps + half) % self.wraps - half
        places: NDArray[np.int64] = np.cumsum(steps)
        places -= places.min()
        length = int(places.max()) + 1
        if length > MOST:
            raise self._error(f"its sequence numbers span {length:,} messages, more than {MOST:,}")
        return places

    def _refuse(self, wrong: NDArray[np.bool_], reason: str) -> None:
        if wrong.any():
            raise self._error(f"row {int(np.argmax(wrong)) + 1:,}: {reason}")


def _in_sequence(places: NDArray[np.int64], values: Any, missing: object) -> Any:
    """The values at their places; of several at the same place, the first."""
    found = np.full(int(places.max()) + 1, missing, values.dtype)
    found[places[::-1]] = values[::-1]
    return found


def _listed(names: list[str]) -> str:
    text = ", ".join(names)
    return text if len(text) <= 200 else f"{text[:200]}..."


class TraceReplay(TraceFile, CommunicationAspect):
    """Loses and delays messages exactly as a measured trace says.

    The n-th message at a place has the fate of the n-th row, or, with ``by: time``, of the last row at or before its
    time, counted from the first row; the last row is valid for as long as the one before it.  Messages overtake each
    other where the delays make them.  The file must be in or below the folder of the YAML file that names it.
    Events: ``dropped``; ``delayed``, with the seconds.
    """

    events: ClassVar[tuple[str, ...]] = ("dropped", "delayed")

    by = Parameter(str, TOKEN, choices=(TOKEN, TIME), doc="what selects the row for a message: its number or its time")
    start = Parameter(
        str, FIRST, choices=(FIRST, RANDOM), doc="where each place starts in the trace; random draws it once per place"
    )
    at_end = Parameter(
        str,
        REPEAT,
        choices=(REPEAT, PASS, STOP),
        doc="what happens at the end of the trace: it repeats, messages pass undisturbed, or the run stops",
    )

    def check(self) -> None:
        self._measured = trace = self.read()
        self._length = len(trace)  # rows, or ns
        if self.by == TIME:
            if trace.times is None:
                raise self._error(f"'by: time' needs a column of times and no sequence; there is no {self.time!r}")
            if len(trace) < 2 or trace.times[-1] == 0:
                raise self._error("'by: time' needs two rows with different times")
            self._times_of_rows = trace.times
            self._length = int(2 * trace.times[-1] - trace.times[-2])

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        row = self._row(point)
        if row is None:
            if self.at_end == STOP:
                point.stop()
            point.forward(token)
        elif self._measured.lost[row]:
            point.act("dropped", token)
        else:
            delays = self._measured.delays
            point.delay(token, 0.0 if delays is None else to_seconds(int(delays[row])))

    def _row(self, point: JoinPoint) -> int | None:
        """The row for the present message; None after the end."""
        at = point.memory.get("start")
        if at is None:
            at = math.floor(point.random.random() * self._length) if self.start == RANDOM else 0
            point.memory["start"] = at
        if self.by == TIME:
            at += point.tag.time
        else:
            number = point.memory.get("messages", 0)
            point.memory["messages"] = number + 1
            at += number
        if at >= self._length:
            if self.at_end != REPEAT:
                return None
            at %= self._length
        if self.by == TOKEN:
            return at
        return int(np.searchsorted(self._times_of_rows, at, side="right")) - 1
