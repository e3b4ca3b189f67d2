"""Retreats: the distance from a target that a robot is certain to keep if it turns away from it at the next period."""

from __future__ import annotations

import math

import numpy as np

from ...core.elementary import hypot
from .compiled import Row, Table, kernel

FIRST = 3  # the first step whose position a control of the next period can change
_STEPS = 10_000  # of a retreat; one that takes longer is not certain of anything


@kernel
def support(directions: Table, mean: Row, covariance: Table, age: float, margin: float, speed: float) -> Row:
    """A target's largest coordinate along each of ``directions`` (K, 2), m.

    It was within ``margin`` standard deviations of its estimate (mean (4,), covariance (4, 4)) ``age`` seconds ago, and
    has moved at most at ``speed`` since.
    """
    found = np.empty(directions.shape[0])
    for i in range(directions.shape[0]):
        nx, ny = directions[i, 0], directions[i, 1]
        variance = nx * nx * covariance[0, 0] + 2.0 * nx * ny * covariance[0, 1] + ny * ny * covariance[1, 1]
        found[i] = nx * mean[0] + ny * mean[1] + margin * math.sqrt(max(variance, 0.0)) + speed * age
    return found


@kernel
def kept_distance(
    nx: float, ny: float, bound: float, position: Row, velocity: Row, control: Row, target_speed: float,
    max_speed: float, max_acceleration: float, period: float,
) -> float:  # fmt: skip
    """The least distance, m, that a retreat in the direction n is certain to keep from a target, from step 3 on.

    The robot is at ``position`` and ``velocity`` at step 1, applies ``control`` for a period, and then accelerates
    along n with all it has.  The target's coordinate along n is now at most ``bound``, and its speed at most
    ``target_speed``.  Bodies are not nearer than their coordinates along n; and these part for ever as soon as the
    robot is as fast along n as the target can be.
    """
    px, py = position[0] + period * velocity[0], position[1] + period * velocity[1]
    vx, vy = velocity[0] + period * control[0], velocity[1] + period * control[1]
    least: float = math.inf
    push = period * max_acceleration
    for k in range(FIRST, _STEPS):
        speed = hypot(vx, vy)
        if speed > max_speed:
            vx, vy = vx * (max_speed / speed), vy * (max_speed / speed)
        px, py = px + period * vx, py + period * vy
        least = min(least, nx * px + ny * py - bound - k * period * target_speed)
        if nx * vx + ny * vy >= target_speed:
            return least
        vx, vy = vx + push * nx, vy + push * ny
    return -math.inf


@kernel
def best_retreat(
    directions: Table, limits: Row, position: Row, velocity: Row, control: Row, target_speed: float,
    max_speed: float, max_acceleration: float, period: float,
) -> tuple[float, int]:  # fmt: skip
    """The retreat of ``directions`` (K, 2) that keeps the most distance: that distance, and the row.

    The target's coordinates along the directions are now at most ``limits`` (K,).
    """
    most, best = -math.inf, 0
    for i in range(directions.shape[0]):
        kept = kept_distance(
            directions[i, 0], directions[i, 1], limits[i], position, velocity, control,
            target_speed, max_speed, max_acceleration, period,
        )  # fmt: skip
        if kept > most:
            most, best = kept, i
    return most, best
