"""Monitoring: a monitor while the run goes on, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, Moment, Receiver, to_seconds
from epicycle.actors.expression import operand, value_at
from epicycle.aspects import Reading

from ...model.graph.outputs import Monitor, Part
from ...model.temporal import (
    LINEAR,
    TINY,
    Condition,
    Line,
    Piece,
    PropertyMonitor,
    PropertyVerdict,
    Source,
    leaves,
    looks_ahead,
    moment,
    time_of,
    waits_for_tokens,
)
from ..results import Past, Verdict

if TYPE_CHECKING:
    from .director import Director

_KEPT = 1_000  # samples, or up to twice as many, of which it is known what the ports had sent, to look back
_AT_ONCE = 50  # samples that are judged together, where nobody asks before


class _Margin:
    """The margin of a condition from sample to sample; it holds until the next, or is linear in between."""

    __slots__ = ("_condition", "_found", "_is_linear", "_next", "_readings", "_since", "_source", "is_new")

    def __init__(self, condition: Condition, readings: list[Reading], source: Source, linear: bool) -> None:
        self._condition = condition
        self._readings = readings
        self._source = source
        self._is_linear = linear and condition.difference is not None
        self._found: float | None = None
        self._since = 0  # of a linear margin: when it was found
        self._next = 0  # and from when on it is not known
        self.is_new = False  # whether one of its ports has sent in this sample

    def settle(self, now: int, upcoming: int, latest: dict[str, Any]) -> None:
        """What had been sent by a moment stands until the next; raises ``EpicycleError``."""
        if self.is_new:
            self.is_new = False
            if all(port in latest for port, _ in self._readings):
                found = self._condition.margin([operand(value_at(latest[port], path)) for port, path in self._readings])
                if self._is_linear:
                    self._add_line(now, found)
                self._found = found
        if not self._is_linear:
            self._source.pieces.append(Piece(now, upcoming - 1, self._found))

    def _add_line(self, now: int, found: float) -> None:
        before = self._found
        since, time = time_of(self._since), time_of(now)
        if before is None or since == time or not (math.isfinite(before) and math.isfinite(found)):
            if now > self._next:
                self._source.pieces.append(Piece(self._next, now - 1, before))
            self._source.pieces.append(Piece(now, now, found))
        else:
            line = Line(since, before, time, found, self._condition.zero)
            self._source.pieces.append(Piece(self._next, now, line))
        self._since, self._next = now, now + 1

    def close(self, upcoming: int) -> None:
        """Nothing more comes before ``upcoming``."""
        if self._is_linear and self._next < upcoming:
            self._source.pieces.append(Piece(self._next, upcoming - 1, self._found))


class _Pulse:
    """True in the samples of the tags at which a port sends."""

    __slots__ = ("_source", "is_new")

    def __init__(self, source: Source) -> None:
        self._source = source
        self.is_new = False

    def settle(self, now: int, upcoming: int, latest: dict[str, Any]) -> None:
        """The same as of a margin."""
        if self.is_new:
            until = min(upcoming, moment(time_of(now) + 1))
            self._source.pieces.append(Piece(now, until - 1, math.inf))
            self.is_new = False
            now = until
        if now < upcoming:
            self._source.pieces.append(Piece(now, upcoming - 1, -math.inf))

    def close(self, upcoming: int) -> None:
        """The same as of a margin."""


class PartMonitoring:
    """Watches what the ports of a part of a monitor send.

    A tag has as many samples as the port that sends most has tokens there: the first of each port, the second, and so
    on; a port that sends fewer stays at its last.
    """

    __slots__ = (
        "_conditions",
        "_is_found",
        "_kept",
        "_latest",
        "_listening",
        "_microstep",
        "_missing",
        "_moment",
        "_monitor",
        "_past",
        "_sent",
        "_time",
        "_values",
        "_verdict",
        "_waits",
        "monitor",
        "part",
    )  # fmt: skip

    def __init__(self, monitor: Monitor, part: Part) -> None:
        self.monitor = monitor
        self.part = part
        self._monitor = PropertyMonitor(part.tree)
        linear = monitor.requirement.between == LINEAR
        self._conditions: list[_Margin | _Pulse] = [
            _Margin(each, readings, source, linear) if isinstance(each, Condition) else _Pulse(source)
            for each, readings, source in zip(leaves(part.tree), part.readings, self._monitor.sources, strict=True)
        ]
        self._listening: dict[str, list[_Margin | _Pulse]] = {port: [] for port in part.ports}
        for condition, readings in zip(self._conditions, part.readings, strict=True):
            for port in dict.fromkeys(port for port, _ in readings):
                self._listening[port].append(condition)
        self._latest: dict[str, Any] = {}
        self._time = 0  # the instant that is not settled yet
        self._microstep = 0
        self._moment = 0  # of the next sample
        self._sent: dict[str, list[Any]] = {}  # at the present tag
        self._verdict = PropertyVerdict()
        self._missing = ""  # why it cannot be judged
        self._waits = waits_for_tokens(part.tree)
        is_late = looks_ahead(part.tree) or linear  # a break may be found out later than it happens
        self._kept = _KEPT if is_late else _AT_ONCE
        self._is_found = True  # whether the verdict is that of all samples
        self._past: Past[tuple[int, dict[str, Any]]] = Past()
        self._values: dict[str, Any] = {}  # of its ports where it broke first

    @property
    def is_broken(self) -> bool:
        """Whether it is certain that the run does not have the property."""
        if not self._is_found:
            self._find(over=False)
        return self._verdict.holds is False

    @property
    def most(self) -> float:
        """What its robustness is at most, by all that is settled; infinity if nothing is certain yet."""
        self._find(over=False)
        return self.monitor.in_unit(self._monitor.most)

    def add(self, port: str, tag: Moment, token: Any) -> None:
        """Take in what a port sends at a tag."""
        if tag.time > self._time:
            self._settle(tag.time)
        elif self._sent and tag.microstep != self._microstep:
            self._sample_tag(None)
        self._microstep = tag.microstep
        self._sent.setdefault(port, []).append(token)

    def settle(self, upcoming: int) -> None:
        """What was sent by now stands until a later time (ns)."""
        if self._sent or not self._waits:
            self._settle(upcoming)

    def _settle(self, upcoming: int) -> None:
        if upcoming > self._time:
            self._sample_tag(moment(upcoming))
            self._time = upcoming

    def _sample_tag(self, upcoming: int | None) -> None:
        """Take in the samples of a tag; the last stands until a moment, or the next of the instant (None)."""
        sent, self._sent = self._sent, {}
        count = max(map(len, sent.values()), default=1)
        for number in range(count):
            for port, tokens in sent.items():
                self._latest[port] = tokens[min(number, len(tokens) - 1)]
                for each in self._listening[port]:
                    each.is_new = True
            now, self._moment = self._moment, self._moment + 1
            if upcoming is not None and number == count - 1:
                self._moment = upcoming
            self._sample(now, self._moment)

    def _sample(self, now: int, upcoming: int) -> None:
        if self._missing:
            return
        try:
            for each in self._conditions:
                each.settle(now, upcoming, self._latest)
        except EpicycleError as error:
            self._missing = f"{error}, at {to_seconds(time_of(now)):.9g} s"
            return
        self._past.append((now, dict(self._latest)))
        if len(self._past) > 2 * self._kept:
            del self._past[: self._kept]
        self._is_found = False
        if len(self._past) % _AT_ONCE == 0:
            self._find(over=False)

    def _find(self, over: bool) -> None:
        self._is_found = True
        was_broken = self._verdict.holds is False
        self._verdict = self._monitor.verdict(over)
        if self._verdict.holds is False and not was_broken and self._verdict.moment is not None:
            self._values = self._at(self._verdict.moment)

    def _at(self, moment: int) -> dict[str, Any]:
        """What the conditions asked for at a moment, if that is still known."""
        known: dict[str, Any] = next((latest for start, latest in reversed(self._past) if start <= moment), {})
        asked = dict.fromkeys(each for readings in self._asked() for each in readings)
        return {".".join((port, *path)): value_at(known[port], path) for port, path in asked if port in known}

    def _asked(self) -> Iterable[list[Reading]]:
        pairs = zip(leaves(self.part.tree), self.part.readings, strict=True)
        return (readings for condition, readings in pairs if isinstance(condition, Condition))

    def verdict(self, end: int) -> Verdict:
        """What it comes to when the run ends at a time (ns); nothing more may be added."""
        self._settle(end + 1)
        if self._missing:
            return Verdict(missing=self._missing)
        for each in self._conditions:
            each.close(moment(end + 1))
        self._find(over=True)
        found, margin = self._verdict, self._verdict.robustness
        if margin is not None:
            margin = 0.0 if abs(margin) == TINY else self.monitor.in_unit(margin)
        time = None if found.moment is None else to_seconds(time_of(found.moment))
        if found.holds is None:
            return Verdict(missing="the run was too short to tell")
        return Verdict(found.holds, margin, time, self._values)


class Monitoring:
    """A monitor in a run: what is judged of its parts, each by itself, together."""

    __slots__ = ("monitor", "parts")

    def __init__(self, monitor: Monitor) -> None:
        self.monitor = monitor
        self.parts = [PartMonitoring(monitor, part) for part in monitor.parts]

    @property
    def is_broken(self) -> bool:
        """Whether it is certain that the run does not have the property."""
        broken = [each.is_broken for each in self.parts]
        return bool(broken) and (all(broken) if self.monitor.any else any(broken))

    @property
    def most(self) -> float:
        """What its robustness is at most, by all that is settled; infinity if nothing is certain yet."""
        each = (part.most for part in self.parts)
        return max(each, default=math.inf) if self.monitor.any else min(each, default=math.inf)

    def settle(self, upcoming: int) -> None:
        """What was sent by now stands until a later time (ns)."""
        for each in self.parts:
            each.settle(upcoming)

    def verdict(self, end: int) -> Verdict:
        """What it comes to when the run ends at a time (ns); nothing more may be added."""
        found = {each.part.of: each.verdict(end) for each in self.parts}
        if len(found) == 1 and "" in found:
            return found[""]
        if not found:
            return Verdict(missing="its pattern matches nothing in this model")
        is_any = self.monitor.any
        deciding = {of: each for of, each in found.items() if each.holds is is_any}
        if not deciding:
            for of, each in found.items():
                if each.holds is None:
                    return Verdict(missing=f"of {of}: {each.missing}")
            deciding = found
        margins = [each.robustness for each in deciding.values() if each.robustness is not None]
        holds = next(iter(deciding.values())).holds
        margin = max(margins) if is_any else min(margins)
        if holds:
            return Verdict(True, margin)
        in_order = sorted(deciding, key=lambda of: math.inf if (time := found[of].time) is None else time)
        shown = found[in_order[-1 if is_any else 0]]  # it is broken when the last is, or the first
        return Verdict(False, margin, shown.time, shown.values, broken_by=() if is_any else tuple(in_order))


class Listening(Receiver):
    """Hands the tokens of a port to a part of a monitor."""

    __slots__ = ("director", "monitoring", "port")

    def __init__(self, monitoring: PartMonitoring, port: str, director: Director) -> None:
        self.monitoring = monitoring
        self.port = port
        self.director = director

    def put(self, token: Any) -> None:
        self.monitoring.add(self.port, self.director.now(), token)
