"""A horizon problem as a solver works on it: a plan's table, what is minimised over it, and how far a step may go.

f6 = max(0, d - Dmax) has a kink.  It is the value of ``min t, t >= 0, t >= d - Dmax``; putting both bounds of t into
the barrier and eliminating t in closed form gives a smooth function that tends to f6 with the barrier parameter.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...core.elementary import log
from .compiled import borrower, inlined, inner
from .constraints import BOUND, MARGIN, NEED, PLACE, ROW, VALUE, WHEN, certainly_kept, constraints_of, term
from .horizon import REACH_GOAL, HorizonProblem
from .mutual_information import informed, new_points
from .newton import CONTROL, STEP, VELOCITY, add, clear, new_stages
from .terms import Term, stay_near
from .typing import Array

RESTORE, OPTIMISE = 0.0, 1.0  # phases; numba would compile everything once for each of two integers
_SHARE = 0.8  # of the way to the nearest limit that a step goes at most

# Columns of the table of a plan, a row for each prediction step; each is x and y.
_POSITION = 0
_VELOCITY = 2
_TRIED = 4  # the controls that position and velocity follow from
TAKEN = 6  # the best controls so far
_MOVED = 8  # of the position, by a whole step
_OBSTACLE = 10  # whom f6 is about
_COLUMNS = 12


class Task(NamedTuple):
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
    free: int  # controls, the last of which is held
    plan: Array  # (N, 12)
    stages: Array  # of ``newton``
    constraints: Array  # those within reach
    points: Array  # sigma points, of ``mutual_information``


@inner
def new_task(problem: HorizonProblem, steps: int, free: int, spare: float) -> Task:
    plan = np.zeros((steps, _COLUMNS))
    informs = problem.objective != REACH_GOAL and problem.obstacle_mean.shape[0] > 0
    if informs:
        points = new_points(problem.sigma_positions, problem.sigma_weights, problem.others_distance)
        for s in range(steps):
            plan[s, _OBSTACLE] = problem.obstacle_mean[0, s, 0]
            plan[s, _OBSTACLE + 1] = problem.obstacle_mean[0, s, 1]
    else:
        points = plan[:0]
    return Task(
        problem.period, problem.position[0], problem.position[1], problem.velocity[0], problem.velocity[1],
        problem.max_speed, problem.max_acceleration, problem.objective == REACH_GOAL, problem.goal[0], problem.goal[1],
        informs,
        problem.measurement_variance, problem.range_penalty, problem.measurement_range,
        free, plan, new_stages(steps), constraints_of(problem, spare), points,
    )  # fmt: skip


@borrower
def _drive(task: Task) -> None:
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
def move(task: Task, length: float) -> None:
    """Go so much of the step from the controls taken."""
    plan, stages = task.plan, task.stages
    for s in range(plan.shape[0]):
        for c in range(2):
            plan[s, _TRIED + c] = plan[s, TAKEN + c] + length * stages[s, STEP + c]
    _drive(task)


@borrower
def take(task: Task) -> None:
    """Take the controls tried."""
    plan = task.plan
    for s in range(plan.shape[0]):
        plan[s, TAKEN], plan[s, TAKEN + 1] = plan[s, _TRIED], plan[s, _TRIED + 1]


@borrower
def excess_of(task: Task) -> float:
    """The largest value of f3-f5 with the controls taken: negative if all are kept strictly, inf if one is none."""
    plan, constraints = task.plan, task.constraints
    for s in range(plan.shape[0]):
        plan[s, _TRIED], plan[s, _TRIED + 1] = plan[s, TAKEN], plan[s, TAKEN + 1]
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
def objective_of(task: Task, mu: float) -> float:
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
def evaluate(task: Task, phase: float, mu: float, dual: float, limit: float) -> float:
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
    if phase == RESTORE:
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
    return value - mu * log(product) + objective_of(task, mu)


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
def longest_step(task: Task, phase: float) -> float:
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
        x, y, dx, dy = plan[s, TAKEN], plan[s, TAKEN + 1], stages[s, STEP], stages[s, STEP + 1]
        if _squared(x + dx, y + dy) >= task.max_acceleration * task.max_acceleration:
            share = min(share, _share(x, y, dx, dy, task.max_acceleration))
        vx += h * dx
        vy += h * dy
    if phase == OPTIMISE:
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
def keeps_limits(task: Task) -> bool:
    """Whether the controls taken keep f1 and f2 strictly."""
    plan = task.plan
    vx, vy = task.vx, task.vy
    for s in range(plan.shape[0]):
        ux, uy = plan[s, TAKEN], plan[s, TAKEN + 1]
        if not ux * ux + uy * uy < task.max_acceleration * task.max_acceleration:
            return False
        vx += task.period * ux
        vy += task.period * uy
        if s < plan.shape[0] - 1 and not vx * vx + vy * vy < task.max_speed * task.max_speed:
            return False
    return True
