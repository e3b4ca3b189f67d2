"""The bridge to SimPy: processes see an environment in seconds, and a director lets its events happen.

All that depends on how SimPy works inside is here.
"""

from __future__ import annotations

import math
from heapq import heappop, heappush
from typing import Any, Final, NoReturn, Protocol

import simpy
from simpy.events import NORMAL, Event, EventPriority, Process

from .order import NEVER
from .tag import to_nanoseconds, to_seconds

_DIRECTED: Final = "the director lets time pass: yield events, and give the model a stop time instead of {}()"


class Host(Protocol):
    """A director, or what stands for one inside a composite: whose time it is, and who lets events happen."""

    @property
    def time(self) -> int:
        """The present time (ns)."""

    @property
    def next_event(self) -> int:
        """The time of the next event (ns); ``NEVER`` if there is none."""

    def put_event(self, event: Event, priority: EventPriority, delay: int) -> None:
        """Let an event happen after ``delay`` ns."""


class Environment(simpy.Environment):
    """SimPy's environment for the processes and resources of a run.

    Its clock and all delays are in seconds, as in any SimPy program.  A delay is rounded to the nearest nanosecond (of
    two, the even one), so that all events are at times that the director has, too; an infinite one never ends.
    """

    def __init__(self, host: Host) -> None:
        super().__init__()
        self._host = host

    @property
    def now(self) -> float:
        """The present time (s)."""
        return to_seconds(self._host.time)

    def schedule(self, event: Event, priority: EventPriority = NORMAL, delay: float = 0) -> None:
        """Let an event happen after ``delay`` s; raises ``ValueError`` for what is not a time."""
        nanoseconds = NEVER if delay == math.inf else to_nanoseconds(delay) if delay else 0
        self._host.put_event(event, priority, nanoseconds)

    def peek(self) -> float:
        """The time of the next event (s); infinity if there is none."""
        time = self._host.next_event
        return to_seconds(time) if time < NEVER else math.inf

    def step(self) -> NoReturn:
        """Not for processes: the director lets time pass."""
        raise RuntimeError(_DIRECTED.format("step"))

    def run(self, until: object = None) -> NoReturn:
        """Not for processes: the director lets time pass."""
        raise RuntimeError(_DIRECTED.format("run"))


class Events:
    """The events of a run that are to happen: by time (ns), then SimPy's priority, then the order of requests."""

    def __init__(self) -> None:
        self.content: list[tuple[int, EventPriority, int, Event]] = []
        self._number = 0

    @property
    def first(self) -> int:
        """The time of the next one; ``NEVER`` if there is none."""
        return min(self.content[0][0], NEVER) if self.content else NEVER

    def put(self, time: int, priority: EventPriority, event: Event) -> None:
        """Add an event."""
        heappush(self.content, (time, priority, self._number, event))
        self._number += 1

    def happen(self) -> None:
        """Let the next one happen; raises what it failed with, if nobody has taken care of that."""
        event = heappop(self.content)[3]
        _call_back(event)
        if not event.ok and not event.defused:
            failure: Any = event.value
            raise failure


def settle(event: Event, value: object) -> None:
    """Let an event happen now, inside a firing."""
    event._ok = True
    event._value = value
    _call_back(event)


def end(process: Process) -> None:
    """End a process where it waits, which leaves its ``with`` blocks: a resource that it held is released."""
    if process.is_alive:
        if process.target.callbacks is not None:
            process.target.callbacks.remove(process._resume)
        process._generator.close()


def _call_back(event: Event) -> None:
    callbacks: Any = event.callbacks
    event.callbacks = None  # type: ignore[assignment]
    for callback in callbacks or ():
        callback(event)
