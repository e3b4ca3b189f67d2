"""Actors that watch a run and report what matters of it."""

from __future__ import annotations

from itertools import combinations

from ..core import Actor, InputPort, OutputPort, Parameter, array_parameter
from ..core.elementary import distance
from .messages import BodyState


class GoalMonitor(Actor):
    """Tells when a body first comes within ``tolerance`` of the goal, and how far it has travelled."""

    state = InputPort(BodyState, doc="the body")
    arrived = OutputPort(bool, doc="true, once, at the first arrival")
    time = OutputPort(float, doc="the time of the first arrival in seconds, once")
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
            self.time.send(self.now)
            self.arrived.send(True)


class DistanceMonitor(Actor):
    """The distance between two bodies at each tag at which both are known."""

    a = InputPort(BodyState, doc="one body")
    b = InputPort(BodyState, doc="the other body")
    distance = OutputPort(float, doc="metres between them")

    def fire(self) -> None:
        if self.a.present and self.b.present:
            self.distance.send(distance(self.a.value.position.tolist(), self.b.value.position.tolist()))


class SeparationMonitor(Actor):
    """The smallest distance between any two of several bodies, at each tag at which two or more are known."""

    bodies = InputPort(BodyState, multi=True, doc="a connection for each body")
    distance = OutputPort(float, doc="smallest distance between two of them in metres")

    def fire(self) -> None:
        # One state of each body: a state that was duplicated on its way is not two bodies at one place.
        positions = [states[-1].position.tolist() for states in self.bodies.by_channel() if states]
        if len(positions) >= 2:
            self.distance.send(min(distance(a, b) for a, b in combinations(positions, 2)))
