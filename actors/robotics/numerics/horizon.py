"""The horizon problem of the paper's eqs. (2)-(5) as plain arrays, and the dynamics that links them.

Indices.  The problem is posed at time t.  The acceleration ``U_t`` was decided one period ago and is being
applied, so ``Pr_{t+1}`` and ``V_{t+1}`` are known; the unknowns are ``controls[j] = U_{t+1+j}``, j = 0..N-1.
Row ``s - 1`` of an array over the horizon belongs to the prediction step s = 1..N, that is time t + s * period.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compiled import Array, kernel
from .mutual_information import pairwise_distance

REACH_GOAL = 0
INFORM = 1


class HorizonProblem(NamedTuple):
    """One robot's optimisation problem at one time; every length in metres, every time in seconds.

    The comment after a field is its shape and the paper's symbol.
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
    objective: int = REACH_GOAL  # eq. (2); or INFORM, eq. (5)
    goal: Array = np.zeros((1, 2))  # (n, 2) at steps 1..n of eq. (2); the last one is there for the other steps, too
    sigma_positions: Array = np.empty((0, 2))  # (T M, 2) sigma points at t + N of the first T obstacles' positions
    sigma_weights: Array = np.empty(0)  # (M,) w_{t,i}
    others_distance: Array = np.empty((0, 0))  # (T M, M) exponent that the others' measurements add, mutual_information
    measurement_variance: float = 1.0  # eta_t of eq. (5), m^2
    range_penalty: float = 0.0  # gamma
    measurement_range: float = 0.0  # Dmax, f6

    def to_reach(self, goal: Array) -> HorizonProblem:
        """The same problem with the objective of eq. (2); a ``goal`` (2,) that stands still, or (N, 2) at each step."""
        return self._replace(objective=REACH_GOAL, goal=np.array(goal).reshape(-1, 2))

    def to_inform(
        self, points: Array, weights: Array, others: Array, variance: float, gamma: float, reach: float
    ) -> HorizonProblem:
        """The same problem with the objective of eq. (5), in which ``others`` (n, N, 2) also measure at their ends.

        Of several targets, one after the other in ``points`` (T M, 2), it is the sum.
        """
        size = len(weights)
        if len(points) == size:
            distance = pairwise_distance(points, others, variance)
        else:
            each = [pairwise_distance(points[i : i + size], others, variance) for i in range(0, len(points), size)]
            distance = np.concatenate(each)
        return self._replace(
            objective=INFORM,
            sigma_positions=points,
            sigma_weights=weights,
            others_distance=distance,
            measurement_variance=variance,
            range_penalty=gamma,
            measurement_range=reach,
        )


@kernel
def trajectory(position: Array, velocity: Array, controls: Array, period: float, steps: int) -> Array:
    """Positions at steps 1..``steps`` from the state at step 1 and the controls from there on, shape (steps, 2).

    The equality constraint of eq. (2): ``P' = P + period * V``, ``V' = V + period * U``; past the last control the
    velocity is kept.
    """
    positions = np.empty((steps, 2))
    px, py = position[0], position[1]
    vx, vy = velocity[0], velocity[1]
    for s in range(steps):
        positions[s, 0], positions[s, 1] = px, py
        px += period * vx
        py += period * vy
        if s < controls.shape[0]:
            vx += period * controls[s, 0]
            vy += period * controls[s, 1]
    return positions
