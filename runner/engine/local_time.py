"""Composites with their own director: their local time, and their ports, which pass one token at a time.

The director of the model fires all actors: those of such a composite follow each other in its order, in place of the
composite (``firing_order``).  Only the time that they see is their own.
"""

from __future__ import annotations

import heapq
from collections import deque
from typing import Any

from simpy.events import Event, EventPriority

from epicycle.actors import NEVER, Actor, Environment, Tag, Wake, Way

from ..graph import Clock, is_within
from .agenda import Delivery, Poster, Turn
from .director import Director
from .refinement import Refinement
from .way import Call


class LocalDirector:
    """The director as seen by the actors and aspects inside a composite with its own clock."""

    def __init__(self, director: Director | Refinement, clock: Clock) -> None:
        self.environment = LocalEnvironment(director.environment, clock)
        self.seed = director.seed
        self.streams = director.streams
        self._director = director
        self._clock = clock

    @property
    def tag(self) -> Tag:
        """The present tag in local time."""
        return self._clock.tag(self._director.tag)

    @property
    def time(self) -> int:
        """Its time (ns)."""
        return self.tag.time

    def wake(self, actor: Actor, time: int) -> Wake:
        """Fire ``actor`` at a local time."""
        wake = self._director.wake(actor, self._clock.outer(time))
        wake.move(self._clock.tag(wake.tag))
        return wake

    def stop(self, reason: str) -> None:
        """End the whole run, not only this composite."""
        self._director.stop(reason)

    def later(self, delay: int, way: Way, token: Any) -> None:
        """Send a token onward after ``delay`` ns of local time."""
        self._director.later(self._clock.span(self._director.time, delay), way, token)


class LocalEnvironment(Environment):
    """The run's SimPy environment in local time, for the processes inside: its events are the run's."""

    def __init__(self, environment: Environment, clock: Clock) -> None:
        super().__init__()
        self._environment = environment
        self._clock = clock

    @property
    def time(self) -> int:
        """The local time (ns)."""
        return self._clock.local(self._environment.time)

    def put(self, event: Event, priority: EventPriority, delay: int) -> None:
        """Let an event happen after ``delay`` ns of local time."""
        if 0 < delay < NEVER:
            delay = self._clock.span(self._environment.time, delay)
        self._environment.put(event, priority, delay)


class Passage(Actor):
    """A port of a composite with its own director: at each tag it lets one token of each channel through.

    The rest waits for the next microstep.  A *lane* is the way of one channel, from the sender's side onward.  With a
    ``border``, it lets one token through per firing of the composite; if it ``is_refired`` with the surroundings of the
    composite, per firing of those.  One that ``holds_one`` keeps only the latest of the tokens that come together.
    """

    def __init__(self, path: str, director: Director | Refinement) -> None:
        super().__init__(path)
        self.enter(director)
        self.gate: Refinement | None = None  # the passage behind it, which may be closed: then tokens are lost
        self.beside: Actor | None = None  # fires when something has come through
        self.border: Border | None = None
        self.is_refired = False
        self.holds_one = False
        self.requests: deque[Delivery] = deque()  # requests to an aspect that is a model, waiting for its turn
        self._director = director
        self._lanes: dict[object, _Lane] = {}

    def clear(self) -> None:
        """Forget what waits."""
        self.requests.clear()
        for lane in self._lanes.values():
            lane.waiting.clear()

    def lane(self, channel: object, onward: Way) -> Way:
        """The way of a token of a channel that has come this far; ``onward`` is its way after passing."""
        lane = self._lanes.setdefault(channel, _Lane())

        def arrive(token: Any) -> None:
            lane.waiting.append(self._director.hold(onward, token))
            self._director.trigger(self)

        return Call(arrive)

    def fire(self) -> None:
        if self.gate is not None and not self.gate.is_open:
            self.clear()
        if self.beside is not None:
            self._director.trigger(self.beside)
        if self.holds_one:
            for lane in self._lanes.values():
                while len(lane.waiting) > 1:
                    lane.waiting.popleft()
        if self.border is not None:
            self._let_through(self.border)
            return
        now = self.tag
        for lane in self._lanes.values():
            if lane.waiting and (self.is_refired or lane.passed != now):
                lane.passed = now
                lane.waiting.popleft().arrive()
        if self.is_waited_for:
            self.wake_in(0)

    @property
    def is_waited_for(self) -> bool:
        """Whether tokens wait."""
        return any(lane.waiting for lane in self._lanes.values())

    def _let_through(self, border: Border) -> None:
        if not border.lets_pass(self):
            self.wake_in(0)
            return
        while self.requests:
            self.requests.popleft().arrive()
        for lane in self._lanes.values():
            if lane.waiting:
                lane.waiting.popleft().arrive()
        if self.is_waited_for and self in border.outputs_behind:
            self.wake_in(0)

    def await_turn(self, onward: Way) -> Way:
        """The way of a request, which waits until the composite fires; then all of them go onward."""
        border, waiting = self.border, self.requests
        assert border is not None

        def arrive(token: Any) -> None:
            waiting.append(self._director.hold(onward, token))
            if border.is_to_come:
                self._director.trigger(self)
            else:
                self.wake_in(0)

        return Call(arrive)


class Border(Actor):
    """The border of a composite whose director is like Ptolemy's: as long as tokens wait at its inputs, it fires again.

    In each of its firings, one token of each channel passes its ports. The output of an actor whose firing was deferred
    from outside leaves at the next microstep, unless the composite fires at this tag for new input.
    """

    def __init__(self, path: str, end: str, director: Director, outside: Director | Refinement) -> None:
        super().__init__(end)
        self.enter(outside)
        self.inputs_before: list[Passage] = []
        self.outputs_behind: list[Passage] = []
        self._director = director
        self._outside = outside
        ranks = [rank for each, rank in director.ranks.items() if is_within(each, path)]
        self._first, self._last = min(ranks), max(ranks)
        self._came_in: Tag | None = None  # when something came in
        self._resumed: Tag | None = None  # when a deferred firing was executed
        # When it has fired, it is posted for what comes first inside.
        self.poster: Poster | None = None
        self.nesting = 0
        self._turn: Turn | None = None
        self._inside: list[tuple[int, int]] = []  # the tags with work to do, a heap
        self._posted: set[tuple[int, int]] = set()  # the tags for which it has been posted

    @property
    def is_to_come(self) -> bool:
        """Whether the composite has yet to fire at the present tag."""
        return self._director.is_to_come(self._first, self._last)

    @property
    def turn(self) -> Turn:
        """The turn that ends a firing of the composite."""
        if self._turn is None:
            self._turn = self._director.turn(self, self._director.ranks[self.path])
        return self._turn

    def note(self, time: int, microstep: int) -> None:
        """Something inside has requested a turn."""
        heapq.heappush(self._inside, (time, microstep))
        if self._director.last.microstep and self._director.is_between(self._first, self._last):
            self.post()

    def post(self) -> None:
        """Request a turn for what comes first inside."""
        now = self._director.last
        while self._inside and self._inside[0] <= now:
            heapq.heappop(self._inside)
        self._posted = {tag for tag in self._posted if tag > now}
        if self._inside and self._inside[0] not in self._posted:
            self._posted.add(self._inside[0])
            self._director.want_at(self.turn, self._inside[0][0])

    def resume(self) -> None:
        """An actor inside now fires after its firing was deferred from outside."""
        self._resumed = self.tag

    def lets_pass(self, passage: Passage) -> bool:
        """Whether waiting tokens may pass a port now."""
        now = self.tag
        if passage in self.inputs_before:
            self._came_in = now
            self._outside.trigger(self)
            return True
        return self._resumed != now or self._came_in == now

    def fire(self) -> None:
        if any(passage.is_waited_for for passage in self.inputs_before):
            for passage in (*self.inputs_before, *self.outputs_behind):
                if passage.is_waited_for:
                    self._outside.trigger(passage)
        else:
            self.post()


class _Lane:
    """One channel of a passage: the tokens that wait, and the tag at which one has passed."""

    __slots__ = ("passed", "waiting")

    def __init__(self) -> None:
        self.waiting: deque[Delivery] = deque()
        self.passed: Tag | None = None
