"""Guidance of vehicles: WaypointFollower."""

from __future__ import annotations

import math

from ..core import Actor, InputPort, OutputPort, Parameter, ParameterError, array_parameter
from ..core.elementary import atan, hypot
from ..robotics import BodyState
from .pose import Pose

Point = tuple[float, float]


class WaypointFollower(Actor):
    """Drives a vehicle along straight lines from waypoint to waypoint, by pure pursuit.

    The vehicle heads for the point of the path that is ``lookahead`` ahead of the point beside it, on an arc of
    curvature ``2 sin(angle) / distance``; a point behind it is approached in the tightest such turn.  The path begins
    at the first position of the vehicle.  A waypoint is passed when the vehicle is beside it, at the end of its line,
    or nearer than ``tolerance``; at the last one, it stops unless the path is ``closed``.  For a ``Unicycle`` connect
    ``speed`` and ``turn_rate``, for an ``Ackermann`` ``speed`` and ``steering``.
    Source: R. C. Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, CMU-RI-TR-92-01, 1992.
    """

    pose = InputPort(Pose, doc="where the vehicle is, or believes it is")
    speed = OutputPort(float, doc="m/s, speed to drive; 0 at the end")
    turn_rate = OutputPort(float, doc="rad/s, turn rate at this speed; positive is to the left")
    steering = OutputPort(float, doc="rad, steering angle; sent if 'wheelbase' is given")
    passed = OutputPort(int, doc="number of each waypoint passed, from 0")
    arrived = OutputPort(bool, doc="true, once, when the last waypoint is passed")
    deviation = OutputPort(float, doc="m, distance of the vehicle from its line; positive is to the left of it")

    waypoints = array_parameter((None, 2), unit="m", doc="points to pass, in this order")
    cruise = Parameter(float, 1.0, unit="m/s", above=0, doc="speed to drive")
    lookahead = Parameter(
        float, 1.0, unit="m", above=0, doc="distance along the path to the point that the vehicle heads for"
    )
    tolerance = Parameter(float, 0.1, unit="m", above=0, doc="distance from a waypoint that counts as passing it")
    deceleration = Parameter(
        float, None, unit="m/s^2", above=0, doc="deceleration before the last waypoint; no braking if left out"
    )
    wheelbase = Parameter(float, None, unit="m", above=0, doc="distance between the axles of a steered vehicle")
    closed = Parameter(bool, False, doc="whether the path is closed: the first waypoint follows the last")

    def check(self) -> None:
        if not len(self.waypoints):
            raise ParameterError("waypoints: the list is empty; give at least one")
        if self.closed and len(self.waypoints) == 1:
            raise ParameterError("closed: a path of one waypoint cannot be closed; give two or more")
        rows = self.waypoints.tolist()
        for number, (one, other) in enumerate(zip(rows, rows[1:] + rows[: self.closed], strict=False)):
            if one == other:
                raise ParameterError(f"waypoints: {number} and {(number + 1) % len(rows)} are the same, {one}")

    def initialize(self) -> None:
        self._points: list[Point] = [(x, y) for x, y in self.waypoints.tolist()]
        self._next = 0  # the number of the waypoint ahead; their count when the last is passed
        self._from: Point | None = None  # where its line begins

    def fire(self) -> None:
        for pose in self.pose.tokens:
            x, y = pose.position.tolist()
            if self._from is None:
                self._from = x, y
            self._pass(pose)
            if self._next < len(self._points):
                self._drive(pose)
            else:
                self._send(0.0, 0.0)

    def _pass(self, pose: BodyState) -> None:
        """Pass the waypoints that the vehicle has reached; each at most once."""
        x, y = pose.position.tolist()
        for _ in self._points:
            if self._next == len(self._points):
                return
            done, length, _ = self._beside(x, y)
            ahead = self._points[self._next]
            if done < length and hypot(ahead[0] - x, ahead[1] - y) > self.tolerance:
                return
            self.passed.send(self._next)
            self._from = ahead
            self._next += 1
            if self._next == len(self._points) and not self.closed:
                self.arrived.send(True)
            elif self._next == len(self._points):
                self._next = 0

    def _beside(self, x: float, y: float) -> tuple[float, float, float]:
        """The distance of the vehicle along its line, the length of the line, and the distance to the left of it."""
        assert self._from is not None
        (ax, ay), (bx, by) = self._from, self._points[self._next]
        length = hypot(bx - ax, by - ay)
        if length == 0.0:  # the line begins at a waypoint
            return 0.0, 0.0, 0.0
        ex, ey = (bx - ax) / length, (by - ay) / length
        return (x - ax) * ex + (y - ay) * ey, length, (y - ay) * ex - (x - ax) * ey

    def _drive(self, pose: Pose) -> None:
        x, y = pose.position.tolist()
        done, length, aside = self._beside(x, y)
        self.deviation.send(aside)
        target, left = self._ahead(done, length)
        ahead, across = pose.seen(target)
        distance = hypot(ahead, across)
        speed = self.cruise
        if self.deceleration is not None and not self.closed:
            speed = min(speed, math.sqrt(2.0 * self.deceleration * left))
        if distance == 0.0:
            curvature = 0.0
        elif ahead < 0.0:
            curvature = (2.0 if across >= 0.0 else -2.0) / distance
        else:
            curvature = 2.0 * across / (distance * distance)
        self._send(speed, curvature)

    def _ahead(self, done: float, length: float) -> tuple[Point, float]:
        """The point to head for, and the distance to the last waypoint along the path."""
        assert self._from is not None
        points, number, begin = self._points, self._next, self._from
        wanted = max(done, 0.0) + self.lookahead
        target: Point | None = None
        whole = 0.0  # from the beginning of the present line
        for step in range(len(points)):
            if number == len(points) and not self.closed:
                break
            end = points[number % len(points)]
            length = length if step == 0 else hypot(end[0] - begin[0], end[1] - begin[1])
            if target is None and wanted <= whole + length and length > 0.0:
                share = (wanted - whole) / length
                target = begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1])
            whole += length
            begin, number = end, number + 1
        return target or begin, max(whole - done, 0.0)

    def _send(self, speed: float, curvature: float) -> None:
        self.speed.send(speed)
        self.turn_rate.send(speed * curvature)
        if self.wheelbase is not None:
            self.steering.send(atan(self.wheelbase * curvature))
