"""SimPy's environment as processes see it: in seconds, while its events wait in whole nanoseconds."""

from __future__ import annotations

import math
from heapq import heappush
from typing import Any, Final, NoReturn

import simpy
from simpy.events import NORMAL, Event, EventPriority

from .order import NEVER
from .tag import to_nanoseconds, to_seconds

_DIRECTED: Final = "the director lets time pass: yield events, and give the model a stop time instead of {}()"


class Environment(simpy.Environment):
    """SimPy's part of a run: the events of processes and resources.

    Its clock and all delays are in seconds, as in any SimPy program.  A delay is rounded to the nearest nanosecond (of
    two, the even one), so that all events are at times that the director has, too; an infinite one never ends.
    """

    @property
    def now(self) -> float:
        """The present time (s)."""
        return to_seconds(self.time)

    @property
    def time(self) -> int:
        """The present time (ns)."""
        return int(self._now)

    @property
    def queue(self) -> list[Any]:
        """Engine: the events, the next one first, with their times (ns)."""
        return self._queue

    def schedule(self, event: Event, priority: EventPriority = NORMAL, delay: float = 0) -> None:
        """Let an event happen after ``delay`` s; raises ``ValueError`` for what is not a time."""
        self.put(event, priority, NEVER if delay == math.inf else to_nanoseconds(delay) if delay else 0)

    def put(self, event: Event, priority: EventPriority, delay: int) -> None:
        """Engine: let an event happen after ``delay`` ns."""
        heappush(self._queue, (self.time + delay, priority, next(self._eid), event))

    def peek(self) -> float:
        """The time of the next event (s); infinity if there is none."""
        return to_seconds(int(self._queue[0][0])) if self._queue and self._queue[0][0] < NEVER else math.inf

    def happen(self) -> None:
        """Engine: let the next event happen."""
        super().step()

    def step(self) -> NoReturn:
        """Not for processes: the director lets time pass."""
        raise RuntimeError(_DIRECTED.format("step"))

    def run(self, until: object = None) -> NoReturn:
        """Not for processes: the director lets time pass."""
        raise RuntimeError(_DIRECTED.format("run"))
