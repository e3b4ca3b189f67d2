"""Which constraints a solver is given: those that a plan within f1 and f2 can break."""

import importlib
from typing import Any

import numba
import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import PREFIX, crowded_problem, inform_problem, solve, violations

constraints = importlib.import_module(PREFIX + "constraints")
horizon = importlib.import_module(PREFIX + "horizon")
HorizonProblem = horizon.HorizonProblem
# Called by kernels only; numba looks them up as globals.
constraints_of, ROUNDING, columns = constraints.constraints_of, constraints.ROUNDING, constraints.constraint_columns


@numba.njit
def kept_and_all(*fields: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    problem = HorizonProblem(*fields)
    others = 1 + len(problem.obstacle_mean) + len(problem.peer_mean)
    tables = np.empty((2, others * len(problem.tube_radius), columns(2)))
    every = tables[0, : constraints_of(problem, np.inf, tables[0], (0.0, 0.0))].astype(np.int64)
    kept = tables[1, : constraints_of(problem, ROUNDING, tables[1], (0.0, 0.0))].astype(np.int64)
    return every[:, 0], every[:, 1], kept[:, 0], kept[:, 1]


def test_the_largest_variance_of_a_place(random: np.random.Generator) -> None:
    """In the plane it is exact, in space a bound."""
    for d in (2, 3):
        root = random.normal(size=(d, d))
        covariance = root @ root.T
        found, most = constraints._largest(tuple(covariance[np.triu_indices(d)])), np.linalg.eigvalsh(covariance)[-1]
        assert found == pytest.approx(most) if d == 2 else most <= found <= 1.8 * most


@pytest.mark.slow
def test_a_tube_binds_where_it_has_a_radius(random: np.random.Generator) -> None:
    radius = np.linspace(0.6, 4.2, 10)
    radius[[4, 8]] = np.inf
    problem = inform_problem(random)._replace(obstacle_mean=np.empty((0, 10, 2)), tube_radius=radius)
    row, step, _, _ = kept_and_all(*problem)
    assert (row.tolist(), step.tolist()) == ([0] * 6, [2, 3, 5, 6, 7, 9])


@pytest.mark.slow
@pytest.mark.parametrize("step", [2, 3, 9])
@pytest.mark.parametrize("limit", ["speed", "acceleration"])
@pytest.mark.parametrize("tube", [False, True])
def test_what_is_left_out_is_just_out_of_reach(random: np.random.Generator, step: int, limit: str, tube: bool) -> None:
    """A robot at (1, 2) with (3, 4) m/s, which may go 8 m/s or push with 8 m/s^2, whatever the other."""
    place, velocity, away = np.array([1.0, 2.0]), np.array([3.0, 4.0]), np.array([0.8, -0.6])
    if limit == "speed":
        begun, reach = place + 0.1 * velocity, (step - 1) * 0.1 * 8.0
    else:
        begun, reach = place + step * 0.1 * velocity, 0.5 * 8.0 * 0.01 * step * (step - 1)
    limits = {"max_speed": 8.0, "max_acceleration": 1e6} if limit == "speed" else {"max_speed": 1e6}
    kept = []
    for nearer in (-1e-3, 1e-3):
        problem = inform_problem(random)._replace(
            position=place, velocity=velocity, max_acceleration=8.0, obstacle_mean=np.empty((0, 10, 2))
        )
        problem = problem._replace(**limits, objective=horizon.REACH_GOAL)
        if tube:  # whose middle is so far off that only just it is reached
            radius = np.full(10, np.inf)
            radius[step] = 20.0 + reach + nearer
            problem = problem._replace(tube_centre=np.tile(begun + 20.0 * away, (10, 1)), tube_radius=radius)
        else:
            distance = np.full((1, 10), -1e6)
            distance[0, step] = 2.0 - nearer
            peer = np.tile(begun + (2.0 + reach) * away, (1, 10, 1))
            problem = problem._replace(peer_mean=peer, peer_distance=distance)
        kept.append([int(each) for each in kept_and_all(*problem)[3]])
    assert kept == [[step], []]


@pytest.mark.slow
def test_what_is_left_out_no_plan_can_break(random: np.random.Generator) -> None:
    dropped = 0
    for _ in range(200):
        problem = crowded_problem(random)
        row, step, kept_row, kept_step = kept_and_all(*problem)
        kept = set(zip(kept_row, kept_step, strict=True))
        every = set(zip(row, step, strict=True))
        left = every - kept
        dropped += len(left)
        assert kept < every
        for _ in range(20):  # as hard as f2 allows, in one direction or in many, for as long as f1 allows
            angle = random.uniform(0.0, 2.0 * np.pi, size=1 if random.random() < 0.5 else 10) + np.zeros(10)
            controls = 8.0 * np.column_stack([np.cos(angle), np.sin(angle)])
            speed = problem.velocity.copy()
            for s in range(10):
                controls[s] *= next(
                    f for f in (1.0, 0.5, 0.2, 0.0) if np.hypot(*(speed + 0.1 * f * controls[s])) <= 8.0
                )
                speed += 0.1 * controls[s]
            values = violations(problem, controls)
            assert all(values[other, step - 2] < 0.0 for other, step in left)
    assert dropped > 1000


@pytest.mark.slow
def test_who_is_out_of_reach_changes_no_bit(random: np.random.Generator) -> None:
    alone = 0
    for _ in range(30):
        problem = crowded_problem(random)
        _, _, kept_row, _ = kept_and_all(*problem)
        near = [peer for peer in range(6) if 2 + peer in set(kept_row)]
        fewer = problem._replace(
            peer_mean=problem.peer_mean[near].copy(), peer_distance=problem.peer_distance[near].copy()
        )
        assert solve(problem).controls.tobytes() == solve(fewer).controls.tobytes()
        alone += 6 - len(near)
    assert alone > 30
