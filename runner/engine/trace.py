"""Trace: who fired when, and why.

A traced run has a director and a log that tell a ``Tracer`` what they do; it is otherwise the same, to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import Actor, InputPort, Tag, Wake
from epicycle.aspects import Job

from .director import Director
from .execution import is_turn
from .log import EventLog, Record


@dataclass(frozen=True, slots=True)
class Arrival:
    """A token at an input port, the output port that sent it, and when."""

    port: str
    channel: int
    token: Any
    source: str
    sent: Tag


@dataclass(slots=True)
class Firing:
    """One firing of an actor: the tokens and wake-ups that caused it, and what came of it.

    ``wakes`` are the tags at which the wake-ups were asked for, None for those of ``initialize``.  ``records`` are the
    actor's sends, and what aspects at its outputs made of them.  What is sent outside of a firing says so in
    ``outside``: "resumed" by a process that SimPy resumed, "released" by an aspect that has kept it for some time.
    """

    tag: Tag
    actor: str
    arrivals: list[Arrival] = field(default_factory=list)
    wakes: list[Tag | None] = field(default_factory=list)
    outside: str = ""
    records: list[Record] = field(default_factory=list)


class Tracer:
    """Tells ``report`` of each firing of some actors, in order, when it is over."""

    def __init__(self, actors: Mapping[str, Actor], report: Callable[[Firing], None]) -> None:
        self.actors = actors
        self.report = report
        self.origin: tuple[str, Tag] = ("", Tag(0, 0))  # what is on its way just now: which port sent it, and when
        self.firing: Firing | None = None  # the one that is going on
        self.releasing = False  # whether something that was kept is on its way

    def begin(self, firing: Firing) -> None:
        """A firing begins."""
        self.end()
        self.firing = firing

    def end(self) -> None:
        """It is over."""
        if self.firing is not None:
            self.report(self.firing)
            self.firing = None

    def add(self, record: Record) -> None:
        """Something has been written into the log."""
        if record.event == "send":
            self.origin = (f"{record.actor}.{record.port}", record.tag)
        # What aspects do at the actor's inputs is not its doing.
        if record.actor not in self.actors or record.port not in self.actors[record.actor].outputs:
            return
        if self.firing is None or (self.firing.tag, self.firing.actor) != (record.tag, record.actor):
            self.begin(Firing(record.tag, record.actor, outside="released" if self.releasing else "resumed"))
        assert self.firing is not None
        self.firing.records.append(record)


class TracingLog(EventLog):
    """A log that a tracer reads along."""

    def __init__(self, keeps: Callable[[str, str, str, str], bool] | None, tracer: Tracer) -> None:
        super().__init__(keeps)
        self._tracer = tracer

    def add(self, tag: Tag, event: str, actor: str, port: str, channel: int | None, aspect: str, value: Any) -> None:
        super().add(tag, event, actor, port, channel, aspect, value)
        self._tracer.add(Record(tag, event, actor, port, channel, aspect, value))


class TracingDirector(Director):
    """A director that remembers why."""

    def __init__(self, order: dict[str, int], seed: int, tracer: Tracer) -> None:
        super().__init__(order, seed)
        self._tracer = tracer
        self._arrivals: dict[str, list[Arrival]] = {}
        self._asked: dict[Wake, Tag | None] = {}
        self._due: list[Tag | None] = []
        self._aside: dict[Job, tuple[list[Arrival], list[Tag | None]]] = {}

    def wake(self, actor: Actor, time: int) -> Wake:
        wake = super().wake(actor, time)
        if actor.path in self._tracer.actors:
            self._asked[wake] = self.tag if self.last.microstep else None
        return wake

    def put(self, port: InputPort[Any], channel: int, token: Any, turn: Actor | None = None) -> None:
        super().put(port, channel, token, turn)
        if port.actor.path in self._tracer.actors:
            arrival = Arrival(port.name, channel, token, *self._tracer.origin)
            self._arrivals.setdefault(port.actor.path, []).append(arrival)

    def hold(self, deliver: Callable[[Any], None], token: Any) -> Callable[[], None]:
        origin = self._tracer.origin

        def release() -> None:
            self._tracer.origin, self._tracer.releasing = origin, True
            try:
                deliver(token)
            finally:
                self._tracer.releasing = False

        return release

    def _is_idle(self, actor: Actor, key: tuple[int, int, int], rank: int) -> bool:
        asked = [(wake, self._asked.pop(wake)) for wake in self._wakes.get(key, ()) if wake in self._asked]
        idle = super()._is_idle(actor, key, rank)
        self._due = [tag for wake, tag in asked if wake.due]
        return idle

    def set_aside(self, job: Job) -> None:
        taken = {port.name for port in job.arrivals}
        waiting = self._arrivals.pop(job.actor.path, [])
        self._arrivals[job.actor.path] = [arrival for arrival in waiting if arrival.port not in taken]
        self._aside[job] = [arrival for arrival in waiting if arrival.port in taken], self._due

    def put_back(self, job: Job) -> None:
        arrivals, self._due = self._aside.pop(job)
        self._arrivals[job.actor.path] = [*arrivals, *self._arrivals.get(job.actor.path, [])]

    def fire(self, actor: Actor, rank: int) -> None:
        if actor.path not in self._tracer.actors or is_turn(actor):
            self._tracer.end()  # of a process that was resumed before
            super().fire(actor, rank)
            return
        waiting = self._arrivals.pop(actor.path, [])
        later = {port.name for port in self._later_ports.get(rank, ())}
        self._arrivals[actor.path] = [arrival for arrival in waiting if arrival.port in later]
        arrivals = [arrival for arrival in waiting if arrival.port not in later]
        self._tracer.begin(Firing(self.last, actor.path, arrivals, self._due))
        try:
            super().fire(actor, rank)
        finally:
            self._tracer.end()
