"""An interior-point barrier method for the horizon problem (Boyd & Vandenberghe, ch. 11; the paper's [7]).

The problem is not convex, so two things are done beyond the textbook:

* A Newton step uses the exact gradient and the exact second derivatives, summed per prediction step into one 2x2
  block for each of position, velocity and control; a block that is not positive semidefinite is replaced by its
  nearest one that is.  The step then always descends, and near a minimum with full curvature it is Newton's own.
* *Restoration* comes first when the start breaks a constraint: it minimises half the sum of the squared violations
  of f3-f5 (metres), with f1 and f2 kept by their barriers.  If some violation is left, the problem is infeasible:
  each constraint then gets its violation in that restoration as its bound, and the objective is minimised within
  these bounds.  So least violation comes first and progress second, and the two are never traded against each other.

Every start is first moved a little towards braking.  A plan shifted by one step lies on the boundary of f1 or f2 to
rounding wherever it drives or accelerates at full rate; from there Newton's method can only double its distance to
the boundary in a step, and it stops far from the optimum, or at once when the Hessian has lost its digits.

f6 = max(0, d - Dmax) has a kink.  It is the value of ``min t, t >= 0, t >= d - Dmax``; putting both bounds of t into
the barrier and eliminating t in closed form gives a smooth function that tends to f6 with the barrier parameter.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiled import kernel
from .horizon import REACH_GOAL, HorizonProblem, roll_out
from .mutual_information import negative_information
from .terms import keep_away, keep_away_uncertain, stay_near
from .typing import Array

# Violations below this (metres) count as none; it is also the slack an infeasible problem's bounds get.
TOLERANCE = 1e-6
_SLACK = 1e-4
_CENTRING = 0.01  # how far a start is moved towards braking before anything else
_RESTORE_EXPONENT = 7  # restoration ends at barrier parameter 10 ** -7
_RESTORE, _OPTIMISE = 0, 1
_GAP = 1e-5  # relative (and absolute below 1e-2) gap, constraints times barrier parameter, at which it stops
_NEWTON_STEPS = 40  # per barrier parameter
_CURVATURE = 1e-9  # smallest eigenvalue of a repaired block


class Solution(NamedTuple):
    """What a solver returns: the plan and how good it is."""

    controls: Array  # (N, 2) U_{t+1} .. U_{t+N}
    violation: float  # largest violation of f3-f5, metres; 0 when feasible
    objective: float
    iterations: int  # Newton steps


class _Blocks(NamedTuple):
    """Gradient and Hessian of a function, in blocks per prediction step: (x, y) and (xx, xy, yy)."""

    position: Array  # (N, 5)
    velocity: Array  # (N, 5)
    control: Array  # (N, 5)


@kernel
def _add(block: Array, scale: float, gx: float, gy: float, hxx: float, hxy: float, hyy: float) -> None:
    block[0] += scale * gx
    block[1] += scale * gy
    block[2] += scale * hxx
    block[3] += scale * hxy
    block[4] += scale * hyy


@kernel
def _add_squashed(
    block: Array, slope: float, bend: float, gx: float, gy: float, hxx: float, hxy: float, hyy: float
) -> None:
    """Add p(h(.)) where p has derivatives ``slope`` and ``bend`` at h, and h the given gradient and Hessian."""
    _add(block, slope, gx, gy, hxx, hxy, hyy)
    block[2] += bend * gx * gx
    block[3] += bend * gx * gy
    block[4] += bend * gy * gy


@kernel
def _ball(block: Array, x: float, y: float, radius: float, mu: float) -> float:
    """-mu log(1 - |(x, y)|^2 / radius^2): the barrier of f1 and f2; inf outside."""
    inside = 1.0 - (x * x + y * y) / (radius * radius)
    if inside <= 0.0:
        return math.inf
    slope = 2.0 * mu / (radius * radius * inside)
    _add(block, slope, x, y, 1.0, 0.0, 1.0)
    bend = slope * slope / mu
    block[2] += bend * x * x
    block[3] += bend * x * y
    block[4] += bend * y * y
    return -mu * math.log(inside)


@kernel
def _term(
    problem: HorizonProblem, row: int, s: int, x: float, y: float
) -> tuple[float, float, float, float, float, float]:
    """Constraint ``row`` of step ``s``: 0 is f3, then f4 of every obstacle, then f5 of every peer."""
    obstacles = problem.obstacle_mean.shape[0]
    if row == 0:
        return stay_near(x, y, problem.tube_centre[s, 0], problem.tube_centre[s, 1], problem.tube_radius[s])
    if row <= obstacles:
        mean, covariance = problem.obstacle_mean[row - 1, s], problem.obstacle_covariance[row - 1, s]
        return keep_away_uncertain(
            x,
            y,
            mean[0],
            mean[1],
            covariance[0],
            covariance[1],
            covariance[2],
            problem.safe_distance,
            problem.margin,
        )
    peer = row - 1 - obstacles
    mean = problem.peer_mean[peer, s]
    return keep_away(x, y, mean[0], mean[1], problem.peer_distance[peer, s])


@kernel
def _rows(problem: HorizonProblem) -> int:
    return int(1 + problem.obstacle_mean.shape[0] + problem.peer_mean.shape[0])


@kernel
def _bound(problem: HorizonProblem, row: int, s: int) -> bool:
    """Whether constraint ``row`` binds at step ``s``: steps 1 and 2 are decided before U_{t+1} acts."""
    return s >= 2 and (row > 0 or problem.tube_radius[s] < math.inf)


@kernel
def violations(problem: HorizonProblem, controls: Array) -> Array:
    """Values of f3 (row 0), f4 and f5 with their margins at each step, shape (1 + K + n, N); <= 0 is satisfied.

    Entries no control can change, or that do not bind, are -inf.
    """
    steps = controls.shape[0]
    positions, velocities = np.empty((steps, 2)), np.empty((steps, 2))
    roll_out(problem.position, problem.velocity, controls, problem.period, positions, velocities)
    values = np.full((_rows(problem), steps), -math.inf)
    for row in range(_rows(problem)):
        for s in range(steps):
            if _bound(problem, row, s):
                values[row, s] = _term(problem, row, s, positions[s, 0], positions[s, 1])[0]
    return values


@kernel
def _objective(problem: HorizonProblem, positions: Array, mu: float, blocks: _Blocks) -> float:
    """f0 of eq. (2) or the objective of eq. (5); ``mu`` = 0 is the paper's own, mu > 0 smooths f6's kink."""
    steps = positions.shape[0]
    value = 0.0
    if problem.objective == REACH_GOAL:
        for s in range(steps):
            dx, dy = positions[s, 0] - problem.goal[0], positions[s, 1] - problem.goal[1]
            value += dx * dx + dy * dy
            _add(blocks.position[s], 2.0, dx, dy, 1.0, 0.0, 1.0)
        return value
    if problem.obstacle_mean.shape[0] == 0:
        return value
    information, gx, gy, hxx, hxy, hyy = negative_information(
        positions[steps - 1, 0],
        positions[steps - 1, 1],
        problem.sigma_positions,
        problem.sigma_weights,
        problem.others_distance,
        problem.measurement_variance,
    )
    value += information
    _add(blocks.position[steps - 1], 1.0, gx, gy, hxx, hxy, hyy)
    gamma = problem.range_penalty
    for s in range(steps):
        mean = problem.obstacle_mean[0, s]
        g, gx, gy, hxx, hxy, hyy = stay_near(
            positions[s, 0], positions[s, 1], mean[0], mean[1], problem.measurement_range
        )
        if mu == 0.0 or gamma == 0.0:
            value += gamma * max(0.0, g)
            if g > 0.0:
                _add(blocks.position[s], gamma, gx, gy, hxx, hxy, hyy)
        else:
            root = math.hypot(gamma * g, 2.0 * mu)
            # t and t - g of the eliminated bound, written so that neither cancels.
            if g > 0.0:
                t = (gamma * g + 2.0 * mu + root) / (2.0 * gamma)
                over = mu * t / (gamma * t - mu)
            else:
                over = (2.0 * mu - gamma * g + root) / (2.0 * gamma)
                t = mu * over / (gamma * over - mu)
            value += gamma * t - mu * math.log(t * over)
            slope = mu / over
            bend = mu / (over * over + t * t)
            _add_squashed(blocks.position[s], slope, bend, gx, gy, hxx, hxy, hyy)
    return value


@kernel
def _evaluate(
    problem: HorizonProblem,
    controls: Array,
    phase: int,
    mu: float,
    bounds: Array,
    positions: Array,
    velocities: Array,
    blocks: _Blocks,
) -> float:
    """The function the current phase minimises, its blocks filled in; inf outside the barriers' domain."""
    steps = controls.shape[0]
    roll_out(problem.position, problem.velocity, controls, problem.period, positions, velocities)
    blocks.position[:] = 0.0
    blocks.velocity[:] = 0.0
    blocks.control[:] = 0.0
    value = 0.0
    for s in range(steps):
        value += _ball(blocks.control[s], controls[s, 0], controls[s, 1], problem.max_acceleration, mu)
        if s > 0:  # the speed at step 1 is decided already
            value += _ball(blocks.velocity[s], velocities[s, 0], velocities[s, 1], problem.max_speed, mu)
        if value == math.inf:
            return math.inf
    for row in range(_rows(problem)):
        for s in range(steps):
            if not _bound(problem, row, s):
                continue
            h, gx, gy, hxx, hxy, hyy = _term(problem, row, s, positions[s, 0], positions[s, 1])
            slack = bounds[row, s] - h
            if phase == _OPTIMISE:
                if slack <= 0.0:
                    return math.inf
                value -= mu * math.log(slack)
                slope = mu / slack
                _add_squashed(blocks.position[s], slope, slope / slack, gx, gy, hxx, hxy, hyy)
            elif slack < 0.0:
                value += 0.5 * slack * slack
                _add_squashed(blocks.position[s], -slack, 1.0, gx, gy, hxx, hxy, hyy)
    if phase == _OPTIMISE:
        value += _objective(problem, positions, mu, blocks)
    return value


@kernel
def _repair(block: Array) -> None:
    """Replace a 2x2 block by the nearest positive semidefinite one."""
    mean, half, mixed = 0.5 * (block[2] + block[4]), 0.5 * (block[2] - block[4]), block[3]
    radius = math.hypot(half, mixed)
    low, high = mean - radius, mean + radius
    if low >= _CURVATURE:
        return
    low, high = max(low, _CURVATURE), max(high, _CURVATURE)
    mean, spread = 0.5 * (low + high), 0.5 * (high - low)
    scale = spread / radius if radius > 0.0 else 0.0
    block[2], block[3], block[4] = mean + half * scale, mixed * scale, mean - half * scale


@kernel
def _newton_step(blocks: _Blocks, period: float, gradient: Array, hessian: Array, step: Array) -> float:
    """Turn the blocks into a step in the controls; returns gradient . step (negative), or 0 if that fails.

    d P_{s} / d U_j = period^2 (s - 1 - j) I and d V_s / d U_j = period I for j < s, both zero otherwise, with s and
    j counted from 0; so the Hessian is a double and a single running sum of the blocks.
    """
    steps = blocks.position.shape[0]
    for s in range(steps):
        _repair(blocks.position[s])
        _repair(blocks.velocity[s])
        _repair(blocks.control[s])
    square = period * period
    for j in range(steps):
        for c in range(2):
            total = blocks.control[j, c]
            for s in range(j + 1, steps):
                total += period * blocks.velocity[s, c] + square * (s - 1 - j) * blocks.position[s, c]
            gradient[2 * j + c] = total
        for k in range(j + 1):
            xx = xy = yy = 0.0
            for s in range(j + 1, steps):
                weight = square * square * (s - 1 - j) * (s - 1 - k)
                xx += weight * blocks.position[s, 2] + square * blocks.velocity[s, 2]
                xy += weight * blocks.position[s, 3] + square * blocks.velocity[s, 3]
                yy += weight * blocks.position[s, 4] + square * blocks.velocity[s, 4]
            if k == j:
                xx += blocks.control[j, 2]
                xy += blocks.control[j, 3]
                yy += blocks.control[j, 4]
            hessian[2 * j, 2 * k] = xx
            hessian[2 * j, 2 * k + 1] = xy
            hessian[2 * j + 1, 2 * k] = xy
            hessian[2 * j + 1, 2 * k + 1] = yy
    size = 2 * steps
    for i in range(size):  # Cholesky in place, lower triangle
        for k in range(i + 1):
            total = hessian[i, k]
            for m in range(k):
                total -= hessian[i, m] * hessian[k, m]
            if i == k:
                if not total > 0.0:
                    return 0.0
                hessian[i, i] = math.sqrt(total)
            else:
                hessian[i, k] = total / hessian[k, k]
    for i in range(size):
        total = -gradient[i]
        for m in range(i):
            total -= hessian[i, m] * step[m]
        step[i] = total / hessian[i, i]
    for i in range(size - 1, -1, -1):
        total = step[i]
        for m in range(i + 1, size):
            total -= hessian[m, i] * step[m]
        step[i] = total / hessian[i, i]
    descent = 0.0
    for i in range(size):
        descent += gradient[i] * step[i]
    return descent


@kernel
def _minimise(
    problem: HorizonProblem, controls: Array, phase: int, mu: float, bounds: Array, tolerance: float
) -> tuple[int, float]:
    """Newton's method with backtracking (0.05, 0.5) on ``controls`` in place: (steps taken, value reached)."""
    steps = controls.shape[0]
    size = 2 * steps
    positions, velocities = np.empty((steps, 2)), np.empty((steps, 2))
    blocks = _Blocks(np.empty((steps, 5)), np.empty((steps, 5)), np.empty((steps, 5)))
    gradient, step, hessian = np.empty(size), np.empty(size), np.empty((size, size))
    trial = np.empty((steps, 2))
    value = _evaluate(problem, controls, phase, mu, bounds, positions, velocities, blocks)
    for iteration in range(_NEWTON_STEPS):
        descent = _newton_step(blocks, problem.period, gradient, hessian, step)
        if not -0.5 * descent > tolerance:
            return iteration, value
        length = 1.0
        while True:
            for j in range(steps):
                trial[j, 0] = controls[j, 0] + length * step[2 * j]
                trial[j, 1] = controls[j, 1] + length * step[2 * j + 1]
            reached = _evaluate(problem, trial, phase, mu, bounds, positions, velocities, blocks)
            if reached <= value + 0.05 * length * descent:
                break
            length *= 0.5
            if length < 1e-10:  # rounding hides any further descent
                return iteration, value
        controls[:] = trial
        value = reached
    return _NEWTON_STEPS, value


@kernel
def _inside(problem: HorizonProblem, controls: Array) -> bool:
    """Whether the controls keep f1 and f2 strictly."""
    vx, vy = problem.velocity[0], problem.velocity[1]
    for j in range(controls.shape[0]):
        ux, uy = controls[j, 0], controls[j, 1]
        if not ux * ux + uy * uy < problem.max_acceleration**2:
            return False
        vx += problem.period * ux
        vy += problem.period * uy
        if j < controls.shape[0] - 1 and not vx * vx + vy * vy < problem.max_speed**2:
            return False
    return True


@kernel
def _braking(problem: HorizonProblem, steps: int, share: float) -> Array:
    """Controls that brake with at most ``share`` of f2's limit, and per step at most that share of the speed left."""
    controls = np.zeros((steps, 2))
    speed = math.hypot(problem.velocity[0], problem.velocity[1])
    if not speed > 1e-9:
        return controls
    left = speed
    for j in range(steps):
        push = share * min(problem.max_acceleration, left / problem.period)
        controls[j, 0] = -push * problem.velocity[0] / speed
        controls[j, 1] = -push * problem.velocity[1] / speed
        left -= push * problem.period
    return controls


@kernel
def _restore(problem: HorizonProblem, controls: Array) -> tuple[int, float]:
    """Minimise the squared violations: (Newton steps, the sum left of them), 0 left when strictly feasible.

    The barrier parameter has to become small: near the limits of f1 and f2 a larger one costs decimetres of
    violation that full braking would have avoided.
    """
    bounds = np.full((_rows(problem), controls.shape[0]), -_SLACK)
    iterations = 0
    for exponent in range(1, _RESTORE_EXPONENT + 1):
        mu = 10.0**-exponent
        taken, _ = _minimise(problem, controls, _RESTORE, mu, bounds, 1e-3 * mu)
        iterations += taken
        if violations(problem, controls).max() < 0.0:
            return iterations, 0.0
    left = 0.0
    values = violations(problem, controls)
    for row in range(values.shape[0]):
        for s in range(values.shape[1]):
            left += max(0.0, values[row, s]) ** 2
    # A plan that touches a bound without breaking it still ranks behind a strictly feasible one.
    return iterations, max(left, TOLERANCE**2)


@kernel
def _optimise(problem: HorizonProblem, controls: Array) -> tuple[int, float]:
    """Minimise the objective in place within each constraint's present violation: (Newton steps, objective)."""
    steps = controls.shape[0]
    bounds = violations(problem, controls)
    count = 2 * steps
    for row in range(bounds.shape[0]):
        for s in range(steps):
            if _bound(problem, row, s):
                count += 1
            bounds[row, s] = bounds[row, s] + _SLACK if bounds[row, s] >= 0.0 else 0.0
    positions, velocities = np.empty((steps, 2)), np.empty((steps, 2))
    blocks = _Blocks(np.empty((steps, 5)), np.empty((steps, 5)), np.empty((steps, 5)))
    roll_out(problem.position, problem.velocity, controls, problem.period, positions, velocities)
    objective = _objective(problem, positions, 0.0, blocks)
    iterations = 0
    mu = max(1e-3, 0.1 * abs(objective) / count)
    while True:
        allowed = _GAP * max(1e-2, abs(objective)) / count
        mu = max(mu, allowed)
        taken, _ = _minimise(problem, controls, _OPTIMISE, mu, bounds, 1e-2 * mu)
        iterations += taken
        roll_out(problem.position, problem.velocity, controls, problem.period, positions, velocities)
        objective = _objective(problem, positions, 0.0, blocks)
        if mu <= allowed * 1.0001:
            return iterations, objective
        mu *= 0.1


@kernel
def solve(problem: HorizonProblem, starts: Array) -> Solution:
    """Solve from the first of ``starts`` (k, N, 2) that is feasible, or else from the least violating restoration.

    A start that breaks f1 or f2 is skipped; if all do (the vehicle is faster than it may be), the answer is the
    hardest braking that f2 allows.  Never raises; the result is finite for finite input.
    """
    steps = starts.shape[1]
    best = np.zeros((steps, 2))
    least = math.inf
    iterations = 0
    brake = _braking(problem, steps, 0.5)
    for index in range(starts.shape[0]):
        controls = (1.0 - _CENTRING) * starts[index] + _CENTRING * brake
        if not _inside(problem, controls):
            continue
        left = 0.0
        if not violations(problem, controls).max() < 0.0:
            taken, left = _restore(problem, controls)
            iterations += taken
        if left < least:
            least = left
            best[:] = controls
        if least == 0.0:
            break
    if least == math.inf:
        best[:] = _braking(problem, steps, 0.999)
        return Solution(best, max(0.0, violations(problem, best).max()), math.inf, iterations)
    taken, objective = _optimise(problem, best)
    largest = violations(problem, best).max()
    return Solution(best, largest if largest > TOLERANCE else 0.0, objective, iterations + taken)
