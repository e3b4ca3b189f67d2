"""Pose: position, velocity and heading of a vehicle."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.elementary import cos, sin
from ..robotics import BodyState
from ..robotics.tokens import token


@token()
class Pose(BodyState):
    """Position, velocity and heading of a vehicle at ``time``.  It is also a ``BodyState``."""

    heading: float  # rad from the x axis to the left; whole turns count

    @property
    def speed(self) -> float:
        """Speed along the heading, m/s; negative when driving backwards."""
        vx, vy = self.velocity.tolist()
        return float(vx * cos(self.heading) + vy * sin(self.heading))

    def seen(self, point: Sequence[float]) -> tuple[float, float]:
        """A point as seen from the vehicle: metres ahead, and metres to the left."""
        x, y = self.position.tolist()
        dx, dy = point[0] - x, point[1] - y
        along, across = cos(self.heading), sin(self.heading)
        return along * dx + across * dy, along * dy - across * dx
