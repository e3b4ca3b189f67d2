"""Reachability sets: where a robot can be at each prediction step, from its plan, eqs. (3) and (4)."""

from __future__ import annotations

import numpy as np

from .compiled import kernel
from .horizon import roll_out
from .typing import Array


@kernel
def tube_radius(initial: float, growth: float, step_length: float, steps: int) -> Array:
    """sigma_r of eq. (3) at steps 1..N: ``initial + growth * step_length * s``.

    ``step_length`` is 1 where tau counts steps (the default reading) and the period where it counts seconds.
    """
    radius = np.empty(steps)
    for s in range(steps):
        radius[s] = initial + growth * step_length * (s + 1)
    return radius


@kernel
def planned_positions(
    position: Array, velocity: Array, controls: Array, period: float, elapsed: int, steps: int
) -> Array:
    """Positions (steps, 2) at steps 1..N from now on of a robot that announced its plan ``elapsed`` periods ago.

    ``position`` and ``velocity`` are the announced state, ``controls`` (n, 2) the accelerations from the announcement
    on; past the last of them the velocity is kept.
    """
    positions, velocities = np.empty((elapsed + steps, 2)), np.empty((elapsed + steps, 2))
    # roll_out starts at step 1, so the first control is applied here.
    first = np.empty(2)
    speed = np.empty(2)
    for c in range(2):
        first[c] = position[c] + period * velocity[c]
        speed[c] = velocity[c] + period * controls[0, c]
    roll_out(first, speed, controls[1:], period, positions, velocities)
    return positions[elapsed:]


@kernel
def propagate(
    mean: Array, covariance: Array, transition: Array, process_noise: Array, steps: int
) -> tuple[Array, Array]:
    """Predicted positions (N, 2) and their covariances (N, 3) as (xx, xy, yy) of a target at steps 1..N.

    C <- A C A^T + Q; with Q = 0 (the default reading) only the present uncertainty is carried forward.
    """
    size = mean.shape[0]
    means, covariances = np.empty((steps, 2)), np.empty((steps, 3))
    now, spread = mean.copy(), covariance.copy()
    for s in range(steps):
        moved = np.zeros(size)
        half = np.zeros((size, size))
        full = process_noise.copy()
        for i in range(size):
            for k in range(size):
                if transition[i, k] != 0.0:
                    moved[i] += transition[i, k] * now[k]
                    for j in range(size):
                        half[i, j] += transition[i, k] * spread[k, j]
        for i in range(size):
            for j in range(size):
                for k in range(size):
                    full[i, j] += half[i, k] * transition[j, k]
        now, spread = moved, full
        means[s, 0], means[s, 1] = now[0], now[1]
        covariances[s, 0], covariances[s, 1], covariances[s, 2] = spread[0, 0], spread[0, 1], spread[1, 1]
    return means, covariances
