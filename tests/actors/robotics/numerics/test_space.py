"""The solver in three dimensions: against itself in a plane, against IPOPT, and its limits of climbing and height."""

import importlib
from typing import Any

import numpy as np
import pytest

from epicycle.actors.robotics.numerics.horizon import numbers_of
from tests.actors.robotics.numerics.numerics_parts import (
    PREFIX,
    as_problem,
    barrier,
    definitions,
    horizon,
    inform_problem,
    reachability,
    spread,
    ukf,
    violations,
    ways,
)
from tests.actors.robotics.scenario import play

information = importlib.import_module(PREFIX + "mutual_information")
STEPS = 10


def lifted(vectors: np.ndarray, height: float = 0.0) -> np.ndarray:
    """Vectors of the plane at a height."""
    return np.concatenate([vectors, np.full((*vectors.shape[:-1], 1), height)], axis=-1)


def in_space(problem: "horizon.HorizonProblem", height: float = 0.0) -> "horizon.HorizonProblem":
    """The same problem at a height, where climbing is as fast as driving."""
    flat = problem.obstacle_covariance
    covariance = np.zeros((*flat.shape[:-1], 6))
    covariance[..., [0, 1, 3]] = flat
    return problem._replace(
        position=lifted(problem.position, height),
        velocity=lifted(problem.velocity),
        tube_centre=lifted(problem.tube_centre, height),
        obstacle_mean=lifted(problem.obstacle_mean, height),
        obstacle_covariance=covariance,
        peer_mean=lifted(problem.peer_mean, height),
        goal=lifted(problem.goal, height),
        sigma_positions=lifted(problem.sigma_positions, height),
        climb_speed=problem.max_speed,
        climb_acceleration=problem.max_acceleration,
    )


@pytest.fixture(scope="module")
def records() -> list[Any]:
    """Problems of runs."""
    return [record for run in ((0, 30.0, 0.0, 1), (3, 10.0, 0.25, 3)) for record in play(*run, steps=40)[0]][::4]


def test_what_lies_in_a_plane_is_solved_as_in_the_plane(records: list[Any]) -> None:
    """Nothing draws the plan out of the plane.  Steps on the way may differ, and so may the optimum that is found."""
    same = near = 0
    for posed, starts, ours in records:
        problem = numbers_of(posed)
        found = barrier.solve(in_space(problem, 3.0), lifted(starts))
        expected = barrier.solve(problem, starts)
        assert ours.controls.shape == (len(problem.tube_radius), 2)
        assert not found.controls[:, 2].any()
        assert found.violation == pytest.approx(expected.violation, abs=1e-4)
        same += found.objective == pytest.approx(expected.objective, rel=1e-3, abs=1e-3)
        near += np.abs(found.controls[:, :2] - expected.controls).max() < 1e-3
    assert len(records) >= 40
    assert same >= 0.96 * len(records)
    assert near >= 0.8 * len(records)


def flight(random: np.random.Generator, informs: bool) -> tuple["horizon.HorizonProblem", np.ndarray | None]:
    """A robot between two heights that climbs slowly, with a target on the ground, another one that flies, and a
    peer; and where the others end who measure."""
    plane, steps = inform_problem(random, STEPS, reach=4.0), np.arange(STEPS)[:, np.newaxis]
    problem = in_space(plane)
    own, velocity = np.array([6.0, 5.0, 4.0]), random.uniform(-3.0, 3.0, size=3) * [1.0, 1.0, 0.3]
    coasting, other = own + 0.1 * steps * velocity, own + np.array([-2.5, -2.0, 0.5])
    points = np.ascontiguousarray(problem.sigma_positions)
    ends = random.normal(scale=6.0, size=(2, 3))
    cloud = np.linalg.cholesky(0.02 * spread(random, 3))
    covariance = (cloud @ cloud.T)[np.triu_indices(3)]
    problem = problem._replace(
        position=own,
        velocity=velocity,
        max_speed=6.0,
        max_acceleration=10.0,
        climb_speed=2.0,
        climb_acceleration=4.0,
        lowest=3.0,
        highest=5.0,
        tube_centre=coasting,
        tube_radius=0.5 + 0.4 * np.arange(1, STEPS + 1),
        safe_distance=1.5,
        margin=1.0,
        obstacle_mean=np.concatenate([problem.obstacle_mean, np.tile(other, (1, STEPS, 1))]),
        obstacle_covariance=np.concatenate([problem.obstacle_covariance, np.tile(covariance, (1, STEPS, 1))]),
        peer_mean=np.tile(own + np.array([0.5, -2.6, -0.5]), (1, STEPS, 1)),
        peer_distance=np.full((1, STEPS), 1.5),
    )
    if informs:
        others = information.pairwise_distance(points, ends[:, np.newaxis], 2.0)
        return problem._replace(others_distance=others, objective=horizon.INFORM), ends
    return aimed(problem, own + random.normal(scale=4.0, size=3)), None


def aimed(problem: "horizon.HorizonProblem", goal: np.ndarray) -> "horizon.HorizonProblem":
    """The problem with a goal."""
    return problem._replace(objective=horizon.REACH_GOAL, goal=goal[np.newaxis])


@pytest.mark.slow
@pytest.mark.parametrize("informs", [False, True])
def test_against_ipopt_in_space(random: np.random.Generator, informs: bool) -> None:
    """The rule of test_solver.py."""
    pytest.importorskip("casadi")
    ipopt = importlib.import_module("epicycle.actors.robotics.casadi_solver").solve
    same = 0
    for _ in range(12):
        problem, ends = flight(random, informs)
        start, posed = np.zeros((1, STEPS, 3)), as_problem(problem, ends)
        ours, theirs = barrier.solve(problem, start), ipopt(posed, start)
        worst = violations(problem, ours.controls).max()
        assert worst <= 1e-6
        assert ours.violation == 0.0
        velocities = ways(problem, ours.controls)[1][1:]
        assert definitions.f1(velocities, 6.0, 2.0).max() <= 0.0
        assert definitions.f2(ours.controls, 10.0, 4.0).max() <= 0.0
        if ours.objective > theirs.objective + 1e-3 * max(1.0, abs(theirs.objective)):
            again = ipopt(posed, ours.controls[np.newaxis])  # another local optimum
            assert again.objective > ours.objective - 1e-3 * max(1.0, abs(ours.objective))
        same += abs(ours.objective - theirs.objective) <= 1e-3 * max(1.0, abs(theirs.objective))
    assert same >= 9


@pytest.mark.parametrize(("aim", "level"), [(20.0, 5.0), (-20.0, 3.0)])
def test_a_plan_ends_at_the_limit_of_the_height(random: np.random.Generator, aim: float, level: float) -> None:
    problem = flight(random, informs=False)[0]._replace(
        velocity=np.zeros(3), obstacle_mean=np.empty((0, STEPS, 3)), peer_mean=np.empty((0, STEPS, 3)),
        tube_radius=np.full(STEPS, np.inf), period=0.3,
    )  # fmt: skip
    problem = aimed(problem, problem.position + np.array([0.0, 0.0, aim]))
    solution = barrier.solve(problem, np.zeros((1, STEPS, 3)))
    heights = ways(problem, solution.controls)[0][:, 2]
    assert heights[-1] == pytest.approx(level, abs=1e-2)
    assert 3.0 <= heights.min() <= heights.max() <= 5.0


def test_who_begins_outside_the_heights_comes_back(random: np.random.Generator) -> None:
    """As far as f1 and f2 allow."""
    problem = flight(random, informs=False)[0]._replace(
        position=np.array([0.0, 0.0, 9.0]), velocity=np.zeros(3), tube_radius=np.full(STEPS, np.inf),
        obstacle_mean=np.empty((0, STEPS, 3)), peer_mean=np.empty((0, STEPS, 3)),
    )  # fmt: skip
    problem = aimed(problem, problem.position)
    solution = barrier.solve(problem, np.zeros((1, STEPS, 3)))
    heights = ways(problem, solution.controls)[0][:, 2]
    assert solution.violation == pytest.approx(heights[2] - 5.0)
    assert heights[-1] < 9.0 - 0.1 * 2.0 * 4  # most of the way at the largest speed


def test_a_flying_target_is_expected_in_space(random: np.random.Generator) -> None:
    """A state of six numbers; the ground's robots see it from below, as they see that of their own plane."""
    state, covariance, noise = random.normal(size=6), spread(random, 6), np.diag([0.01] * 3 + [0.1] * 3)
    means, covariances, points, weights = reachability.expected_target(
        state, covariance, noise, True, 0.5, 0.1, 0.0, 4, 3
    )
    transition = ukf.constant_velocity(0.1, 3)
    mean, then = state, covariance
    for s in range(4):
        mean, then = transition @ mean, transition @ then @ transition.T + noise
        assert means[0, s] == pytest.approx(mean[:3])
        assert covariances[0, s] == pytest.approx(then[:3, :3][np.triu_indices(3)])
    assert weights @ points == pytest.approx(mean[:3])
    below = reachability.expected_target(state, covariance, noise, True, 0.5, 0.1, 0.0, 4, 2)
    assert below[0] == pytest.approx(means[:, :, :2])
    assert below[1] == pytest.approx(covariances[:, :, [0, 1, 3]])
    assert below[2] == pytest.approx(points[:, :2])


def test_a_target_on_the_ground_is_expected_there(random: np.random.Generator) -> None:
    state, covariance = random.normal(size=4), spread(random, 4)
    plane = reachability.expected_target(state, covariance, np.zeros((4, 4)), False, 0.5, 0.1, 0.0, 4, 2)
    space = reachability.expected_target(state, covariance, np.zeros((4, 4)), False, 0.5, 0.1, 0.0, 4, 3)
    assert space[0].tolist() == lifted(plane[0]).tolist()
    assert space[1][:, :, [0, 1, 3]].tolist() == plane[1].tolist()
    assert not space[1][:, :, [2, 4, 5]].any()
    assert space[2].tolist() == lifted(plane[2]).tolist()
