"""The working state of a solver: the plan, the function to minimise, and how far a step may go."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from ...core.elementary import log
from .compiled import Array, borrower, inlined
from .constraints import BOUND, CONSTRAINT, MARGIN, VALUE, WHEN, X, Y, certainly_kept, circle, constraints_of, term
from .horizon import REACH_GOAL, HorizonProblem
from .mutual_information import PAIRS, informed, new_points
from .newton import CONTROL, STAGE, STEP, VELOCITY, Quadratic, Vector, add, clear, put
from .terms import Term, smoothed, stay_near

_SHARE = 0.8  # largest share of the way to the nearest limit in one step

# Columns of the table of a plan, with a row for each prediction step: vectors (x, y).
_POSITION = 0
_VELOCITY = 2
_TRIED = 4  # the controls that position and velocity follow from
TAKEN = 6  # the best controls so far
_SHIFT = 8  # of the position, by a whole Newton step
_COLUMNS = 10  # number of columns


class Phase(IntEnum):
    """The function to minimise, within f1 and f2."""

    RESTORE = 0  # half the squared violations of f3-f5
    OPTIMISE = 1  # the objective, with f3-f5 kept


class Task(NamedTuple):
    """A problem for repeated evaluation: some numbers, and four working tables."""

    period: float
    position: Vector  # at step 1
    velocity: Vector
    max_speed: float
    max_acceleration: float
    seeks: bool  # the objective is eq. (2)
    goal: Array  # (n, 2) of the problem
    variance: float
    penalty: float
    reach: float
    free: int  # free controls, the last of which is held
    targets: int  # the first of the obstacles, of which the objective is eq. (5); 0 unless it is
    obstacles: Array  # (K, N, 2) of the problem
    plan: Array  # (N, 10)
    stages: Array  # of ``newton``
    constraints: Array  # of ``constraints``, those within reach
    points: Array  # of ``mutual_information``, as many for each target


@inlined
def room_for(problem: HorizonProblem, steps: int) -> int:
    """The number of numbers in the tables of a task."""
    binding: int = (1 + problem.obstacle_mean.shape[0] + problem.peer_mean.shape[0]) * problem.tube_radius.shape[0]
    points: int = problem.sigma_weights.shape[0]
    rows: int = problem.sigma_positions.shape[0]
    return steps * (_COLUMNS + STAGE) + binding * CONSTRAINT + rows * (PAIRS + 2 * points)


@borrower
def new_task(problem: HorizonProblem, steps: int, free: int, spare: float, room: Array) -> Task:
    """A task with its tables in ``room``, one after the other; for callers that do not count references either."""
    binding = (1 + problem.obstacle_mean.shape[0] + problem.peer_mean.shape[0]) * problem.tube_radius.shape[0]
    weights, seeks = problem.sigma_weights, problem.objective == REACH_GOAL
    second = steps * _COLUMNS
    third = second + steps * STAGE
    fourth = third + binding * CONSTRAINT
    for i in range(third):
        room[i] = 0.0
    plan, stages = room[:second].reshape((steps, _COLUMNS)), room[second:third].reshape((steps, STAGE))
    constraints = room[third:fourth].reshape((binding, CONSTRAINT))
    points = room[fourth:].reshape((problem.sigma_positions.shape[0], PAIRS + 2 * weights.shape[0]))
    count = targets = 0
    if not seeks and problem.obstacle_mean.shape[0] > 0:
        count = new_points(problem.sigma_positions, weights, problem.others_distance, points)
        told = problem.sigma_positions.shape[0] // max(weights.shape[0], 1)
        targets = min(told, problem.obstacle_mean.shape[0]) if count > 0 else 0
        count = count // max(told, 1) * targets
    return Task(
        period=problem.period,
        position=(problem.position[0], problem.position[1]),
        velocity=(problem.velocity[0], problem.velocity[1]),
        max_speed=problem.max_speed,
        max_acceleration=problem.max_acceleration,
        seeks=seeks,
        goal=problem.goal,
        variance=problem.measurement_variance,
        penalty=problem.range_penalty,
        reach=problem.measurement_range,
        free=free,
        targets=targets,
        obstacles=problem.obstacle_mean,
        plan=plan,
        stages=stages,
        constraints=constraints[: constraints_of(problem, spare, constraints)],
        points=points[:count],
    )


@borrower
def _drive(task: Task) -> None:
    """Compute the positions and velocities for the trial controls."""
    plan = task.plan
    (px, py), (vx, vy) = task.position, task.velocity
    for s in range(plan.shape[0]):
        plan[s, _POSITION], plan[s, _POSITION + 1] = px, py
        plan[s, _VELOCITY], plan[s, _VELOCITY + 1] = vx, vy
        px += task.period * vx
        py += task.period * vy
        vx += task.period * plan[s, _TRIED]
        vy += task.period * plan[s, _TRIED + 1]


@borrower
def move(task: Task, length: float) -> None:
    """Try the accepted controls plus a share of the Newton step."""
    plan, stages = task.plan, task.stages
    for s in range(plan.shape[0]):
        for c in range(2):
            plan[s, _TRIED + c] = plan[s, TAKEN + c] + length * stages[s, STEP + c]
    _drive(task)


@borrower
def take(task: Task) -> None:
    plan = task.plan
    for s in range(plan.shape[0]):
        for c in range(2):
            plan[s, TAKEN + c] = plan[s, _TRIED + c]


@borrower
def look(task: Task) -> float:
    """Try the accepted controls, and write the value of each of f3-f5; returns the largest.

    It is negative if all are kept strictly, and inf if one is NaN.
    """
    plan, constraints = task.plan, task.constraints
    for s in range(plan.shape[0]):
        for c in range(2):
            plan[s, _TRIED + c] = plan[s, TAKEN + c]
    _drive(task)
    largest = -math.inf
    for i in range(constraints.shape[0]):
        s = int(constraints[i, WHEN])
        value = term(constraints, i, plan[s, _POSITION], plan[s, _POSITION + 1])[0]
        constraints[i, VALUE] = value
        if not value <= largest:
            largest = value if value < math.inf else math.inf
    return largest


@inlined
def _beyond(task: Task, k: int, s: int) -> Term:
    """How far the position is beyond Dmax from an obstacle; the positive part is f6."""
    plan, obstacles = task.plan, task.obstacles
    x, y = plan[s, _POSITION], plan[s, _POSITION + 1]
    return stay_near(x, y, obstacles[k, s, 0], obstacles[k, s, 1], task.reach)


@inlined
def _informed(task: Task, k: int) -> Term:
    """-I of a target at the last position."""
    plan, last = task.plan, task.plan.shape[0] - 1
    each = task.points.shape[0] // task.targets
    points = task.points[k * each : (k + 1) * each]
    return informed(points, plan[last, _POSITION], plan[last, _POSITION + 1], task.variance)


@inlined
def _away(task: Task, s: int) -> Vector:
    """The position as seen from the goal at that step."""
    plan, goal = task.plan, task.goal
    g = min(s, goal.shape[0] - 1)
    return plan[s, _POSITION] - goal[g, 0], plan[s, _POSITION + 1] - goal[g, 1]


@borrower
def objective_of(task: Task) -> float:
    """The objective of eq. (2) or (5) with the trial controls."""
    plan = task.plan
    steps, value = plan.shape[0], 0.0
    if task.seeks:
        for s in range(steps):
            dx, dy = _away(task, s)
            value += dx * dx + dy * dy
    for k in range(task.targets):
        value += _informed(task, k)[0]
        for s in range(steps):
            value += task.penalty * max(0.0, _beyond(task, k, s)[0])
    return value


@inlined
def _less_log(value: float, product: float, mu: float) -> tuple[float, float]:
    """``value`` - mu log(``product``), with the log deferred until the product gets too small or too large."""
    if 1e-100 < product < 1e100:
        return value, product
    return value - mu * log(product), 1.0


@borrower
def _add_objective(task: Task, mu: float) -> float:
    """Add the objective to the stages, with f6 smoothed; returns its value."""
    plan, stages, gamma = task.plan, task.stages, task.penalty
    steps, value, product = plan.shape[0], 0.0, 1.0
    if task.seeks:
        for s in range(steps):
            dx, dy = _away(task, s)
            value += dx * dx + dy * dy
            add(stages, s, 2.0, 2.0, 0.0, (0.0, dx, dy, 1.0, 0.0, 1.0))
    for k in range(task.targets):
        information = _informed(task, k)
        add(stages, steps - 1, 1.0, 1.0, 0.0, information)
        value += information[0]
        for s in range(steps if gamma != 0.0 else 0):
            beyond = _beyond(task, k, s)
            t, over = smoothed(gamma, beyond[0], mu)
            value, product = _less_log(value + gamma * t, product * (t * over), mu)
            slope = mu / over
            add(stages, s, slope, slope, mu / (over * over + t * t), beyond)
    return value - mu * log(product)


@borrower
def _ball(x: float, y: float, radius: float, mu: float, dual: float) -> tuple[float, Quadratic]:
    """The barrier of f1 or f2, -mu log(1 - |(x, y)|^2 / radius^2): the argument of the log, gradient and Hessian."""
    inverse = 1.0 / (radius * radius)
    inside = 1.0 - inverse * (x * x + y * y)
    slope = 2.0 * inverse / inside
    first, second = mu * slope, dual * slope
    bend = second * slope
    return inside, (first * x, first * y, second + bend * x * x, bend * x * y, second + bend * y * y)


@borrower
def evaluate(task: Task, phase: Phase, mu: float, dual: float, limit: float) -> float:
    """The function that the current phase minimises at the trial controls, with derivatives; inf outside its domain.

    The second derivatives of the barriers are taken with ``dual`` in place of ``mu``, see ``barrier``.  If the value
    exceeds ``limit``, a smaller value above ``limit`` may be returned.
    """
    plan, stages, constraints = task.plan, task.stages, task.constraints
    clear(stages)
    value, product = 0.0, 1.0  # of all arguments of logs: one log of a product instead of many of factors
    for s in range(plan.shape[0]):
        inside, barrier = _ball(plan[s, _TRIED], plan[s, _TRIED + 1], task.max_acceleration, mu, dual)
        if not inside > 0.0:
            return math.inf
        product *= inside
        put(stages, s, CONTROL, barrier)
        if s > 0:  # the speed at step 1 is decided already
            inside, barrier = _ball(plan[s, _VELOCITY], plan[s, _VELOCITY + 1], task.max_speed, mu, dual)
            if not inside > 0.0:
                return math.inf
            product *= inside
            put(stages, s, VELOCITY, barrier)
        value, product = _less_log(value, product, mu)
    for i in range(constraints.shape[0]):
        s = int(constraints[i, WHEN])
        x, y = plan[s, _POSITION], plan[s, _POSITION + 1]
        if phase == Phase.RESTORE and certainly_kept(constraints, i, x, y):
            continue  # most are
        kept = term(constraints, i, x, y)
        slack = constraints[i, BOUND] - kept[0]
        if phase == Phase.OPTIMISE:
            if not slack > 0.0:
                return math.inf
            value, product = _less_log(value, product * slack, mu)
            slope = 1.0 / slack
            add(stages, s, mu * slope, dual * slope, dual * slope * slope, kept)
        elif not slack >= 0.0:
            value += 0.5 * slack * slack
            add(stages, s, -slack, -slack, 1.0, kept)
            if value > limit:  # the remaining terms are not negative
                break
    value -= mu * log(product)
    return value + _add_objective(task, mu) if phase == Phase.OPTIMISE else value


@borrower
def _share(x: float, y: float, dx: float, dy: float, radius: float) -> float:
    """The share of (dx, dy) from (x, y) to the circle, if the whole step crosses it."""
    a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - radius * radius
    root = math.sqrt(max(b * b - a * c, 0.0))
    if c > 0.0:  # from outside, the nearer crossing
        return c / (root - b)
    return -c / (root + b) if b > 0.0 else (root - b) / a


@inlined
def _squared(x: float, y: float) -> float:
    return x * x + y * y


@borrower
def longest_step(task: Task, phase: Phase) -> float:
    """The largest share of the step that can be taken: all of it, or ``_SHARE`` of the way to the nearest limit.

    All limits are circles except the obstacle's, whose margin changes with the direction; it is left to the
    backtracking, as a step along it is far longer than one to the circle with the present margin.
    """
    plan, stages, constraints, h = task.plan, task.stages, task.constraints, task.period
    share = 1.0
    px = py = vx = vy = 0.0
    for s in range(plan.shape[0]):
        plan[s, _SHIFT], plan[s, _SHIFT + 1] = px, py
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
    for i in range(constraints.shape[0] if phase == Phase.OPTIMISE else 0):
        if constraints[i, MARGIN] != 0.0:
            continue
        s = int(constraints[i, WHEN])
        x, y = plan[s, _POSITION] - constraints[i, X], plan[s, _POSITION + 1] - constraints[i, Y]
        dx, dy = plan[s, _SHIFT], plan[s, _SHIFT + 1]
        then, (near, radius) = _squared(x + dx, y + dy), circle(constraints, i)
        if then >= radius * radius if near else then <= radius * radius and radius > 0.0:
            share = min(share, _share(x, y, dx, dy, radius))
    return 1.0 if share == 1.0 else _SHARE * share


@borrower
def keeps_limits(task: Task) -> bool:
    """Whether the accepted controls keep f1 and f2 strictly."""
    plan = task.plan
    vx, vy = task.velocity
    for s in range(plan.shape[0]):
        ux, uy = plan[s, TAKEN], plan[s, TAKEN + 1]
        if not _squared(ux, uy) < task.max_acceleration * task.max_acceleration:
            return False
        vx += task.period * ux
        vy += task.period * uy
        if s < plan.shape[0] - 1 and not _squared(vx, vy) < task.max_speed * task.max_speed:
            return False
    return True
