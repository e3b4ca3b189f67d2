"""Trace: which actors fired when, and why.

The director and the log of a traced run report to a ``Tracer``; otherwise the run is the same to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from epicycle.actors import Actor, InputPort, Moment, Receiver, Tag, Wake
from epicycle.aspects import Job

from ..results import EventLog, Names, Record, Writer
from .agenda import Activation, Delivery
from .director import Director
from .execution import is_stand_in
from .receivers import Call


@dataclass(frozen=True, slots=True)
class Arrival:
    """A token at an input port, the output port that sent it, when, and the number of that record in the log."""

    port: str
    channel: int
    token: Any
    source: str
    sent: Tag
    number: int


@dataclass(slots=True)
class Firing:
    """One firing of an actor: the tokens and wake-ups that caused it, and its effects.

    ``wakes`` are the tags at which the wake-ups were requested, None for those of ``initialize``.  ``records`` are the
    actor's sends, and the acts of aspects at its outputs.  ``outside`` marks sends outside of a firing: "resumed" by a
    process that SimPy resumed, "released" by an aspect that has kept them for some time.
    """

    tag: Tag
    actor: str
    arrivals: list[Arrival] = field(default_factory=list)
    wakes: list[Tag | None] = field(default_factory=list)
    outside: str = ""
    records: list[Record] = field(default_factory=list)


class Origin(NamedTuple):
    """The source of a token on its way: which port sent it, when, and the number of that record in the log."""

    port: str
    tag: Tag
    number: int


class Tracer:
    """Passes each firing of some actors to ``report``, in order, when it is over.

    Before that, ``seen`` gets each record of the log, in order: the record, whether it belongs to the present firing,
    and the number of the send that it is about: its own if it is a send, -1 if nothing has been sent yet.
    """

    def __init__(
        self,
        actors: Mapping[str, Actor],
        report: Callable[[Firing], None],
        seen: Callable[[Record, bool, int], None] | None = None,
    ) -> None:
        self.actors = actors
        self.report = report
        self.seen = seen
        self.count = 0  # of records
        self.origin = Origin("", Tag(0, 0), -1)  # the token on its way just now
        self.firing: Firing | None = None  # the present one
        self.releasing = False  # whether a kept token is on its way

    def begin(self, firing: Firing) -> None:
        """A firing begins."""
        self.end()
        self.firing = firing

    def end(self) -> None:
        """The firing is over."""
        if self.firing is not None:
            self.report(self.firing)
            self.firing = None

    def add(self, record: Record) -> None:
        """A record has been written to the log."""
        if record.event == "send":
            self.origin = Origin(f"{record.actor}.{record.port}", record.tag, self.count)
        self.count += 1
        # Acts of aspects at the actor's inputs are not its own.
        is_own = record.actor in self.actors and record.port in self.actors[record.actor].outputs
        if is_own:
            self._own(record)
        if self.seen is not None:
            is_about = record.event == "send" or not is_own  # at an output, nothing has been sent yet
            self.seen(record, is_own, self.origin.number if is_about else -1)

    def _own(self, record: Record) -> None:
        if self.firing is None or (self.firing.tag, self.firing.actor) != (record.tag, record.actor):
            self.begin(Firing(record.tag, record.actor, outside="released" if self.releasing else "resumed"))
        assert self.firing is not None
        self.firing.records.append(record)


class TracingLog(EventLog):
    """A log that a tracer reads along with."""

    def __init__(self, keeps: Callable[[str, str, str, str], bool] | None, tracer: Tracer) -> None:
        super().__init__(keeps)
        self._tracer = tracer

    def new_writer(self, names: Names, keeps: bool) -> Writer:
        return _TracingWriter(self, names, keeps, self._tracer)


class _TracingWriter(Writer):
    def __init__(self, log: EventLog, names: Names, keeps: bool, tracer: Tracer) -> None:
        super().__init__(log, names, keeps)
        self._tracer = tracer

    def write(self, when: Tag | Moment, value: Any) -> None:
        super().write(when, value)
        self._tracer.add(Record(Tag(when.time, when.microstep), *self.names, value))


if TYPE_CHECKING:
    _Base = Director
else:
    _Base = object  # any director comes behind it, see ``tracing``


class Tracing(_Base):
    """What makes a director remember causes."""

    def begin_trace(self, tracer: Tracer) -> None:
        """Report to a tracer from now on."""
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

    def entry(self, port: InputPort[Any], channel: int, stand_in: Actor | None = None) -> Receiver:
        enter = super().entry(port, channel, stand_in)
        if port.actor.path not in self._tracer.actors:
            return enter
        return Call(partial(self._enter_and_tell, port, channel, enter))

    def _enter_and_tell(self, port: InputPort[Any], channel: int, enter: Receiver, token: Any) -> None:
        enter.put(token)
        arrival = Arrival(port.name, channel, token, *self._tracer.origin)
        self._arrivals.setdefault(port.actor.path, []).append(arrival)

    def hold(self, way: Receiver, token: Any) -> Delivery:
        return super().hold(Call(partial(self._release, self._tracer.origin, way)), token)

    def _release(self, origin: Origin, way: Receiver, token: Any) -> None:
        self._tracer.origin, self._tracer.releasing = origin, True
        try:
            way.put(token)
        finally:
            self._tracer.releasing = False

    def use_wakes(self, activation: Activation) -> bool:
        asked = [
            (wake, self._asked.pop(wake))
            for wake in (activation.wake, *(activation.wakes or ()))
            if wake is not None and wake in self._asked
        ]
        is_to_fire = super().use_wakes(activation)
        self._due = [tag for wake, tag in asked if wake.due and is_to_fire]
        return is_to_fire

    def set_aside(self, job: Job) -> None:
        taken = {port.name for port in job.arrivals}
        waiting = self._arrivals.pop(job.actor.path, [])
        self._arrivals[job.actor.path] = [arrival for arrival in waiting if arrival.port not in taken]
        self._aside[job] = [arrival for arrival in waiting if arrival.port in taken], self._due

    def put_back(self, job: Job) -> None:
        arrivals, self._due = self._aside.pop(job)
        self._arrivals[job.actor.path] = [*arrivals, *self._arrivals.get(job.actor.path, [])]

    def fire(self, activation: Activation) -> None:
        actor = activation.actor
        if actor.path not in self._tracer.actors or is_stand_in(actor):
            self._tracer.end()  # by a process that was resumed before
            super().fire(activation)
            self._due = []
            return
        waiting = self._arrivals.pop(actor.path, [])
        later = {port.name for port in activation.later}
        self._arrivals[actor.path] = [arrival for arrival in waiting if arrival.port in later]
        arrivals = [arrival for arrival in waiting if arrival.port not in later]
        due, self._due = self._due, []
        self._tracer.begin(Firing(self.last, actor.path, arrivals, due))
        try:
            super().fire(activation)
        finally:
            self._tracer.end()


def tracing(kind: type[Director]) -> Any:
    """The class of a director, with ``Tracing``."""
    return type(f"Tracing{kind.__name__}", (Tracing, kind), {})
