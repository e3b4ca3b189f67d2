"""The discrete-event director: which actor fires when.

Order of events
---------------
Events are ordered by tag, that is by time and then microstep.  Within a tag, tokens whose delay is over are put into
their ports first, in the order in which they were sent; then actors fire by rank (``ModelGraph.firing_order``: depth
in the graph of connections without delay, ties in the order of declaration).  A firing sees all tokens that its actor
gets at this tag, because all that can still send to it within the tag have a lower rank.  An actor therefore fires
once per tag; the exception is one with an output that does not depend on an input at once (``depends_on``), which
may have to send before that input is there: it fires again when it comes.

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
from collections.abc import Callable
from itertools import count
from typing import Any

import simpy

from epicycle.actors import Actor, EpicycleError, InputPort, Tag, Wake

MAX_MICROSTEPS = 100_000
_START = 0
# After all of SimPy's own events of an instant (priorities 0 and 1).
_LAST = 2


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
    """Time stands still: too many microsteps at one instant."""

    def __init__(self, time: int, actors: tuple[str, ...]) -> None:
        super().__init__(time, actors)
        self.time = time
        self.actors = actors

    def __str__(self) -> str:
        names = ", ".join(self.actors)
        return (
            f"time stands still at {self.time / 1e9:g} s: more than {MAX_MICROSTEPS:,} microsteps; "
            f"the last actors that fired: {names}; give their loop a delay above zero"
        )


class Director:
    """Fires the actors of one run."""

    def __init__(self, order: dict[str, int], seed: int) -> None:
        self.environment = simpy.Environment(initial_time=_START)
        self.seed = seed
        self.firings = 0
        self.last = Tag(_START, 0)  # the latest tag that was handled, or is being handled
        self._rank = order
        # (time, microstep, rank, sequence, what): deliveries have rank -1, so they come before all firings.
        self._agenda: list[tuple[int, int, int, int, Actor | Callable[[], None]]] = []
        self._sequence = count()
        self._wanted: set[tuple[int, int, int]] = set()  # (time, microstep, rank) of the firings in the agenda
        self._wakes: dict[tuple[int, int, int], list[Wake]] = {}
        self._alarms: set[int] = set()
        self._firing = False
        self._recent: list[str] = []
        # Asked between tags: True ends the run.
        self.finished: Callable[[], bool] = _never

    @property
    def tag(self) -> Tag:
        """The present tag: outside of firings (a process that SimPy resumed), the first not handled yet."""
        if self._firing:
            return self.last
        now = int(self.environment.now)
        return Tag(now, self.last.microstep + 1 if now == self.last.time else 1)

    # -- what actors and aspects ask for --------------------------------------------------------------------------

    def wake(self, actor: Actor, time: int) -> Wake:
        """Fire ``actor`` at ``time``; the present or past is the next microstep."""
        tag = self._tag_at(time)
        wake = Wake(tag)
        key = self._want(actor, tag)
        self._wakes.setdefault(key, []).append(wake)
        return wake

    def put(self, port: InputPort[Any], channel: int, token: Any) -> None:
        """Put a token into a port at the present tag."""
        port.put(token, channel)
        self._want(port.actor, self.tag)

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""
        now = self.tag
        tag = Tag(now.time + delay, 1) if delay > 0 else Tag(now.time, now.microstep + 1)
        self._enter(tag, -1, lambda: deliver(token))

    def _tag_at(self, time: int) -> Tag:
        """The tag of a wake-up for ``time``."""
        now = self.tag
        if time > now.time:
            return Tag(time, 1)
        return Tag(now.time, now.microstep + 1) if self._firing else now

    def _want(self, actor: Actor, tag: Tag) -> tuple[int, int, int]:
        rank = self._rank[actor.path]
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
            alarm.callbacks.append(self._instant)
            self.environment.schedule(alarm, priority=_LAST, delay=tag.time - self.environment.now)

    # -- time -----------------------------------------------------------------------------------------------------

    def _instant(self, _: Any) -> None:
        """Handle every tag of the present instant."""
        now = int(self.environment.now)
        agenda = self._agenda
        self._firing = True
        try:
            while agenda and agenda[0][0] == now:
                _, microstep, rank, _, what = heapq.heappop(agenda)
                if microstep != self.last.microstep or now != self.last.time:
                    if self.finished():
                        # The entry stays undone: the run ends here.
                        return
                    self.last = Tag(now, microstep)
                    if microstep > MAX_MICROSTEPS:
                        raise LoopError(now, tuple(dict.fromkeys(self._recent)))
                if not isinstance(what, Actor):
                    what()
                    continue
                key = (now, microstep, rank)
                self._wanted.discard(key)
                self._fire(what, key)
        finally:
            self._firing = False
            self._alarms.discard(now)

    def _fire(self, actor: Actor, key: tuple[int, int, int]) -> None:
        wakes = self._wakes.pop(key, None)
        if wakes is not None:
            due = False
            for wake in wakes:
                wake.due = not wake.cancelled
                due = due or wake.due
            if not due and not any(port.present for port in actor.inputs.values()):
                return
        self.firings += 1
        if key[1] > MAX_MICROSTEPS - 10:
            self._recent.append(actor.path)
        try:
            actor.fire()
        except EpicycleError:
            raise
        except Exception as error:
            raise ActorError(actor.path, self.tag, "fire()", describe(error)) from error
        for port in actor.inputs.values():
            port.clear()

    def run(self, stop: int | None, progress: Callable[[float], None] | None = None) -> None:
        """Handle events up to and including ``stop`` (ns), until none is left, or until ``finished`` says so."""
        environment = self.environment
        steps = 0
        while (upcoming := environment.peek()) != float("inf"):
            if stop is not None and upcoming > stop:
                break
            environment.step()
            if self.finished():
                break
            steps += 1
            if progress is not None and steps % 16 == 0:
                progress(environment.now / 1e9)


def describe(error: BaseException) -> str:
    """An exception in one line."""
    text = str(error).strip()
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _never() -> bool:
    return False
