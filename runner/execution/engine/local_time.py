"""Composites with their own director: their local time, and their ports, which pass one token at a time.

The director of the model fires all actors: those of such a composite follow each other in its order, in place of the
composite (``firing_order``).  Only the time that they see is their own.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from simpy.events import Event, EventPriority

from epicycle.actors import NEVER, Actor, Environment, Receiver, Tag, Wake

from ...model.graph.clock import Clock
from .agenda import Delivery
from .director import Director
from .refinement import Refinement


class LocalDirector:
    """The director as seen by the actors and aspects inside a composite with its own clock."""

    def __init__(self, director: Director | Refinement, clock: Clock) -> None:
        self.environment = Environment(self)
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

    @property
    def next_event(self) -> int:
        """The local time of the next event of SimPy's (ns)."""
        time = self._director.next_event
        return self._clock.local(time) if time < NEVER else NEVER

    def put_event(self, event: Event, priority: EventPriority, delay: int) -> None:
        """Let an event of SimPy's happen after ``delay`` ns of local time."""
        if 0 < delay < NEVER:
            delay = self._clock.span(self._director.time, delay)
        self._director.put_event(event, priority, delay)

    def stop(self, reason: str) -> None:
        """End the whole run, not only this composite."""
        self._director.stop(reason)

    def later(self, delay: int, way: Receiver, token: Any) -> None:
        """Send a token onward after ``delay`` ns of local time."""
        self._director.later(self._clock.span(self._director.time, delay), way, token)


class BoundaryPort(Actor):
    """A port of a composite with its own director: at each tag it lets one token of each channel through.

    The rest waits for the next microstep.  A *lane* is the way of one channel, from the sender's side onward.
    """

    def __init__(self, path: str, director: Director | Refinement) -> None:
        super().__init__(path)
        self.enter(director)
        self.gate: Refinement | None = None  # the boundary port behind it, which may be closed: then tokens are lost
        self.beside: Actor | None = None  # fires when something has come through
        self._director = director
        self._lanes: dict[object, Lane] = {}

    def clear(self) -> None:
        """Forget what waits."""
        for lane in self._lanes.values():
            lane.waiting.clear()

    def lane(self, channel: object, onward: Receiver) -> Receiver:
        """The way of a token of a channel that has come this far; ``onward`` is its way after passing."""
        return IntoLane(self, self._director, self._lanes.setdefault(channel, Lane()), onward)

    def fire(self) -> None:
        if self.gate is not None and not self.gate.is_open:
            self.clear()
        if self.beside is not None:
            self._director.trigger(self.beside)
        self.let_through()

    def let_through(self) -> None:
        """Let one token of each channel through, if none has passed at this tag; ask for another one for the rest."""
        now = self.tag
        for lane in self._lanes.values():
            if lane.waiting and lane.passed != now:
                lane.passed = now
                lane.waiting.popleft().arrive()
        if self.is_waited_for:
            self.wake_in(0)

    def admit(self, place: str, onward: Receiver, told: Callable[[Receiver], Receiver]) -> tuple[Receiver, bool]:
        """The way of requests from a place to an aspect that is this composite, and whether they wait for it to fire.

        If so, they are ``told`` to be made when they go onward, not before.
        """
        return self.lane(place, onward), False

    @property
    def is_waited_for(self) -> bool:
        """Whether tokens wait."""
        return any(lane.waiting for lane in self._lanes.values())


class IntoLane(Receiver):
    """Lets each token wait in a lane of a boundary port, which then fires."""

    __slots__ = ("boundary_port", "director", "lane", "onward")

    def __init__(
        self, boundary_port: BoundaryPort, director: Director | Refinement, lane: Lane, onward: Receiver
    ) -> None:
        self.boundary_port = boundary_port
        self.director = director
        self.lane = lane
        self.onward = onward

    def put(self, token: Any) -> None:
        self.lane.waiting.append(self.director.hold(self.onward, token))
        self.director.trigger(self.boundary_port)


class Lane:
    """One channel of a boundary port: the tokens that wait, and the tag at which one has passed."""

    __slots__ = ("passed", "waiting")

    def __init__(self) -> None:
        self.waiting: deque[Delivery] = deque()
        self.passed: Tag | None = None
