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

from ...core.elementary import hypot, log
from .compiled import borrower, inlined, inner, kernel
from .constraints import (
    BOUND,
    MARGIN,
    NEED,
    PLACE,
    ROUNDING,
    ROW,
    VALUE,
    WHEN,
    certainly_kept,
    constraints_of,
    term,
)
from .horizon import REACH_GOAL, HorizonProblem
from .mutual_information import informed, new_points
from .newton import CONTROL, STEP, VELOCITY, add, clear, new_stages, newton_step
from .terms import Term, stay_near
from .typing import Array

TOLERANCE = 1e-6  # m; violations below this count as none
_SLACK = 1e-4  # m that an infeasible problem's bounds get, and that restoration goes beyond keeping a constraint
_CENTRING = 0.1  # how far a start is moved towards braking before anything else
_RESTORE, _OPTIMISE = 0.0, 1.0  # phases; numba would compile everything once for each of two integers
_RESTORE_FROM, _RESTORE_TO = 0.1, 1e-7  # barrier parameters of restoration
_RESTORE_ON = 1e-10  # where it goes on to if so little is left that the barriers of f1 and f2 may be all in the way
_OPTIMISE_FROM = 0.03  # relative gap, constraints times barrier parameter, at which optimisation begins
_GAP = 1e-5  # relative (and absolute below 1e-2) gap at which it stops
_REDUCTION = 0.03  # of the barrier parameter from one minimisation to the next
_CLOSE = 0.5  # decrease, in barrier parameters, that a minimisation but the last of them may leave
_SHARE = 0.8  # of the way to the nearest limit that a step goes at most
_NEWTON_STEPS = 40  # per barrier parameter
# What bounds the time of problems that no scenario poses, see ``tests/numerics/robustness.py``.
_MANY = 80  # limits and constraints of all problems but crowds
_HOPELESS = 1e3  # m^2; where a crowd's squared violations sum up to more, it is enough to know them roughly:
_ROUGH = 1e-3  # the share of them that a minimisation may leave, and
_ROUGH_TO = 1e-5  # the barrier parameter, divided by them, at which restoration ends
_LITTLE = 1e-3  # of what a minimisation may leave: a step that gains less is its last


class Solution(NamedTuple):
    """What a solver returns: the plan and how good it is."""

    controls: Array  # (N, 2) U_{t+1} .. U_{t+N}
    violation: float  # largest violation of f3-f5, metres; 0 when feasible
    objective: float
    iterations: int  # Newton steps


# Columns of the table of a plan, a row for each prediction step; each is x and y.
_POSITION = 0
_VELOCITY = 2
_TRIED = 4  # the controls that position and velocity follow from
_TAKEN = 6  # the best controls so far
_MOVED = 8  # of the position, by a whole step
_OBSTACLE = 10  # whom f6 is about
_COLUMNS = 12


class _Task(NamedTuple):
    """A problem as it is evaluated again and again: some numbers, and four tables that everything happens in."""

    period: float
    x: float  # position and velocity at step 1
    y: float
    vx: float
    vy: float
    max_speed: float
    max_acceleration: float
    seeks: bool  # the objective is eq. (2)
    goal_x: float
    goal_y: float
    informs: bool  # it is eq. (5), and there is an obstacle
    variance: float
    penalty: float
    reach: float
    plan: Array  # (N, 12)
    stages: Array  # of ``newton``
    constraints: Array  # those within reach
    points: Array  # sigma points, of ``mutual_information``


@inner
def _new_task(problem: HorizonProblem, steps: int, spare: float) -> _Task:
    plan = np.zeros((steps, _COLUMNS))
    informs = problem.objective != REACH_GOAL and problem.obstacle_mean.shape[0] > 0
    if informs:
        points = new_points(problem.sigma_positions, problem.sigma_weights, problem.others_distance)
        for s in range(steps):
            plan[s, _OBSTACLE] = problem.obstacle_mean[0, s, 0]
            plan[s, _OBSTACLE + 1] = problem.obstacle_mean[0, s, 1]
    else:
        points = plan[:0]
    return _Task(
        problem.period, problem.position[0], problem.position[1], problem.velocity[0], problem.velocity[1],
        problem.max_speed, problem.max_acceleration, problem.objective == REACH_GOAL, problem.goal[0], problem.goal[1],
        informs,
        problem.measurement_variance, problem.range_penalty, problem.measurement_range,
        plan, new_stages(steps), constraints_of(problem, spare), points,
    )  # fmt: skip


@borrower
def _drive(task: _Task) -> None:
    """Fill in the positions and velocities that follow from the controls tried."""
    plan = task.plan
    px, py, vx, vy = task.x, task.y, task.vx, task.vy
    for s in range(plan.shape[0]):
        plan[s, _POSITION], plan[s, _POSITION + 1] = px, py
        plan[s, _VELOCITY], plan[s, _VELOCITY + 1] = vx, vy
        px += task.period * vx
        py += task.period * vy
        vx += task.period * plan[s, _TRIED]
        vy += task.period * plan[s, _TRIED + 1]


@borrower
def _try(task: _Task, length: float) -> None:
    """Go so much of the step from the controls taken."""
    plan, stages = task.plan, task.stages
    for s in range(plan.shape[0]):
        for c in range(2):
            plan[s, _TRIED + c] = plan[s, _TAKEN + c] + length * stages[s, STEP + c]
    _drive(task)


@borrower
def _keep(task: _Task) -> None:
    """Take the controls tried."""
    plan = task.plan
    for s in range(plan.shape[0]):
        plan[s, _TAKEN], plan[s, _TAKEN + 1] = plan[s, _TRIED], plan[s, _TRIED + 1]


@borrower
def _excess(task: _Task) -> float:
    """The largest value of f3-f5 with the controls taken: negative if all are kept strictly, inf if one is none."""
    plan, constraints = task.plan, task.constraints
    for s in range(plan.shape[0]):
        plan[s, _TRIED], plan[s, _TRIED + 1] = plan[s, _TAKEN], plan[s, _TAKEN + 1]
    _drive(task)
    largest = -math.inf
    for i in range(constraints.shape[0]):
        s = int(constraints[i, WHEN])
        value = term(constraints, i, plan[s, _POSITION], plan[s, _POSITION + 1])[0]
        constraints[i, VALUE] = value
        if not value <= largest:
            largest = value if value < math.inf else math.inf
    return largest


@borrower
def _ball(x: float, y: float, radius: float, mu: float, dual: float) -> Term:
    """The barrier of f1 or f2, -mu log(1 - |(x, y)|^2 / radius^2): what the log is taken of, gradient and Hessian."""
    inverse = 1.0 / (radius * radius)
    inside = 1.0 - inverse * (x * x + y * y)
    slope = 2.0 * inverse / inside
    first, second = mu * slope, dual * slope
    bend = second * slope
    return inside, first * x, first * y, second + bend * x * x, bend * x * y, second + bend * y * y


@borrower
def _objective(task: _Task, mu: float) -> float:
    """f0 of eq. (2) or the objective of eq. (5); ``mu`` = 0 is the paper's own, mu > 0 smooths f6's kink."""
    plan, stages = task.plan, task.stages
    steps = plan.shape[0]
    value = 0.0
    if task.seeks:
        for s in range(steps):
            dx, dy = plan[s, _POSITION] - task.goal_x, plan[s, _POSITION + 1] - task.goal_y
            value += dx * dx + dy * dy
            add(stages, s, 2.0, 2.0, 0.0, dx, dy, 1.0, 0.0, 1.0)
    if not task.informs:
        return value
    last = steps - 1
    value, gx, gy, hxx, hxy, hyy = informed(
        task.points, plan[last, _POSITION], plan[last, _POSITION + 1], task.variance
    )
    add(stages, last, 1.0, 1.0, 0.0, gx, gy, hxx, hxy, hyy)
    gamma, product = task.penalty, 1.0
    for s in range(steps):
        g, gx, gy, hxx, hxy, hyy = stay_near(
            plan[s, _POSITION], plan[s, _POSITION + 1], plan[s, _OBSTACLE], plan[s, _OBSTACLE + 1], task.reach
        )
        if mu == 0.0 or gamma == 0.0:
            value += gamma * max(0.0, g)
            continue
        root = math.sqrt(gamma * g * gamma * g + 4.0 * mu * mu)
        # t and t - g of the eliminated bound, written so that neither cancels.
        if g > 0.0:
            t = (gamma * g + 2.0 * mu + root) / (2.0 * gamma)
            over = mu * t / (gamma * t - mu)
        else:
            over = (2.0 * mu - gamma * g + root) / (2.0 * gamma)
            t = mu * over / (gamma * over - mu)
        value += gamma * t
        product *= t * over
        if not 1e-100 < product < 1e100:
            value -= mu * log(product)
            product = 1.0
        slope = mu / over
        add(stages, s, slope, slope, mu / (over * over + t * t), gx, gy, hxx, hxy, hyy)
    return value - mu * log(product)


@borrower
def _evaluate(task: _Task, phase: float, mu: float, dual: float, limit: float) -> float:
    """The function the current phase minimises at the controls tried, with derivatives; inf outside its domain.

    The second derivatives of the barriers are taken with ``dual`` in place of ``mu``, see ``_minimise``.  Where the
    value is beyond ``limit``, it may be a smaller one that is so too.
    """
    plan, stages, constraints = task.plan, task.stages, task.constraints
    clear(stages)
    value, product = 0.0, 1.0  # of all arguments of logs: one log of a product for many of its factors
    for s in range(plan.shape[0]):
        inside, gx, gy, hxx, hxy, hyy = _ball(plan[s, _TRIED], plan[s, _TRIED + 1], task.max_acceleration, mu, dual)
        if not inside > 0.0:
            return math.inf
        product *= inside
        stages[s, CONTROL], stages[s, CONTROL + 1] = gx, gy
        stages[s, CONTROL + 2], stages[s, CONTROL + 3], stages[s, CONTROL + 4] = hxx, hxy, hyy
        if s > 0:  # the speed at step 1 is decided already
            inside, gx, gy, hxx, hxy, hyy = _ball(plan[s, _VELOCITY], plan[s, _VELOCITY + 1], task.max_speed, mu, dual)
            if not inside > 0.0:
                return math.inf
            product *= inside
            stages[s, VELOCITY], stages[s, VELOCITY + 1] = gx, gy
            stages[s, VELOCITY + 2], stages[s, VELOCITY + 3], stages[s, VELOCITY + 4] = hxx, hxy, hyy
        if product < 1e-100:
            value -= mu * log(product)
            product = 1.0
    if phase == _RESTORE:
        for i in range(constraints.shape[0]):
            s = int(constraints[i, WHEN])
            if certainly_kept(constraints, i, plan[s, _POSITION], plan[s, _POSITION + 1]):
                continue  # most are
            h, gx, gy, hxx, hxy, hyy = term(constraints, i, plan[s, _POSITION], plan[s, _POSITION + 1])
            over = h - constraints[i, BOUND]
            if not over <= 0.0:
                value += 0.5 * over * over
                add(stages, s, over, over, 1.0, gx, gy, hxx, hxy, hyy)
                if value > limit:  # what is to come is not negative
                    break
        return value - mu * log(product)
    for i in range(constraints.shape[0]):
        s = int(constraints[i, WHEN])
        h, gx, gy, hxx, hxy, hyy = term(constraints, i, plan[s, _POSITION], plan[s, _POSITION + 1])
        slack = constraints[i, BOUND] - h
        if not slack > 0.0:
            return math.inf
        product *= slack
        if not 1e-100 < product < 1e100:
            value -= mu * log(product)
            product = 1.0
        slope = 1.0 / slack
        add(stages, s, mu * slope, dual * slope, dual * slope * slope, gx, gy, hxx, hxy, hyy)
    return value - mu * log(product) + _objective(task, mu)


@borrower
def _share(x: float, y: float, dx: float, dy: float, radius: float) -> float:
    """How much of (dx, dy) it takes from (x, y) to the circle, where the whole crosses it."""
    a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - radius * radius
    root = math.sqrt(max(b * b - a * c, 0.0))
    if c > 0.0:  # from outside, the nearer crossing
        return c / (root - b)
    return -c / (root + b) if b > 0.0 else (root - b) / a


@inlined
def _squared(x: float, y: float) -> float:
    return x * x + y * y


@borrower
def _longest(task: _Task, phase: float) -> float:
    """How much of the step can be taken at most: all of it, or ``_SHARE`` of the way to the nearest limit.

    All limits are circles but the obstacle's, whose margin changes with the direction; it is left to the backtracking,
    as a step along it is far longer than one to the circle that has its present margin.
    """
    plan, stages, constraints, h = task.plan, task.stages, task.constraints, task.period
    share = 1.0
    px = py = vx = vy = 0.0
    for s in range(plan.shape[0]):
        plan[s, _MOVED], plan[s, _MOVED + 1] = px, py
        x, y = plan[s, _VELOCITY], plan[s, _VELOCITY + 1]
        if _squared(x + vx, y + vy) >= task.max_speed * task.max_speed and s > 0:
            share = min(share, _share(x, y, vx, vy, task.max_speed))
        px += h * vx
        py += h * vy
        x, y, dx, dy = plan[s, _TAKEN], plan[s, _TAKEN + 1], stages[s, STEP], stages[s, STEP + 1]
        if _squared(x + dx, y + dy) >= task.max_acceleration * task.max_acceleration:
            share = min(share, _share(x, y, dx, dy, task.max_acceleration))
        vx += h * dx
        vy += h * dy
    if phase == _OPTIMISE:
        for i in range(constraints.shape[0]):
            if constraints[i, MARGIN] != 0.0:
                continue
            s = int(constraints[i, WHEN])
            x, y = plan[s, _POSITION] - constraints[i, PLACE], plan[s, _POSITION + 1] - constraints[i, PLACE + 1]
            dx, dy = plan[s, _MOVED], plan[s, _MOVED + 1]
            then, near = _squared(x + dx, y + dy), constraints[i, ROW] == 0.0
            radius = constraints[i, NEED] + (constraints[i, BOUND] if near else -constraints[i, BOUND])
            if then >= radius * radius if near else then <= radius * radius and radius > 0.0:
                share = min(share, _share(x, y, dx, dy, radius))
    return 1.0 if share == 1.0 else _SHARE * share


@borrower
def _crowd(task: _Task) -> float:
    """How much more than otherwise a minimisation of the objective may leave, 1 in all but crowds.

    With hundreds of constraints Newton's method crawls, as much curvature is cut off, long after what is left is small
    beside the gap, which is their number times the barrier parameter.
    """
    share: float = (2 * task.plan.shape[0] + task.constraints.shape[0]) / _MANY
    return max(1.0, share * share)


@borrower
def _is_hopeless(task: _Task, squared: float) -> bool:
    """Whether so much is violated in a crowd that the last digits of it tell nothing."""
    return squared > _HOPELESS and _crowd(task) > 1.0


@borrower
def _minimise(task: _Task, phase: float, mu: float, dual: float, tolerance: float) -> int:
    """Newton's method with backtracking (0.05, 0.5) from the controls taken; returns the steps it took.

    Where the previous barrier parameter ``dual`` was larger, its curvature is kept for the first step.  At the
    minimum of that one, a constraint's multiplier is dual / slack; with it in the Hessian the step is the tangent of
    the central path, which lowers the slacks of active constraints to mu / dual of themselves and no further.  With
    the curvature of ``mu`` the step leaves the domain, and every reduction costs several more.
    """
    value = _evaluate(task, phase, mu, dual, math.inf)
    if not value < math.inf:  # numbers too large to be squared, or none
        return 0
    for iteration in range(_NEWTON_STEPS):
        descent = newton_step(task.stages, task.period)
        hopeless = phase == _RESTORE and _is_hopeless(task, 2.0 * value)
        enough = max(tolerance, _ROUGH * value) if hopeless else tolerance
        if not -0.5 * descent > enough:
            return iteration
        length = _longest(task, phase)
        while True:
            _try(task, length)
            limit = value + 0.05 * length * descent
            reached = _evaluate(task, phase, mu, mu, limit)
            if reached <= limit:
                break
            length *= 0.5
            if length < 1e-10:  # rounding hides any further descent
                return iteration
        _keep(task)
        gained, value = value - reached, reached
        if gained < _LITTLE * enough and (hopeless or phase == _OPTIMISE):  # else a kink may be all in the way
            return iteration + 1
    return _NEWTON_STEPS


@borrower
def _inside(task: _Task) -> bool:
    """Whether the controls taken keep f1 and f2 strictly."""
    plan = task.plan
    vx, vy = task.vx, task.vy
    for s in range(plan.shape[0]):
        ux, uy = plan[s, _TAKEN], plan[s, _TAKEN + 1]
        if not ux * ux + uy * uy < task.max_acceleration * task.max_acceleration:
            return False
        vx += task.period * ux
        vy += task.period * uy
        if s < plan.shape[0] - 1 and not vx * vx + vy * vy < task.max_speed * task.max_speed:
            return False
    return True


@borrower
def _brake(task: _Task, share: float) -> None:
    """Take controls that brake with at most ``share`` of f2's limit, and in a step with that of the speed left."""
    plan = task.plan
    speed = hypot(task.vx, task.vy)
    moving = 1e-9 < speed < math.inf
    left = speed
    for s in range(plan.shape[0]):
        push = share * min(task.max_acceleration, left / task.period) if moving else 0.0
        plan[s, _TAKEN] = -push * task.vx / speed if moving else 0.0
        plan[s, _TAKEN + 1] = -push * task.vy / speed if moving else 0.0
        left -= push * task.period


@borrower
def _restore(task: _Task) -> tuple[int, float]:
    """Minimise the squared violations: (Newton steps, the sum left of them), 0 left when strictly feasible.

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
        taken = _minimise(task, _RESTORE, mu, dual, (0.01 if last else _CLOSE) * mu)
        iterations += taken
        excess = _excess(task)
        if excess < 0.0:
            return iterations, 0.0
        left = 0.0
        for i in range(constraints.shape[0]):
            violation = max(0.0, constraints[i, VALUE])
            left += violation * violation
        if last and excess <= _SLACK:
            last, least = least == _RESTORE_ON, _RESTORE_ON
        if _is_hopeless(task, left):
            least = _ROUGH_TO * left
            last = last or mu <= least
        if last or taken == _NEWTON_STEPS:  # in circles, as it would at smaller parameters
            break
        dual, mu = mu, max(_REDUCTION * mu, least)
    # A plan that touches a bound without breaking it still ranks behind a strictly feasible one.
    return iterations, max(left, TOLERANCE * TOLERANCE)


@borrower
def _optimise(task: _Task) -> tuple[int, float]:
    """Minimise the objective within each constraint's present violation: (Newton steps, objective)."""
    constraints = task.constraints
    _excess(task)
    for i in range(constraints.shape[0]):
        value = constraints[i, VALUE]
        constraints[i, BOUND] = value + _SLACK if value >= 0.0 else 0.0
    count = 2 * task.plan.shape[0] + constraints.shape[0]
    crowd = _crowd(task)
    objective = _objective(task, 0.0)
    iterations = 0
    mu = dual = max(1e-3, _OPTIMISE_FROM * abs(objective) / count)
    while True:
        least = _GAP * max(1e-2, abs(objective)) / count
        last = not mu > 1.1 * least  # also if it is not a number
        iterations += _minimise(task, _OPTIMISE, mu, dual, (0.1 if last else _CLOSE) * crowd * mu)
        _excess(task)
        objective = _objective(task, 0.0)
        if last:
            return iterations, objective
        dual, mu = mu, max(_REDUCTION * mu, least)


@borrower
def _read(plan: Array, controls: Array) -> None:
    """Write the controls taken."""
    for s in range(plan.shape[0]):
        controls[s, 0], controls[s, 1] = plan[s, _TAKEN], plan[s, _TAKEN + 1]


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
    task, best = _new_task(problem, starts.shape[1], ROUNDING), np.empty(starts.shape[1:])
    plan = task.plan
    least, iterations = math.inf, 0
    for index in range(starts.shape[0]):
        _brake(task, 0.5)
        for s in range(plan.shape[0]):
            for c in range(2):
                plan[s, _TAKEN + c] = (1.0 - _CENTRING) * starts[index, s, c] + _CENTRING * plan[s, _TAKEN + c]
        if not _inside(task):
            continue
        left = 0.0
        if not _excess(task) < 0.0:
            taken, left = _restore(task)
            iterations += taken
        if left < least:
            least = left
            _read(plan, best)
        if least == 0.0:
            break
    if least == math.inf:
        task = _new_task(problem, starts.shape[1], math.inf)  # what is out of reach is so within f1 and f2 only
        _brake(task, 0.999)
        _read(task.plan, best)
        return best, max(0.0, _excess(task)), math.inf, iterations
    for s in range(plan.shape[0]):
        plan[s, _TAKEN], plan[s, _TAKEN + 1] = best[s, 0], best[s, 1]
    taken, objective = _optimise(task)
    _read(plan, best)
    largest = _excess(task)
    return best, largest if largest > TOLERANCE else 0.0, objective, iterations + taken
