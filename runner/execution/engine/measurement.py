"""Measurement: a metric during the run, and its final value."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from epicycle.actors import NEVER, Quantity, Receiver, to_nanoseconds, to_seconds
from epicycle.actors.expression import Formula

from ...model.catalogue.metrics import MSER5, TIME, MetricSpec
from ...model.graph.outputs import Metric
from ...support.shown import short
from ..results import Outcome
from .batches import BATCHES, LEAST_OF_MSER, OF_MSER, TimeBatches, TokenBatches, batch_interval, mser
from .statistic import MOST, Statistic, statistic_of

if TYPE_CHECKING:
    from .director import Director

_HELD = 1024  # states for which it is known whether a condition holds
_EXACT = 2**53  # whole numbers up to here have exact floats


@dataclass(frozen=True)
class _Unfit:
    """Stands for a token that cannot be measured; the reason follows 'because'."""

    reason: str


class Measurement:
    """Takes in the tokens that the ports of a metric send."""

    __slots__ = (
        "_holds",
        "_is_beyond",
        "_is_of_floats",
        "_is_of_numbers",
        "_kept",
        "_measure",
        "_ports",
        "_taking",
        "_until",
    )

    def __init__(self, metric: Metric) -> None:
        measure = self._measure = metric.measure
        self._ports = metric.ports
        self._until = NEVER if measure.until is None else to_nanoseconds(measure.until)
        self._kept: _Kept | None = None
        self._is_beyond = False  # of all numbers
        # The values of most tokens are known at once: floats as they are, whole numbers as floats or not.
        self._is_of_numbers = measure.when is None
        self._is_of_floats = measure.when is None and measure.take not in _AS_THEY_ARE
        self._holds: dict[int | str, Any] | None = None if measure.when is None else {}  # states recur
        start = 0
        if measure.after == MSER5:
            self._kept = _Kept(metric.ports)
        else:
            assert isinstance(measure.after, float)
            start = to_nanoseconds(measure.after)
        self._taking: _Taking = _taking(measure, metric.ports, start)

    def add(self, port: str, time: int, token: Any) -> None:
        """Take in a token at a time (ns)."""
        if time > self._until:
            return
        value = self._value(token)
        if type(value) is _Unfit:
            value = _Unfit(f"{port} sent {value.reason} at {to_seconds(time):.9g} s")
        try:
            if self._kept is None:
                self._taking.add(port, time, value)
            else:
                self._kept.add(port, time, value)
        except OverflowError:
            self._is_beyond = True

    def _value(self, token: Any) -> Any:
        if type(token) is float:
            number: float = token
            if self._is_of_numbers and -MOST <= number <= MOST:
                return token
        elif self._is_of_floats:
            if type(token) is int and -_EXACT <= token <= _EXACT:
                return float(token)
        elif self._holds is not None and (type(token) is str or type(token) is int):
            value = self._holds.get(token)
            if value is None:
                value = _measured(self._measure, token)
                if len(self._holds) < _HELD:
                    self._holds[token] = value
            return value
        return _measured(self._measure, token)

    def outcome(self, end: int) -> Outcome:
        """Its value at a time (ns) up to which nothing more will come."""
        beyond = Outcome(missing="it is too large for a number")
        try:
            found = beyond if self._is_beyond else self._outcome(end)
        except (OverflowError, ValueError):  # of sums: infinity, or infinity less infinity
            return beyond
        if isinstance(found.value, float) and not math.isfinite(found.value) and self._measure.take not in _AS_SENT:
            return beyond
        return self._converted(found)

    def _outcome(self, end: int) -> Outcome:
        if self._until != NEVER:
            if end < self._until:
                ended, until = to_seconds(end), to_seconds(self._until)
                return Outcome(missing=f"the run ended at {ended:.6g} s, before {until:.6g} s")
            end = self._until
        if self._kept is None:
            return self._taking.outcome(end)
        taking = self._kept.settled(self._measure, self._ports, end)
        return Outcome(missing=taking) if isinstance(taking, str) else taking.outcome(end)

    def _converted(self, found: Outcome) -> Outcome:
        unit, to = self._measure.own_unit, self._measure.to
        if not to or isinstance(found.value, bool) or not isinstance(found.value, (int, float)):
            return found
        interval = found.interval
        if interval is not None:
            low, high = (Quantity(each, unit).to(to) for each in (interval.low, interval.high))
            interval = replace(interval, low=low, high=high)
        return replace(found, value=Quantity(found.value, unit).to(to), interval=interval)


class Measuring(Receiver):
    """Passes the tokens of a port to a metric."""

    __slots__ = ("director", "measurement", "port")

    def __init__(self, measurement: Measurement, port: str, director: Director) -> None:
        self.measurement = measurement
        self.port = port
        self.director = director

    def put(self, token: Any) -> None:
        self.measurement.add(self.port, self.director.now().time, token)


_AS_SENT = ("first", "last", "min", "max")  # for which infinity is a value like any other
_AS_THEY_ARE = (*_AS_SENT, "sum", "count", "rate")  # whole numbers stay whole


def _measured(measure: MetricSpec, token: Any) -> Any:
    """The value of a token, or ``_Unfit`` with what the port sent."""
    if measure.take in ("first", "last", "count", "rate"):
        return token
    if measure.when is not None:
        return _holds(measure.when, token)
    if isinstance(token, str):  # float() reads some of them
        return _Unfit(f"{short(token)}, which is not a number,")
    try:
        number = float(token)
    except Exception:
        return _Unfit(f"{short(token)}, which is not a number,")
    if math.isnan(number) or (math.isinf(number) and measure.take not in _AS_SENT):
        return _Unfit(f"{number}")
    return token if measure.take in _AS_THEY_ARE else number


def _holds(when: Formula, token: Any) -> float | _Unfit:
    """Whether a condition holds for a token: 1 or 0."""
    try:
        return float(bool(when({"value": token})))
    except Exception as error:
        return _Unfit(f"{short(token)}, for which {when.source!r} cannot be evaluated ({error}),")


# -- tokens, all with the same weight -------------------------------------------------------------------------------


class _Taking:
    """A collector of values from the time ``start``."""

    __slots__ = ("_count", "_measure", "_statistic", "_unfit", "start")

    def __init__(self, measure: MetricSpec, start: int) -> None:
        self.start = start
        self._measure = measure
        self._count = 0  # tokens
        self._statistic: Statistic = statistic_of(measure)
        self._unfit = ""

    def add(self, port: str, time: int, value: Any) -> None:
        """Take in a token that a port sent."""
        raise NotImplementedError

    def outcome(self, end: int) -> Outcome:
        """Its value at a time."""
        raise NotImplementedError


class _Tokens(_Taking):
    """Takes tokens from a time onwards."""

    __slots__ = ("_batches",)

    def __init__(self, measure: MetricSpec, start: int) -> None:
        super().__init__(measure, start)
        self._batches = TokenBatches() if measure.interval is not None else None

    def add(self, port: str, time: int, value: Any) -> None:
        if time < self.start:
            return
        self._count += 1
        if type(value) is _Unfit:
            self._unfit = self._unfit or value.reason
            return
        self._statistic.add(value, 1)
        if self._batches is not None:
            self._batches.add(value)

    def outcome(self, end: int) -> Outcome:
        found = self._statistic.value
        if missing := self._unfit or _too_short(self.start, end):
            return Outcome(missing=missing)
        after = to_seconds(self.start)
        if found is None:
            if self._count == 0 and self._measure.initial is not None:
                return Outcome(self._measure.initial, after=after)
            few = "no token came" if self._count == 0 else "one token has no spread"
            return Outcome(missing=few + (f" after {after:.6g} s" if after else ""))
        if self._batches is None:
            return Outcome(found, after=after)
        return _with_interval(found, self._batches.batches(), self._measure, self._count, after)


# -- spells of time: each value counts for as long as it lasts ------------------------------------------------------


class _Spells(_Taking):
    """Takes the values at ports, from a time onwards."""

    __slots__ = ("_batches", "_open")

    def __init__(
        self, measure: MetricSpec, ports: Iterable[str], start: int, batches: TimeBatches | None = None
    ) -> None:
        super().__init__(measure, start)
        self._batches = batches
        if batches is None and measure.interval is not None:
            self._batches = TimeBatches(start)
        self._open: dict[str, tuple[int, Any]] = {}
        if measure.initial is not None:
            value = _measured(measure, measure.initial)
            self._open = dict.fromkeys(ports, (0, value))

    def add(self, port: str, time: int, value: Any) -> None:
        self._count += time >= self.start
        self._close(port, time)
        self._open[port] = (time, value)

    def _close(self, port: str, time: int) -> None:
        stood = self._open.get(port)
        if stood is None:
            return
        begin, value = stood
        begin = max(begin, self.start)
        if time <= begin:
            return
        if type(value) is _Unfit:
            self._unfit = self._unfit or value.reason
            return
        self._statistic.add(value, time - begin)
        if self._batches is not None:
            self._batches.add(value, begin, time)

    def close(self, end: int) -> None:
        """The present values last until the end."""
        for port in self._open:
            self._close(port, end)

    def outcome(self, end: int) -> Outcome:
        self.close(end)
        if missing := self._unfit or _too_short(self.start, end):
            return Outcome(missing=missing)
        found = self._statistic.value
        if found is None:
            return Outcome(missing="no time passed after the first token" if self._open else "no token came")
        after = to_seconds(self.start)
        if self._batches is None:
            return Outcome(found, after=after)
        return _with_interval(found, self._batches.batches(end), self._measure, self._count, after)


class _Arrivals(_Taking):
    """Counts tokens over time, from a time onwards."""

    __slots__ = ("_batches",)

    def __init__(self, measure: MetricSpec, start: int, batches: TimeBatches | None = None) -> None:
        super().__init__(measure, start)
        self._batches = batches or TimeBatches(start)

    def add(self, port: str, time: int, value: Any) -> None:
        if time >= self.start:
            self._count += 1
            self._batches.count(time)

    def close(self, end: int) -> None:
        self._batches.cover(end)

    def outcome(self, end: int) -> Outcome:
        if missing := _too_short(self.start, end):
            return Outcome(missing=missing)
        if end == self.start:
            return Outcome(missing="no time passed")
        found, after = self._count / to_seconds(end - self.start), to_seconds(self.start)
        if self._measure.interval is None:
            return Outcome(found, after=after)
        self.close(end)
        sums, covered = self._batches.batches(end)
        return _with_interval(found, (sums, [each / 1e9 for each in covered]), self._measure, self._count, after)


def _taking(measure: MetricSpec, ports: Iterable[str], start: int) -> _Taking:
    if measure.take == "rate":
        return _Arrivals(measure, start)
    return _Spells(measure, ports, start) if measure.kind.over == TIME else _Tokens(measure, start)


def _too_short(start: int, end: int) -> str:
    if end >= start:
        return ""
    return f"the run ended at {to_seconds(end):.6g} s, before its warm-up of {to_seconds(start):.6g} s was over"


def _with_interval(
    value: float, batches: tuple[list[float], list[float]], measure: MetricSpec, count: int, after: float
) -> Outcome:
    assert measure.interval is not None
    found = batch_interval(*batches, value, measure.interval) if count >= BATCHES else None
    unsure = "" if found is not None else f"{count} tokens are too few for {BATCHES} batches"
    return Outcome(value, interval=found, unsure=unsure, after=after)


# -- a warm-up that has to be found ---------------------------------------------------------------------------------


class _Kept:
    """Keeps all values until it is known where the warm-up ended."""

    __slots__ = ("_names", "_numbers", "_ports", "_times", "_unfit", "_values")

    def __init__(self, ports: list[str]) -> None:
        self._names = ports
        self._numbers = {port: number for number, port in enumerate(ports)}
        self._ports = array("l")
        self._times = array("q")
        self._values = array("d")
        self._unfit = ""

    def add(self, port: str, time: int, value: Any) -> None:
        if type(value) is _Unfit:
            self._unfit = self._unfit or value.reason
            return
        self._ports.append(self._numbers[port])
        self._times.append(time)
        self._values.append(0.0 if isinstance(value, str) else float(value))  # for arrivals only the times count

    def settled(self, measure: MetricSpec, ports: list[str], end: int) -> _Taking | str:
        """The collector of everything after the warm-up, or the reason why there is none."""
        count = len(self._times)
        if self._unfit:
            return self._unfit
        if count < LEAST_OF_MSER * OF_MSER:
            return f"MSER-5 needs {LEAST_OF_MSER * OF_MSER} tokens, but {count} came"
        pieces = count // OF_MSER
        skipped, start = 0, 0
        if measure.kind.over == TIME:
            origin = 0 if measure.take == "rate" or measure.initial is not None else self._times[0]
            width = (end - origin) // pieces
            if width == 0:
                return "MSER-5 needs time between tokens"
            slices = TimeBatches(origin, width, pieces + 1)
            trial: _Arrivals | _Spells = (
                _Arrivals(measure, origin, slices)
                if measure.take == "rate"
                else _Spells(measure, ports, origin, slices)
            )
            self._replayed(trial, until=origin + pieces * width)
            trial.close(origin + pieces * width)
            sums, covered = slices.batches(origin + pieces * width)
            means = [each / weight for each, weight in zip(sums, covered, strict=True) if weight]
        else:
            places = range(0, pieces * OF_MSER, OF_MSER)
            means = [math.fsum(self._values[place : place + OF_MSER]) / OF_MSER for place in places]
        if (found := mser(means)) is None:
            return "by MSER-5, it does not settle in the first half of the run: make the run longer"
        if measure.kind.over == TIME:
            start = origin + found * width
        else:
            skipped = found * OF_MSER
            start = self._times[skipped] if skipped else 0
        return self._replayed(_taking(measure, ports, start), skipped)

    def _replayed(self, taking: _Taking, skipped: int = 0, until: int | None = None) -> _Taking:
        for place in range(skipped, len(self._times)):
            if until is None or self._times[place] < until:
                taking.add(self._names[self._ports[place]], self._times[place], self._values[place])
        return taking
