"""Sensors that see several bodies at once and cannot tell them apart."""

from __future__ import annotations

import math

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter
from ..core.elementary import cos, hypot, sin
from .arrays import floats
from .messages import BodyState, Detections, enclosing
from .receiving import PLANE, by_channel, latest
from .sensor_models import RANGE, RELATIVE_POSITION
from .sight import disturbed


class MultiTargetSensor(Actor):
    """Detects the bodies in range, each with a probability, and clutter; the scan does not say which is which.

    The noise is that of ``Sensor``.  The number of false detections (clutter) has a Poisson distribution.  They are
    uniform over the disc in range, or over the interval of ranges.  The sensor sends empty scans, too: they show that a
    body was missed.  The values are sorted, so that their order carries no information.  A body that sends no state at
    a tag does not exist then.

    Every body has draws of its own at each firing, whether it is in range or not.  So one body does not change the
    measurements of the others.
    """

    robot = InputPort(BodyState, doc="where the robot that carries the sensor is")
    location = InputPort(
        BodyState,
        required=False,
        doc="where the robot believes it is, used in the scan; without a connection, where it is",
    )
    targets = InputPort(BodyState, multi=True, required=False, doc="the bodies, a connection for each")
    detections = OutputPort(Detections, doc="the scan, at every tag where the robot's state is known")

    kind = Parameter(str, RELATIVE_POSITION, choices=(RELATIVE_POSITION, RANGE), doc="what is measured")
    along = Parameter(float, 0.2, unit="m", min=0, doc="standard deviation along the line of sight, sigma_d")
    across = Parameter(float, 2.0, unit="m", min=0, doc="standard deviation across the line of sight, sigma_b")
    max_range = Parameter(float, 30.0, unit="m", above=0, doc="nothing beyond this distance is detected")
    detection_probability = Parameter(
        float, 0.9, unit="1", min=0, max=1, doc="P_D: probability of detecting a body in range"
    )
    clutter = Parameter(float, 0.0, unit="1", min=0, max=1e3, doc="mean number of false detections in a scan")
    robot_name = Parameter(str, "", doc="name in the scan; if empty, the path of the composite with the sensor")

    def initialize(self) -> None:
        self._noise = self.random_stream("noise").standard_normal
        self._chance = self.random_stream("detection").random
        self._false = self.random_stream("clutter")
        self._name = self.robot_name or enclosing(self.path)

    def fire(self) -> None:
        drawn = [(self._chance(), self._noise(), self._noise()) for _ in range(self.targets.width)]
        if not self.robot.present:
            return
        robot = latest(self.robot, PLANE)
        x, y = floats(robot.position)
        seen: list[tuple[float, ...]] = []
        for (chance, *errors), states in zip(drawn, by_channel(self.targets, PLANE), strict=True):
            for state in list(states)[-1:]:
                tx, ty = floats(state.position)
                dx, dy = tx - x, ty - y
                distance = hypot(dx, dy)
                if distance <= self.max_range and chance < self.detection_probability:
                    seen.append(self._measured(dx, dy, distance, self.along * errors[0], self.across * errors[1]))
        for _ in range(self._false.poisson(self.clutter) if self.clutter > 0.0 else 0):
            seen.append(self._clutter())
        believed = latest(self.location, PLANE).position if self.location.present else robot.position
        values = np.array(sorted(seen)) if seen else np.empty((0, 1 if self.kind == RANGE else 2))
        self.detections.send(
            Detections(
                self._name, believed, self.kind, values, self.along, self.across,
                self.detection_probability, self.clutter, self.max_range, robot.time,
            )
        )  # fmt: skip

    def _measured(self, dx: float, dy: float, distance: float, along: float, across: float) -> tuple[float, ...]:
        if self.kind == RANGE:
            return (distance + along,)
        return disturbed((dx, dy), distance, distance, along, across)

    def _clutter(self) -> tuple[float, ...]:
        """A value from nowhere."""
        if self.kind == RANGE:
            return (self.max_range * self._false.random(),)
        distance = self.max_range * math.sqrt(self._false.random())
        direction = 2.0 * math.pi * self._false.random()
        return distance * cos(direction), distance * sin(direction)
