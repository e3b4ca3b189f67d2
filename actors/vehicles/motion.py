"""Vehicles that roll without slipping: Unicycle and Ackermann."""

from __future__ import annotations

import math
from abc import abstractmethod

from ..core import Actor, EpicycleError, InputPort, OutputPort, Parameter, PortParameter, array_parameter, to_seconds
from ..core.elementary import cos, sin, tan
from .pose import Pose


class _RollingVehicle(Actor):
    """The common part: speed and turn rate are constant between tokens, so the path is an arc, and exact."""

    trigger = InputPort(doc="requests the pose")
    pose = OutputPort(Pose, depends_on=("trigger",), doc="position, velocity and heading at the time of each trigger")

    start = array_parameter((2,), (0.0, 0.0), unit="m", doc="position at the start")
    heading = Parameter(float, 0.0, unit="rad", doc="heading at the start, from the x axis to the left")
    speed = PortParameter(float, 0.0, unit="m/s", doc="speed along the heading; negative is backwards")
    max_speed = Parameter(float, math.inf, unit="m/s", min=0, doc="limit of the speed")

    @abstractmethod
    def _turn_rate(self, speed: float) -> float:
        """The turn rate at a speed, rad/s."""

    def initialize(self) -> None:
        x, y = self.start.tolist()
        self._place = x, y, self.heading  # where the present arc began, and when
        self._since = self.tag.time
        self._motion = self._present_motion()

    def _present_motion(self) -> tuple[float, float]:
        speed = within(self.speed, self.max_speed)
        motion = speed, self._turn_rate(speed)
        if not all(map(math.isfinite, motion)):
            raise EpicycleError(
                f"a speed of {motion[0]:g} m/s and a turn rate of {motion[1]:g} rad/s are not finite numbers"
            )
        return motion

    def fire(self) -> None:
        if any(port.present for port in self.inputs.values() if port is not self.trigger):
            motion = self._present_motion()
            if motion != self._motion:
                self._place, self._since, self._motion = self._now_at(), self.tag.time, motion
        if self.trigger.present:
            x, y, heading = self._now_at()
            speed = self._motion[0]
            self.pose.send(Pose((x, y), (speed * cos(heading), speed * sin(heading)), self.now, heading))

    def _now_at(self) -> tuple[float, float, float]:
        (x, y, heading), (speed, turn_rate) = self._place, self._motion
        elapsed = to_seconds(self.tag.time - self._since)
        half = 0.5 * turn_rate * elapsed
        chord = speed * elapsed * (sin(half) / half if half else 1.0)
        return x + chord * cos(heading + half), y + chord * sin(heading + half), heading + 2.0 * half


def within(value: float, limit: float) -> float:
    """A number, limited on both sides."""
    return min(max(value, -limit), limit)


class Unicycle(_RollingVehicle):
    """A vehicle driven by speed and turn rate: one wheel, or two with separate drives.

    ``dx/dt = v cos h``, ``dy/dt = v sin h``, ``dh/dt = w``.  Speed and turn rate are constant between tokens, so it
    moves along arcs, which are computed as such: the pose is exact, and does not depend on when it is requested.  With
    a constant ``speed`` and ``turn_rate``, it drives in a circle by itself.
    Source: B. Siciliano et al., Robotics: Modelling, Planning and Control, 2009, section 11.2.
    """

    turn_rate = PortParameter(float, 0.0, unit="rad/s", doc="turn rate; positive is to the left")
    max_turn_rate = Parameter(float, math.inf, unit="rad/s", min=0, doc="limit of the turn rate")

    def _turn_rate(self, speed: float) -> float:
        return within(self.turn_rate, self.max_turn_rate)


class Ackermann(_RollingVehicle):
    """A car, driven by speed and steering angle.

    The kinematic bicycle, ``dh/dt = v tan(steering) / wheelbase``; its position is the middle of the rear axle.  Speed
    and steering are constant between tokens, so it moves along arcs, which are computed as such: the pose is exact, and
    does not depend on when it is requested.  For the dynamics of the actuators, put a ``Limiter`` before them.
    Source: B. Siciliano et al., Robotics: Modelling, Planning and Control, 2009, section 11.2.
    """

    steering = PortParameter(float, 0.0, unit="rad", doc="angle of the front wheels; positive is to the left")
    wheelbase = Parameter(float, 2.5, unit="m", above=0, doc="distance between the axles")
    max_steering = Parameter(
        float, 0.6, unit="rad", min=0, max=1.5, doc="limit of the steering angle"
    )  # tan has its pole at 1.57

    def _turn_rate(self, speed: float) -> float:
        return speed * tan(within(self.steering, self.max_steering)) / self.wheelbase
