"""What the tests of the kernels share: problems, their objective by definition, and derivatives by differences."""

import importlib
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

from epicycle.actors import DoubleIntegrator, Inform, Objective, Problem, ReachGoal

PREFIX = "epicycle.actors.robotics.numerics."
importlib.import_module(PREFIX + "compiled").jit()  # which functions compiled here may call
barrier = importlib.import_module(PREFIX + "barrier")
definitions = importlib.import_module(PREFIX + "definitions")
horizon = importlib.import_module(PREFIX + "horizon")
reachability = importlib.import_module(PREFIX + "reachability")
ukf = importlib.import_module(PREFIX + "ukf")

# Called by kernels only; numba looks them up as globals.
information = importlib.import_module(PREFIX + "mutual_information")
informed, new_points, point_columns = information.informed, information.new_points, information.point_columns

Floats = tuple[float, ...]


def packed(matrix: np.ndarray) -> Floats:
    """The rows of the upper triangle of a symmetric matrix, as the kernels take it."""
    return tuple(matrix[np.triu_indices(len(matrix))].tolist())


def check_derivatives(function: Callable[[Floats], Floats], at: np.ndarray, tolerance: float = 1e-6) -> None:
    """Gradient against differences of values, Hessian against differences of gradients."""
    step, d = 1e-5, len(at)
    found = np.array(function(tuple(at.tolist())))
    gradient, hessian = found[1 : 1 + d], np.empty((d, d))
    hessian[np.triu_indices(d)] = found[1 + d :]
    scale = tolerance * (1.0 + abs(found[1:]).max())
    for axis, unit in enumerate(step * np.eye(d)):
        slope = (np.array(function(tuple((at + unit).tolist()))) - function(tuple((at - unit).tolist()))) / (2 * step)
        assert gradient[axis] == pytest.approx(slope[0], abs=scale)
        assert hessian[axis, axis:] == pytest.approx(slope[1 + axis : 1 + d], abs=scale)
        assert hessian[:axis, axis] == pytest.approx(slope[1 : 1 + axis], abs=scale)


@numba.njit
def negative_information(
    at: Floats, points: np.ndarray, weights: np.ndarray, others_distance: np.ndarray, variance: float
) -> Floats:
    table = np.empty((len(weights), point_columns(len(at), len(weights))))
    return informed(table[: new_points(points, weights, others_distance, table, at)], at, variance)


def spread(random: np.random.Generator, size: int) -> np.ndarray:
    root = random.normal(size=(size, size))
    return root @ root.T + 0.05 * np.eye(size)


def inform_problem(random: np.random.Generator, steps: int = 10, reach: float = 8.0) -> "horizon.HorizonProblem":
    """A free robot that is to inform itself about a target near the origin."""
    state, covariance = np.array([0.0, 0.0, 1.0, 0.5]), spread(random, 4)
    points, weights = ukf.sigma_points(state, covariance, 0.0)
    transition = ukf.constant_velocity(0.1)
    means, covariances = reachability.propagate(state, covariance, transition, np.zeros((4, 4)), steps, 2)
    points = np.ascontiguousarray(points[:, :2])
    return horizon.HorizonProblem(
        period=0.1,
        position=np.array([6.0, 5.0]),
        velocity=np.zeros(2),
        max_speed=16.0,
        max_acceleration=16.0,
        tube_centre=np.zeros((steps, 2)),
        tube_radius=np.full(steps, np.inf),
        safe_distance=0.1,
        margin=0.0,
        obstacle_mean=means[np.newaxis],
        obstacle_covariance=covariances[np.newaxis],
        peer_mean=np.empty((0, steps, 2)),
        peer_distance=np.empty((0, steps)),
        objective=horizon.INFORM,
        goal=np.zeros((1, 2)),
        sigma_positions=points,
        sigma_weights=weights,
        others_distance=np.zeros((9, 9)),
        measurement_variance=2.0,
        range_penalty=0.001,
        measurement_range=reach,
    )


def crowded_problem(random: np.random.Generator) -> "horizon.HorizonProblem":
    """Peers, tube and obstacle at any distance."""
    steps, peers = 10, 6
    problem = inform_problem(random)
    position, velocity = random.normal(scale=6.0, size=2), random.uniform(-5.5, 5.5, size=2)
    coasting = position + 0.1 * np.arange(steps)[:, np.newaxis] * velocity
    return problem._replace(
        position=position,
        velocity=velocity,
        max_speed=8.0,
        max_acceleration=8.0,
        safe_distance=2.0,
        margin=2.0,
        tube_centre=coasting + random.normal(scale=0.3, size=2),
        tube_radius=0.2 + 0.4 * np.arange(1, steps + 1),
        peer_mean=random.normal(scale=12.0, size=(peers, 1, 2)) + np.zeros((peers, steps, 2)),
        peer_distance=np.full((peers, steps), 3.0),
        objective=horizon.REACH_GOAL,
    )


def as_problem(
    numbers: "horizon.HorizonProblem", ends: np.ndarray | None = None, objective: Objective | None = None
) -> Problem:
    """What the kernels take, said by a dynamics and an objective; the other robots, who measure, end at ``ends``."""
    d, steps = len(numbers.position), len(numbers.tube_radius)
    climb = {name: min(getattr(numbers, name), 1e6) for name in ("climb_speed", "climb_acceleration")}
    motion = DoubleIntegrator(
        dimensions=d, max_speed=numbers.max_speed, max_acceleration=numbers.max_acceleration, **climb
    )
    if objective is None and numbers.objective == horizon.REACH_GOAL:
        (goal,) = numbers.goal
        objective = ReachGoal(goal=goal)
    elif objective is None:
        objective = Inform(
            range=numbers.measurement_range, penalty=numbers.range_penalty, variance=numbers.measurement_variance
        )
    others = np.empty((0, steps, d)) if ends is None else np.repeat(ends[:, np.newaxis], steps, axis=1)
    return Problem(
        dynamics=motion,
        objective=objective,
        names=tuple(f"other{i}" for i in range(len(others))),
        period=numbers.period,
        state=np.concatenate([numbers.position, numbers.velocity]),
        tube_centre=numbers.tube_centre,
        tube_radius=numbers.tube_radius,
        safe_distance=numbers.safe_distance,
        margin=numbers.margin,
        obstacle_mean=numbers.obstacle_mean,
        obstacle_covariance=numbers.obstacle_covariance,
        peer_mean=np.concatenate([others, numbers.peer_mean]),
        peer_distance=np.concatenate([np.full((len(others), steps), -1e6), numbers.peer_distance]),
        samples=numbers.sigma_positions,
        weights=numbers.sigma_weights,
        lowest=numbers.lowest,
        highest=numbers.highest,
    )


def informing(
    problem: "horizon.HorizonProblem", objective: Inform, ends: np.ndarray | None = None, **fields: Any
) -> "horizon.HorizonProblem":
    """The problem with another objective of eq. (5), and others who measure at their ``ends``."""
    return problem._replace(**objective.pose(as_problem(problem, ends)._replace(**fields)))


def ways(problem: "horizon.HorizonProblem", controls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (N, d) at steps 1..N."""
    d, state = len(problem.position), np.concatenate([problem.position, problem.velocity])
    states = DoubleIntegrator(dimensions=d).trajectory(state, controls, problem.period)
    return states[:, :d], states[:, d:]


def violations(problem: "horizon.HorizonProblem", controls: np.ndarray) -> np.ndarray:
    """f3 to f5 and f7 by their definitions, a row each."""
    found: np.ndarray = definitions.constraints(problem, ways(problem, controls)[0])
    return found


def objective_by_definition(
    problem: "horizon.HorizonProblem", controls: np.ndarray, ends: np.ndarray | None = None
) -> float:
    return float(as_problem(problem, ends).cost(controls))


def solve(problem: "horizon.HorizonProblem", start: np.ndarray | None = None) -> "barrier.Solution":
    start = np.zeros((len(problem.tube_radius), 2)) if start is None else start
    return barrier.solve(problem, start[np.newaxis].copy())
