"""The constraints f3-f5 of a horizon problem: their values, and which of them a plan can break at all."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiled import borrower, inner, kernel
from .horizon import HorizonProblem, roll_out
from .terms import Term, keep_away, keep_away_uncertain, stay_near
from .typing import Array

_ROUNDING = 1e-6  # m; a constraint that is kept by less than this is not left out


class Constraints(NamedTuple):
    """Some constraints of a problem, each at one step: what a solver walks through at every step of its own."""

    margin: float  # alpha
    obstacles: int  # K
    row: Array  # (m,) 0 is f3, then f4 of every obstacle, then f5 of every peer; integers
    step: Array  # (m,) row of the arrays over the horizon; integers
    place: Array  # (m, 6) of the other: x, y, the distance to it, and of an obstacle the covariance xx, xy, yy


@inner
def all_constraints(problem: HorizonProblem) -> Constraints:
    """Those that bind.  Steps 1 and 2 are decided before U_{t+1} acts, so nothing binds there."""
    steps, obstacles, peers = problem.tube_radius.shape[0], problem.obstacle_mean.shape[0], problem.peer_mean.shape[0]
    most = (1 + obstacles + peers) * steps
    row, step, place = np.empty(most, np.int64), np.empty(most, np.int64), np.zeros((most, 6))
    count = 0
    for r in range(1 + obstacles + peers):
        for s in range(2, steps):
            row[count], step[count] = r, s
            if r == 0:
                if not problem.tube_radius[s] < math.inf:
                    continue
                place[count, 0], place[count, 1] = problem.tube_centre[s, 0], problem.tube_centre[s, 1]
                place[count, 2] = problem.tube_radius[s]
            elif r <= obstacles:
                place[count, 0], place[count, 1] = (
                    problem.obstacle_mean[r - 1, s, 0],
                    problem.obstacle_mean[r - 1, s, 1],
                )
                place[count, 2] = problem.safe_distance
                for c in range(3):
                    place[count, 3 + c] = problem.obstacle_covariance[r - 1, s, c]
            else:
                peer = r - 1 - obstacles
                place[count, 0], place[count, 1] = problem.peer_mean[peer, s, 0], problem.peer_mean[peer, s, 1]
                place[count, 2] = problem.peer_distance[peer, s]
            count += 1
    return Constraints(problem.margin, obstacles, row[:count], step[:count], place[:count])


@inner
def within_reach(problem: HorizonProblem, constraints: Constraints) -> Constraints:
    """Of some constraints those that a plan within f1 and f2 can break; the others are overwritten.

    Leaving out a constraint that every such plan keeps changes no optimum.  Step s (counted from 0) lies at
    ``P + s h V + h^2 sum_{j < s - 1} (s - 1 - j) U_j``.  As |U_j| <= Amax, this is at most
    ``Amax h^2 s (s - 1) / 2`` from ``P + s h V``; and as the speed is at most Vmax from the second step on, it is at
    most ``(s - 1) h Vmax`` from ``P + h V``.  A distance to a point changes by no more than that, and the deviation
    along any direction is at most the root of the covariance's largest eigenvalue.
    """
    row, step, place = constraints.row, constraints.step, constraints.place
    h, count = problem.period, 0
    px, py = problem.position[0], problem.position[1]
    vx, vy = problem.velocity[0], problem.velocity[1]
    for i in range(row.shape[0]):
        s, x, y, need = step[i], place[i, 0], place[i, 1], place[i, 2]
        if 0 < row[i] <= constraints.obstacles:
            mean, half, mixed = 0.5 * (place[i, 3] + place[i, 5]), 0.5 * (place[i, 3] - place[i, 5]), place[i, 4]
            need += constraints.margin * math.sqrt(max(mean + math.sqrt(half * half + mixed * mixed), 0.0))
        driven = math.sqrt((px + s * h * vx - x) ** 2 + (py + s * h * vy - y) ** 2)
        pushed = 0.5 * problem.max_acceleration * h * h * s * (s - 1)
        begun = math.sqrt((px + h * vx - x) ** 2 + (py + h * vy - y) ** 2)
        raced = (s - 1) * h * problem.max_speed
        if row[i] == 0:
            kept = min(driven + pushed, begun + raced) < need - _ROUNDING
        else:
            kept = max(driven - pushed, begun - raced) > need + _ROUNDING
        if not kept:
            row[count], step[count] = row[i], s
            for c in range(6):
                place[count, c] = place[i, c]
            count += 1
    return Constraints(constraints.margin, constraints.obstacles, row[:count], step[:count], place[:count])


@borrower
def term(constraints: Constraints, i: int, x: float, y: float) -> Term:
    """The i-th constraint at (x, y): value, gradient and Hessian."""
    row, place = constraints.row[i], constraints.place
    if row == 0:
        return stay_near(x, y, place[i, 0], place[i, 1], place[i, 2])
    if row > constraints.obstacles:
        return keep_away(x, y, place[i, 0], place[i, 1], place[i, 2])
    return keep_away_uncertain(
        x, y, place[i, 0], place[i, 1], place[i, 3], place[i, 4], place[i, 5], place[i, 2], constraints.margin
    )


@kernel
def violations(problem: HorizonProblem, controls: Array) -> Array:
    """Values of f3 (row 0), f4 and f5 with their margins at each step, shape (1 + K + n, N); <= 0 is satisfied.

    Entries no control can change, or that do not bind, are -inf.
    """
    steps = controls.shape[0]
    positions, velocities = np.empty((steps, 2)), np.empty((steps, 2))
    roll_out(problem.position, problem.velocity, controls, problem.period, positions, velocities)
    constraints = all_constraints(problem)
    table = np.full((1 + problem.obstacle_mean.shape[0] + problem.peer_mean.shape[0], steps), -math.inf)
    for i in range(constraints.row.shape[0]):
        s = constraints.step[i]
        table[constraints.row[i], s] = term(constraints, i, positions[s, 0], positions[s, 1])[0]
    return table
