"""The horizon problem of the paper's eqs. (2)-(5) as the kernels take it, and the dynamics that links its steps.

Indices.  The problem is posed at time t.  The acceleration ``U_t`` was decided one period ago and is being
applied, so ``Pr_{t+1}`` and ``V_{t+1}`` are known; the unknowns are ``controls[j] = U_{t+1+j}``, j = 0..N-1.
Row ``s - 1`` of an array over the horizon belongs to the prediction step s = 1..N, that is time t + s * period.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .compiled import Array, Layers, Row, Table, inner

REACH_GOAL, INFORM = 0, 1  # the kinds of objectives: eq. (2), eq. (5)
TOLERANCE = 1e-6  # m; smaller violations count as none


class Solution(NamedTuple):
    """The result of a solver: the plan and its quality."""

    controls: Array  # (N, m) U_{t+1} .. U_{t+N}
    violation: float  # largest violation of f3-f5, metres; 0 when feasible
    objective: float
    iterations: int  # Newton steps, or whatever the solver counts


class HorizonProblem(NamedTuple):
    """A problem as plain numbers; every length in metres, every time in seconds.

    The comment after a field is its shape and the paper's symbol.
    """

    period: float  # Delta t
    position: Row  # (d,) Pr_{t+1}; d = 2 in the plane, and 3 in space, with the height last
    velocity: Row  # (d,) V_{t+1}
    max_speed: float  # Vmax, f1
    max_acceleration: float  # Amax, f2
    tube_centre: Table  # (N, d) Rs_{t+s}, f3
    tube_radius: Row  # (N,) sigma_r of eq. (3); inf where the tube is free
    safe_distance: float  # Dmin, f4
    margin: float  # alpha
    obstacle_mean: Layers  # (K, N, d) Po_{t+s}; K = 0 while no obstacle is known
    obstacle_covariance: Layers  # (K, N, d (d + 1) / 2) C_{t+s} as (xx, xy, yy), or (xx, xy, xz, yy, yz, zz)
    peer_mean: Layers  # (n, N, d) Ro_{i,t+s}, f5
    peer_distance: Table  # (n, N) Dmin + alpha * sigma_5i
    objective: int = REACH_GOAL  # eq. (2); or INFORM, eq. (5)
    goal: Table = np.zeros((1, 2))  # (n, d) at steps 1..n of eq. (2); the last one is there for the other steps, too
    sigma_positions: Table = np.empty((0, 2))  # (T M, d) sigma points at t + N of the first T obstacles' positions
    sigma_weights: Row = np.empty(0)  # (M,) w_{t,i}
    others_distance: Table = np.empty((0, 0))  # (T M, M) exponent that the others' measurements add, mutual_information
    measurement_variance: float = 1.0  # eta_t of eq. (5), m^2
    range_penalty: float = 0.0  # gamma
    measurement_range: float = 0.0  # Dmax, f6
    # In space only.  f1 and f2 are ellipsoids: what climbs counts more, by the ratio of the limits.
    climb_speed: float = math.inf  # largest vertical speed
    climb_acceleration: float = math.inf  # largest vertical acceleration
    lowest: float = -math.inf  # f7, the height to stay above
    highest: float = math.inf  # f7, the height to stay below


def numbers_of(problem: Any) -> HorizonProblem:
    """A ``Problem`` of a ``DoubleIntegrator``, whose objective the kernels know."""
    motion, state = problem.dynamics, problem.state
    d = motion.dimensions
    return HorizonProblem(
        period=problem.period,
        position=state[:d],
        velocity=state[d:],
        max_speed=motion.max_speed,
        max_acceleration=motion.max_acceleration,
        climb_speed=motion.climb_speed,
        climb_acceleration=motion.climb_acceleration,
        tube_centre=problem.tube_centre,
        tube_radius=problem.tube_radius,
        safe_distance=problem.safe_distance,
        margin=problem.margin,
        obstacle_mean=problem.obstacle_mean,
        obstacle_covariance=problem.obstacle_covariance,
        peer_mean=problem.peer_mean,
        peer_distance=problem.peer_distance,
        lowest=problem.lowest,
        highest=problem.highest,
        **problem.objective.pose(problem),
    )


@inner
def trajectory(position: Array, velocity: Array, controls: Array, period: float, steps: int) -> Array:
    """Positions at steps 1..``steps`` from the state at step 1 and the controls from there on, shape (steps, d).

    The equality constraint of eq. (2): ``P' = P + period * V``, ``V' = V + period * U``; past the last control the
    velocity is kept.
    """
    d = position.shape[0]
    positions = np.empty((steps, d))
    for c in range(d):
        p, v = position[c], velocity[c]
        for s in range(steps):
            positions[s, c] = p
            p += period * v
            if s < controls.shape[0]:
                v += period * controls[s, c]
    return positions
