"""The positions that robots can reach at each prediction step, from their plans, eqs. (3) and (4), and the positions of
the target."""

from __future__ import annotations

import math

import numpy as np

from .compiled import Array, inner, kernel
from .entry import entry
from .horizon import trajectory
from .ukf import constant_velocity, mapped, predict, sigma_points, turned

OLDEST = 100_000.0  # periods
_SAME = 1e-6  # periods: a difference of times due to rounding


@inner
def _age(elapsed: float, period: float, oldest: float) -> int:
    """How many periods have passed, at most ``oldest``."""
    return round(min(max(elapsed / period, 0.0), oldest))


@entry("Tuple((f8[:, ::1], f8[::1], f8[:, :, ::1]))(f8[::1], f8[::1], f8[:, ::1], f8, f8[::1], f8[::1], f8, f8, f8)")
def standing_plan(
    position: Array, velocity: Array, controls: Array, elapsed: float, radius: Array, moving: Array, speed: float,
    max_acceleration: float, period: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """The use of a plan from ``position`` and ``velocity`` with ``controls`` (N, 2), ``elapsed`` seconds later.

    f3: centres (N, 2) and radii (N,) of the tube around it, which binds up to the end of the plan, with the ``radius``
    (N,) of eq. (3), and is free beyond.

    Starts for a solver, (2, N, 2), the best guess first: the controls from now on, then zeros; and braking from the
    present velocity ``moving``, of length ``speed``, as fast as f2 allows, with 5 % to spare.
    """
    steps = radius.shape[0]
    centres, radii, guesses = np.zeros((steps, 2)), np.empty(steps), np.zeros((2, steps, 2))
    planned = trajectory(position, velocity, controls, period, steps)
    age = _age(elapsed, period, steps)
    for s in range(steps):
        radii[s] = math.inf
        if s < steps - age:
            centres[s, 0], centres[s, 1] = planned[age + s, 0], planned[age + s, 1]
            radii[s] = radius[s]
            guesses[0, s, 0], guesses[0, s, 1] = controls[age + s, 0], controls[age + s, 1]
    if not 1e-9 < speed < math.inf:
        return centres, radii, guesses
    x, y = moving[0] / speed, moving[1] / speed
    for s in range(steps):
        push = min(0.95 * max_acceleration, speed / period)
        guesses[1, s, 0], guesses[1, s, 1] = -push * x, -push * y
        speed -= push * period
    return centres, radii, guesses


@entry("Tuple((f8[:, :, ::1], f8[:, ::1]))(f8[:, ::1], f8, f8, f8[::1], f8, f8, f8)")
def peer_tubes(
    plans: Array, now: float, period: float, radius: Array, growth: float, safe_distance: float, margin: float
) -> tuple[Array, Array]:
    """f5: the positions of n peers at steps 1..N from now on (n, N, 2), and the distances to keep from them (n, N).

    Each row of ``plans`` is one plan: x, y, vx, vy when it was made, that time (s), the number of controls, and these,
    the accelerations from then on; after the last one, the velocity is kept.  To the ``radius`` (N,) of eq. (3), eq.
    (4) adds ``growth`` for every period since then except one, which is normal latency.  Plans older than ``OLDEST``
    count as that old: the distance to keep exceeds any information in them.  For a peer whose periods begin at other
    times, the position between two of its steps is used.
    """
    count, steps = plans.shape[0], radius.shape[0]
    positions, distances = np.empty((count, steps, 2)), np.empty((count, steps))
    for i in range(count):
        px, py, vx, vy = plans[i, 0], plans[i, 1], plans[i, 2], plans[i, 3]
        age = _age(now - plans[i, 4], period, OLDEST)
        planned = int(plans[i, 5])
        ahead = now - plans[i, 4] - age * period  # less than half a period, or the plan is from the future or too old
        if not _SAME * period < abs(ahead) <= period:
            ahead = 0.0
        for k in range(age + steps):
            px += period * vx
            py += period * vy
            before_x, before_y = vx, vy
            if k < planned:
                vx += period * plans[i, 6 + 2 * k]
                vy += period * plans[i, 7 + 2 * k]
            if k >= age:
                speed_x, speed_y = (before_x, before_y) if ahead < 0.0 else (vx, vy)
                positions[i, k - age, 0], positions[i, k - age, 1] = px + ahead * speed_x, py + ahead * speed_y
        lost = max(0, age - 1)
        for s in range(steps):
            distances[i, s] = safe_distance + margin * (radius[s] + growth * lost)
    return positions, distances


@kernel
def propagate(
    mean: Array, covariance: Array, transition: Array, process_noise: Array, steps: int
) -> tuple[Array, Array]:
    """Predicted positions (N, 2) and their covariances (N, 3) as (xx, xy, yy) of a target at steps 1..N.

    C <- A C A^T + Q; with Q = 0 only the present uncertainty is carried forward.
    """
    means, covariances = np.empty((steps, 2)), np.empty((steps, 3))
    for s in range(steps):
        mean, covariance = mapped(transition, mean), turned(transition, covariance, process_noise)
        means[s, 0], means[s, 1] = mean[0], mean[1]
        covariances[s, 0], covariances[s, 1], covariances[s, 2] = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    return means, covariances


@inner
def _after(mean: Array, covariance: Array, noise: Array, periods: float, period: float) -> tuple[Array, Array]:
    """An estimate a number of periods later (or earlier), as its filter predicts it: period by period, then the
    remainder."""
    transition, whole = constant_velocity(period), int(max(periods, 0.0) + _SAME)
    for _ in range(whole):
        mean, covariance = predict(mean, covariance, transition, noise)
    left = periods - whole
    if abs(left) > _SAME:
        part = noise.copy()
        for i in range(part.shape[0]):
            for j in range(part.shape[1]):
                part[i, j] *= abs(left)
        mean, covariance = predict(mean, covariance, constant_velocity(left * period), part)
    return mean, covariance


@entry(
    "Tuple((f8[:, :, ::1], f8[:, :, ::1], f8[:, ::1], f8[::1]))(f8[::1], f8[:, ::1], f8[:, ::1], b1, f8, f8, f8, i8)"
)
def expected_target(
    mean: Array, covariance: Array, noise: Array, is_widened: bool, kappa: float, period: float, elapsed: float,
    steps: int,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Data for f4 and eq. (5) of a target with constant velocity, from an estimate made ``elapsed`` seconds ago.

    Means (1, N, 2) and covariances (1, N, 3) at steps 1..N from now on; the positions (M, 2) of its sigma points at
    step N, and their weights (M,).  ``noise`` is the process noise of a period.  Up to now, the estimate is predicted
    with it, as its filter does; over the horizon only if the covariance ``is_widened`` by it.  The sigma points are
    then those of the state at step N; otherwise, they are the propagated ones of the present state.
    """
    # Copies, as tokens are read-only, and kernels would be compiled again for read-only arrays.
    periods = min(max(elapsed / period, -OLDEST), OLDEST)
    now, spread = _after(mean.copy(), covariance.copy(), noise, periods, period)
    gained = noise if is_widened else np.zeros(noise.shape)
    means, covariances = propagate(now, spread, constant_velocity(period), gained, steps)
    ahead = steps * period
    if is_widened:
        now, spread = _after(now, spread, noise, float(steps), period)
        ahead = 0.0
    points, weights = sigma_points(now, spread, kappa)
    last = np.empty((points.shape[0], 2))
    for i in range(points.shape[0]):
        for c in range(2):
            last[i, c] = points[i, c] + ahead * points[i, 2 + c]
    return means.reshape((1, steps, 2)), covariances.reshape((1, steps, 3)), last, weights
