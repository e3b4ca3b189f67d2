"""The horizon problem of the paper's eqs. (2)-(5) as plain arrays, and the dynamics that links them.

Indices.  The problem is posed at time t.  The acceleration ``U_t`` was decided one period ago and is being
applied, so ``Pr_{t+1}`` and ``V_{t+1}`` are known; the unknowns are ``controls[j] = U_{t+1+j}``, j = 0..N-1.
Row ``s - 1`` of an array over the horizon belongs to the prediction step s = 1..N, that is time t + s * period.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compiled import kernel
from .typing import Array

REACH_GOAL = 0
INFORM = 1


class HorizonProblem(NamedTuple):
    """One robot's optimisation problem at one time; every length in metres, every time in seconds.

    The comment behind a field is its shape and the paper's symbol.
    """

    period: float  # Delta t
    position: Array  # (2,) Pr_{t+1}
    velocity: Array  # (2,) V_{t+1}
    max_speed: float  # Vmax, f1
    max_acceleration: float  # Amax, f2
    tube_centre: Array  # (N, 2) Rs_{t+s}, f3
    tube_radius: Array  # (N,) sigma_r of eq. (3); inf where the tube is free
    safe_distance: float  # Dmin, f4
    margin: float  # alpha
    obstacle_mean: Array  # (K, N, 2) Po_{t+s}; K = 0 while no obstacle is known
    obstacle_covariance: Array  # (K, N, 3) C_{t+s} as (xx, xy, yy)
    peer_mean: Array  # (n, N, 2) Ro_{i,t+s}, f5
    peer_distance: Array  # (n, N) Dmin + alpha * sigma_5i
    objective: int  # REACH_GOAL: eq. (2); INFORM: eq. (5)
    goal: Array  # (2,)
    sigma_positions: Array  # (M, 2) sigma points of the obstacle's position at t + N
    sigma_weights: Array  # (M,) w_{t,i}
    others_distance: Array  # (M, M) exponent that the other robots' measurements add, see mutual_information
    measurement_variance: float  # eta_t of eq. (5), m^2
    range_penalty: float  # gamma
    measurement_range: float  # Dmax, f6


@kernel
def roll_out(
    position: Array, velocity: Array, controls: Array, period: float, positions: Array, velocities: Array
) -> None:
    """Write the states at steps 1..N that follow from the state at step 1 and the controls from step 1 on.

    The equality constraint of eq. (2): ``P' = P + period * V``, ``V' = V + period * U``.
    """
    steps = positions.shape[0]
    px, py = position[0], position[1]
    vx, vy = velocity[0], velocity[1]
    for s in range(steps):
        positions[s, 0], positions[s, 1] = px, py
        velocities[s, 0], velocities[s, 1] = vx, vy
        px += period * vx
        py += period * vy
        if s < controls.shape[0]:
            vx += period * controls[s, 0]
            vy += period * controls[s, 1]


def trajectory(position: Array, velocity: Array, controls: Array, period: float, steps: int) -> Array:
    """Positions at steps 1..``steps``, shape (steps, 2); past the last control the velocity is kept."""
    positions, velocities = np.empty((steps, 2)), np.empty((steps, 2))
    roll_out(position, velocity, np.ascontiguousarray(controls, dtype=float), period, positions, velocities)
    return positions
