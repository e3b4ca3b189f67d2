"""The omnidirectional robot of eq. (2): acceleration in, position and velocity out."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..core import Actor, InputPort, OutputPort, Parameter, array_parameter
from ..core.elementary import hypot
from .messages import BodyState, all_finite

# Of floats: arithmetic on arrays of two takes ten times as long.
Pair = tuple[float, float]


class Vehicle(Actor):
    """A double integrator in the paper's discrete form: ``P += dt * V``, ``V += dt * U`` at every trigger.

    ``dt`` is the time since the last trigger and U the acceleration held over it.  A control that arrives at
    the time of a trigger acts from that time on, so the state sent there does not depend on it; one that
    arrives between two triggers acts from the next one.  Without a new control the last one is held.  A
    control that is not finite is ignored.
    """

    trigger = InputPort(object, doc="move to the present time and send the state")
    acceleration = InputPort(np.ndarray, shape=(2,), triggers=False, doc="m/s^2, the control to be applied from now on")
    state = OutputPort(BodyState, depends_on=("trigger",), doc="position and velocity at this time")

    start = array_parameter((2,), unit="m", doc="position at the first trigger")
    start_velocity = array_parameter((2,), (0.0, 0.0), unit="m/s", doc="velocity at the first trigger")
    max_speed = Parameter(float, 8.0, unit="m/s", min=0, doc="a faster velocity is shortened to this")
    max_acceleration = Parameter(float, 8.0, unit="m/s^2", min=0, doc="a harder control is shortened to this")

    def initialize(self) -> None:
        self._position = _pair(self.start)
        self._velocity = shortened(_pair(self.start_velocity), self.max_speed)
        self._held: Pair = 0.0, 0.0
        self._next = self._held
        self._moved_at: int | None = None

    def fire(self) -> None:
        now = self.tag.time
        if self.trigger.present:
            if self._moved_at is not None:
                self._move((now - self._moved_at) / 1e9)
            self._held = self._next
            self._moved_at = now
            self.state.send(BodyState(self._position, self._velocity, self.now))
        if self.acceleration.present and all_finite(wanted := _pair(self.acceleration.value)):
            self._next = shortened(wanted, self.max_acceleration)
            if self._moved_at == now:
                self._held = self._next

    def _move(self, elapsed: float) -> None:
        (x, y), (vx, vy), (ux, uy) = self._position, self._velocity, self._held
        self._position = x + elapsed * vx, y + elapsed * vy
        self._velocity = shortened((vx + elapsed * ux, vy + elapsed * uy), self.max_speed)


def shortened(vector: Pair, longest: float) -> Pair:
    """The vector itself, or the one of length ``longest`` in its direction if it is longer."""
    x, y = vector
    length = hypot(x, y)
    return (x * (longest / length), y * (longest / length)) if length > longest else vector


def _pair(values: ArrayLike) -> Pair:
    x, y = np.asarray(values, dtype=float).tolist()
    return x, y
