"""How robots move: what vehicles do, and what controllers plan with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from ..core import Configurable, Parameter
from ..core.elementary import hypot
from .arrays import Array, array_of, floats
from .messages import BodyState, MotionState
from .own import numbers_of
from .receiving import MessageError

Numbers: TypeAlias = Any  # a sequence or an array of floats or of symbols


class Dynamics(Configurable):
    """How a robot moves, written once for numbers and for symbols of CasADi: use ``symbolic`` for its functions.

    A state begins with the position.  Say how many numbers states and controls have, and write ``step``; write
    ``velocity`` unless it is what follows in the state, and the limits and the braking that there are.
    """

    dimensions: int = 2  # d, of its positions
    states: int = 4  # numbers of a state
    controls: int = 2  # numbers of a control
    # How many steps ahead the position is not changed by the first control that is still to be found; in the paper's
    # discrete form, a control changes the velocity of the next step, and the position of the one after it.
    decided: int = 1

    def step(self, state: Numbers, control: Numbers, period: float) -> Numbers:
        """The state after a ``period`` (s) of a constant control."""
        raise NotImplementedError(f"{type(self).__name__} has no step()")

    def velocity(self, state: Numbers) -> Numbers:
        """The velocity (d,), m/s."""
        return state[self.dimensions : 2 * self.dimensions]

    def state_limits(self, state: Numbers) -> Numbers:
        """Numbers that are <= 0 in each state that the robot may have."""
        return ()

    def control_limits(self, control: Numbers) -> Numbers:
        """Numbers that are <= 0 for each control that the robot may apply."""
        return ()

    def limited_state(self, state: Sequence[float]) -> Sequence[float]:
        """The nearest state that a vehicle may have."""
        return state

    def limited_control(self, control: Sequence[float]) -> Sequence[float]:
        """What a vehicle does when it is told to apply a control."""
        return control

    def braking(self, state: Numbers, period: float) -> Numbers:
        """A control that brings the robot to rest, kept by ``control_limits``."""
        return [0.0] * self.controls

    def at_rest(self, place: Numbers) -> Numbers:
        """The state at rest at a place (d,)."""
        return [*place, *[0.0] * (self.states - len(place))]

    def state_of(self, body: BodyState) -> list[float]:
        """The state of a robot that sent a token."""
        rest = getattr(body, "rest", body.velocity)
        state = [*floats(body.position), *floats(rest)]
        if len(state) != self.states:
            raise MessageError(
                f"{type(self).__name__} has states of {self.states} numbers, and a {type(body).__name__} of "
                f"{len(state)} came; is the vehicle's 'dynamics' the controller's?"
            )
        return state

    def body(self, state: Sequence[float], time: float) -> BodyState:
        """The token for a state."""
        d = self.dimensions
        return MotionState(np.array(state[:d]), np.array(self.velocity(state)), time, np.array(state[d:]))

    def try_out(self, place: Sequence[float]) -> None:
        """Raise ``MethodError`` if a method does not give as many numbers as it should."""
        of_state, of_control = ", as 'states' says", ", as 'controls' says"
        state = numbers_of(self, "at_rest", self.at_rest(place), self.states, of_state)
        numbers_of(self, "velocity", self.velocity(state), self.dimensions, ", as 'dimensions' says")
        control = numbers_of(self, "braking", self.braking(state, 1.0), self.controls, of_control)
        numbers_of(self, "step", self.step(state, control, 1.0), self.states, of_state)
        numbers_of(self, "state_limits", self.state_limits(state))
        numbers_of(self, "control_limits", self.control_limits(control))
        numbers_of(self, "limited_state", self.limited_state(state), self.states, of_state)
        numbers_of(self, "limited_control", self.limited_control(control), self.controls, of_control)

    def trajectory(self, state: Numbers, controls: Any, period: float) -> Any:
        """States (N, n) at steps 1..N, from the first one, under controls (N, m); the last control changes none."""
        states = [np.array(state)]
        for control in controls[:-1]:
            states.append(np.array(self.step(states[-1], control, period)))
        return np.stack(states)

    # --- what a controller does with it -----------------------------------------------------------------

    def next_state(self, own: BodyState, applied: Array, period: float) -> Array:
        """The state (n,) a period after that of a token."""
        return np.array(self.step(self.state_of(own), floats(applied), period), dtype=float)

    def standing_plan(
        self, state: Array, controls: Array, elapsed: float, radius: Array, now: Array, period: float
    ) -> tuple[Array, Array, Array]:
        """The use of a plan from ``state`` (n,) with ``controls`` (N, m), ``elapsed`` seconds later, as
        ``reachability.standing_plan``: centres (N, d) and radii (N,) of the tube around it, and the starts of a solver
        (2, N, m): the plan, and braking from the state ``now``."""
        steps = len(radius)
        age = round(min(max(elapsed / period, 0.0), steps))
        centres, radii = np.zeros((steps, self.dimensions)), np.full(steps, math.inf)
        starts = np.zeros((2, *controls.shape))
        left = steps - age
        if left:
            centres[:left] = self.trajectory(state, controls, period)[age:, : self.dimensions]
            radii[:left], starts[0, :left] = radius[:left], controls[age:]
        for s in range(steps):
            starts[1, s] = self.braking(now, period)
            now = np.array(self.step(now, starts[1, s], period), dtype=float)
        return centres, radii, starts

    def announced(self, own: BodyState, state: Array, controls: Array, period: float) -> tuple[BodyState, Array]:
        """A plan from the ``state`` at the next step, as others take it: the state and the accelerations of a double
        integrator that is at the same places."""
        positions = self.trajectory(state, controls, period)[:, : self.dimensions]
        velocities = np.diff(np.vstack([own.position, positions]), axis=0) / period
        return BodyState(own.position, velocities[0], own.time), np.diff(velocities, axis=0) / period


class DoubleIntegrator(Dynamics):
    """The paper's robot, eq. (2): the control is the acceleration, and the state is position and velocity.

    In space, speed and acceleration stay in ellipsoids, whose vertical half axes are the limits of climbing.
    """

    decided = 2

    dimensions = Parameter(int, 2, min=2, max=3, doc="of its positions: 3 if it flies, the height last")
    max_speed = Parameter(float, 8.0, unit="m/s", min=0, doc="Vmax")
    max_acceleration = Parameter(float, 8.0, unit="m/s^2", min=0, doc="Amax")
    climb_speed = Parameter(float, 4.0, unit="m/s", above=0, doc="in space, largest vertical speed, up and down")
    climb_acceleration = Parameter(float, 4.0, unit="m/s^2", above=0, doc="in space, largest vertical acceleration")

    def check(self) -> None:
        self.states, self.controls = 2 * self.dimensions, self.dimensions

    def try_out(self, place: Sequence[float]) -> None:
        """It is right, and its formulas take long to load."""

    def step(self, state: Numbers, control: Numbers, period: float) -> Numbers:
        from .numerics.definitions import dynamics

        return dynamics(state, control, period)

    def state_limits(self, state: Numbers) -> Numbers:
        from .numerics.definitions import f1

        return f1(np.array([state[self.dimensions :]]), self.max_speed, self.climb_speed)

    def control_limits(self, control: Numbers) -> Numbers:
        from .numerics.definitions import f2

        return f2(np.array([control]), self.max_acceleration, self.climb_acceleration)

    def limited_state(self, state: Sequence[float]) -> Sequence[float]:
        d = self.dimensions
        return *state[:d], *shortened(state[d:], self.max_speed, self.max_speed / self.climb_speed)

    def limited_control(self, control: Sequence[float]) -> Sequence[float]:
        return shortened(control, self.max_acceleration, self.max_acceleration / self.climb_acceleration)

    def braking(self, state: Numbers, period: float) -> Numbers:
        velocity = state[self.dimensions :]
        speed, most = self.speed_and_braking(velocity)
        if not speed > 0.0:
            return [0.0] * self.dimensions
        push = min(0.95 * most, speed / period)
        return [-push * (v / speed) for v in velocity]

    def speed_and_braking(self, velocity: Sequence[float]) -> tuple[float, float]:
        """The speed, and the largest acceleration against it."""
        speed, most = length(velocity), self.max_acceleration
        if len(velocity) == 2 or not 0.0 < speed < math.inf:
            return speed, most
        return speed, most * (speed / length(velocity, most / self.climb_acceleration))

    def body(self, state: Sequence[float], time: float) -> BodyState:
        d = self.dimensions
        return BodyState(array_of(tuple(state[:d])), array_of(tuple(state[d:])), time)


def length(vector: Sequence[float], ratio: float = 1.0) -> float:
    """The length of a vector, in which a height counts times ``ratio``."""
    level = hypot(vector[0], vector[1])
    return level if len(vector) == 2 else hypot(level, ratio * vector[2])


def shortened(vector: Sequence[float], longest: float, ratio: float = 1.0) -> Sequence[float]:
    """The vector itself, or, if it is longer than ``longest``, the vector of that length in its direction; a height
    counts times ``ratio``."""
    size = length(vector, ratio)
    if not size > longest:
        return vector
    share = longest / size
    return tuple([x * share for x in vector])
