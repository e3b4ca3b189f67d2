"""An interior-point barrier method for the horizon problem (Boyd & Vandenberghe, ch. 11; the paper's [7]).

The problem is not convex, so two things are done beyond the textbook:

* A Newton step uses the exact gradient and the exact second derivatives, summed per prediction step into one d x d
  block for each of position, velocity and control; a block that is not positive semidefinite is replaced by its
  nearest one that is.  The step then always descends, and near a minimum with full curvature it is Newton's own.
* *Restoration* comes first if the start breaks a constraint: it minimises half the sum of the squared violations
  of f3-f5 (metres), with f1 and f2 kept by their barriers.  If some violation remains, the problem is infeasible: each
  constraint then gets its violation in that restoration as its bound, and the objective is minimised within these
  bounds.  So least violation comes first and progress second, and the two are never traded against each other.

Every start is first moved a little towards braking.  A plan shifted by one step is on the boundary of f1 or f2, up to
rounding, wherever it drives or accelerates at full rate; from there Newton's method can only double its distance to the
boundary in a step, and it stops far from the optimum, or at once if the Hessian has lost its digits.

If only the first controls are free and the last of these is held, the held controls of a start are replaced by their
mean: the result keeps f1 and f2 if the start does.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compiled import Array, Layers, Table, borrower, kernel
from .constraints import BOUND, ROUNDING, VALUE
from .horizon import TOLERANCE, HorizonProblem, Solution
from .newton import newton_step
from .task import (
    ACCEPTED,
    Phase,
    Task,
    accept,
    at,
    check_constraints,
    evaluate,
    keeps_limits,
    longest_step,
    move,
    new_task,
    objective_of,
    room_for,
    store,
)
from .vectors import Vector, length_of, read, replaced, steeper, total, write, zero_vector

_SLACK = 1e-4  # m; added to an infeasible problem's bounds, and the margin of restoration
_NEARLY = 1e-3  # m; a violation that may be entirely due to the barriers of f1 and f2
_CENTRING = 0.1  # how far a start is moved towards braking before anything else
_RESTORE_FROM, _RESTORE_TO = 0.1, 1e-7  # barrier parameters of restoration
_RESTORE_ON = 1e-10  # further ones, if the remaining violation may be due to the barriers of f1 and f2
_OPTIMISE_FROM = 0.03  # relative gap, constraints times barrier parameter, at which optimisation begins
_REDUCTION = 0.03  # of the barrier parameter from one minimisation to the next
_CLOSE = 0.5  # decrease, in barrier parameters, that each minimisation except the last may leave
_NEWTON_STEPS = 40  # per barrier parameter
# In a crowd, the last digits of the violation are meaningless.  No scenario comes near, but the worst of 10,000
# problems of tests/actors/robotics/numerics/robustness.py takes 14 times as long as the median with these, and 22 times
# without them (goal: 20); with 64 peers, the median takes half as long.
_CROWD = 60  # constraints within reach; more are a crowd
_HOPELESS = 1e3  # m^2; if a crowd's squared violations add up to more, a rough value is enough:
_ROUGH = 1e-3  # the share of them that a minimisation may leave, and
_ROUGH_TO = 1e-5  # the barrier parameter, divided by them, at which restoration ends


PROGRESS, LEAST_VIOLATION, BRAKE = 0, 1, 2


class Rules(NamedTuple):
    """Settings of the barrier method that the paper leaves open."""

    gap: float = 1e-5  # relative (and absolute below 1e-2) gap to the optimum at which it stops
    last_parameter: float = 0.0  # the barrier parameter at which it stops instead, in units of the objective; 0: by gap
    free: int = 0  # number of free controls, the last of which is held to the end of the horizon; 0: all
    infeasible: int = PROGRESS  # or LEAST_VIOLATION or BRAKE: the answer to a problem that no plan solves


_RULES = Rules()


@borrower
def _is_hopeless(task: Task, squared: float) -> bool:
    """Whether a crowd's squared violations, m^2, exceed the limit."""
    return squared > _HOPELESS and task.constraints.shape[0] > _CROWD


@borrower
def _minimise(task: Task, phase: Phase, mu: float, dual: float, tolerance: float) -> int:
    """Newton's method with backtracking (0.05, 0.5) from the accepted controls; returns the number of steps.

    If the previous barrier parameter ``dual`` was larger, its curvature is kept for the first step.  At the minimum of
    that one, a constraint's multiplier is dual / slack; with it in the Hessian the step is the tangent of the central
    path, which lowers the slacks of active constraints to mu / dual of themselves and no further.  With the curvature
    of ``mu`` the step leaves the domain, and every reduction costs several more.
    """
    value = evaluate(task, phase, mu, dual, math.inf)
    if not value < math.inf:  # NaN, or numbers too large to be squared
        return 0
    for iteration in range(_NEWTON_STEPS):
        descent = newton_step(task.stages, task.period, task.free, zero_vector(task.position))
        rough = phase == Phase.RESTORE and _is_hopeless(task, 2.0 * value)
        if not -0.5 * descent > (max(tolerance, _ROUGH * value) if rough else tolerance):
            return iteration
        length = longest_step(task, phase)
        while True:
            move(task, length)
            limit = value + 0.05 * length * descent
            reached = evaluate(task, phase, mu, mu, limit)
            if reached <= limit:
                break
            length *= 0.5
            if length < 1e-10:  # rounding hides any further descent
                return iteration
        accept(task)
        value = reached
    return _NEWTON_STEPS


@borrower
def _brake(task: Task, share: float) -> None:
    """Accept controls that brake with at most ``share`` of f2's limit, and in one step with at most that share of the
    remaining speed."""
    speed, most = length_of(task.velocity), task.max_acceleration
    moving = 1e-9 < speed < math.inf
    if len(task.velocity) == 3 and moving:  # f2 in that direction
        most *= speed / length_of(steeper(task.velocity, task.acceleration_ratio))
    left = speed
    for s in range(task.plan.shape[0]):
        push, control = 0.0, zero_vector(task.velocity)
        if moving:
            push = share * min(most, left / task.period)
            for c in range(len(control)):
                control = replaced(control, c, -push * task.velocity[c] / speed)
        store(task, s, ACCEPTED, control)
        left -= push * task.period


@borrower
def _restore(task: Task) -> tuple[int, float]:
    """Minimise the squared violations; returns (Newton steps, the remaining sum), 0 if strictly feasible.

    The barrier parameter has to become small: near the limits of f1 and f2 a larger one costs decimetres of
    violation that full braking would have avoided.
    """
    constraints = task.constraints
    for i in range(constraints.shape[0]):
        constraints[i, BOUND] = -_SLACK
    iterations, least, left = 0, _RESTORE_TO, 0.0
    mu = dual = _RESTORE_FROM
    while True:
        last = mu <= least
        taken = _minimise(task, Phase.RESTORE, mu, dual, (0.01 if last else _CLOSE) * mu)
        iterations += taken
        excess = check_constraints(task)
        if excess < 0.0:
            return iterations, 0.0
        left = 0.0
        for i in range(constraints.shape[0]):
            violation = max(0.0, constraints[i, VALUE])
            left += violation * violation
        if last and excess <= _NEARLY:
            last, least = least == _RESTORE_ON, _RESTORE_ON
        if _is_hopeless(task, left):
            least = _ROUGH_TO * left
            last = last or mu <= least
        if last or taken == _NEWTON_STEPS:  # in circles, as it would be at smaller parameters
            break
        dual, mu = mu, max(_REDUCTION * mu, least)
    # A plan that touches a bound without breaking it still ranks after a strictly feasible one.
    return iterations, max(left, TOLERANCE * TOLERANCE)


@borrower
def _optimise(task: Task, gap: float, last_parameter: float) -> tuple[int, float]:
    """Minimise the objective within each constraint's present violation; returns (Newton steps, objective)."""
    constraints = task.constraints
    check_constraints(task)
    for i in range(constraints.shape[0]):
        value = constraints[i, VALUE]
        constraints[i, BOUND] = value + _SLACK if value >= 0.0 else 0.0
    count = 2 * task.plan.shape[0] + constraints.shape[0]
    objective = objective_of(task)
    iterations = 0
    if last_parameter > 0.0:
        gap = 0.0
    mu = dual = max(1e-3, max(_OPTIMISE_FROM, gap) * abs(objective) / count, last_parameter)
    while True:
        least = max(last_parameter, gap * max(1e-2, abs(objective)) / count)
        last = not mu > 1.1 * least  # also if it is NaN
        iterations += _minimise(task, Phase.OPTIMISE, mu, dual, (0.1 if last else _CLOSE) * mu)
        check_constraints(task)
        objective = objective_of(task)
        if last:
            return iterations, objective
        dual, mu = mu, max(_REDUCTION * mu, least)


@borrower
def _hold(task: Task) -> None:
    """Replace the held controls by the mean of those that move the robot within the horizon."""
    first, steps = task.free - 1, task.plan.shape[0]
    if first + 1 >= steps:
        return
    mean = zero_vector(task.position)
    for s in range(first, steps - 1):
        mean = total(mean, at(task, s, ACCEPTED))
    for c in range(len(mean)):
        mean = replaced(mean, c, mean[c] / (steps - 1 - first))
    for s in range(first, steps):
        store(task, s, ACCEPTED, mean)


@borrower
def _read(task: Task, controls: Array) -> None:
    """Write the accepted controls."""
    for s in range(task.plan.shape[0]):
        write(controls, s, 0, at(task, s, ACCEPTED))


def solve(problem: HorizonProblem, starts: Array, rules: Rules = _RULES) -> Solution:
    """Solve from the first of ``starts`` (k, N, 2) that is feasible, or else from the least violating restoration.

    A start that breaks f1 or f2 is skipped; if all do (the vehicle is faster than it may be), the answer is the
    hardest braking that f2 allows.  Never raises, and the controls are always finite and keep f2; if numbers of the
    problem are not finite, or too large to be squared, the violation may be inf.
    """
    solve_here = SOLVERS[len(problem.position)]
    return Solution(*solve_here(problem, rules, starts))


@kernel
def _solve_in_plane(problem: HorizonProblem, rules: Rules, starts: Layers) -> tuple[Table, float, float, int]:
    best, room = np.empty(starts.shape[1:]), np.empty(room_for(problem, starts.shape[1], 2))
    violation, objective, iterations = _search(problem, rules, starts, best, room, (0.0, 0.0))
    return best, violation, objective, iterations


@kernel
def _solve_in_space(problem: HorizonProblem, rules: Rules, starts: Layers) -> tuple[Table, float, float, int]:
    """The same with vectors of three numbers, compiled when first needed."""
    best, room = np.empty(starts.shape[1:]), np.empty(room_for(problem, starts.shape[1], 3))
    violation, objective, iterations = _search(problem, rules, starts, best, room, (0.0, 0.0, 0.0))
    return best, violation, objective, iterations


SOLVERS = {2: _solve_in_plane, 3: _solve_in_space}


@borrower
def _search(
    problem: HorizonProblem, rules: Rules, starts: Array, best: Array, room: Array, zero: Vector
) -> tuple[float, float, int]:
    """Write the best plan."""
    free = min(rules.free, starts.shape[1]) if rules.free > 0 else starts.shape[1]
    task = new_task(problem, starts.shape[1], free, ROUNDING, room, zero)
    steps = task.plan.shape[0]
    least, iterations = math.inf, 0
    for index in range(starts.shape[0]):
        _brake(task, 0.5)
        for s in range(steps):
            taken = at(task, s, ACCEPTED)
            for c in range(len(zero)):
                taken = replaced(taken, c, (1.0 - _CENTRING) * starts[index, s, c] + _CENTRING * taken[c])
            store(task, s, ACCEPTED, taken)
        _hold(task)
        if not keeps_limits(task):
            continue
        left = 0.0
        if not check_constraints(task) < 0.0:
            more, left = _restore(task)
            iterations += more
        if left < least:
            least = left
            _read(task, best)
        if least == 0.0:
            break
    if least == math.inf or (least > 0.0 and rules.infeasible == BRAKE):
        # What is out of reach is so only within f1 and f2.
        task = new_task(problem, starts.shape[1], free, math.inf, room, zero)
        _brake(task, 0.999)
        _read(task, best)
        return max(0.0, check_constraints(task)), math.inf, iterations
    for s in range(steps):
        store(task, s, ACCEPTED, read(zero, best, s, 0))
    if least > 0.0 and rules.infeasible == LEAST_VIOLATION:
        check_constraints(task)  # the last start tried may be another one
        more, objective = 0, objective_of(task)
    else:
        more, objective = _optimise(task, rules.gap, rules.last_parameter)
    _read(task, best)
    largest = check_constraints(task)
    return largest if largest > TOLERANCE else 0.0, objective, iterations + more
