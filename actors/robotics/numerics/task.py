"""The working state of a solver: the plan, the function to minimise, and how far a step may go."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from ...core.elementary import log
from .compiled import Array, borrower, inlined
from .constraints import (
    AWAY,
    BOUND,
    DISTANCE,
    KIND,
    LEVEL,
    PLACE,
    VALUE,
    WHEN,
    ball,
    certainly_kept,
    constraint_columns,
    constraints_of,
    subjects,
    term,
)
from .horizon import REACH_GOAL, HorizonProblem
from .mutual_information import informed, new_points, point_columns
from .newton import add, clear, control_column, stage_columns, step_column, velocity_column
from .terms import smoothed, stay_near
from .vectors import (
    Quadratic,
    Term,
    Vector,
    dot,
    less,
    packed,
    plus,
    read,
    replaced,
    squared,
    steeper,
    total,
    write,
    zero_quadratic,
    zero_term,
    zero_vector,
)

_SHARE = 0.8  # largest share of the way to the nearest limit in one step

# The table of a plan has a row for each prediction step, of vectors; each begins at the dimensions times its number.
_POSITION = 0
_VELOCITY = 1
_TRIED = 2  # the controls that position and velocity follow from
ACCEPTED = 3  # the best controls so far
_SHIFT = 4  # of the position, by a whole Newton step
_VECTORS = 5  # number of vectors


class Phase(IntEnum):
    """The function to minimise, within f1 and f2."""

    RESTORE = 0  # half the squared violations of f3-f5
    OPTIMISE = 1  # the objective, with f3-f5 kept


class Task(NamedTuple):
    """A problem for repeated evaluation: some numbers, and four working tables."""

    period: float
    position: Vector  # at step 1; its length is the number of dimensions
    velocity: Vector
    max_speed: float
    max_acceleration: float
    speed_ratio: float  # of the largest speed to that of climbing: times this, a height is as if it were a length
    acceleration_ratio: float
    seeks: bool  # the objective is eq. (2)
    goal: Array  # (n, 2) of the problem
    variance: float
    penalty: float
    reach: float
    free: int  # free controls, the last of which is held
    targets: int  # the first of the obstacles, of which the objective is eq. (5); 0 unless it is
    obstacles: Array  # (K, N, d) of the problem
    plan: Array  # (N, 5 d)
    stages: Array  # of ``newton``
    constraints: Array  # of ``constraints``, those within reach
    points: Array  # of ``mutual_information``, as many for each target


@inlined
def room_for(problem: HorizonProblem, steps: int, d: int) -> int:
    """The number of numbers in the tables of a task."""
    binding: int = subjects(problem, d) * problem.tube_radius.shape[0]
    points: int = problem.sigma_weights.shape[0]
    rows: int = problem.sigma_positions.shape[0]
    columns: int = point_columns(d, points)
    return steps * (_VECTORS * d + stage_columns(d)) + binding * constraint_columns(d) + rows * columns


@borrower
def new_task(problem: HorizonProblem, steps: int, free: int, spare: float, room: Array, zero: Vector) -> Task:
    """A task with its tables in ``room``, one after the other; for callers that do not count references either.

    ``zero`` is a vector of zeros: its type is that of all vectors.
    """
    d, binding = len(zero), subjects(problem, len(zero)) * problem.tube_radius.shape[0]
    weights, seeks = problem.sigma_weights, problem.objective == REACH_GOAL
    second = steps * _VECTORS * d
    third = second + steps * stage_columns(d)
    fourth = third + binding * constraint_columns(d)
    for i in range(third):
        room[i] = 0.0
    plan, stages = room[:second].reshape((steps, _VECTORS * d)), room[second:third].reshape((steps, stage_columns(d)))
    constraints = room[third:fourth].reshape((binding, constraint_columns(d)))
    points = room[fourth:].reshape((problem.sigma_positions.shape[0], point_columns(d, weights.shape[0])))
    count = targets = 0
    if not seeks and problem.obstacle_mean.shape[0] > 0:
        count = new_points(problem.sigma_positions, weights, problem.others_distance, points, zero)
        told = problem.sigma_positions.shape[0] // max(weights.shape[0], 1)
        targets = min(told, problem.obstacle_mean.shape[0]) if count > 0 else 0
        count = count // max(told, 1) * targets
    position = velocity = zero
    for c in range(d):
        position, velocity = replaced(position, c, problem.position[c]), replaced(velocity, c, problem.velocity[c])
    return Task(
        period=problem.period,
        position=position,
        velocity=velocity,
        max_speed=problem.max_speed,
        max_acceleration=problem.max_acceleration,
        speed_ratio=problem.max_speed / problem.climb_speed,
        acceleration_ratio=problem.max_acceleration / problem.climb_acceleration,
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
        constraints=constraints[: constraints_of(problem, spare, constraints, zero)],
        points=points[:count],
    )


@inlined
def at(task: Task, s: int, vector: int) -> Vector:
    """A vector of the plan at step ``s``."""
    return read(task.position, task.plan, s, vector * len(task.position))


@inlined
def store(task: Task, s: int, vector: int, value: Vector) -> None:
    write(task.plan, s, vector * len(task.position), value)


@borrower
def _drive(task: Task) -> None:
    """Compute the positions and velocities for the trial controls."""
    p, v = task.position, task.velocity
    for s in range(task.plan.shape[0]):
        store(task, s, _POSITION, p)
        store(task, s, _VELOCITY, v)
        p = plus(p, task.period, v)
        v = plus(v, task.period, at(task, s, _TRIED))


@borrower
def move(task: Task, length: float) -> None:
    """Try the accepted controls plus a share of the Newton step."""
    d = len(task.position)
    for s in range(task.plan.shape[0]):
        step = read(task.position, task.stages, s, step_column(d))
        store(task, s, _TRIED, plus(at(task, s, ACCEPTED), length, step))
    _drive(task)


@borrower
def accept(task: Task) -> None:
    for s in range(task.plan.shape[0]):
        store(task, s, ACCEPTED, at(task, s, _TRIED))


@borrower
def check_constraints(task: Task) -> float:
    """Try the accepted controls, and write the value of each of f3-f5 and f7; returns the largest.

    It is negative if all are kept strictly, and inf if one is NaN.
    """
    constraints = task.constraints
    for s in range(task.plan.shape[0]):
        store(task, s, _TRIED, at(task, s, ACCEPTED))
    _drive(task)
    largest = -math.inf
    for i in range(constraints.shape[0]):
        value = term(constraints, i, at(task, int(constraints[i, WHEN]), _POSITION))[0]
        constraints[i, VALUE] = value
        if not value <= largest:
            largest = value if value < math.inf else math.inf
    return largest


@inlined
def _beyond(task: Task, k: int, s: int) -> Term:
    """How far the position is beyond Dmax from an obstacle; the positive part is f6."""
    target = task.position
    for c in range(len(target)):
        target = replaced(target, c, task.obstacles[k, s, c])
    return stay_near(at(task, s, _POSITION), target, task.reach)


@inlined
def _informed(task: Task, k: int) -> Term:
    """-I of a target at the last position."""
    each = task.points.shape[0] // task.targets
    points = task.points[k * each : (k + 1) * each]
    return informed(points, at(task, task.plan.shape[0] - 1, _POSITION), task.variance)


@inlined
def _away(task: Task, s: int) -> Vector:
    """The position as seen from the goal at that step; a goal without a height is on the ground."""
    away, goal = at(task, s, _POSITION), task.goal
    g = min(s, goal.shape[0] - 1)
    for c in range(len(away)):
        away = replaced(away, c, away[c] - (goal[g, c] if c < goal.shape[1] else 0.0))
    return away


@borrower
def objective_of(task: Task) -> float:
    """The objective of eq. (2) or (5) with the trial controls."""
    steps, value = task.plan.shape[0], 0.0
    if task.seeks:
        for s in range(steps):
            value += squared(_away(task, s))
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
    stages, gamma, d = task.stages, task.penalty, len(task.position)
    steps, value, product = task.plan.shape[0], 0.0, 1.0
    if task.seeks:
        for s in range(steps):
            offset, halved = _away(task, s), zero_term(task.position)
            value += squared(offset)
            for c in range(d):
                halved = replaced(replaced(halved, 1 + c, offset[c]), 1 + d + packed(d, c, c), 1.0)
            add(stages, s, 2.0, 2.0, 0.0, halved)
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
def _ellipsoid(v: Vector, radius: float, ratio: float, mu: float, dual: float) -> tuple[float, Quadratic]:
    """The barrier of f1 or f2, -mu log(1 - |S v|^2 / radius^2), where S multiplies the height by ``ratio``: the
    argument of the log, gradient and Hessian."""
    d, function = len(v), zero_quadratic(v)
    inverse = 1.0 / (radius * radius)
    weighted = steeper(v, ratio * ratio)
    inside = 1.0 - inverse * dot(v, weighted)
    slope = 2.0 * inverse / inside
    first, second = mu * slope, dual * slope
    bend = second * slope
    for i in range(d):
        function = replaced(function, i, first * weighted[i])
        for j in range(i, d):
            curvature = bend * weighted[i] * weighted[j]
            if i == j:
                curvature = (second if i < 2 else second * (ratio * ratio)) + curvature
            function = replaced(function, d + packed(d, i, j), curvature)
    return inside, function


@borrower
def evaluate(task: Task, phase: Phase, mu: float, dual: float, limit: float) -> float:
    """The function that the current phase minimises at the trial controls, with derivatives; inf outside its domain.

    The second derivatives of the barriers are taken with ``dual`` in place of ``mu``, see ``barrier``.  If the value
    exceeds ``limit``, a smaller value above ``limit`` may be returned.
    """
    stages, constraints, d = task.stages, task.constraints, len(task.position)
    clear(stages, task.position)
    value, product = 0.0, 1.0  # of all arguments of logs: one log of a product instead of many of factors
    for s in range(task.plan.shape[0]):
        inside, barrier = _ellipsoid(at(task, s, _TRIED), task.max_acceleration, task.acceleration_ratio, mu, dual)
        if not inside > 0.0:
            return math.inf
        product *= inside
        write(stages, s, control_column(d), barrier)
        if s > 0:  # the speed at step 1 is decided already
            inside, barrier = _ellipsoid(at(task, s, _VELOCITY), task.max_speed, task.speed_ratio, mu, dual)
            if not inside > 0.0:
                return math.inf
            product *= inside
            write(stages, s, velocity_column(d), barrier)
        value, product = _less_log(value, product, mu)
    for i in range(constraints.shape[0]):
        s = int(constraints[i, WHEN])
        position = at(task, s, _POSITION)
        if phase == Phase.RESTORE and certainly_kept(constraints, i, position):
            continue  # most are
        kept = term(constraints, i, position)
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
def _share(v: Vector, step: Vector, radius: float) -> float:
    """The share of a ``step`` from ``v`` to the sphere, if the whole step crosses it."""
    a, b, c = squared(step), dot(v, step), squared(v) - radius * radius
    root = math.sqrt(max(b * b - a * c, 0.0))
    if c > 0.0:  # from outside, the nearer crossing
        return c / (root - b)
    return -c / (root + b) if b > 0.0 else (root - b) / a


@borrower
def longest_step(task: Task, phase: Phase) -> float:
    """The largest share of the step that can be taken: all of it, or ``_SHARE`` of the way to the nearest limit.

    All limits are spheres or levels except the obstacle's, whose margin changes with the direction; it is left to the
    backtracking, as a step along it is far longer than one to the sphere with the present margin.
    """
    stages, constraints, h, d = task.stages, task.constraints, task.period, len(task.position)
    share = 1.0
    p = v = zero_vector(task.position)
    for s in range(task.plan.shape[0]):
        store(task, s, _SHIFT, p)
        start, step = steeper(at(task, s, _VELOCITY), task.speed_ratio), steeper(v, task.speed_ratio)
        if squared(total(start, step)) >= task.max_speed * task.max_speed and s > 0:
            share = min(share, _share(start, step, task.max_speed))
        p = plus(p, h, v)
        change = read(task.position, stages, s, step_column(d))
        start, step = steeper(at(task, s, ACCEPTED), task.acceleration_ratio), steeper(change, task.acceleration_ratio)
        if squared(total(start, step)) >= task.max_acceleration * task.max_acceleration:
            share = min(share, _share(start, step, task.max_acceleration))
        v = plus(v, h, change)
    for i in range(constraints.shape[0] if phase == Phase.OPTIMISE else 0):
        s, kind = int(constraints[i, WHEN]), constraints[i, KIND]
        if kind <= AWAY:
            start = less(at(task, s, _POSITION), read(task.position, constraints, i, PLACE))
            step = at(task, s, _SHIFT)
            then, (near, radius) = squared(total(start, step)), ball(constraints, i)
            if then >= radius * radius if near else then <= radius * radius and radius > 0.0:
                share = min(share, _share(start, step, radius))
        elif d == 3 and kind == LEVEL:
            sign = constraints[i, DISTANCE]
            above = sign * (at(task, s, _POSITION)[d - 1] - constraints[i, PLACE + d - 1])
            slack, rise = constraints[i, BOUND] - above, sign * at(task, s, _SHIFT)[d - 1]
            if rise >= slack:
                share = min(share, slack / rise)
    return 1.0 if share == 1.0 else _SHARE * share


@borrower
def keeps_limits(task: Task) -> bool:
    """Whether the accepted controls keep f1 and f2 strictly."""
    v, steps = task.velocity, task.plan.shape[0]
    for s in range(steps):
        u = at(task, s, ACCEPTED)
        if not squared(steeper(u, task.acceleration_ratio)) < task.max_acceleration * task.max_acceleration:
            return False
        v = plus(v, task.period, u)
        if s < steps - 1 and not squared(steeper(v, task.speed_ratio)) < task.max_speed * task.max_speed:
            return False
    return True
