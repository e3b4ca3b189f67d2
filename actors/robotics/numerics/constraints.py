"""The constraints f3-f5 and f7 of a horizon problem: their values, and which of them a plan can break at all."""

from __future__ import annotations

import math

from .compiled import Array, borrower, inlined
from .horizon import HorizonProblem
from .terms import keep_away, keep_away_uncertain, keep_level, stay_near
from .vectors import (
    Symmetric,
    Term,
    Vector,
    less,
    plus,
    read,
    replaced,
    squared,
    symmetric_size,
    zero_symmetric,
)

ROUNDING = 1e-6  # m; a constraint kept by less than this is not left out
NEAR, AWAY, UNCERTAIN, LEVEL = 0.0, 1.0, 2.0, 3.0  # kinds

# Columns of the table of constraints, with a row for each constraint at each step where it can be broken.
OTHER = 0  # subject: 0 is the own plan (f3), then come all obstacles (f4), all peers (f5), and two levels (f7)
WHEN = 1  # row of the arrays over the horizon
KIND = 2
DISTANCE = 3  # m, the distance to keep from it, or the largest one from the own plan; of a level, a sign: 1 below it
MARGIN = 4  # alpha, if it is an obstacle; 0 otherwise
BOUND = 5  # m, the bound that a solver sets for the constraint's value
VALUE = 6  # m, the value at the solver's latest point
PLACE = 7  # m, vector, position of the other body, or the height of a level; then the obstacle's covariance, m^2


@inlined
def constraint_columns(d: int) -> int:
    """The number of columns in d dimensions."""
    return PLACE + d + symmetric_size(d)


@inlined
def subjects(problem: HorizonProblem, d: int) -> int:
    """Own plan, obstacles, peers, and in space two levels."""
    count: int = 1 + problem.obstacle_mean.shape[0] + problem.peer_mean.shape[0]
    return count + (2 if d == 3 else 0)


@borrower
def constraints_of(problem: HorizonProblem, spare: float, table: Array, zero: Vector) -> int:
    """Write all binding constraints except those that any plan keeps by more than ``spare``, which may be inf; returns
    how many.

    ``zero`` is a vector of zeros.  Steps 1 and 2 are decided before U_{t+1} acts: none bind there.
    """
    d, steps = len(zero), problem.tube_radius.shape[0]
    obstacles, peers = problem.obstacle_mean.shape[0], problem.peer_mean.shape[0]
    count = 0
    for other in range(subjects(problem, d)):
        for s in range(2, steps):
            margin = 0.0
            if other == 0:
                kind, distance = NEAR, problem.tube_radius[s]
                if not distance < math.inf:
                    continue
                for c in range(d):
                    table[count, PLACE + c] = problem.tube_centre[s, c]
            elif other <= obstacles:
                kind, distance, margin = UNCERTAIN, problem.safe_distance, problem.margin
                for c in range(d):
                    table[count, PLACE + c] = problem.obstacle_mean[other - 1, s, c]
                for c in range(symmetric_size(d)):
                    table[count, PLACE + d + c] = problem.obstacle_covariance[other - 1, s, c]
                if margin == 0.0:
                    kind = AWAY
            elif other <= obstacles + peers:
                i = other - 1 - obstacles
                kind, distance = AWAY, problem.peer_distance[i, s]
                for c in range(d):
                    table[count, PLACE + c] = problem.peer_mean[i, s, c]
            else:
                kind, distance = LEVEL, 1.0 if other > obstacles + peers + 1 else -1.0
                level = problem.highest if distance > 0.0 else problem.lowest
                if not abs(level) < math.inf:
                    continue
                table[count, PLACE + d - 1] = level
            most = distance
            if kind == UNCERTAIN:
                most += margin * math.sqrt(max(_largest(read(zero_symmetric(zero), table, count, PLACE + d)), 0.0))
            if _within_reach(problem, kind, s, read(zero, table, count, PLACE), most, spare):
                table[count, OTHER], table[count, WHEN], table[count, KIND] = other, s, kind
                table[count, DISTANCE], table[count, MARGIN] = distance, margin
                count += 1
    return count


@inlined
def _largest(covariance: Symmetric) -> float:
    """The largest eigenvalue in the plane; in space, its bound by Frobenius."""
    if len(covariance) == 3:
        xx, xy, yy = covariance[0], covariance[1], covariance[2]
        centre, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
        return centre + math.sqrt(half * half + xy * xy)
    diagonal = 0.0
    for c in (0, 3, 5):
        diagonal += covariance[c] * covariance[c]
    return math.sqrt(2.0 * squared(covariance) - diagonal)


@borrower
def _within_reach(problem: HorizonProblem, kind: float, s: int, place: Vector, distance: float, spare: float) -> bool:
    """Whether a plan within f1 and f2 can break a constraint at step s, or keep it by less than ``spare``.

    The constraint is to stay near ``place``, away from it, or on one side of its height.  Leaving out one that every
    such plan keeps does not change the optimum.  Step s (counted from 0) lies at ``P + s h V + h^2 sum_{j < s - 1} (s -
    1 - j) U_j``.  As |U_j| <= Amax, this is at most ``Amax h^2 s (s - 1) / 2`` from ``P + s h V``; and as the speed is
    at most Vmax from the second step on, it is at most ``(s - 1) h Vmax`` from ``P + h V``.  A distance to a point
    changes by no more than that, and the deviation along any direction is at most the root of the covariance's largest
    eigenvalue.
    """
    h, speed, acceleration = problem.period, problem.max_speed, problem.max_acceleration
    if len(place) == 3:
        speed, acceleration = max(speed, problem.climb_speed), max(acceleration, problem.climb_acceleration)
    at = velocity = place
    for c in range(len(place)):
        at, velocity = replaced(at, c, problem.position[c]), replaced(velocity, c, problem.velocity[c])
    drift, soon = less(_moved(at, s, h, velocity), place), less(plus(at, h, velocity), place)
    pushed = 0.5 * acceleration * h * h * s * (s - 1.0)
    raced = (s - 1.0) * h * speed
    if kind == LEVEL:  # ``distance`` is its sign
        last = len(place) - 1
        return not min(distance * drift[last] + pushed, distance * soon[last] + raced) < -spare
    driven, begun = math.sqrt(squared(drift)), math.sqrt(squared(soon))
    if kind == NEAR:
        return not min(driven + pushed, begun + raced) < distance - spare
    return not max(driven - pushed, begun - raced) > distance + spare


@inlined
def _moved(at: Vector, s: int, h: float, velocity: Vector) -> Vector:
    """After ``s`` periods ``h``."""
    for c in range(len(at)):
        at = replaced(at, c, at[c] + s * h * velocity[c])
    return at


@inlined
def term(table: Array, i: int, at: Vector) -> Term:
    """The i-th constraint at a point: value, gradient and Hessian."""
    kind, place, distance = table[i, KIND], read(at, table, i, PLACE), table[i, DISTANCE]
    if kind == NEAR:
        return stay_near(at, place, distance)
    if kind == AWAY:
        return keep_away(at, place, distance)
    if len(at) == 3 and kind == LEVEL:
        return keep_level(at, place[len(at) - 1], distance)
    covariance = read(zero_symmetric(at), table, i, PLACE + len(at))
    return keep_away_uncertain(at, place, covariance, distance, table[i, MARGIN])


@inlined
def ball(table: Array, i: int) -> tuple[bool, float]:
    """The ball where the i-th constraint, a distance without margin, reaches its bound: whether the inside is feasible,
    and the radius."""
    near = table[i, KIND] == NEAR
    return near, table[i, DISTANCE] + (table[i, BOUND] if near else -table[i, BOUND])


@borrower
def certainly_kept(table: Array, i: int, at: Vector) -> bool:
    """Whether the i-th constraint is at most its bound at a point, without a root; obstacles are not checked."""
    if table[i, KIND] > AWAY:
        return False
    distance, (near, radius) = squared(less(at, read(at, table, i, PLACE))), ball(table, i)
    if near:
        return radius > 0.0 and distance <= radius * radius
    return bool(distance >= radius * radius)
