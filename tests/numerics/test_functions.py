"""Terms, mutual information, objective and reachability against definitions and finite differences."""

import importlib
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

PREFIX = "epicycle.actors.robotics.numerics."
barrier = importlib.import_module(PREFIX + "barrier")
horizon = importlib.import_module(PREFIX + "horizon")
information = importlib.import_module(PREFIX + "mutual_information")
reachability = importlib.import_module(PREFIX + "reachability")
terms = importlib.import_module(PREFIX + "terms")
ukf = importlib.import_module(PREFIX + "ukf")
HorizonProblem = horizon.HorizonProblem
constraints = importlib.import_module(PREFIX + "constraints")
newton = importlib.import_module(PREFIX + "newton")
# Called by kernels only; numba looks them up as globals.
new_stages, newton_step = newton.new_stages, newton.newton_step
POSITION, VELOCITY, CONTROL, STEP = newton.POSITION, newton.VELOCITY, newton.CONTROL, newton.STEP
constraints_of, ROUNDING = constraints.constraints_of, constraints.ROUNDING

Six = tuple[float, float, float, float, float, float]


def check_derivatives(function: Callable[[float, float], Six], x: float, y: float, tolerance: float = 1e-6) -> None:
    """Gradient against differences of values, Hessian against differences of gradients."""
    step = 1e-5
    _, gx, gy, hxx, hxy, hyy = function(x, y)
    by_x = (np.array(function(x + step, y)) - function(x - step, y)) / (2 * step)
    by_y = (np.array(function(x, y + step)) - function(x, y - step)) / (2 * step)
    scale = tolerance * (1.0 + max(map(abs, (gx, gy, hxx, hxy, hyy))))
    assert [gx, gy] == pytest.approx([by_x[0], by_y[0]], abs=scale)
    assert [hxx, hxy, hyy] == pytest.approx([by_x[1], by_x[2], by_y[2]], abs=scale)
    assert by_x[2] == pytest.approx(by_y[1], abs=scale)


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(17)


def spread(random: np.random.Generator, size: int) -> np.ndarray:
    root = random.normal(size=(size, size))
    return root @ root.T + 0.05 * np.eye(size)


def test_terms(random: np.random.Generator) -> None:
    for _ in range(200):
        x, y, cx, cy = random.normal(scale=5.0, size=4)
        c = spread(random, 2)
        check_derivatives(lambda x, y, cx=cx, cy=cy: terms.stay_near(x, y, cx, cy, 1.5), x, y, 1e-5)
        check_derivatives(lambda x, y, cx=cx, cy=cy: terms.keep_away(x, y, cx, cy, 1.5), x, y, 1e-5)

        def uncertain(x: float, y: float, cx: float = cx, cy: float = cy, c: np.ndarray = c) -> Six:
            return terms.keep_away_uncertain(x, y, cx, cy, c[0, 0], c[0, 1], c[1, 1], 2.0, 2.0)

        if np.hypot(x - cx, y - cy) > 0.3:
            check_derivatives(uncertain, x, y, 1e-5)
        n = np.array([x - cx, y - cy]) / np.hypot(x - cx, y - cy)
        value = 2.0 - np.hypot(x - cx, y - cy) + 2.0 * np.sqrt(n @ c @ n)
        assert uncertain(x, y)[0] == pytest.approx(value, abs=1e-12)


def test_an_obstacle_on_top_of_the_robot_lies_along_x() -> None:
    value, gx, gy, hxx, hxy, hyy = terms.keep_away_uncertain(1.0, 2.0, 1.0, 2.0, 0.04, 0.01, 0.09, 1.0, 2.0)
    assert value == pytest.approx(1.0 + 2.0 * 0.2)
    assert gx == -1.0
    assert all(map(np.isfinite, (gy, hxx, hxy, hyy)))
    # Without a covariance's slant there is no direction to turn to, and the distance bends as one to a point does.
    _, gx, gy, hxx, hxy, hyy = terms.keep_away_uncertain(1.0, 2.0, 1.0, 2.0, 0.04, 0.0, 0.04, 1.0, 2.0)
    assert (gx, gy, hxx, hxy) == (-1.0, 0.0, 0.0, 0.0)
    assert hyy == pytest.approx(-1e9)


def information_by_definition(own: np.ndarray, others: np.ndarray, points: np.ndarray, weights: np.ndarray) -> float:
    """Eq. (5) as it is written, without the density's constant; variance 2."""
    robots = np.vstack([own[np.newaxis], others])
    ranges = np.linalg.norm(points[:, np.newaxis] - robots, axis=2)  # (M, robots)
    squares = ((ranges[:, np.newaxis] - ranges) ** 2).sum(axis=2)
    return float(-(weights * np.log((weights * np.exp(-squares / 4.0)).sum(axis=1)))[weights > 0].sum())


@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_mutual_information(random: np.random.Generator, kappa: float) -> None:
    for _ in range(50):
        state = random.normal(scale=3.0, size=4)
        points, weights = ukf.sigma_points(state, spread(random, 4), kappa)
        points = np.ascontiguousarray(points[:, :2])
        others = random.normal(scale=10.0, size=(int(random.integers(0, 4)), 2))
        own = random.normal(scale=10.0, size=2)
        distance = information.pairwise_distance(points, others[:, np.newaxis], 2.0)

        def negative(
            x: float, y: float, p: np.ndarray = points, w: np.ndarray = weights, d: np.ndarray = distance
        ) -> Six:
            return information.negative_information(x, y, p, w, d, 2.0)

        expected = -information_by_definition(own, others, points, weights)
        assert negative(*own)[0] == pytest.approx(expected, abs=1e-12)
        check_derivatives(negative, *own, tolerance=1e-5)


def test_information_on_top_of_a_sigma_point_is_finite() -> None:
    points, weights = np.array([[1.0, 2.0], [3.0, 2.0], [0.0, 5.0]]), np.array([0.5, 0.25, 0.25])
    found = information.negative_information(1.0, 2.0, points, weights, np.zeros((3, 3)), 2.0)
    assert found[0] == pytest.approx(-information_by_definition(points[0], np.empty((0, 2)), points, weights))
    assert np.isfinite(found).all()


def inform_problem(random: np.random.Generator, steps: int = 10, reach: float = 8.0) -> "horizon.HorizonProblem":
    """A free robot that is to inform itself about a target near the origin."""
    state, covariance = np.array([0.0, 0.0, 1.0, 0.5]), spread(random, 4)
    points, weights = ukf.sigma_points(state, covariance, 0.0)
    means, covariances = reachability.propagate(state, covariance, ukf.constant_velocity(0.1), np.zeros((4, 4)), steps)
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
        goal=np.zeros(2),
        sigma_positions=points,
        sigma_weights=weights,
        others_distance=np.zeros((9, 9)),
        measurement_variance=2.0,
        range_penalty=0.001,
        measurement_range=reach,
    )


def objective_by_definition(problem: "horizon.HorizonProblem", controls: np.ndarray) -> float:
    """Eqs. (2) and (5) in numpy."""
    places = horizon.trajectory(problem.position, problem.velocity, controls, problem.period, len(controls))
    if problem.objective == horizon.REACH_GOAL:
        return float(((places - problem.goal) ** 2).sum())
    excess = np.linalg.norm(places - problem.obstacle_mean[0], axis=1) - problem.measurement_range
    informed = information_by_definition(places[-1], np.empty((0, 2)), problem.sigma_positions, problem.sigma_weights)
    return float(-informed + problem.range_penalty * np.maximum(excess, 0.0).sum())


def solve(problem: "horizon.HorizonProblem", start: np.ndarray | None = None) -> "barrier.Solution":
    start = np.zeros((len(problem.tube_radius), 2)) if start is None else start
    return barrier.solve(problem, start[np.newaxis].copy())


@pytest.mark.parametrize("reach", [8.0, 3.0])
def test_the_reported_objective_is_the_papers(random: np.random.Generator, reach: float) -> None:
    for _ in range(10):
        problem = inform_problem(random, reach=reach)
        solution = solve(problem)
        expected = objective_by_definition(problem, solution.controls)
        assert solution.objective == pytest.approx(expected, abs=1e-9)
        goal = problem._replace(objective=horizon.REACH_GOAL)
        solution = solve(goal)
        assert solution.objective == pytest.approx(objective_by_definition(goal, solution.controls), abs=1e-9)


def test_an_observer_gains_information(random: np.random.Generator) -> None:
    """The sign of I in eq. (5): a plan must not know less in the end than standing still does."""
    for _ in range(10):
        problem = inform_problem(random)
        still = objective_by_definition(problem, np.zeros((10, 2)))
        assert objective_by_definition(problem, solve(problem).controls) < still


@pytest.mark.parametrize("kind", ["goal", "inform"])
def test_solution_is_stationary(random: np.random.Generator, kind: str) -> None:
    """The whole objective by finite differences: no small step within the limits improves the plan found."""
    problem = inform_problem(random, steps=6)._replace(max_speed=1e3, max_acceleration=1e3)
    if kind == "goal":
        problem = problem._replace(objective=horizon.REACH_GOAL, goal=np.array([8.0, 5.0]))
    solution = solve(problem)
    value = objective_by_definition(problem, solution.controls)
    gap = 1e-4 * max(1.0, abs(value))
    for _ in range(200):
        step = random.normal(size=(6, 2))
        trial = solution.controls + step * random.choice([1e-3, 1e-2, 0.1])
        assert objective_by_definition(problem, trial) > value - gap


def test_violations_are_the_papers(random: np.random.Generator) -> None:
    problem = inform_problem(random)._replace(
        safe_distance=2.0,
        margin=2.0,
        peer_mean=random.normal(size=(2, 10, 2)),
        peer_distance=np.full((2, 10), 3.0),
        tube_centre=random.normal(size=(10, 2)),
        tube_radius=np.linspace(0.6, 4.2, 10),
    )
    controls = random.normal(size=(10, 2))
    places = horizon.trajectory(problem.position, problem.velocity, controls, 0.1, 10)
    away = places - problem.obstacle_mean[0]
    n = away / np.linalg.norm(away, axis=1)[:, np.newaxis]
    xx, xy, yy = problem.obstacle_covariance[0].T
    sigma = np.sqrt(n[:, 0] ** 2 * xx + 2 * n[:, 0] * n[:, 1] * xy + n[:, 1] ** 2 * yy)
    expected = [
        np.linalg.norm(places - problem.tube_centre, axis=1) - problem.tube_radius,
        2.0 - np.linalg.norm(away, axis=1) + 2.0 * sigma,
        *(3.0 - np.linalg.norm(places - mean, axis=1) for mean in problem.peer_mean),
    ]
    found = constraints.violations(problem, controls)
    assert (found[:, :2] == -np.inf).all()  # decided before the first control acts
    assert found[:, 2:] == pytest.approx(np.array(expected)[:, 2:], abs=1e-12)


def test_a_tube_binds_where_it_has_a_radius(random: np.random.Generator) -> None:
    radius = np.linspace(0.6, 4.2, 10)
    radius[[4, 8]] = np.inf
    problem = inform_problem(random)._replace(obstacle_mean=np.empty((0, 10, 2)), tube_radius=radius)
    found = constraints.violations(problem, np.zeros((10, 2)))
    assert np.isinf(found[0]).nonzero()[0].tolist() == [0, 1, 4, 8]


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


def test_peers_are_where_their_plans_take_them(random: np.random.Generator) -> None:
    ages, lengths = (0, 1, 3, 9, 25), (11, 2, 11, 1, 30)
    states, plans = random.normal(size=(5, 4)), [random.normal(size=(length, 2)) for length in lengths]
    made_at, radius = 7.0 - 0.1 * np.array(ages), 0.2 + 0.4 * np.arange(1, 11)
    table = np.full((5, 6 + 2 * 30), np.nan)  # what is past a plan's end is not looked at
    for row, state, made, plan in zip(table, states, made_at, plans, strict=True):
        row[: 6 + plan.size] = [*state, made, len(plan), *plan.ravel()]
    positions, distances = reachability.peer_tubes(table, 7.0, 0.1, radius, 0.4, 2.0, 3.0)
    for row, (age, state, plan) in enumerate(zip(ages, states, plans, strict=True)):
        place, speed, driven = state[:2], state[2:], []
        for k in range(age + 10):
            place, speed = place + 0.1 * speed, speed + 0.1 * (plan[k] if k < len(plan) else 0.0)
            driven.append(place)
        assert positions[row] == pytest.approx(np.array(driven[age:]), abs=1e-12)
        assert distances[row] == pytest.approx(2.0 + 3.0 * (radius + 0.4 * max(0, age - 1)))


@pytest.mark.parametrize("elapsed", [0.0, 0.03, 0.08, 0.1, 0.24, 0.36, -0.04, 1.17])
def test_a_peer_between_two_of_its_steps_is_on_the_line_between_them(
    random: np.random.Generator, elapsed: float
) -> None:
    state, plan, radius = random.normal(size=4), random.normal(size=(5, 2)), 0.2 + 0.4 * np.arange(1, 11)
    table = np.array([[*state, 7.0 - elapsed, 5, *plan.ravel()]])
    positions, distances = reachability.peer_tubes(table, 7.0, 0.1, radius, 0.4, 2.0, 3.0)
    place, speed, steps = state[:2], state[2:], [state[:2]]
    for k in range(30):
        place, speed = place + 0.1 * speed, speed + 0.1 * (plan[k] if k < 5 else 0.0)
        steps.append(place)
    times = elapsed + 0.1 * np.arange(1, 11)
    expected = [[np.interp(time, 0.1 * np.arange(31), np.array(steps)[:, c]) for c in range(2)] for time in times]
    assert positions[0] == pytest.approx(np.array(expected), abs=1e-12)
    assert distances[0] == pytest.approx(2.0 + 3.0 * (radius + 0.4 * max(0, round(elapsed / 0.1) - 1)))


@pytest.mark.parametrize(
    ("elapsed", "whole", "part"), [(0.03, 0, 0.3), (0.23, 2, 0.3), (0.28, 2, 0.8), (-0.04, 0, -0.4)]
)
@pytest.mark.parametrize("is_widened", [False, True])
def test_an_estimate_between_two_steps_is_predicted_to_now(
    random: np.random.Generator, elapsed: float, whole: int, part: float, is_widened: bool
) -> None:
    mean, covariance, noise = random.normal(size=4), spread(random, 4), np.diag([0.002, 0.002, 0.4, 0.4])
    found = reachability.expected_target(mean, covariance, noise, is_widened, 0.5, 0.1, elapsed, 10)
    transition = ukf.constant_velocity(0.1)
    for _ in range(whole):
        mean, covariance = ukf.predict(mean, covariance, transition, noise)
    mean, covariance = ukf.predict(mean, covariance, ukf.constant_velocity(0.1 * part), abs(part) * noise)
    means, covariances = reachability.propagate(mean, covariance, transition, noise if is_widened else 0.0 * noise, 10)
    assert found[0][0] == pytest.approx(means)
    assert found[1][0] == pytest.approx(covariances)
    points, weights = ukf.sigma_points(mean, covariance, 0.5)
    moved = points @ np.linalg.matrix_power(transition, 10).T
    if is_widened:
        for _ in range(10):
            mean, covariance = ukf.predict(mean, covariance, transition, noise)
        moved, weights = ukf.sigma_points(mean, covariance, 0.5)
    assert found[2] == pytest.approx(moved[:, :2])
    assert found[3] == pytest.approx(weights)


@pytest.mark.parametrize("made_at", [-1e5, -1e12, -1.7e308])
def test_plans_from_time_immemorial_are_lost_in_the_distance_to_keep(made_at: float) -> None:
    table, radius = np.array([[1.0, 2.0, 0.0, 0.0, made_at, 2.0, 0.0, 0.0, 0.0, 0.0]]), np.ones(10)
    positions, distances = reachability.peer_tubes(table, 0.0, 0.1, radius, 0.4, 2.0, 3.0)
    assert positions == pytest.approx(np.tile([1.0, 2.0], (1, 10, 1)))
    assert distances == pytest.approx(2.0 + 3.0 * (1.0 + 0.4 * (reachability.OLDEST - 1)))


@pytest.mark.parametrize("age", [0, 1, 3, 9, 10])
def test_a_standing_plan_is_shifted_and_binds_as_far_as_it_reaches(random: np.random.Generator, age: int) -> None:
    controls, radius = random.normal(size=(10, 2)), np.arange(1.0, 11.0)
    position, velocity, moving = random.normal(size=2), random.normal(size=2), np.array([3.0, 4.0])
    begun = position, velocity, controls, 0.1 * age, radius
    centres, radii, (shifted, braking) = reachability.standing_plan(*begun, moving, 5.0, 8.0, 0.1)
    planned = horizon.trajectory(position, velocity, controls, 0.1, 10)
    assert centres[: 10 - age].tolist() == planned[age:].tolist()
    assert radii.tolist() == [*radius[: 10 - age], *[np.inf] * age]
    assert shifted.tolist() == [*controls[age:].tolist(), *[[0.0, 0.0]] * age]
    assert np.hypot(*braking[:6].T) == pytest.approx(0.95 * 8.0)  # as hard as it may until the last period
    assert moving + 0.1 * braking.sum(axis=0) == pytest.approx(np.zeros(2), abs=1e-12)
    assert not reachability.standing_plan(*begun, np.zeros(2), 0.0, 8.0, 0.1)[2][1].any()


@pytest.mark.parametrize("age", [0, 2])
def test_target_is_expected_where_prediction_takes_it(random: np.random.Generator, age: int) -> None:
    """An estimate that is as old as that is predicted with noise up to now, and from there on if it is widened."""
    mean, covariance, noise = random.normal(size=4), spread(random, 4), np.diag([0.002, 0.002, 0.4, 0.4])
    transition = ukf.constant_velocity(0.1)
    now = mean, covariance
    for _ in range(age):
        now = ukf.predict(*now, transition, noise)
    for is_widened in (True, False):
        means, covariances, points, weights = reachability.expected_target(
            mean, covariance, noise, is_widened, 0.5, 0.1, 0.1 * age, 10
        )
        every = reachability.propagate(*now, transition, is_widened * noise, 10)
        assert means[0].tolist() == every[0].tolist()
        assert covariances[0].tolist() == every[1].tolist()
        assert weights @ points == pytest.approx(means[0, -1])
    # Without noise the sigma points move as the target does.
    before, _ = ukf.sigma_points(*now, 0.5)
    assert points == pytest.approx((before @ np.linalg.matrix_power(transition, 10).T)[:, :2])


def test_trajectory_starts_at_step_one(random: np.random.Generator) -> None:
    controls = random.normal(size=(4, 2))
    places = horizon.trajectory(np.array([1.0, 2.0]), np.array([3.0, 4.0]), controls, 0.5, 4)
    assert places[:2] == pytest.approx(np.array([[1.0, 2.0], [2.5, 4.0]]))
    assert places[2] == pytest.approx(places[1] + 0.5 * (np.array([3.0, 4.0]) + 0.5 * controls[0]))


def test_velocities_add_up_the_controls(random: np.random.Generator) -> None:
    controls, velocity = random.normal(size=(6, 2)), np.array([3.0, -4.0])
    places, velocities = np.empty((6, 2)), np.empty((6, 2))
    horizon.roll_out(np.zeros(2), velocity, controls, 0.5, places, velocities)
    assert velocities == pytest.approx(velocity + 0.5 * np.cumsum(np.vstack([np.zeros((1, 2)), controls[:-1]]), axis=0))
    assert places[1:] == pytest.approx(0.5 * np.cumsum(velocities[:-1], axis=0))


def test_tube_radius_in_steps_and_seconds() -> None:
    assert reachability.tube_radius(0.2, 0.4, 1.0, 10)[[0, 9]] == pytest.approx([0.6, 4.2])
    assert reachability.tube_radius(0.2, 0.4, 0.1, 10)[[0, 9]] == pytest.approx([0.24, 0.6])


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_propagate_is_repeated_prediction(random: np.random.Generator, noise: float) -> None:
    mean, covariance = random.normal(size=4), spread(random, 4)
    transition, q = ukf.constant_velocity(0.1), noise * np.diag([0.002, 0.002, 0.4, 0.4])
    means, covariances = reachability.propagate(mean, covariance, transition, q, 10)
    for row, spread_row in zip(means, covariances, strict=True):
        mean, covariance = ukf.predict(mean, covariance, transition, q)
        assert row == pytest.approx(mean[:2], abs=1e-12)
        assert spread_row == pytest.approx([covariance[0, 0], covariance[0, 1], covariance[1, 1]], abs=1e-12)


@numba.njit
def riccati(
    position: np.ndarray, velocity: np.ndarray, control: np.ndarray, period: float, free: int
) -> tuple[float, np.ndarray]:
    stages = new_stages(len(control))
    stages[:, POSITION : POSITION + 5] = position
    stages[:, VELOCITY : VELOCITY + 5] = velocity
    stages[:, CONTROL : CONTROL + 5] = control
    return newton_step(stages, period, free), stages[:, STEP : STEP + 2].copy()


@pytest.mark.parametrize(("steps", "free"), [(3, 3), (10, 10), (40, 40), (10, 9), (10, 4), (10, 1), (40, 7)])
def test_newton_step_is_that_of_the_dense_system(random: np.random.Generator, steps: int, free: int) -> None:
    """Where the last free control is held, it is the dense system of the free ones."""
    held = np.zeros((2 * free, 2 * steps))
    for column in range(2 * steps):
        held[min(column, 2 * (free - 1) + column % 2), column] = 1.0
    for _ in range(20):
        blocks = []
        for scale in 10.0 ** random.uniform(-1.0, 1.0, size=3):
            curvature = [scale * spread(random, 2) for _ in range(steps)]
            blocks.append([(*random.normal(size=2), c[0, 0], c[0, 1], c[1, 1]) for c in curvature])
        gradient, hessian = np.zeros(2 * steps), np.zeros((2 * steps, 2 * steps))
        for kind, table in enumerate(np.array(blocks)):
            for s, (gx, gy, xx, xy, yy) in enumerate(table):
                # What P_s, V_s or U_s is of all controls, from the dynamics with a unit control each.
                units = np.eye(2 * steps).reshape(2 * steps, steps, 2)
                driven = [
                    horizon.trajectory(np.zeros(2), np.zeros(2), each, 0.1, steps + 1)[[s, s + 1]] for each in units
                ]
                reached = (
                    np.array([each[0] for each in driven]),
                    np.array([(each[1] - each[0]) / 0.1 for each in driven]),
                    units[:, s],
                )[kind]
                gradient += reached @ [gx, gy]
                hessian += reached @ np.array([[xx, xy], [xy, yy]]) @ reached.T
        descent, step = riccati(*np.array(blocks), 0.1, free)
        expected = held.T @ np.linalg.solve(held @ hessian @ held.T, -held @ gradient)
        assert step.ravel() == pytest.approx(expected, rel=1e-8, abs=1e-10)
        assert descent == pytest.approx(gradient @ expected)


@pytest.mark.parametrize("curvature", [(-1.0, 0.0, -2.0), (1.0, 2.0, 1.0), (np.nan, 0.0, 1.0)])
def test_where_the_cost_of_controls_is_no_bowl_there_is_no_descent(curvature: tuple[float, float, float]) -> None:
    flat, controls = np.zeros((3, 5)), np.array([[1.0, 1.0, 1.0, 0.0, 1.0]] * 3)
    assert riccati(flat, flat, controls, 0.1, 3)[0] < 0.0
    controls[1, 2:] = curvature
    assert riccati(flat, flat, controls, 0.1, 3)[0] == 0.0


def test_a_start_that_is_too_fast_on_the_way_is_left_out(random: np.random.Generator) -> None:
    """It is slow enough at the end, and the plan is to be so all the way."""
    problem = crowded_problem(random)._replace(velocity=np.array([6.0, 0.0]))
    fast = np.zeros((10, 2))
    fast[:4, 0], fast[4:, 0] = 7.0, -7.0  # 8.8 m/s after the fourth, and 4.6 at the end
    found = solve(problem, fast)
    assert found.controls[:, 0].max() < 0.0
    assert (found.objective, found.iterations) == (np.inf, 0)


@numba.njit
def kept_and_all(*fields: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    problem = HorizonProblem(*fields)
    every, kept = constraints_of(problem, np.inf).astype(np.int64), constraints_of(problem, ROUNDING).astype(np.int64)
    return every[:, 0], every[:, 1], kept[:, 0], kept[:, 1]


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
            values = constraints.violations(problem, controls)
            assert all(values[pair] < 0.0 for pair in left)
    assert dropped > 1000


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
