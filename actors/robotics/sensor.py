"""What a robot sees of the target."""

from __future__ import annotations

from ..core import Actor, InputPort, OutputPort, Parameter
from ..core.elementary import hypot
from .messages import RANGE, RELATIVE_POSITION, BodyState, Measurement, enclosing


class Sensor(Actor):
    """Measures the target's relative position, or its distance, with normal noise (Table II).

    The noise of a relative position is an ellipse: ``along`` the true line of sight and ``across`` it.  Both
    of its components are drawn at every firing, whether used or not, so that neither ``kind`` nor
    ``max_range`` moves the noise of later measurements.  A measurement is of the time of the robot's own
    state, by the robot's own clock.
    """

    robot = InputPort(BodyState, doc="where the robot that carries the sensor is")
    location = InputPort(
        BodyState, required=False, doc="where it believes to be, which stands in the measurement; unconnected: as robot"
    )
    target = InputPort(BodyState, doc="where the target is")
    measurement = OutputPort(Measurement, doc="sent at tags where both are known and the target is in range")

    kind = Parameter(str, RELATIVE_POSITION, choices=(RELATIVE_POSITION, RANGE), doc="what is measured")
    along = Parameter(float, 0.2, unit="m", min=0, doc="standard deviation along the line of sight, sigma_d")
    across = Parameter(float, 2.0, unit="m", min=0, doc="standard deviation across the line of sight, sigma_b")
    max_range: Parameter[float | None] = Parameter(
        float, None, unit="m", min=0, doc="no measurement beyond this distance; none: no limit"
    )
    robot_name = Parameter(str, "", doc="name in the measurement; empty: the path of what the sensor stands in")

    def initialize(self) -> None:
        self._draw = self.random_stream("noise").standard_normal
        self._name = self.robot_name or enclosing(self.path)

    def fire(self) -> None:
        error_along, error_across = self._draw(2).tolist()
        if not (self.robot.present and self.target.present):
            return
        robot = self.robot.value
        position = robot.position
        believed = self.location.value.position if self.location.present else position
        # Floats: arithmetic on arrays of two takes ten times as long.
        (tx, ty), (x, y) = self.target.value.position.tolist(), position.tolist()
        dx, dy = tx - x, ty - y
        distance = hypot(dx, dy)
        if self.max_range is not None and distance > self.max_range:
            return
        along, across = self.along * error_along, self.across * error_across
        if self.kind == RANGE:
            value = [distance + along]
        else:
            nx, ny = (dx / distance, dy / distance) if distance > 0.0 else (1.0, 0.0)  # the line of sight
            value = [dx + along * nx - across * ny, dy + along * ny + across * nx]
        self.measurement.send(Measurement(self._name, believed, self.kind, value, self.along, self.across, robot.time))
