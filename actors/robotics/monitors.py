"""Actors that watch a run and report what matters of it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from ..core import Actor, InputPort, OutputPort, Parameter, array_parameter
from ..core.elementary import distance
from .messages import BodyState


class GoalMonitor(Actor):
    """Tells when a body first comes within ``tolerance`` of the goal, and how far it has travelled."""

    state = InputPort(BodyState, doc="the body")
    arrived = OutputPort(bool, doc="true, once, at the first arrival")
    time = OutputPort(float, doc="the time of that state in seconds, once")
    path_length = OutputPort(float, doc="metres travelled so far, at every state")
    distance = OutputPort(float, doc="metres to the goal, at every state")

    goal = array_parameter((2,), (0.0, 0.0), unit="m", doc="where the body is to arrive")
    tolerance = Parameter(float, 0.5, unit="m", min=0, doc="how near counts as arrived")

    def initialize(self) -> None:
        self._last: list[float] | None = None
        self._length = 0.0
        self._has_arrived = False

    def fire(self) -> None:
        position: list[float] = self.state.value.position.tolist()
        if self._last is not None:
            self._length += distance(position, self._last)
        self._last = position
        left = distance(position, self.goal.tolist())
        self.path_length.send(self._length)
        self.distance.send(left)
        if left <= self.tolerance and not self._has_arrived:
            self._has_arrived = True
            self.time.send(self.state.value.time)
            self.arrived.send(True)


class _Known:
    """The latest state of each of several bodies."""

    def __init__(self) -> None:
        self._states: dict[int, BodyState] = {}

    def see(self, body: int, states: Iterable[BodyState]) -> None:
        """Take note of states of a body; an older one than what is known of it says nothing new."""
        for state in states:
            if body not in self._states or state.time >= self._states[body].time:
                self._states[body] = state

    def tell(self, output: OutputPort[float]) -> None:
        """Send the smallest distance between two, if so many are known, at the time of the latest state.

        Each has moved on with its velocity since its own state.
        """
        now = max((state.time for state in self._states.values()), default=0.0)
        places = []
        for state in self._states.values():
            (x, y), elapsed = state.position.tolist(), now - state.time
            if elapsed > 0.0:
                vx, vy = state.velocity.tolist()
                x, y = x + elapsed * vx, y + elapsed * vy
            places.append((x, y))
        if len(places) >= 2:
            output.send(min(distance(a, b) for a, b in combinations(places, 2)))


class DistanceMonitor(Actor):
    """The distance between two bodies, whenever a state of one comes and both are known.

    It is that of the time of the later state: where the other body was last known to be is moved on with its velocity
    since.  So bodies need not tell where they are at the same times; what the older state lacks is half its
    acceleration times the square of the difference in time.
    """

    a = InputPort(BodyState, doc="one body")
    b = InputPort(BodyState, doc="the other body")
    distance = OutputPort(float, doc="metres between them")

    def initialize(self) -> None:
        self._known = _Known()

    def fire(self) -> None:
        self._known.see(0, self.a.tokens)
        self._known.see(1, self.b.tokens)
        self._known.tell(self.distance)


class SeparationMonitor(Actor):
    """The smallest distance between any two of several bodies, whenever a state comes and two or more are known.

    It is that of the time of the latest state, as ``DistanceMonitor`` tells it.
    """

    bodies = InputPort(BodyState, multi=True, doc="a connection for each body")
    distance = OutputPort(float, doc="smallest distance between two of them in metres")

    def initialize(self) -> None:
        self._known = _Known()

    def fire(self) -> None:
        for body, states in enumerate(self.bodies.by_channel()):
            self._known.see(body, states)
        self._known.tell(self.distance)
