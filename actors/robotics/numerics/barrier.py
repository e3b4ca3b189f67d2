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
from typing import Any, NamedTuple

import numpy as np

from .compiled import borrower, inner, kernel
from .constraints import Constraints, all_constraints, term, violations, within_reach
from .horizon import REACH_GOAL, HorizonProblem, roll_out
from .mutual_information import negative_information
from .newton import Blocks, Feedback, add, clear, new_blocks, new_feedback, newton_step
from .terms import stay_near
from .typing import Array

# Violations below this (metres) count as none; it is also the slack an infeasible problem's bounds get.
TOLERANCE = 1e-6
_SLACK = 1e-4
_CENTRING = 0.1  # how far a start is moved towards braking before anything else
_RESTORE, _OPTIMISE = 0.0, 1.0  # phases; numba would compile everything once for each of two integers
_RESTORE_FROM, _RESTORE_TO = 0.1, 1e-7  # barrier parameters of restoration
_OPTIMISE_FROM = 0.03  # relative gap, constraints times barrier parameter, at which optimisation begins
_GAP = 1e-5  # relative (and absolute below 1e-2) gap at which it stops
_REDUCTION = 0.03  # of the barrier parameter from one minimisation to the next
_CLOSE = 0.5  # decrease, in barrier parameters, that a minimisation but the last of them may leave
_NEWTON_STEPS = 40  # per barrier parameter


class Solution(NamedTuple):
    """What a solver returns: the plan and how good it is."""

    controls: Array  # (N, 2) U_{t+1} .. U_{t+N}
    violation: float  # largest violation of f3-f5, metres; 0 when feasible
    objective: float
    iterations: int  # Newton steps


class _Task(NamedTuple):
    """A problem with the constraints to be watched, and room for a method that would else allocate at every step."""

    problem: HorizonProblem
    constraints: Constraints
    bounds: Array  # (m,) what each constraint may be at most; 0 where the problem is feasible
    values: Array  # (m,) of the constraints
    positions: Array  # (N, 2)
    velocities: Array  # (N, 2)
    blocks: Blocks
    feedback: Feedback
    step: Array  # (N, 2)
    trial: Array  # (N, 2)


@inner
def _new_task(problem: HorizonProblem, steps: int) -> _Task:
    constraints = within_reach(problem, all_constraints(problem))
    count = constraints.row.shape[0]
    return _Task(
        problem, constraints, np.zeros(count), np.empty(count), np.empty((steps, 2)), np.empty((steps, 2)),
        new_blocks(steps), new_feedback(steps), np.empty((steps, 2)), np.empty((steps, 2)),
    )  # fmt: skip


@borrower
def _drive(task: _Task, controls: Array) -> None:
    """Fill in positions and velocities."""
    problem = task.problem
    roll_out(problem.position, problem.velocity, controls, problem.period, task.positions, task.velocities)


@borrower
def _excess(task: _Task, controls: Array) -> float:
    """The largest value of f3-f5: negative if all are kept strictly, inf if one is not a number."""
    _drive(task, controls)
    largest = -math.inf
    for i in range(task.values.shape[0]):
        s = task.constraints.step[i]
        task.values[i] = term(task.constraints, i, task.positions[s, 0], task.positions[s, 1])[0]
        if not task.values[i] <= largest:
            largest = task.values[i] if task.values[i] < math.inf else math.inf
    return largest


@borrower
def _ball(blocks: Array, s: int, x: float, y: float, radius: float, mu: float, dual: float) -> float:
    """Add the barrier of f1 or f2, -mu log(1 - |(x, y)|^2 / radius^2), and return what the log is taken of."""
    inside = 1.0 - (x * x + y * y) / (radius * radius)
    slope = 2.0 / (radius * radius * inside)
    add(blocks, s, mu * slope, dual * slope, dual * slope * slope, x, y, 1.0, 0.0, 1.0)
    return inside


@borrower
def _objective(task: _Task, mu: float) -> float:
    """f0 of eq. (2) or the objective of eq. (5); ``mu`` = 0 is the paper's own, mu > 0 smooths f6's kink."""
    problem, positions, blocks = task.problem, task.positions, task.blocks.position
    steps = positions.shape[0]
    value = 0.0
    if problem.objective == REACH_GOAL:
        for s in range(steps):
            dx, dy = positions[s, 0] - problem.goal[0], positions[s, 1] - problem.goal[1]
            value += dx * dx + dy * dy
            add(blocks, s, 2.0, 2.0, 0.0, dx, dy, 1.0, 0.0, 1.0)
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
    add(blocks, steps - 1, 1.0, 1.0, 0.0, gx, gy, hxx, hxy, hyy)
    gamma = problem.range_penalty
    for s in range(steps):
        g, gx, gy, hxx, hxy, hyy = stay_near(
            positions[s, 0],
            positions[s, 1],
            problem.obstacle_mean[0, s, 0],
            problem.obstacle_mean[0, s, 1],
            problem.measurement_range,
        )
        if mu == 0.0 or gamma == 0.0:
            value += gamma * max(0.0, g)
            if g > 0.0:
                add(blocks, s, gamma, gamma, 0.0, gx, gy, hxx, hxy, hyy)
        else:
            root = math.sqrt(gamma * g * gamma * g + 4.0 * mu * mu)
            # t and t - g of the eliminated bound, written so that neither cancels.
            if g > 0.0:
                t = (gamma * g + 2.0 * mu + root) / (2.0 * gamma)
                over = mu * t / (gamma * t - mu)
            else:
                over = (2.0 * mu - gamma * g + root) / (2.0 * gamma)
                t = mu * over / (gamma * over - mu)
            value += gamma * t - mu * math.log(t * over)
            slope = mu / over
            add(blocks, s, slope, slope, mu / (over * over + t * t), gx, gy, hxx, hxy, hyy)
    return value


@borrower
def _evaluate(task: _Task, controls: Array, phase: float, mu: float, dual: float) -> float:
    """The function the current phase minimises, its blocks filled in; inf outside the barriers' domain.

    The second derivatives of the barriers are taken with ``dual`` in place of ``mu``, see ``_minimise``.
    """
    problem, blocks, constraints = task.problem, task.blocks, task.constraints
    _drive(task, controls)
    clear(blocks)
    positions, velocities = task.positions, task.velocities
    value, product = 0.0, 1.0  # of all arguments of logs: one log of a product for many of its factors
    for s in range(controls.shape[0]):
        inside = _ball(blocks.control, s, controls[s, 0], controls[s, 1], problem.max_acceleration, mu, dual)
        if not inside > 0.0:
            return math.inf
        product *= inside
        if s > 0:  # the speed at step 1 is decided already
            inside = _ball(blocks.velocity, s, velocities[s, 0], velocities[s, 1], problem.max_speed, mu, dual)
            if not inside > 0.0:
                return math.inf
            product *= inside
        if product < 1e-100:
            value -= mu * math.log(product)
            product = 1.0
    for i in range(constraints.row.shape[0]):
        s = constraints.step[i]
        if phase == _RESTORE and term(constraints, i, positions[s, 0], positions[s, 1])[0] <= task.bounds[i]:
            continue  # most are kept, and their derivatives are not even computed
        h, gx, gy, hxx, hxy, hyy = term(constraints, i, positions[s, 0], positions[s, 1])
        slack = task.bounds[i] - h
        if phase == _OPTIMISE:
            if not slack > 0.0:
                return math.inf
            product *= slack
            if not 1e-100 < product < 1e100:
                value -= mu * math.log(product)
                product = 1.0
            slope = 1.0 / slack
            add(blocks.position, s, mu * slope, dual * slope, dual * slope * slope, gx, gy, hxx, hxy, hyy)
        else:
            value += 0.5 * slack * slack
            add(blocks.position, s, -slack, -slack, 1.0, gx, gy, hxx, hxy, hyy)
    value -= mu * math.log(product)
    if phase == _OPTIMISE:
        value += _objective(task, mu)
    return value


@borrower
def _minimise(task: _Task, controls: Array, phase: float, mu: float, dual: float, tolerance: float) -> int:
    """Newton's method with backtracking (0.05, 0.5) on ``controls`` in place; returns the steps taken.

    Where the previous barrier parameter ``dual`` was larger, its curvature is kept for the first step.  At the
    minimum of that one, a constraint's multiplier is dual / slack; with it in the Hessian the step is the tangent of
    the central path, which lowers the slacks of active constraints to mu / dual of themselves and no further.  With
    the curvature of ``mu`` the step leaves the domain, and every reduction costs several more.
    """
    steps = controls.shape[0]
    step, trial = task.step, task.trial
    value = _evaluate(task, controls, phase, mu, dual)
    if not value < math.inf:  # numbers too large to be squared, or none
        return 0
    for iteration in range(_NEWTON_STEPS):
        descent = newton_step(task.blocks, task.problem.period, task.feedback, step)
        if not -0.5 * descent > tolerance:
            return iteration
        length = 1.0
        while True:
            for j in range(steps):
                trial[j, 0] = controls[j, 0] + length * step[j, 0]
                trial[j, 1] = controls[j, 1] + length * step[j, 1]
            reached = _evaluate(task, trial, phase, mu, mu)
            if reached <= value + 0.05 * length * descent:
                break
            length *= 0.5
            if length < 1e-10:  # rounding hides any further descent
                return iteration
        for j in range(steps):
            controls[j, 0], controls[j, 1] = trial[j, 0], trial[j, 1]
        value = reached
    return _NEWTON_STEPS


@borrower
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


@inner
def _braking(problem: HorizonProblem, steps: int, share: float) -> Array:
    """Controls that brake with at most ``share`` of f2's limit, and per step at most that share of the speed left."""
    controls = np.zeros((steps, 2))
    speed = math.hypot(problem.velocity[0], problem.velocity[1])
    if not 1e-9 < speed < math.inf:
        return controls
    left = speed
    for j in range(steps):
        push = share * min(problem.max_acceleration, left / problem.period)
        controls[j, 0] = -push * problem.velocity[0] / speed
        controls[j, 1] = -push * problem.velocity[1] / speed
        left -= push * problem.period
    return controls


@borrower
def _restore(task: _Task, controls: Array) -> tuple[int, float]:
    """Minimise the squared violations: (Newton steps, the sum left of them), 0 left when strictly feasible.

    The barrier parameter has to become small: near the limits of f1 and f2 a larger one costs decimetres of
    violation that full braking would have avoided.
    """
    for i in range(task.bounds.shape[0]):
        task.bounds[i] = -_SLACK
    iterations = 0
    mu = dual = _RESTORE_FROM
    while True:
        last = mu <= _RESTORE_TO
        taken = _minimise(task, controls, _RESTORE, mu, dual, (0.01 if last else _CLOSE) * mu)
        last = last or taken == _NEWTON_STEPS  # it goes in circles, and would at smaller parameters
        iterations += taken
        if _excess(task, controls) < 0.0:
            return iterations, 0.0
        if last:
            break
        dual, mu = mu, max(_REDUCTION * mu, _RESTORE_TO)
    left = 0.0
    for i in range(task.values.shape[0]):
        left += max(0.0, task.values[i]) ** 2
    # A plan that touches a bound without breaking it still ranks behind a strictly feasible one.
    return iterations, max(left, TOLERANCE**2)


@borrower
def _optimise(task: _Task, controls: Array) -> tuple[int, float]:
    """Minimise the objective in place within each constraint's present violation: (Newton steps, objective)."""
    _excess(task, controls)
    for i in range(task.values.shape[0]):
        task.bounds[i] = task.values[i] + _SLACK if task.values[i] >= 0.0 else 0.0
    count = 2 * controls.shape[0] + task.values.shape[0]
    objective = _objective(task, 0.0)
    iterations = 0
    mu = dual = max(1e-3, _OPTIMISE_FROM * abs(objective) / count)
    while True:
        least = _GAP * max(1e-2, abs(objective)) / count
        last = not mu > 1.1 * least  # also if it is not a number
        iterations += _minimise(task, controls, _OPTIMISE, mu, dual, (0.1 if last else _CLOSE) * mu)
        _drive(task, controls)
        objective = _objective(task, 0.0)
        if last:
            return iterations, objective
        dual, mu = mu, max(_REDUCTION * mu, least)


def solve(problem: HorizonProblem, starts: Array) -> Solution:
    """Solve from the first of ``starts`` (k, N, 2) that is feasible, or else from the least violating restoration.

    A start that breaks f1 or f2 is skipped; if all do (the vehicle is faster than it may be), the answer is the
    hardest braking that f2 allows.  Never raises, and the controls are finite and keep f2 whatever is asked; where
    numbers of the problem are not finite, or too large to be squared, the violation may be inf.
    """
    # Field by field, as numba takes 4 us longer to look at a named tuple.
    return Solution(*_solve(*problem, starts))


@kernel
def _solve(*fields: Any) -> tuple[Array, float, float, int]:
    """The fields of the problem, then the starts."""
    problem, starts = HorizonProblem(*fields[:-1]), fields[-1]
    steps = starts.shape[1]
    task = _new_task(problem, steps)
    brake = _braking(problem, steps, 0.5)
    controls, best = np.empty((steps, 2)), np.empty((steps, 2))
    least, iterations = math.inf, 0
    for index in range(starts.shape[0]):
        for j in range(steps):
            for c in range(2):
                controls[j, c] = (1.0 - _CENTRING) * starts[index, j, c] + _CENTRING * brake[j, c]
        if not _inside(problem, controls):
            continue
        left = 0.0
        if not _excess(task, controls) < 0.0:
            taken, left = _restore(task, controls)
            iterations += taken
        if left < least:
            least = left
            controls, best = best, controls
        if least == 0.0:
            break
    if least == math.inf:
        best = _braking(problem, steps, 0.999)
        largest = violations(problem, best).max()
        return best, max(0.0, largest) if largest < math.inf else math.inf, math.inf, iterations
    taken, objective = _optimise(task, best)
    largest = _excess(task, best)
    return best, largest if largest > TOLERANCE else 0.0, objective, iterations + taken
