"""Refinements: composites that are active in one mode of a machine; in all others, their time stands still.

Requests inside a refinement wait in its own agenda, in its local time.  The mode director of the machine's composite
fires before everything in it: it lets the machine take a preemptive transition, or else lets the active refinement do
what is due.  The machine fires last, and a mode that it enters begins at the next microstep.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping
from itertools import count
from typing import TYPE_CHECKING, Any, Protocol

from simpy.events import Event, EventPriority

from epicycle.actors import NEVER, Actor, Context, Environment, Host, Receiver, Tag, Wake, new_wake

from .agenda import Activation, Delivery
from .director import Director
from .errors import ActorError, CrowdError

if TYPE_CHECKING:
    from collections.abc import Callable

    from epicycle.actors import StateMachine

# When, a number that keeps the order, what and how, and the earliest outer time and microstep.
Entry = tuple[int, int, "Wake | Delivery | Event", "Activation | EventPriority | None", tuple[int, int]]


class Outer(Context, Host, Protocol):
    """The director around a machine."""


class Refinement:
    """The director as seen inside a refinement; ``outer`` is the director around its machine."""

    def __init__(self, path: str, outer: Outer, director: Director, mode_director: ModeDirector) -> None:
        self.path = path
        self.seed = director.seed
        self.streams = director.streams
        self.director = director
        self.environment = Environment(self)
        self.mode_director = mode_director
        self.is_active = False
        self._outer = outer
        self._lag = 0  # how far its time lags behind (ns)
        self._stood = 0  # outer time since when it has stood still
        self._agenda: list[Entry] = []
        self._numbers = count()

    @property
    def time(self) -> int:
        """The local time (ns)."""
        return (self._outer.time if self.is_active else self._stood) - self._lag

    @property
    def tag(self) -> Tag:
        """The present tag in local time."""
        return Tag(self.time, self.director.tag.microstep)

    @property
    def is_open(self) -> bool:
        """Whether it takes part in the present tag."""
        return self.is_active and not self.mode_director.has_left

    def wake(self, actor: Actor, time: int) -> Wake:
        """Fire ``actor`` at a local time; the present or past is the next microstep."""
        now, present = self.time, self.director.now()
        step = present.microstep + (self.director.present is not None)
        wake = new_wake(time, 1) if time > now else new_wake(now, step)
        activation = self.director.activation(actor, self.director.ranks[actor.path])
        self._put(max(time, now), wake, activation)
        return wake

    def later(self, delay: int, way: Receiver, token: Any) -> None:
        """Let a token go on after ``delay`` ns of local time."""
        self._put(self.time + delay, self.director.hold(way, token), None)

    @property
    def next_event(self) -> int:
        """The local time of the next event of SimPy's in here (ns)."""
        return min((time for time, _, what, *_ in self._agenda if isinstance(what, Event)), default=NEVER)

    def put_event(self, event: Event, priority: EventPriority, delay: int) -> None:
        """Let an event of SimPy's happen after ``delay`` ns of local time."""
        if delay == 0 and self.is_active:
            self._outer.put_event(event, priority, 0)
        else:
            self._put(self.time + delay, event, priority)

    def _put(self, time: int, what: Wake | Delivery | Event, how: Activation | EventPriority | None) -> None:
        most = self.director.crowd.most
        if len(self._agenda) >= most:
            raise CrowdError(self.director.tag, most, f"pending tokens, wake-ups and events in {self.path}", ())
        heapq.heappush(self._agenda, (time, next(self._numbers), what, how, self.not_before(time)))
        if self.is_active:
            self.mode_director.plan()

    def not_before(self, time: int) -> tuple[int, int]:
        """The outer time and microstep before which work for a local time is not done: for the present, the next."""
        if time > self.time:
            return 0, 0
        present = self.director.now()
        return present.time, present.microstep + (self.director.present is not None)

    def hold(self, way: Receiver, token: Any) -> Delivery:
        """A function that sends a token onward, later."""
        return self.director.hold(way, token)

    def trigger(self, actor: Actor) -> None:
        """Fire ``actor`` at the present tag."""
        self.director.trigger(actor)

    def stop(self, reason: str) -> None:
        """End the run."""
        self.director.stop(reason)

    # -- for its mode director ----------------------------------------------------------------------------------------

    @property
    def next_time(self) -> int | None:
        """The outer time of its next work."""
        return self._agenda[0][0] + self._lag if self._agenda else None

    def release(self) -> bool:
        """Do what is due; returns whether anything is."""
        now, present, due = self.time, self.director.now(), list[Entry]()
        while self._agenda and self._agenda[0][0] <= now and self._agenda[0][4] <= (present.time, present.microstep):
            due.append(heapq.heappop(self._agenda))
        is_any = False
        for _, _, what, how, _ in due:
            if isinstance(what, Delivery):
                what.arrive()
            elif isinstance(what, Event):
                assert isinstance(how, int)
                self._outer.put_event(what, how, 0)
            elif what.cancelled:
                continue
            else:
                assert isinstance(how, Activation)
                how.add(what)
                self.director.schedule(how)
            is_any = True
        return is_any

    def suspend(self) -> None:
        """Stop its time."""
        self._stood = self._outer.time
        self.is_active = False

    def resume(self) -> None:
        """Resume its time where it stood."""
        self._lag += self._outer.time - self._stood
        self.is_active = True

    def begin(self) -> None:
        """Restart it at the outer time, with nothing to do."""
        for _, _, what, *_ in self._agenda:
            if isinstance(what, Wake):
                what.cancel()
        self._agenda.clear()
        self._lag, self.is_active = 0, True

    def begin_inside(self, inside: Callable[[], None]) -> None:
        """Start its contents."""
        inside()


class ModeDirector(Actor):
    """Fires first in a composite with modes: it holds the refinements, of which at most one is active."""

    def __init__(self, path: str, machine: StateMachine, director: Director, outer: Context) -> None:
        super().__init__(path)
        self.enter(outer)
        self.machine = machine
        self.refinements: dict[str, Refinement] = {}
        self.insides: dict[str, Callable[[], None]] = {}  # restarts the contents of a refinement
        self.boundary_ports: Mapping[str, Any] = {}
        self._director = director
        self._active: Refinement | None = None
        self._left: Tag | None = None  # the tag at which a preemptive transition, or an error, cut a firing short
        self._wake: Wake | None = None
        self.failure: ActorError | None = None
        machine.refinements = self

    @property
    def has_left(self) -> bool:
        """Whether the active refinement no longer takes part in the present tag."""
        return self._left is not None and self._left == self._director.tag

    @property
    def hears_inputs(self) -> bool:
        """Whether it fires when something comes in, not only when its refinement has work to do."""
        return self.machine.is_preemptive

    def fire(self) -> None:
        if self._wake is not None and (self._wake.due or self._wake.cancelled):
            self._wake = None
        if self.machine.is_preemptive and self.machine.preempt():
            self._left = self._director.tag
        elif self._active is not None and self._active.release():
            self.machine.is_asked = True
            self._director.trigger(self.machine)
        self.plan()

    def plan(self) -> None:
        """Request a firing for when there is work."""
        times = [None if self._active is None else self._active.next_time]
        if self.machine.is_preemptive:  # it is checked before its refinement fires
            times.append(self.machine.next_time)
        time = min((each for each in times if each is not None), default=None)
        if time is None or (self._wake is not None and not self._wake.cancelled and self._wake.time <= time):
            return
        if self._wake is not None:
            self._wake.cancel()
        self._wake = self.context.wake(self, time)

    # -- for the machine ------------------------------------------------------------------------------------------

    def begin(self, mode: str) -> None:
        """Start, or restart, in a mode."""
        for name, refinement in self.refinements.items():
            refinement.begin()
            if name != mode:
                refinement.suspend()
        self._left = self.failure = None
        self._active = self.refinements.get(mode)

    def change(self, mode: str, *, history: bool) -> None:
        """Leave the present mode's refinement, and enter the other's, where it was left or from the beginning."""
        if self._active is not None:
            self._active.suspend()
        if self._wake is not None:
            self._wake.cancel()
            self._wake = None
        self._active = self.active_in(mode)
        if self._active is None:
            return
        if history:
            self._active.resume()
        else:
            self._active.begin()
            self._active.begin_inside(self.insides[mode])
        self.plan()

    def active_in(self, mode: str) -> Refinement | None:
        """The refinement that is active in a mode that is entered, if there is one."""
        return self.refinements.get(mode)

    def fail(self, error: ActorError) -> None:
        """Something in the active refinement has failed: the machine decides what follows."""
        if not self.machine.catches:
            raise error
        self.failure = error
        self._left = self._director.tag
        self.machine.error = error.reason
        self._director.trigger(self.machine)

    def raise_failure(self) -> None:
        """No transition of the machine takes the error."""
        if self.failure is not None:
            raise self.failure
