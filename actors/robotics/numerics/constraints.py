"""The constraints f3-f5 of a horizon problem: their values, and which of them a plan can break at all."""

from __future__ import annotations

import math

from .compiled import Array, borrower, inlined
from .horizon import HorizonProblem
from .terms import Term, keep_away, keep_away_uncertain, stay_near

ROUNDING = 1e-6  # m; a constraint kept by less than this is not left out

# Columns of the table of constraints, with a row for each constraint at each step where it can be broken.
OTHER = 0  # subject: 0 is the own plan (f3), then come all obstacles (f4), then all peers (f5)
WHEN = 1  # row of the arrays over the horizon
X, Y = 2, 3  # m, position of the other body
DISTANCE = 4  # m, the distance to keep from it, or the largest distance from the own plan
MARGIN = 5  # alpha, if it is an obstacle; 0 otherwise
XX, XY, YY = 6, 7, 8  # m^2, the obstacle's covariance
BOUND = 9  # m, the bound that a solver sets for the constraint's value
VALUE = 10  # m, the value at the solver's latest point
CONSTRAINT = 11  # number of columns


@borrower
def constraints_of(problem: HorizonProblem, spare: float, table: Array) -> int:
    """Write all binding constraints except those that any plan keeps by more than ``spare``, which may be inf; returns
    how many.

    Steps 1 and 2 are decided before U_{t+1} acts: none bind there.
    """
    steps, obstacles, peers = problem.tube_radius.shape[0], problem.obstacle_mean.shape[0], problem.peer_mean.shape[0]
    count = 0
    for other in range(1 + obstacles + peers):
        for s in range(2, steps):
            margin = xx = xy = yy = 0.0
            if other == 0:
                x, y, distance = problem.tube_centre[s, 0], problem.tube_centre[s, 1], problem.tube_radius[s]
                if not distance < math.inf:
                    continue
            elif other <= obstacles:
                mean, covariance, k = problem.obstacle_mean, problem.obstacle_covariance, other - 1
                x, y, distance, margin = mean[k, s, 0], mean[k, s, 1], problem.safe_distance, problem.margin
                xx, xy, yy = covariance[k, s, 0], covariance[k, s, 1], covariance[k, s, 2]
            else:
                i = other - 1 - obstacles
                x, y, distance = problem.peer_mean[i, s, 0], problem.peer_mean[i, s, 1], problem.peer_distance[i, s]
            most = distance
            if margin != 0.0:
                centre, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
                most += margin * math.sqrt(max(centre + math.sqrt(half * half + xy * xy), 0.0))
            if _within_reach(problem, other == 0, s, x, y, most, spare):
                table[count, OTHER], table[count, WHEN], table[count, DISTANCE] = other, s, distance
                table[count, X], table[count, Y], table[count, MARGIN] = x, y, margin
                table[count, XX], table[count, XY], table[count, YY] = xx, xy, yy
                count += 1
    return count


@borrower
def _within_reach(
    problem: HorizonProblem, near: bool, s: int, x: float, y: float, distance: float, spare: float
) -> bool:
    """Whether a plan within f1 and f2 can break a constraint at step s, or keep it by less than ``spare``.

    The constraint is to stay ``near`` (x, y), or away from it.  Leaving out one that every such plan keeps does not
    change the optimum.  Step s (counted from 0) lies at ``P + s h V + h^2 sum_{j < s - 1} (s - 1 - j) U_j``.  As |U_j|
    <= Amax, this is at most ``Amax h^2 s (s - 1) / 2`` from ``P + s h V``; and as the speed is at most Vmax from the
    second step on, it is at most ``(s - 1) h Vmax`` from ``P + h V``.  A distance to a point changes by no more than
    that, and the deviation along any direction is at most the root of the covariance's largest eigenvalue.
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
    other_x, other_y, distance, margin = table[i, X], table[i, Y], table[i, DISTANCE], table[i, MARGIN]
    if table[i, OTHER] == 0.0:
        return stay_near(x, y, other_x, other_y, distance)
    if margin == 0.0:
        return keep_away(x, y, other_x, other_y, distance)
    return keep_away_uncertain(x, y, other_x, other_y, table[i, XX], table[i, XY], table[i, YY], distance, margin)


@inlined
def circle(table: Array, i: int) -> tuple[bool, float]:
    """The circle where the i-th constraint, without margin, reaches its bound: whether the inside is feasible, and the
    radius."""
    near = table[i, OTHER] == 0.0
    return near, table[i, DISTANCE] + (table[i, BOUND] if near else -table[i, BOUND])


@borrower
def certainly_kept(table: Array, i: int, x: float, y: float) -> bool:
    """Whether the i-th constraint is at most its bound at (x, y), without a root; obstacles are not checked."""
    dx, dy = x - table[i, X], y - table[i, Y]
    squared, (near, radius) = dx * dx + dy * dy, circle(table, i)
    if near:
        return radius > 0.0 and squared <= radius * radius
    return bool(table[i, MARGIN] == 0.0 and squared >= radius * radius)
