"""A run inside a program's own SimPy environment: one clock for both.

The run's processes and resources live in that environment, so that both may share resources, stores and events; those
in a composite with a clock of its own do not, but their events join the same queue.  A tag of the director is a *tick*,
an event there that comes after all others of its time: the order at one instant is that of a run by itself, first the
events of SimPy, then the tags.
"""

from __future__ import annotations

import math
from typing import Final

import simpy
from simpy.events import Event, EventPriority

from epicycle.actors import NEVER, EpicycleError, Events, Process, to_nanoseconds, to_seconds

from ..results import STOP_TIME, Results
from .errors import of_process
from .run import Run

_LAST: Final = EventPriority(2)  # after SimPy's URGENT and NORMAL
_LATEST: Final = 4.6e9  # s, beyond which nothing happens in a run


class _EventsOutside(Events):
    """The events of composites with their own clock, in the queue outside; ``content`` stays empty."""

    def __init__(self, outside: simpy.Environment) -> None:
        super().__init__()
        self._outside = outside

    @property
    def first(self) -> int:
        """The time of the next event, of the run or not; ``NEVER`` if there is none."""
        return _nanoseconds(self._outside.peek())

    def put(self, time: int, priority: EventPriority, event: Event) -> None:
        """Add an event."""
        delay = math.inf if time >= NEVER else max(0.0, to_seconds(time) - self._outside.now)
        self._outside.schedule(event, priority, delay)


class Attached:
    """A run that an environment outside lets advance; ``done`` happens when it is over, with its results."""

    def __init__(self, run: Run, outside: simpy.Environment, stop: int | None) -> None:
        if not 0 <= outside.now < math.inf:
            raise EpicycleError(
                f"{run.model.name} cannot be attached to an environment whose time is {outside.now:g}: a run has no "
                "time before 0 s"
            )
        self.done = Event(outside)
        self._run, self._director, self._outside = run, run.director, outside
        self._stop = NEVER if stop is None else stop
        self._planned = NEVER  # the time of the next tick
        self._step = outside.step
        self._director._time = _nanoseconds(outside.now)
        self._director.events = _EventsOutside(outside)
        run.live_in(outside)
        run.advance(None, most=0)  # which initialises the actors
        outside.step = self._follow  # type: ignore[method-assign]
        self._plan(self._stop)
        self._plan(self._director.next_time)

    def _follow(self) -> None:
        """Let the environment take a step, at the director's time; then see what the step has brought."""
        if self._is_over():
            self._step()
            return
        time = _nanoseconds(self._outside.peek())
        if time < NEVER:
            self._director._time = max(self._director._time, time)
        try:
            self._step()
        except Exception as error:
            actors = [] if self._is_over() else self._run.actors.values()
            if any(isinstance(actor, Process) and actor.failure is not None for actor in actors):
                found, cause = of_process(error, self._run.actors.values(), self._director.tag)
                found.__cause__ = cause
                raise self._run.failed(found) from cause
            raise
        if not self._is_over():
            self._plan(self._director._time if self._director._stop_after is not None else self._director.next_time)

    def _plan(self, time: int, at: float = 0.0) -> None:
        """Have a tick at a time (ns), in the environment not before ``at`` (s), unless one comes before."""
        if time < self._planned and time <= self._stop and time < NEVER:
            self._planned = time
            tick = Event(self._outside)
            tick._ok, tick._value = True, None
            tick.callbacks.append(lambda _: self._tick(time))
            self._outside.schedule(tick, _LAST, max(0.0, max(at, to_seconds(time)) - self._outside.now))

    def _tick(self, time: int) -> None:
        """Handle the tags of a time, once nothing else is to happen then."""
        if self._is_over() or time != self._planned:
            return
        self._planned = NEVER
        if self._outside.now < self._outside.peek() and self._is_soon(time):  # a later float at the same nanosecond
            self._plan(time, self._outside.peek())
            return
        # Nothing comes before this now, but what its own tags bring.
        director, reason, is_awaited = self._director, "", False
        stop = None if self._stop == NEVER else self._stop
        while not reason and not is_awaited and director.next_time <= time:
            reason = self._run.advance(stop, most=1)
            while not reason and director.present is not None:
                reason = self._run.advance(stop, most=1)
            is_awaited = self._is_soon(time)
        if not reason and director._stop_after is not None and director.next_time > time:
            reason = director._reason
        if not reason and time >= self._stop and director.next_time > time and not is_awaited:
            reason, self._run._stop = STOP_TIME, stop
        if reason:
            self._run.stopped = reason
            self.finish()
        else:
            self._plan(self._stop)
            self._plan(self._director.next_time)

    def _is_over(self) -> bool:
        return self._run.is_over

    def _is_soon(self, time: int) -> bool:
        """Whether the next event of the environment is at a time (ns)."""
        return _nanoseconds(self._outside.peek()) <= time

    def finish(self) -> Results:
        """End the run where it is; its processes end, too."""
        for actor in self._run.actors.values():
            if isinstance(actor, Process):
                actor.halt()
        results = self._run.finish()
        self.done.succeed(results)
        return results


def _nanoseconds(time: float) -> int:
    return NEVER if time > _LATEST else to_nanoseconds(time)
