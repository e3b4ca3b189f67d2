"""The constraints f3-f5 of a horizon problem: their values, and which of them a plan can break at all."""

from __future__ import annotations

import math

import numpy as np

from .compiled import borrower, inlined, inner, kernel
from .horizon import HorizonProblem, roll_out
from .terms import Term, keep_away, keep_away_uncertain, stay_near
from .typing import Array

ROUNDING = 1e-6  # m; a constraint that is kept by less than this is not left out


# Columns of a table of constraints, each at one step, one a row: what a solver walks through at every step of its own.
ROW = 0  # 0 is f3, then f4 of every obstacle, then f5 of every peer
WHEN = 1  # row of the arrays over the horizon
PLACE = 2  # x, y of the other,
NEED = 4  # the distance to it,
MARGIN = 5  # alpha where it is an obstacle, whose
_COVARIANCE = 6  # is xx, xy, yy
BOUND = 9  # what a solver lets the constraint be at most,
VALUE = 10  # and where it keeps what it is
_COLUMNS = 11


@inner
def constraints_of(problem: HorizonProblem, spare: float) -> Array:
    """All that bind but those that any plan keeps by more than ``spare``, which may be inf.

    Steps 1 and 2 are decided before U_{t+1} acts: none bind there.
    """
    steps, obstacles, peers = problem.tube_radius.shape[0], problem.obstacle_mean.shape[0], problem.peer_mean.shape[0]
    table = np.empty(((1 + obstacles + peers) * steps, _COLUMNS))
    return table[: _fill(problem, table, spare)]


@borrower
def _fill(problem: HorizonProblem, table: Array, spare: float) -> int:
    """Write the constraints; returns how many they are."""
    steps, obstacles, peers = problem.tube_radius.shape[0], problem.obstacle_mean.shape[0], problem.peer_mean.shape[0]
    count = 0
    for r in range(1 + obstacles + peers):
        for s in range(2, steps):
            margin = xx = xy = yy = 0.0
            if r == 0:
                x, y, need = problem.tube_centre[s, 0], problem.tube_centre[s, 1], problem.tube_radius[s]
                if not need < math.inf:
                    continue
            elif r <= obstacles:
                mean, covariance = problem.obstacle_mean, problem.obstacle_covariance
                x, y, need, margin = mean[r - 1, s, 0], mean[r - 1, s, 1], problem.safe_distance, problem.margin
                xx, xy, yy = covariance[r - 1, s, 0], covariance[r - 1, s, 1], covariance[r - 1, s, 2]
            else:
                i = r - 1 - obstacles
                x, y, need = problem.peer_mean[i, s, 0], problem.peer_mean[i, s, 1], problem.peer_distance[i, s]
            most = need
            if margin != 0.0:
                centre, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
                most += margin * math.sqrt(max(centre + math.sqrt(half * half + xy * xy), 0.0))
            if not _within_reach(problem, r == 0, s, x, y, most, spare):
                continue
            table[count, ROW], table[count, WHEN] = r, s
            table[count, PLACE], table[count, PLACE + 1], table[count, NEED] = x, y, need
            table[count, MARGIN], table[count, _COVARIANCE] = margin, xx
            table[count, _COVARIANCE + 1], table[count, _COVARIANCE + 2] = xy, yy
            table[count, BOUND] = table[count, VALUE] = 0.0
            count += 1
    return count


@borrower
def _within_reach(
    problem: HorizonProblem, near: bool, s: int, x: float, y: float, distance: float, spare: float
) -> bool:
    """Whether a plan within f1 and f2 can break a constraint at step s, or keep it by less than ``spare``.

    The constraint is to stay ``near`` (x, y), or away from it.  Leaving out one that every such plan keeps changes no
    optimum.  Step s (counted from 0) lies at ``P + s h V + h^2 sum_{j < s - 1} (s - 1 - j) U_j``.  As |U_j| <= Amax,
    this is at most ``Amax h^2 s (s - 1) / 2`` from ``P + s h V``; and as the speed is at most Vmax from the second step
    on, it is at most ``(s - 1) h Vmax`` from ``P + h V``.  A distance to a point changes by no more than that, and the
    deviation along any direction is at most the root of the covariance's largest eigenvalue.
    """
    h = problem.period
    px, py = problem.position[0], problem.position[1]
    vx, vy = problem.velocity[0], problem.velocity[1]
    dx, dy = px + s * h * vx - x, py + s * h * vy - y
    driven = math.sqrt(dx * dx + dy * dy)
    pushed = 0.5 * problem.max_acceleration * h * h * s * (s - 1.0)
    dx, dy = px + h * vx - x, py + h * vy - y
    begun = math.sqrt(dx * dx + dy * dy)
    raced = (s - 1.0) * h * problem.max_speed
    if near:
        return not min(driven + pushed, begun + raced) < distance - spare
    return not max(driven - pushed, begun - raced) > distance + spare


@inlined
def term(table: Array, i: int, x: float, y: float) -> Term:
    """The i-th constraint at (x, y): value, gradient and Hessian."""
    px, py, need, margin = table[i, PLACE], table[i, PLACE + 1], table[i, NEED], table[i, MARGIN]
    if table[i, ROW] == 0.0:
        return stay_near(x, y, px, py, need)
    if margin == 0.0:
        return keep_away(x, y, px, py, need)
    xx, xy, yy = table[i, _COVARIANCE], table[i, _COVARIANCE + 1], table[i, _COVARIANCE + 2]
    return keep_away_uncertain(x, y, px, py, xx, xy, yy, need, margin)


@borrower
def certainly_kept(table: Array, i: int, x: float, y: float) -> bool:
    """Whether the i-th constraint is at most its bound at (x, y), without a root; an obstacle's is not looked at."""
    dx, dy, need, bound = x - table[i, PLACE], y - table[i, PLACE + 1], table[i, NEED], table[i, BOUND]
    squared = dx * dx + dy * dy
    if table[i, ROW] == 0.0:
        return bool(need + bound > 0.0 and squared <= (need + bound) * (need + bound))
    return bool(table[i, MARGIN] == 0.0 and squared >= (need - bound) * (need - bound))


@kernel
def violations(problem: HorizonProblem, controls: Array) -> Array:
    """Values of f3 (row 0), f4 and f5 with their margins at each step, shape (1 + K + n, N); <= 0 is satisfied.

    Entries no control can change, or that do not bind, are -inf.
    """
    steps = controls.shape[0]
    positions, velocities = np.empty((steps, 2)), np.empty((steps, 2))
    roll_out(problem.position, problem.velocity, controls, problem.period, positions, velocities)
    constraints = constraints_of(problem, math.inf)
    found = np.full((1 + problem.obstacle_mean.shape[0] + problem.peer_mean.shape[0], steps), -math.inf)
    for i in range(constraints.shape[0]):
        s = int(constraints[i, WHEN])
        found[int(constraints[i, ROW]), s] = term(constraints, i, positions[s, 0], positions[s, 1])[0]
    return found
