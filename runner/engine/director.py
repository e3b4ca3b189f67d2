"""The discrete-event director: which actor fires when.

Order of events
---------------
Events are ordered by tag, that is by time and then microstep.  Within a tag, tokens whose delay is over are put into
their ports first, in the order in which they were sent; then actors fire by rank (``firing_order``: depth in the graph
of connections without delay, then priority, ties in the order of declaration).  A firing sees all tokens that its actor
gets at this tag, because all that can still send to it within the tag have a lower rank.  An actor therefore fires
once per tag; the exception is one with an output that does not depend on an input at once (``depends_on``), which
may have to send before that input is there: its tokens are taken in a firing of their own, at the rank of the input.

A token sent over a connection without delay arrives at the same tag; with delay d > 0 at (time + d, 1); with delay 0
at the next microstep.  A wake-up for the present time comes at the next microstep, one for the future at
microstep 1.  The first tag of a run is (start, 1).

SimPy owns time and the event heap: the director puts one event into it for each instant at which something happens,
with lower priority than SimPy's own, so that timeouts, resources and processes of that instant come first.  What they
send is received at the first microstep that the director has not handled yet.

Departures from Ptolemy II: a firing sees all tokens of its tag at once, where Ptolemy fires again for each further
token; and tokens that an actor does not read do not stay in the port.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from functools import partial
from itertools import count
from typing import Any, cast

import simpy
from simpy.events import EventPriority

from epicycle.actors import Actor, EpicycleError, InputPort, Process, Tag, Wake
from epicycle.aspects import Job

from .pace import Pace

MAX_MICROSTEPS = 100_000
MAX_STEPS = 1_000_000  # of SimPy at one instant
_START = 0
# After all of SimPy's own events of an instant (priorities 0 and 1).
_LAST = cast(EventPriority, 2)


class ActorError(EpicycleError):
    """An actor raised an exception: names it and the tag; the exception itself is the cause."""

    def __init__(self, path: str, tag: Tag, doing: str, reason: str, where: str = "") -> None:
        super().__init__(path, tag, doing, reason, where)
        self.path = path
        self.tag = tag
        self.doing = doing
        self.reason = reason
        self.where = where

    def __str__(self) -> str:
        at = f"\n   declared at {self.where}" if self.where else ""
        return f"{self.path} failed in {self.doing} at {self.tag}: {self.reason}{at}"


class LoopError(EpicycleError):
    """Time stands still: too many microsteps at one instant, or too many events of SimPy's."""

    def __init__(self, time: int, actors: tuple[str, ...]) -> None:
        super().__init__(time, actors)
        self.time = time
        self.actors = actors

    def __str__(self) -> str:
        head = f"time stands still at {self.time / 1e9:g} s: more than "
        if not self.actors:
            return head + f"{MAX_STEPS:,} SimPy events; a process waits again and again for no time at all"
        names = ", ".join(self.actors)
        return head + (
            f"{MAX_MICROSTEPS:,} microsteps; the last actors that fired: {names}; give their loop a delay above zero"
        )


class Director:
    """Fires the actors of one run."""

    def __init__(self, order: dict[str, int], seed: int) -> None:
        self.environment = simpy.Environment(initial_time=_START)
        self.seed = seed
        self.firings = 0
        self.last = Tag(_START, 0)  # the latest tag that was handled, or is being handled
        self.ranks = order  # of actors and of their inputs
        # By the rank of a firing, the ports whose tokens are taken in a later firing of the same actor.
        self._later_ports: dict[int, list[InputPort[Any]]] = {}
        # (time, microstep, rank, sequence, what): deliveries have rank -1, so they come before all firings.
        self._agenda: list[tuple[int, int, int, int, Actor | Callable[[], None]]] = []
        self._sequence = count()
        self._wanted: set[tuple[int, int, int]] = set()  # (time, microstep, rank) of the firings in the agenda
        self._wakes: dict[tuple[int, int, int], list[Wake]] = {}
        self._alarms: set[int] = set()
        self._firing = False
        self._turn = -1  # the rank of what is handled now
        self._stop_after: Tag | None = None
        self._reason = "no events left"
        self._recent: list[str] = []

    @property
    def tag(self) -> Tag:
        """The present tag: outside of firings (a process that SimPy resumed), the first not handled yet."""
        if self._firing:
            return self.last
        # SimPy's time need not be whole; what comes between two nanoseconds belongs to the later one.
        now = math.ceil(self.environment.now)
        return Tag(now, 1) if now > self.last.time else Tag(self.last.time, self.last.microstep + 1)

    # -- what actors and aspects ask for --------------------------------------------------------------------------

    def wake(self, actor: Actor, time: int) -> Wake:
        """Fire ``actor`` at ``time``; the present or past is the next microstep."""
        return self.call(actor, self._tag_at(time), self.ranks[actor.path])

    def call(self, actor: Actor, tag: Tag, rank: int) -> Wake:
        """Fire ``actor`` at a tag and rank that are still to come."""
        wake = Wake(tag)
        key = self._want(actor, tag, rank)
        self._wakes.setdefault(key, []).append(wake)
        return wake

    def put(self, port: InputPort[Any], channel: int, token: Any, turn: Actor | None = None) -> None:
        """Put a token into a port at the present tag, and fire its actor, or who has the ``turn`` in its place."""
        port.put(token, channel)
        self._want(turn or port.actor, self.tag, self.ranks[port.path])

    def trigger(self, actor: Actor) -> None:
        """Fire ``actor`` at the present tag."""
        self._want(actor, self.tag, self.ranks[actor.path])

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""
        now = self.tag
        tag = Tag(now.time + delay, 1) if delay > 0 else Tag(now.time, now.microstep + 1)
        self._enter(tag, -1, self.hold(deliver, token))

    def hold(self, deliver: Callable[[Any], None], token: Any) -> Callable[[], None]:
        """``deliver(token)``, to be called later."""
        return partial(deliver, token)

    def stop(self, reason: str) -> None:
        """End the run when the present tag has been handled; the first who asks gives the reason."""
        if self._stop_after is None:
            self._stop_after = self.tag
            self._reason = reason

    def next_turn(self, rank: int) -> Tag:
        """The first tag at which a turn of this rank is still to come."""
        now = self.tag
        is_over = self._firing and self._turn >= rank
        return Tag(now.time, now.microstep + 1) if is_over else now

    def set_aside(self, job: Job) -> None:
        """A firing is put off: what it is for does not belong to the next one of its actor."""

    def put_back(self, job: Job) -> None:
        """A firing that was put off is the next one of its actor."""

    def _tag_at(self, time: int) -> Tag:
        """The tag of a wake-up for ``time``."""
        now = self.tag
        if time > now.time:
            return Tag(time, 1)
        return Tag(now.time, now.microstep + 1) if self._firing else now

    def _want(self, actor: Actor, tag: Tag, rank: int) -> tuple[int, int, int]:
        key = (tag.time, tag.microstep, rank)
        if key not in self._wanted:
            self._wanted.add(key)
            self._enter(tag, rank, actor)
        return key

    def _enter(self, tag: Tag, rank: int, what: Actor | Callable[[], None]) -> None:
        heapq.heappush(self._agenda, (tag.time, tag.microstep, rank, next(self._sequence), what))
        if tag.time not in self._alarms:
            self._alarms.add(tag.time)
            alarm = self.environment.event()
            alarm._ok, alarm._value = True, None
            alarm.callbacks.append(lambda _: self._instant(tag.time))
            self.environment.schedule(alarm, priority=_LAST, delay=tag.time - self.environment.now)

    # -- time -----------------------------------------------------------------------------------------------------

    def _instant(self, now: int) -> None:
        """Handle every tag of the present instant."""
        agenda = self._agenda
        self._firing = True
        try:
            while agenda and agenda[0][0] == now:
                _, microstep, rank, _, what = heapq.heappop(agenda)
                self._turn = rank
                tag = self.last
                if microstep != tag.microstep or now != tag.time:
                    tag = Tag(now, microstep)
                    if self._stop_after is not None and tag > self._stop_after:
                        # The entry stays undone: the run ends here.
                        return
                if isinstance(what, Actor):
                    key = (now, microstep, rank)
                    self._wanted.discard(key)
                    if self._is_idle(what, key, rank):
                        continue
                self.last = tag
                if microstep > MAX_MICROSTEPS:
                    raise LoopError(now, tuple(dict.fromkeys(self._recent)))
                if isinstance(what, Actor):
                    self.fire(what, rank)
                else:
                    what()
        finally:
            self._firing = False
            self._alarms.discard(now)

    def _is_idle(self, actor: Actor, key: tuple[int, int, int], rank: int) -> bool:
        """Make the wake-ups of a firing due; true if all were cancelled and there is nothing else to fire for."""
        wakes = self._wakes.pop(key, None)
        if wakes is None:
            return False
        due = False
        for wake in wakes:
            wake.due = not wake.cancelled
            due = due or wake.due
        later = self._later_ports.get(rank, ())
        return not due and not any(port.present for port in actor.inputs.values() if port not in later)

    def fire(self, actor: Actor, rank: int) -> None:
        """Let an actor fire, in its turn."""
        self.firings += 1
        if self.last.microstep > MAX_MICROSTEPS - 10:
            self._recent.append(actor.path)
        later = self._later_ports.get(rank, ())
        for port in later:
            port.hold()
        try:
            actor.fire()
        except ActorError:  # of an aspect on the way of a token
            raise
        except Exception as error:
            doing = "run()" if isinstance(actor, Process) else "fire()"
            raise ActorError(actor.path, self.last, doing, describe(error)) from error
        finally:
            for port in actor.inputs.values():
                port.clear()  # which leaves what is held
            for port in later:
                port.release()

    def run(
        self,
        stop: int | None,
        actors: list[Actor],
        progress: Callable[[float], None] | None = None,
        pace: Pace | None = None,
    ) -> str:
        """Handle events up to and including ``stop`` (ns), until none is left, or until a stop was asked for.

        Returns why it ended.
        """
        self._find_later_ports(actors)
        environment = self.environment
        steps = here = 0
        now: float = _START
        if pace is not None:
            pace.wait_for(now)
        while (upcoming := environment.peek()) != math.inf:
            if self._stop_after is not None and max(upcoming, self.last.time) > self._stop_after.time:
                break
            if stop is not None and upcoming > stop:
                if pace is not None:
                    pace.wait_for(stop)
                return "stop time"
            if pace is not None and upcoming > now:
                pace.wait_for(upcoming)
            try:
                environment.step()
            except (ActorError, LoopError):
                raise
            except Exception as error:
                raise self._of_process(error, actors) from error
            if self._stop_after is not None and self.last >= self._stop_after:
                break
            here = here + 1 if upcoming == now else 0
            now = upcoming
            if here > MAX_STEPS:
                raise LoopError(self.tag.time, ())
            steps += 1
            if progress is not None and steps % 16 == 0:
                progress(now / 1e9)
        return self._reason

    def _find_later_ports(self, actors: list[Actor]) -> None:
        for actor in actors:
            ranks = {self.ranks[port.path] for port in actor.inputs.values()} | {self.ranks[actor.path]}
            for rank in ranks - {max(ranks)}:
                self._later_ports[rank] = [port for port in actor.inputs.values() if self.ranks[port.path] > rank]

    def _of_process(self, error: Exception, actors: list[Actor]) -> ActorError:
        """The error of a process that SimPy resumed: from there, no firing says whose it was."""
        for actor in actors:
            failure = actor.failure if isinstance(actor, Process) else None
            if isinstance(failure, ActorError):  # of an aspect or a metric, to which the process has sent
                return failure
            if failure is not None:
                return ActorError(actor.path, self.tag, "run()", describe(failure))
        return ActorError("a SimPy process", self.tag, "its generator", describe(error.__cause__ or error))


def describe(error: BaseException) -> str:
    """An exception in one line; our own explain themselves without their type."""
    text = str(error).strip()
    if isinstance(error, EpicycleError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
