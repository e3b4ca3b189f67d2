"""Actors that monitor a run."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from ..core import Actor, InputPort, OutputPort, Parameter
from ..core.elementary import distance
from .arrays import floats
from .messages import BodyState
from .receiving import PlaceParameter, by_channel, latest, received


class GoalMonitor(Actor):
    """Sends when a body first comes within ``tolerance`` of the goal, and how far it has travelled."""

    state = InputPort(BodyState, doc="the body")
    arrived = OutputPort(bool, doc="true, once, at the first arrival")
    time = OutputPort(float, doc="the time of that state in seconds, once")
    path_length = OutputPort(float, doc="length of the path so far in metres, at every state")
    distance = OutputPort(float, doc="distance to the goal in metres, at every state")

    goal = PlaceParameter((0.0, 0.0), doc="where the body should arrive; without a height, on the ground")
    tolerance = Parameter(float, 0.5, unit="m", min=0, doc="distance from the goal that counts as arrived")

    def initialize(self) -> None:
        self._last: tuple[float, ...] | None = None
        self._length = 0.0
        self._has_arrived = False

    def fire(self) -> None:
        state = latest(self.state)
        position = floats(state.position)
        if self._last is not None:
            self._length += _apart(position, self._last)
        self._last = position
        left = _apart(position, floats(self.goal))
        self.path_length.send(self._length)
        self.distance.send(left)
        if left <= self.tolerance and not self._has_arrived:
            self._has_arrived = True
            self.time.send(state.time)
            self.arrived.send(True)


class _DistanceBetween(Actor):
    """The common part of monitors of distances: the latest state of each body."""

    def initialize(self) -> None:
        self._states: dict[int, BodyState] = {}

    def _tell(self, output: OutputPort[float], states_by_body: Iterable[Iterable[BodyState]]) -> None:
        """Store states, and send the smallest distance between two bodies, if at least two are known.

        The distance is at the time of the latest state: each body is moved on from its own state with its velocity.  A
        state older than the known one of a body has no effect.
        """
        for body, states in enumerate(states_by_body):
            for state in states:
                if body not in self._states or state.time >= self._states[body].time:
                    self._states[body] = state
        now = max((state.time for state in self._states.values()), default=0.0)
        places = []
        for state in self._states.values():
            place, elapsed = floats(state.position), now - state.time
            if elapsed > 0.0:
                place = tuple([p + elapsed * v for p, v in zip(place, floats(state.velocity), strict=True)])
            places.append(place)
        if len(places) >= 2:
            output.send(min(_apart(a, b) for a, b in combinations(places, 2)))


def _apart(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """The distance of two places; one without a height is on the ground."""
    if len(a) == len(b):
        return distance(a, b)
    return distance((*a, 0.0)[:3], (*b, 0.0)[:3])


class DistanceMonitor(_DistanceBetween):
    """The distance between two bodies, whenever a state of one comes and both are known.

    The distance is at the time of the later state: the other body is moved on from its last known position with its
    velocity.  So bodies need not send states at the same times; the error is half the acceleration times the square of
    the time difference.
    """

    a = InputPort(BodyState, doc="one body")
    b = InputPort(BodyState, doc="the other body")
    distance = OutputPort(float, doc="distance between them in metres")

    def fire(self) -> None:
        self._tell(self.distance, (received(self.a), received(self.b)))


class SeparationMonitor(_DistanceBetween):
    """The smallest distance between any two of several bodies, whenever a state comes and two or more are known.

    The distance is at the time of the latest state, as in ``DistanceMonitor``.
    """

    bodies = InputPort(BodyState, multi=True, doc="a connection for each body")
    distance = OutputPort(float, doc="smallest distance between two of them in metres")

    def fire(self) -> None:
        self._tell(self.distance, by_channel(self.bodies))


class ClearanceMonitor(Actor):
    """The distance from a body to the nearest of several others that come and go.

    Only those count that send a state at the same tag.
    """

    body = InputPort(BodyState, doc="the body")
    others = InputPort(BodyState, multi=True, required=False, doc="a connection for each of the others")
    distance = OutputPort(float, doc="distance to the nearest in metres, if there is one")

    def fire(self) -> None:
        if self.body.present and self.others.present:
            here = floats(latest(self.body).position)
            self.distance.send(min(_apart(here, floats(state.position)) for state in received(self.others)))
