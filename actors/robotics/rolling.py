"""What a controller does by the paper's kernels for a double integrator, for any other dynamics."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .arrays import Array
from .dynamics import Dynamics
from .messages import BodyState


def standing_plan(
    dynamics: Dynamics, state: Array, controls: Array, elapsed: float, radius: Array, now: Array, period: float
) -> tuple[Array, Array, Array]:
    """The use of a plan from ``state`` (n,) with ``controls`` (N, m), ``elapsed`` seconds later, as
    ``reachability.standing_plan``: centres (N, d) and radii (N,) of the tube around it, and the starts of a solver
    (2, N, m): the plan, and braking from the state ``now``."""
    steps = len(radius)
    age = round(min(max(elapsed / period, 0.0), steps))
    centres, radii = np.zeros((steps, dynamics.dimensions)), np.full(steps, math.inf)
    starts = np.zeros((2, *controls.shape))
    left = steps - age
    if left:
        centres[:left] = dynamics.trajectory(state, controls, period)[age:, : dynamics.dimensions]
        radii[:left], starts[0, :left] = radius[:left], controls[age:]
    for s in range(steps):
        starts[1, s] = dynamics.braking(now, period)
        now = np.array(dynamics.step(now, starts[1, s], period), dtype=float)
    return centres, radii, starts


def announced(own: BodyState, positions: Array, period: float) -> tuple[BodyState, Array]:
    """A plan's positions (N, d) from the next step on as others take them: the state and the accelerations of a double
    integrator that is at the same places."""
    velocities = np.diff(np.vstack([own.position, positions]), axis=0) / period
    return BodyState(own.position, velocities[0], own.time), np.diff(velocities, axis=0) / period


def next_state(dynamics: Dynamics, own: BodyState, applied: Any, period: float) -> Array:
    """The state (n,) a period after that of a token."""
    return np.array(dynamics.step(dynamics.state_of(own), list(map(float, applied)), period), dtype=float)
