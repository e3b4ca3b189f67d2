"""The positions that robots can reach at each prediction step, from their plans, eqs. (3) and (4), and the positions of
the target."""

from __future__ import annotations

import math

import numpy as np

from .compiled import Array, Layers, Row, Table, inner, kernel
from .horizon import trajectory
from .ukf import congruence, constant_velocity, mapped, predict, sigma_points

OLDEST = 100_000.0  # periods
_SAME = 1e-6  # periods: a difference of times due to rounding


@inner
def _age(elapsed: float, period: float, oldest: float) -> int:
    """How many periods have passed, at most ``oldest``."""
    return round(min(max(elapsed / period, 0.0), oldest))


@kernel
def standing_plan(
    position: Row, velocity: Row, controls: Table, elapsed: float, radius: Row, moving: Row, speed: float,
    max_acceleration: float, period: float,
) -> tuple[Table, Row, Layers]:  # fmt: skip
    """The use of a plan from ``position`` and ``velocity`` with ``controls`` (N, d), ``elapsed`` seconds later.

    f3: centres (N, d) and radii (N,) of the tube around it, which binds up to the end of the plan, with the ``radius``
    (N,) of eq. (3), and is free beyond.

    Starts for a solver, (2, N, d), the best guess first: the controls from now on, then zeros; and braking from the
    present velocity ``moving``, of length ``speed``, with ``max_acceleration``, what f2 allows in that direction, less
    5 %.
    """
    steps, d = radius.shape[0], position.shape[0]
    centres, radii, guesses = np.zeros((steps, d)), np.empty(steps), np.zeros((2, steps, d))
    planned = trajectory(position, velocity, controls, period, steps)
    age = _age(elapsed, period, steps)
    for s in range(steps):
        radii[s] = math.inf
        if s < steps - age:
            radii[s] = radius[s]
            for c in range(d):
                centres[s, c], guesses[0, s, c] = planned[age + s, c], controls[age + s, c]
    if not 1e-9 < speed < math.inf:
        return centres, radii, guesses
    left = speed
    for s in range(steps):
        push = min(0.95 * max_acceleration, left / period)
        for c in range(d):
            guesses[1, s, c] = -push * (moving[c] / speed)
        left -= push * period
    return centres, radii, guesses


@kernel
def peer_tubes(
    plans: Table, now: float, period: float, radius: Row, growth: float, safe_distance: float, margin: float,
    dimensions: int,
) -> tuple[Layers, Table]:  # fmt: skip
    """f5: the positions of n peers at steps 1..N from now on (n, N, d), and the distances to keep from them (n, N).

    Each row of ``plans`` is one plan: the time (s) when it was made, its number of dimensions, the number of controls,
    the position and the velocity then, and the controls, the accelerations from then on; after the last one, the
    velocity is kept.  Where the peer has fewer dimensions than the robot, it is on the ground.  Where it has more, the
    robot keeps out of the circle that the sphere around the peer cuts from the ground.

    To the ``radius`` (N,) of eq. (3), eq. (4) adds ``growth`` for every period since then except one, which is normal
    latency.  Plans older than ``OLDEST`` count as that old: the distance to keep exceeds any information in them.  For
    a peer whose periods begin at other times, the position between two of its steps is used.
    """
    count, steps = plans.shape[0], radius.shape[0]
    positions, distances = np.zeros((count, steps, dimensions)), np.empty((count, steps))
    for i in range(count):
        age, own, planned = _age(now - plans[i, 0], period, OLDEST), int(plans[i, 1]), int(plans[i, 2])
        ahead = now - plans[i, 0] - age * period  # less than half a period, or the plan is from the future or too old
        if not _SAME * period < abs(ahead) <= period:
            ahead = 0.0
        lost = max(0, age - 1)
        for s in range(steps):
            distances[i, s] = safe_distance + margin * (radius[s] + growth * lost)
        for c in range(own):
            p, v = plans[i, 3 + c], plans[i, 3 + own + c]
            for k in range(age + steps):
                p += period * v
                before = v
                if k < planned:
                    v += period * plans[i, 3 + 2 * own + own * k + c]
                if k >= age:
                    then = p + ahead * (before if ahead < 0.0 else v)
                    if c < dimensions:
                        positions[i, k - age, c] = then
                    else:
                        kept = distances[i, k - age]
                        distances[i, k - age] = math.sqrt(max(kept * kept - then * then, 0.0))
    return positions, distances


@kernel
def propagate(
    mean: Row, covariance: Table, transition: Table, process_noise: Table, steps: int, dimensions: int
) -> tuple[Table, Table]:
    """Predicted positions (N, d) and their covariances (N, d (d + 1) / 2), upper triangles, of a target at steps 1..N.

    A target with fewer dimensions is on the ground, where nothing is uncertain about its height; one with more is seen
    from above.  C <- A C A^T + Q; with Q = 0 only the present uncertainty is carried forward.
    """
    own = mean.shape[0] // 2
    means, covariances = np.zeros((steps, dimensions)), np.zeros((steps, dimensions * (dimensions + 1) // 2))
    for s in range(steps):
        mean, covariance = mapped(transition, mean), congruence(transition, covariance, process_noise)
        place = 0
        for i in range(dimensions):
            if i < own:
                means[s, i] = mean[i]
            for j in range(i, dimensions):
                if j < own:
                    covariances[s, place] = covariance[i, j]
                place += 1
    return means, covariances


@inner
def _after(mean: Array, covariance: Array, noise: Array, periods: float, period: float) -> tuple[Array, Array]:
    """An estimate a number of periods later (or earlier), as its filter predicts it: period by period, then the
    remainder."""
    d = mean.shape[0] // 2
    transition, whole = constant_velocity(period, d), int(max(periods, 0.0) + _SAME)
    for _ in range(whole):
        mean, covariance = predict(mean, covariance, transition, noise)
    left = periods - whole
    if abs(left) > _SAME:
        part = noise.copy()
        for i in range(part.shape[0]):
            for j in range(part.shape[1]):
                part[i, j] *= abs(left)
        mean, covariance = predict(mean, covariance, constant_velocity(left * period, d), part)
    return mean, covariance


@kernel
def expected_target(
    mean: Row, covariance: Table, noise: Table, is_widened: bool, kappa: float, period: float, elapsed: float,
    steps: int, dimensions: int,
) -> tuple[Layers, Layers, Table, Row]:  # fmt: skip
    """Data for f4 and eq. (5) of a target with constant velocity, from an estimate made ``elapsed`` seconds ago.

    Means (1, N, d) and covariances (1, N, d (d + 1) / 2) at steps 1..N from now on, in as many ``dimensions`` as the
    robot that expects it has, see ``propagate``; the positions (M, d) of its sigma points at
    step N, and their weights (M,).  ``noise`` is the process noise of a period.  Up to now, the estimate is predicted
    with it, as its filter does; over the horizon only if the covariance ``is_widened`` by it.  The sigma points are
    then those of the state at step N; otherwise, they are the propagated ones of the present state.
    """
    own = mean.shape[0] // 2
    periods = min(max(elapsed / period, -OLDEST), OLDEST)
    now, spread = _after(mean, covariance, noise, periods, period)
    gained = noise if is_widened else np.zeros(noise.shape)
    means, covariances = propagate(now, spread, constant_velocity(period, own), gained, steps, dimensions)
    ahead = steps * period
    if is_widened:
        now, spread = _after(now, spread, noise, float(steps), period)
        ahead = 0.0
    points, weights = sigma_points(now, spread, kappa)
    last = np.zeros((points.shape[0], dimensions))
    for i in range(points.shape[0]):
        for c in range(min(own, dimensions)):
            last[i, c] = points[i, c] + ahead * points[i, own + c]
    return means.reshape((1, *means.shape)), covariances.reshape((1, *covariances.shape)), last, weights
