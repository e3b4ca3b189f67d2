"""The compiled kernels against the paper's equations as ``definitions.py`` has them, and docs/paper.md's table."""

import importlib
import inspect
import math
import re
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from epicycle.actors import Inform
from tests.actors.robotics.numerics import test_association
from tests.actors.robotics.numerics.numerics_parts import (
    PREFIX,
    inform_problem,
    informing,
    negative_information,
    objective_by_definition,
    packed,
    solve,
    spread,
    violations,
    ways,
)

constraints = importlib.import_module(PREFIX + "constraints")
definitions = importlib.import_module(PREFIX + "definitions")
horizon = importlib.import_module(PREFIX + "horizon")
information = importlib.import_module(PREFIX + "mutual_information")
reachability = importlib.import_module(PREFIX + "reachability")
task = importlib.import_module(PREFIX + "task")
terms = importlib.import_module(PREFIX + "terms")
ukf = importlib.import_module(PREFIX + "ukf")
# Called by kernels only; numba looks them up as globals.
HorizonProblem, constraints_of, term = horizon.HorizonProblem, constraints.constraints_of, constraints.term
constraint_columns = constraints.constraint_columns
ellipsoid, keeps_limits, new_task, smoothed = task._ellipsoid, task.keeps_limits, task.new_task, terms.smoothed
ACCEPTED = task.ACCEPTED
room_for = task.room_for
read = importlib.import_module(PREFIX + "vectors").read

PAPER = Path(__file__).parents[4] / "docs" / "paper.md"


def test_the_target_s_model(random: np.random.Generator) -> None:
    state = random.normal(size=4)
    after = definitions.target_after(state, 0.1)
    assert after == pytest.approx([state[0] + 0.1 * state[2], state[1] + 0.1 * state[3], state[2], state[3]])
    assert ukf.constant_velocity(0.1) @ state == pytest.approx(after, abs=1e-15)


def test_a_roaming_target() -> None:
    """Two spans are one of both lengths; many short steps of v' = v - v h / T + noise tend to it."""
    first, second, both = (definitions.integrated_ou(1.5, 2.0, t, math.exp(-t / 2.0)) for t in (0.3, 0.9, 1.2))
    assert second[0] @ first[0] == pytest.approx(both[0], abs=1e-14)
    assert second[0] @ first[1] @ second[0].T + second[1] == pytest.approx(both[1], abs=1e-14)
    h, transition, gained = 1e-4, np.eye(4), np.zeros((4, 4))
    step = ukf.constant_velocity(h) - np.diag([0, 0, h / 2.0, h / 2.0])
    for _ in range(12_000):
        transition, gained = step @ transition, step @ gained @ step.T
        gained[[2, 3], [2, 3]] += 1.5**2 * h / 2.0
    assert transition == pytest.approx(both[0], abs=1e-4)
    assert gained == pytest.approx(both[1], abs=1e-4)
    assert np.diag(definitions.integrated_ou(1.5, 2.0, 100.0, 0.0)[1])[2:] == pytest.approx([1.125, 1.125])


def test_dynamics(random: np.random.Generator) -> None:
    """Step 1 is given; the first unknown control moves the robot at step 3."""
    position, velocity, controls = random.normal(size=2), random.normal(size=2), random.normal(size=(6, 2))
    states = [np.concatenate([position, velocity])]
    for control in controls[:-1]:
        states.append(np.array(definitions.dynamics(states[-1], control, 0.5)))
    positions, velocities = np.hsplit(np.array(states), 2)
    assert positions[:3] == pytest.approx(
        np.array([position, position + 0.5 * velocity, position + velocity + 0.25 * controls[0]])
    )
    assert velocities == pytest.approx(velocity + 0.5 * np.cumsum(np.vstack([np.zeros((1, 2)), controls[:-1]]), axis=0))
    assert horizon.trajectory(position, velocity, controls, 0.5, 6) == pytest.approx(positions, abs=1e-14)


@numba.njit
def inside(v: tuple[float, ...], radius: float, ratio: float) -> float:
    return ellipsoid(v, radius, ratio, 1.0, 1.0)[0]


def test_limits_of_speed_and_acceleration(random: np.random.Generator) -> None:
    vectors = random.normal(scale=5.0, size=(200, 2))
    found = [inside(tuple(each), 8.0, 1.0) for each in vectors.tolist()]
    assert definitions.f1(vectors, 8.0) == pytest.approx(-64.0 * np.array(found), abs=1e-12)
    assert definitions.f2(vectors, 8.0) == pytest.approx((vectors**2).sum(axis=1) - 64.0)


def test_limits_of_climbing(random: np.random.Generator) -> None:
    vectors = random.normal(scale=5.0, size=(200, 3))
    found = [inside(tuple(each), 8.0, 8.0 / 2.0) for each in vectors.tolist()]
    assert definitions.f1(vectors, 8.0, 2.0) == pytest.approx(-64.0 * np.array(found), abs=1e-12)
    assert definitions.f2(np.array([[8.0, 0.0, 0.0], [0.0, 0.0, 2.0]]), 8.0, 2.0).tolist() == [0.0, 0.0]
    assert definitions.f2(vectors, 8.0).tolist() == definitions.f2(vectors[:, :2], 8.0).tolist()  # without a limit


@numba.njit
def room_of(*fields: Any) -> int:
    return room_for(HorizonProblem(*fields), 10, 2)


@numba.njit(_nrt=False)
def keeps(controls: np.ndarray, room: np.ndarray, *fields: Any) -> bool:
    posed = new_task(HorizonProblem(*fields), len(controls), len(controls), np.inf, room, (0.0, 0.0))
    for s in range(len(controls)):
        posed.plan[s, 2 * ACCEPTED], posed.plan[s, 2 * ACCEPTED + 1] = controls[s, 0], controls[s, 1]
    return keeps_limits(posed)


@pytest.mark.slow
def test_who_keeps_the_limits(random: np.random.Generator) -> None:
    """The speed at step 1 is decided already."""
    kept = []
    for _ in range(200):
        problem = inform_problem(random)._replace(velocity=random.normal(scale=3.0, size=2), max_speed=5.0)
        problem = problem._replace(max_acceleration=8.0)
        controls = random.normal(scale=3.0, size=(10, 2))
        velocities = ways(problem, controls)[1][1:]
        worst = max(definitions.f1(velocities, 5.0).max(), definitions.f2(controls, 8.0).max())
        assert keeps(controls, np.empty(room_of(*problem)), *problem) == (worst < 0.0)
        kept.append(worst < 0.0)
    assert 20 < sum(kept) < 180


@pytest.mark.parametrize("d", [2, 3])
def test_distances_and_their_margins(random: np.random.Generator, d: int) -> None:
    for _ in range(100):
        own, other = random.normal(scale=5.0, size=(2, d))
        here, there, c = own[np.newaxis], other[np.newaxis], spread(random, d)
        distance = np.linalg.norm(own - other)
        sigma = definitions.sigma_4(here, there, np.array([packed(c)]))[0]
        n = (own - other) / distance
        assert sigma == pytest.approx(np.sqrt(n @ c @ n))
        assert definitions.f3(here, there, 1.5)[0] == pytest.approx(distance - 1.5)
        assert definitions.f4(here, there, 1.5)[0] == pytest.approx(1.5 - distance)
        at, place = tuple(own.tolist()), tuple(other.tolist())
        assert terms.stay_near(at, place, 1.5)[0] == pytest.approx(definitions.f3(here, there, 1.5)[0], abs=1e-12)
        assert terms.keep_away(at, place, 1.5)[0] == pytest.approx(definitions.f5(here, there, 1.5)[0], abs=1e-12)
        robust = terms.keep_away_uncertain(at, place, packed(c), 2.0, 3.0)[0]
        assert robust == pytest.approx(definitions.f4(here, there, 2.0)[0] + 3.0 * sigma, abs=1e-12)


def test_radii_of_reachability_sets() -> None:
    steps = np.arange(1, 11)
    assert definitions.sigma_r(0.2, 0.4, steps)[[0, 9]] == pytest.approx([0.6, 4.2])
    assert definitions.sigma_r(0.2, 0.4, 0.1 * steps)[[0, 9]] == pytest.approx([0.24, 0.6])


@pytest.mark.parametrize("lost", [0, 1, 7])
def test_a_peer_that_is_not_heard_is_given_more_room(lost: int) -> None:
    radius = definitions.sigma_r(0.2, 0.4, np.arange(1, 11))
    table = np.array(
        [[7.0 - 0.1 * (1 + lost), 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
    )  # of the period before, when none is lost
    distances = reachability.peer_tubes(table, 7.0, 0.1, radius, 0.4, 2.0, 3.0, 2)[1]
    assert distances[0] == pytest.approx(2.0 + 3.0 * definitions.sigma_5(radius, 0.4, lost))


@pytest.mark.slow
@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_mutual_information(random: np.random.Generator, kappa: float) -> None:
    for _ in range(50):
        points, weights = ukf.sigma_points(random.normal(scale=3.0, size=4), spread(random, 4), kappa)
        points, heavy = np.ascontiguousarray(points[:, :2]), weights > 0.0
        others = random.normal(scale=10.0, size=(int(random.integers(0, 4)), 2))
        own = random.normal(scale=10.0, size=2)
        distance = information.pairwise_distance(points, others[:, np.newaxis], 2.0)
        assert distance == pytest.approx(definitions.misfit(points, others, 2.0), abs=1e-12)
        found = negative_information(tuple(own.tolist()), points, weights, distance, 2.0)[0]
        expected = definitions.mutual_information(
            own, points[heavy], weights[heavy], 2.0, distance[np.ix_(heavy, heavy)]
        )
        assert found == pytest.approx(-expected, abs=1e-12)
        # As eq. (5) is written, for all robots at once, variance 2 and without the density's constant.
        ranges = np.linalg.norm(points[:, np.newaxis] - np.vstack([own[np.newaxis], others]), axis=2)
        squares = ((ranges[:, np.newaxis] - ranges) ** 2).sum(axis=2)
        written = (weights * np.log((weights * np.exp(-squares / 4.0)).sum(axis=1)))[heavy].sum()
        assert expected == pytest.approx(-written, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("along", "across"), [(0.04, 4.0), (2.0, 2.0), (4.0, 0.5)])
def test_information_of_ranges_and_directions(random: np.random.Generator, along: float, across: float) -> None:
    """What the kernels are given for the whole ellipse of eq. (1) is what the definition says, in polar coordinates."""
    for _ in range(20):
        points, weights = ukf.sigma_points(random.normal(scale=2.0, size=4), spread(random, 4), 1.0)
        points = np.ascontiguousarray(points[:, :2])
        others, own = random.normal(scale=10.0, size=(2, 2)), random.normal(scale=10.0, size=2)
        exponent = np.zeros((len(points), len(points)))
        for robot in (own, *others):
            seen = points - robot
            z, bearing = np.linalg.norm(seen, axis=1), np.arctan2(seen[:, 1], seen[:, 0])
            turn = bearing[:, np.newaxis] - bearing
            chord = 4.0 * z[:, np.newaxis] * z * np.sin(turn / 2.0) ** 2
            exponent += (z[:, np.newaxis] - z) ** 2 / (2.0 * along) + chord / (2.0 * across)
        written = -(weights * np.log((weights * np.exp(-exponent)).sum(axis=1))).sum()
        misfit = definitions.misfit(points, others, along, across)
        assert definitions.mutual_information(own, points, weights, along, misfit, across) == pytest.approx(written)
        objective = Inform(variance=along, across=across)
        posed = informing(inform_problem(random), objective, others, samples=points, weights=weights)
        given = (tuple(own.tolist()), points, weights, posed.others_distance, posed.measurement_variance)
        assert negative_information(*given)[0] == pytest.approx(-written, abs=1e-12)


@numba.njit
def excess(gamma: float, g: float, mu: float) -> tuple[float, float]:
    return smoothed(gamma, g, mu)


@pytest.mark.parametrize("g", [-30.0, -1.0, -1e-9, 0.0, 1e-9, 1.0, 30.0])
@pytest.mark.parametrize("gamma", [1e-3, 1.0])
def test_f6_without_its_kink(gamma: float, g: float) -> None:
    """It is where the barriers of both its bounds have their minimum, and tends to max(0, g)."""
    for mu in (1.0, 1e-4, 1e-8):
        t, over = excess(gamma, g, mu)
        assert t > 0.0
        assert over > 0.0
        assert t - over == pytest.approx(g, abs=1e-6 * max(t, over))
        assert mu / t + mu / over == pytest.approx(gamma)
        assert 0.0 <= t - max(0.0, g) <= 2.0 * mu / gamma
    here, there = np.array([[40.0 + g, 0.0]]), np.zeros((1, 2))
    assert definitions.f6(here, there, 40.0) == pytest.approx([max(0.0, g)], abs=1e-12)


@numba.njit
def all_values(positions: np.ndarray, zero: tuple[float, ...], rows: int, *fields: Any) -> np.ndarray:
    table = np.empty((rows * len(positions), constraint_columns(len(zero))))
    table = table[: constraints_of(HorizonProblem(*fields), np.inf, table, zero)]
    found = np.full((rows, len(positions)), np.nan)
    for i in range(len(table)):
        s = int(table[i, 1])
        found[int(table[i, 0]), s] = term(table, i, read(zero, positions, s, 0))[0]
    return found


@pytest.mark.slow
def test_constraints_with_their_margins(random: np.random.Generator) -> None:
    problem = inform_problem(random)._replace(
        safe_distance=2.0,
        margin=2.0,
        peer_mean=random.normal(size=(2, 10, 2)),
        peer_distance=np.full((2, 10), 3.0),
        tube_centre=random.normal(size=(10, 2)),
        tube_radius=np.linspace(0.6, 4.2, 10),
    )
    controls = random.normal(size=(10, 2))
    places = ways(problem, controls)[0]
    away = places - problem.obstacle_mean[0]
    n = away / np.linalg.norm(away, axis=1)[:, np.newaxis]
    xx, xy, yy = problem.obstacle_covariance[0].T
    sigma = np.sqrt(n[:, 0] ** 2 * xx + 2 * n[:, 0] * n[:, 1] * xy + n[:, 1] ** 2 * yy)
    written = [
        np.linalg.norm(places - problem.tube_centre, axis=1) - problem.tube_radius,
        2.0 - np.linalg.norm(away, axis=1) + 2.0 * sigma,
        *(3.0 - np.linalg.norm(places - mean, axis=1) for mean in problem.peer_mean),
    ]
    expected = violations(problem, controls)
    assert expected == pytest.approx(np.array(written)[:, 2:], abs=1e-12)
    found = all_values(places, (0.0, 0.0), 4, *problem)
    assert np.isnan(found[:, :2]).all()  # decided before the first control acts
    assert found[:, 2:] == pytest.approx(expected, abs=1e-12)


@pytest.mark.slow
def test_constraints_in_space(random: np.random.Generator) -> None:
    """Own plan, obstacle and peer, and the lowest and the highest height."""
    cloud = spread(random, 3)
    problem = inform_problem(random)._replace(
        position=random.normal(size=3),
        velocity=random.normal(size=3),
        safe_distance=2.0,
        margin=2.0,
        obstacle_mean=random.normal(size=(1, 10, 3)),
        obstacle_covariance=np.tile(packed(cloud), (1, 10, 1)),
        peer_mean=random.normal(size=(1, 10, 3)),
        peer_distance=np.full((1, 10), 3.0),
        tube_centre=random.normal(size=(10, 3)),
        tube_radius=np.linspace(0.6, 4.2, 10),
        climb_speed=2.0,
        climb_acceleration=2.0,
        lowest=-1.0,
        highest=1.5,
    )
    controls = random.normal(size=(10, 3))
    places = ways(problem, controls)[0]
    away = places - problem.obstacle_mean[0]
    n = away / np.linalg.norm(away, axis=1)[:, np.newaxis]
    written = [
        np.linalg.norm(places - problem.tube_centre, axis=1) - problem.tube_radius,
        2.0 - np.linalg.norm(away, axis=1) + 2.0 * np.sqrt(((n @ cloud) * n).sum(axis=1)),
        3.0 - np.linalg.norm(places - problem.peer_mean[0], axis=1),
        -1.0 - places[:, 2],
        places[:, 2] - 1.5,
    ]
    expected = violations(problem, controls)
    assert expected == pytest.approx(np.array(written)[:, 2:], abs=1e-12)
    found = all_values(places, (0.0, 0.0, 0.0), 5, *problem)
    assert found[:, 2:] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("reach", [8.0, 3.0])
def test_the_reported_objective(random: np.random.Generator, reach: float) -> None:
    for _ in range(10):
        problem = inform_problem(random, reach=reach)
        solution = solve(problem)
        expected = objective_by_definition(problem, solution.controls)
        assert solution.objective == pytest.approx(expected, abs=1e-9)
        for rows in (1, 10):  # a goal that stands still, and one that moves
            goal = problem._replace(objective=horizon.REACH_GOAL, goal=random.normal(size=(rows, 2)))
            solution = solve(goal)
            places = ways(goal, solution.controls)[0]
            assert solution.objective == pytest.approx(definitions.f0(places, goal.goal).sum(), abs=1e-9)


def test_staying_near_several(random: np.random.Generator) -> None:
    """It is to be at their weighted mean, which is where the weighted sum of f0 is least, at every step."""
    for _ in range(20):
        places, weights = random.normal(scale=9.0, size=(3, 10, 2)), random.uniform(0.1, 3.0, size=3)
        station = definitions.common_goal(places, weights)
        least = definitions.f0_of_several(station, places, weights)
        assert least == pytest.approx(
            sum(w * definitions.f0(station, each) for w, each in zip(weights, places, strict=True))
        )
        for _ in range(10):
            positions = random.normal(scale=9.0, size=(10, 2))
            found = definitions.f0_of_several(positions, places, weights)
            assert found - least == pytest.approx(weights.sum() * definitions.f0(positions, station))


def several_targets(
    random: np.random.Generator, count: int, reach: float
) -> tuple["horizon.HorizonProblem", np.ndarray]:
    """A robot that is to inform itself about several targets, and where a peer ends that measures, too."""
    each = [inform_problem(random, reach=reach) for _ in range(count)]
    shifts = random.normal(scale=5.0, size=(count, 2))
    posed = each[0]._replace(
        obstacle_mean=np.concatenate([one.obstacle_mean + shift for one, shift in zip(each, shifts, strict=True)]),
        obstacle_covariance=np.concatenate([one.obstacle_covariance for one in each]),
    )
    points = np.concatenate([one.sigma_positions + shift for one, shift in zip(each, shifts, strict=True)])
    ends = random.normal(scale=8.0, size=(1, 2))
    return informing(posed, Inform(range=reach, penalty=0.01), ends, samples=points), ends


@pytest.mark.parametrize("reach", [8.0, 3.0])
def test_what_is_minimised_for_several_targets(random: np.random.Generator, reach: float) -> None:
    """Eq. (5) for each target, and their sum; one of them alone is as it always was."""
    for count in (1, 2, 5):
        problem, ends = several_targets(random, count, reach)
        solution = solve(problem)
        assert solution.objective == pytest.approx(objective_by_definition(problem, solution.controls, ends), abs=1e-9)
        alone = [
            problem._replace(
                obstacle_mean=problem.obstacle_mean[k : k + 1],
                sigma_positions=problem.sigma_positions[9 * k : 9 * k + 9],
                others_distance=problem.others_distance[9 * k : 9 * k + 9],
            )
            for k in range(count)
        ]
        together = sum(objective_by_definition(each, solution.controls, ends) for each in alone)
        assert solution.objective == pytest.approx(together, abs=1e-9)
        assert solution.violation == 0.0
        for _ in range(20):  # and it is a minimum
            other = np.clip(solution.controls + random.normal(scale=0.3, size=(10, 2)), -11.0, 11.0)
            if violations(problem, other).max() <= 0.0:
                assert objective_by_definition(problem, other, ends) > solution.objective - 1e-3


def test_the_information_about_independent_targets_is_the_sum(random: np.random.Generator) -> None:
    """By the definition of eq. (5), for the pairs of sigma points of two targets, each with its own measurement."""
    robot, weights = random.normal(size=(1, 2)), np.array([0.5, 0.3, 0.2])
    first, second = random.normal(scale=3.0, size=(2, 3, 2))
    ranges = np.array([[*definitions.measured_range(np.array([a, b]), robot[0])] for a in first for b in second])
    both = np.array([one * other for one in weights for other in weights])
    misfit = ((ranges[:, np.newaxis] - ranges) ** 2).sum(axis=-1) / 4.0
    joint = -(both * np.log((both * np.exp(-misfit)).sum(axis=1))).sum()
    none = np.zeros((3, 3))
    each = [definitions.mutual_information(robot[0], points, weights, 2.0, none) for points in (first, second)]
    assert joint == pytest.approx(sum(each))


def test_the_table_of_the_equations() -> None:
    """Every definition is in it, and what it names is there."""
    tests = {**globals(), **vars(test_association)}
    rows = re.findall(
        r"^\| \([\w ,]+\).*? \| `(\w+)` \| (.*) \| (.*) \|$", PAPER.read_text("utf-8"), flags=re.MULTILINE
    )
    written = {name for name, each in vars(definitions).items() if inspect.isfunction(each) and name[0] != "_"}
    assert {name for name, _, _ in rows} == written
    for _, kernels, checks in rows:
        for module, name in re.findall(r"`(\w+)\.(\w+)`", kernels):
            assert hasattr(importlib.import_module(PREFIX + module), name), f"{module}.{name}"
        named = re.findall(r"`(test_\w+)`", checks)
        assert named
        assert all(name in tests for name in named), named
