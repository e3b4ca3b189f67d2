"""Bodies that move by themselves."""

from __future__ import annotations

import math

from ..core import Actor, InputPort, OutputPort, Parameter, array_parameter
from ..core.elementary import cos, sin
from .messages import BodyState


class CircularMotion(Actor):
    """A body on a circle of radius ``speed / turn_rate`` (Table III), computed from the time alone.

    The circle's centre lies to the left of the first heading: with the defaults the body starts on top of a
    circle around (12, 0) and turns counter-clockwise.
    """

    trigger = InputPort(object, doc="send the state now")
    state = OutputPort(BodyState, doc="position and velocity at this time")

    start = array_parameter((2,), (12.0, 2.0), unit="m", doc="position at the start of the run")
    speed = Parameter(float, 1.26, unit="m/s", min=0, doc="constant speed")
    turn_rate = Parameter(float, 0.628, unit="rad/s", doc="positive turns left; 0 is a straight line")
    heading = Parameter(float, math.pi, unit="rad", doc="direction of motion at the start, from the x axis")

    def initialize(self) -> None:
        self._began = self.now

    def fire(self) -> None:
        now = self.now
        elapsed = now - self._began
        turned = self.turn_rate * elapsed
        # The chord of the arc travelled: right for any turn rate, 0 included.
        chord = self.speed * elapsed * _sinc(turned / (2.0 * math.pi))
        direction, heading = self.heading + turned / 2.0, self.heading + turned
        x, y = self.start.tolist()
        position = x + chord * cos(direction), y + chord * sin(direction)
        velocity = self.speed * cos(heading), self.speed * sin(heading)
        self.state.send(BodyState(position, velocity, now))


def _sinc(x: float) -> float:
    """sin(pi x) / (pi x), 1 at 0; np.sinc takes 10 us for one number."""
    angle = math.pi * x
    return sin(angle) / angle if angle else 1.0
