"""Sensors of vehicles: RangeBearingSensor, RangeScanner and InertialSensor."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter, ParameterError, PortError, array_parameter
from ..core.elementary import atan2, cos, hypot, sin
from ..robotics import BodyState
from ..robotics.receiving import PLANE, by_channel, latest
from .pose import Pose

_TURN: Final = 2.0 * math.pi
_EDGE: Final = 1e-9  # of a wall's length, so that no beam passes between two walls that meet


class RangeBearingSensor(Actor):
    """Measures the distance and direction of a target as seen from the vehicle, with normal noise.

    The target is a body that sends its state, or a ``landmark``.  It is seen while it is within ``max_range`` and the
    field of view.  Both errors are drawn at each pose, used or not, so that visibility does not change the noise of
    later measurements.
    Source: S. Thrun, W. Burgard and D. Fox, Probabilistic Robotics, 2005, section 6.6.
    """

    pose = InputPort(Pose, doc="where the vehicle is; each pose causes a measurement")
    target = InputPort(BodyState, required=False, doc="where the target is; the latest position is used")
    bearing = OutputPort(float, doc="rad, from the heading to the left, from -pi to pi")
    range = OutputPort(float, doc="m, the distance")

    landmark = array_parameter((2,), None, unit="m", doc="position of the target, if none is connected")
    bearing_deviation = Parameter(float, 0.0, unit="rad", min=0, doc="standard deviation of the bearing")
    range_deviation = Parameter(float, 0.0, unit="m", min=0, doc="standard deviation of the range")
    max_range = Parameter(float, math.inf, unit="m", min=0, doc="nothing is seen beyond this distance")
    field_of_view = Parameter(
        float, _TURN, unit="rad", above=0, max=_TURN, doc="field of view: full angle, centred on the heading"
    )

    def initialize(self) -> None:
        if (self.landmark is None) == (self.target.width == 0):
            raise PortError(f"{self.path} needs one target: either connect 'target' or give a 'landmark'")
        self._draw = self.random_stream("noise").standard_normal
        self._seen: list[float] | None = None if self.landmark is None else self.landmark.tolist()

    def fire(self) -> None:
        if self.target.present:
            self._seen = latest(self.target, PLANE).position.tolist()
        for pose in self.pose.tokens:
            errors = self._draw(), self._draw()
            if self._seen is None:
                continue
            ahead, across = pose.seen(self._seen)
            distance, bearing = hypot(ahead, across), atan2(across, ahead)
            if distance > self.max_range or abs(bearing) > 0.5 * self.field_of_view:
                continue
            self.bearing.send(wrapped(bearing + self.bearing_deviation * errors[0]))
            self.range.send(max(distance + self.range_deviation * errors[1], 0.0))


def wrapped(angle: float) -> float:
    """The same direction as an angle from -pi to pi."""
    if -math.pi <= angle <= math.pi:
        return angle
    return angle - _TURN * math.floor((angle + math.pi) / _TURN)


class RangeScanner(Actor):
    """A lidar in the plane: distances to obstacles along beams from the vehicle's position, with noise.

    The beams are evenly spread over the field of view, from the right to the left; over a full turn, the first one
    points backwards.  A beam ends at the nearest wall, disc or body, or at ``max_range``, which is then its distance.
    The noise is normal, and independent from beam to beam.
    Source: S. Thrun, W. Burgard and D. Fox, Probabilistic Robotics, 2005, section 6.3.
    """

    pose = InputPort(Pose, doc="where the vehicle is; each pose causes a measurement")
    bodies = InputPort(BodyState, multi=True, required=False, doc="moving discs; their latest positions are used")
    ranges = OutputPort(np.ndarray, shape=(None,), doc="m, a distance for each beam")
    nearest = OutputPort(float, doc="m, the shortest of them")

    beams = Parameter(int, 36, min=1, max=10_000, doc="number of beams")
    field_of_view = Parameter(
        float, _TURN, unit="rad", min=0, max=_TURN, doc="angle from the first beam to the last, centred on the heading"
    )
    max_range = Parameter(float, 30.0, unit="m", above=0, doc="longest distance that it measures")
    deviation = Parameter(float, 0.0, unit="m", min=0, doc="standard deviation of a range")
    walls = array_parameter((None, 4), (), unit="m", doc="straight walls: x and y of one end, x and y of the other")
    discs = array_parameter((None, 3), (), unit="m", doc="round obstacles: x, y and radius")
    body_radius = Parameter(float, 0.5, unit="m", min=0, doc="radius of the bodies")

    def check(self) -> None:
        if self.max_range == math.inf:
            raise ParameterError("max_range: it must be finite, because beams that hit nothing end there")
        if any(row[2] < 0.0 for row in self.discs.tolist()):
            raise ParameterError("discs: a radius is negative; expected >= 0")

    def initialize(self) -> None:
        self._draw = self.random_stream("noise").standard_normal
        self._bodies: list[tuple[float, float] | None] = [None] * self.bodies.width
        count, whole = self.beams, self.field_of_view
        # Over a full turn the last beam would be the first one again.
        step = whole / (count if whole == _TURN else max(count - 1, 1))
        first = 0.0 if count == 1 else -0.5 * whole
        self._angles = [first + number * step for number in range(count)]

    def fire(self) -> None:
        for channel, tokens in enumerate(by_channel(self.bodies, PLANE)):
            if tokens:
                x, y = tokens[-1].position.tolist()
                self._bodies[channel] = x, y
        for pose in self.pose.tokens:
            found = self._measured(pose)
            ranges = np.array(found)
            ranges.setflags(write=False)
            self.ranges.send(ranges)
            self.nearest.send(min(found))

    def _measured(self, pose: Pose) -> list[float]:
        x, y = pose.position.tolist()
        # As seen from the vehicle: all beams start at the origin.
        walls = [(ax - x, ay - y, bx - ax, by - ay) for ax, ay, bx, by in self.walls.tolist()]
        discs = [(cx - x, cy - y, radius) for cx, cy, radius in self.discs.tolist()]
        discs += [(body[0] - x, body[1] - y, self.body_radius) for body in self._bodies if body is not None]
        found = []
        for angle in self._angles:
            dx, dy = cos(pose.heading + angle), sin(pose.heading + angle)
            distance = self.max_range
            for wall in walls:
                distance = min(distance, _to_wall(dx, dy, *wall))
            for disc in discs:
                distance = min(distance, _to_disc(dx, dy, *disc))
            error = self._draw()
            if distance < self.max_range:
                distance = min(max(distance + self.deviation * error, 0.0), self.max_range)
            found.append(distance)
        return found


def _to_wall(dx: float, dy: float, ax: float, ay: float, ex: float, ey: float) -> float:
    """The distance from the origin along (dx, dy) to a wall from a to a + e; infinite if the beam misses it."""
    across = dx * ey - dy * ex
    if across == 0.0:  # parallel to the wall: the beam sees at most its edge
        return math.inf
    distance = (ax * ey - ay * ex) / across
    share = (ax * dy - ay * dx) / across
    return distance if distance >= 0.0 and -_EDGE <= share <= 1.0 + _EDGE else math.inf


def _to_disc(dx: float, dy: float, cx: float, cy: float, radius: float) -> float:
    """The distance from the origin along (dx, dy) to a disc; 0 from within, infinite if the beam misses it."""
    if cx * cx + cy * cy <= radius * radius:
        return 0.0
    along, aside = cx * dx + cy * dy, cx * dy - cy * dx
    square = radius * radius - aside * aside
    return along - math.sqrt(square) if along > 0.0 and square >= 0.0 else math.inf


class InertialSensor(Actor):
    """An inertial measurement unit in the plane: turn rate and acceleration, with noise and drifting biases.

    Both are means from pose to pose, as in a sensor that integrates.  The noise of a reading over t seconds has the
    standard deviation ``noise / sqrt(t)``, so densities are those in data sheets; each bias is a Wiener process with
    the standard deviation ``walk * sqrt(t)``.
    Source: IEEE Std 952-1997, annex C; O. J. Woodman, An introduction to inertial navigation, UCAM-CL-TR-696, 2007.
    """

    pose = InputPort(Pose, doc="how the vehicle moves; each pose from the second on causes a measurement")
    turn_rate = OutputPort(float, doc="rad/s, positive to the left")
    acceleration = OutputPort(np.ndarray, shape=(2,), doc="m/s^2, along the heading and to the left of it")

    turn_rate_noise = Parameter(
        float, 0.0, min=0, doc="density of the gyroscope's noise, in rad/s per square root of Hz"
    )
    turn_rate_walk = Parameter(float, 0.0, min=0, doc="random walk of its bias, in rad/s per square root of a second")
    turn_rate_bias = Parameter(float, 0.0, unit="rad/s", doc="its bias at the start")
    acceleration_noise = Parameter(
        float, 0.0, min=0, doc="density of the accelerometers' noise, in m/s^2 per square root of Hz"
    )
    acceleration_walk = Parameter(
        float, 0.0, min=0, doc="random walk of their biases, in m/s^2 per square root of a second"
    )
    acceleration_bias = array_parameter((2,), (0.0, 0.0), unit="m/s^2", doc="their biases at the start")

    def initialize(self) -> None:
        self._noise = self.random_stream("noise").standard_normal
        self._walk = self.random_stream("walk").standard_normal
        self._biases = [self.turn_rate_bias, *self.acceleration_bias.tolist()]
        self._before: Pose | None = None

    def fire(self) -> None:
        for pose in self.pose.tokens:
            before = self._before
            if before is None or pose.time > before.time:
                self._before = pose
            if before is not None and pose.time > before.time:
                self._measure(before, pose, pose.time - before.time)

    def _measure(self, before: Pose, pose: Pose, elapsed: float) -> None:
        turn_rate = (pose.heading - before.heading) / elapsed
        speeds = before.speed, pose.speed
        truth = turn_rate, (speeds[1] - speeds[0]) / elapsed, turn_rate * (0.5 * (speeds[0] + speeds[1]))
        root = math.sqrt(elapsed)
        noises = self.turn_rate_noise, self.acceleration_noise, self.acceleration_noise
        walks = self.turn_rate_walk, self.acceleration_walk, self.acceleration_walk
        self._biases = [bias + walk * root * self._walk() for bias, walk in zip(self._biases, walks, strict=True)]
        found = [
            value + bias + noise / root * self._noise()
            for value, bias, noise in zip(truth, self._biases, noises, strict=True)
        ]
        self.turn_rate.send(found[0])
        acceleration = np.array(found[1:])
        acceleration.setflags(write=False)
        self.acceleration.send(acceleration)
