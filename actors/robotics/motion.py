"""Bodies that come and go."""

from __future__ import annotations

from ..core import Actor, EpicycleError, InputPort, OutputPort, Parameter, array_parameter
from ..core.elementary import distance, total
from .messages import BodyState


class WaypointMotion(Actor):
    """A body that moves from waypoint to waypoint with constant speed, computed from the time alone.

    It sends nothing before it ``appears`` at the first waypoint, and nothing from the time when it ``leaves``.  At the
    last waypoint it stops, or starts again from the first one, to which it jumps unless both are the same place.
    """

    trigger = InputPort(object, doc="sends the state now, if the body is there")
    state = OutputPort(BodyState, doc="position and velocity at this time")

    waypoints = array_parameter((None, 2), unit="m", doc="where it goes, one after the other")
    speed = Parameter(float, 1.0, unit="m/s", min=0, doc="constant speed")
    appears = Parameter(float, 0.0, unit="s", min=0, doc="when it appears, in the run")
    leaves = Parameter(float, None, unit="s", min=0, doc="when it leaves; never if left out")
    repeats = Parameter(bool, False, doc="whether it begins again after the last waypoint")

    def check(self) -> None:
        if not len(self.waypoints):
            raise EpicycleError("needs at least one waypoint")

    def initialize(self) -> None:
        self._places = [(x, y) for x, y in self.waypoints.tolist()]
        self._legs = [distance(a, b) for a, b in zip(self._places, self._places[1:], strict=False)]
        self._length: float = total(self._legs)

    def fire(self) -> None:
        now = self.now
        if now < self.appears or (self.leaves is not None and now >= self.leaves):
            return
        travelled = self.speed * (now - self.appears)
        if self.repeats and self._length > 0.0:
            travelled -= self._length * int(travelled / self._length)
        for (x, y), (to_x, to_y), leg in zip(self._places, self._places[1:], self._legs, strict=False):
            if travelled < leg:
                dx, dy = (to_x - x) / leg, (to_y - y) / leg
                velocity = self.speed * dx, self.speed * dy
                self.state.send(BodyState((x + travelled * dx, y + travelled * dy), velocity, now))
                return
            travelled -= leg
        self.state.send(BodyState(self._places[-1], (0.0, 0.0), now))
