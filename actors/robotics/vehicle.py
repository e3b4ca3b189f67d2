"""The omnidirectional robot of eq. (2): acceleration in, position and velocity out."""

from __future__ import annotations

import math

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter, array_parameter
from .messages import Array, BodyState, all_finite


class Vehicle(Actor):
    """A double integrator in the paper's discrete form: ``P += dt * V``, ``V += dt * U`` at every trigger.

    ``dt`` is the time since the last trigger and U the acceleration held over it.  A control that arrives at
    the time of a trigger acts from that time on, so the state sent there does not depend on it; one that
    arrives between two triggers acts from the next one.  Without a new control the last one is held.  A
    control that is not finite is ignored.
    """

    trigger = InputPort(object, doc="move to the present time and send the state")
    acceleration = InputPort(np.ndarray, shape=(2,), doc="m/s^2, the control to be applied from now on")
    state = OutputPort(BodyState, depends_on=("trigger",), doc="position and velocity at this time")

    start = array_parameter((2,), unit="m", doc="position at the first trigger")
    start_velocity = array_parameter((2,), (0.0, 0.0), unit="m/s", doc="velocity at the first trigger")
    max_speed = Parameter(float, 8.0, unit="m/s", min=0, doc="a faster velocity is shortened to this")
    max_acceleration = Parameter(float, 8.0, unit="m/s^2", min=0, doc="a harder control is shortened to this")

    def initialize(self) -> None:
        self._position = np.array(self.start)
        self._velocity = shortened(np.array(self.start_velocity), self.max_speed)
        self._held = np.zeros(2)
        self._next = self._held
        self._moved_at: int | None = None

    def fire(self) -> None:
        now = self.tag.time
        if self.trigger.present:
            if self._moved_at is not None:
                self._move((now - self._moved_at) / 1e9)
            self._held = self._next
            self._moved_at = now
            self.state.send(BodyState(self._position, self._velocity))
        if self.acceleration.present and all_finite(wanted := np.array(self.acceleration.value, dtype=float)):
            self._next = shortened(wanted, self.max_acceleration)
            if self._moved_at == now:
                self._held = self._next

    def _move(self, elapsed: float) -> None:
        self._position = self._position + elapsed * self._velocity
        self._velocity = shortened(self._velocity + elapsed * self._held, self.max_speed)


def shortened(vector: Array, longest: float) -> Array:
    """The vector itself, or the one of length ``longest`` in its direction if it is longer."""
    length = math.hypot(vector.item(0), vector.item(1))
    return vector * (longest / length) if length > longest else vector
