"""Where robots and target will be, from plans and estimates of any age."""

import importlib

import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import PREFIX, spread

horizon = importlib.import_module(PREFIX + "horizon")
reachability = importlib.import_module(PREFIX + "reachability")
ukf = importlib.import_module(PREFIX + "ukf")


@pytest.mark.parametrize("d", [2, 3])
def test_peers_are_where_their_plans_take_them(random: np.random.Generator, d: int) -> None:
    ages, lengths = (0, 1, 3, 9, 25), (11, 2, 11, 1, 30)
    states, plans = random.normal(size=(5, 2 * d)), [random.normal(size=(length, d)) for length in lengths]
    made_at, radius = 7.0 - 0.1 * np.array(ages), 0.2 + 0.4 * np.arange(1, 11)
    table = np.full((5, 3 + 2 * d + d * 30), np.nan)  # what is past a plan's end is not looked at
    for row, state, made, plan in zip(table, states, made_at, plans, strict=True):
        row[: 3 + 2 * d + plan.size] = [made, d, len(plan), *state, *plan.ravel()]
    positions, distances = reachability.peer_tubes(table, 7.0, 0.1, radius, 0.4, 2.0, 3.0, d)
    for row, (age, state, plan) in enumerate(zip(ages, states, plans, strict=True)):
        place, speed, driven = state[:d], state[d:], []
        for k in range(age + 10):
            place, speed = place + 0.1 * speed, speed + 0.1 * (plan[k] if k < len(plan) else 0.0)
            driven.append(place)
        assert positions[row] == pytest.approx(np.array(driven[age:]), abs=1e-12)
        assert distances[row] == pytest.approx(2.0 + 3.0 * (radius + 0.4 * max(0, age - 1)))


def test_peers_above_and_below() -> None:
    """For a robot in the plane, a circle of the sphere around one above; for one above, another one on the ground."""
    radius = np.zeros(3)
    above = np.array([[7.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0, 1.0]])  # it climbs at 1 m/s from 3 m
    positions, distances = reachability.peer_tubes(above, 7.0, 1.0, radius, 0.0, 5.0, 1.0, 2)
    assert positions.tolist() == [[[1.0, 2.0]] * 3]
    assert distances[0] == pytest.approx([3.0, 0.0, 0.0])  # at heights of 4, 5 and 6 m
    below = np.array([[7.0, 2.0, 0.0, 1.0, 2.0, 1.0, 0.0]])
    positions, distances = reachability.peer_tubes(below, 7.0, 1.0, radius, 0.0, 5.0, 1.0, 3)
    assert positions.tolist() == [[[2.0, 2.0, 0.0], [3.0, 2.0, 0.0], [4.0, 2.0, 0.0]]]
    assert distances.tolist() == [[5.0] * 3]


@pytest.mark.parametrize("elapsed", [0.0, 0.03, 0.08, 0.1, 0.24, 0.36, -0.04, 1.17])
def test_a_peer_between_two_of_its_steps_is_on_the_line_between_them(
    random: np.random.Generator, elapsed: float
) -> None:
    state, plan, radius = random.normal(size=4), random.normal(size=(5, 2)), 0.2 + 0.4 * np.arange(1, 11)
    table = np.array([[7.0 - elapsed, 2, 5, *state, *plan.ravel()]])
    positions, distances = reachability.peer_tubes(table, 7.0, 0.1, radius, 0.4, 2.0, 3.0, 2)
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
    found = reachability.expected_target(mean, covariance, noise, is_widened, 0.5, 0.1, elapsed, 10, 2)
    transition = ukf.constant_velocity(0.1)
    for _ in range(whole):
        mean, covariance = ukf.predict(mean, covariance, transition, noise)
    mean, covariance = ukf.predict(mean, covariance, ukf.constant_velocity(0.1 * part), abs(part) * noise)
    means, covariances = reachability.propagate(
        mean, covariance, transition, noise if is_widened else 0.0 * noise, 10, 2
    )
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
    table, radius = np.array([[made_at, 2.0, 2.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]), np.ones(10)
    positions, distances = reachability.peer_tubes(table, 0.0, 0.1, radius, 0.4, 2.0, 3.0, 2)
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
            mean, covariance, noise, is_widened, 0.5, 0.1, 0.1 * age, 10, 2
        )
        every = reachability.propagate(*now, transition, is_widened * noise, 10, 2)
        assert means[0].tolist() == every[0].tolist()
        assert covariances[0].tolist() == every[1].tolist()
        assert weights @ points == pytest.approx(means[0, -1])
    # Without noise the sigma points move as the target does.
    before, _ = ukf.sigma_points(*now, 0.5)
    assert points == pytest.approx((before @ np.linalg.matrix_power(transition, 10).T)[:, :2])


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_propagate_is_repeated_prediction(random: np.random.Generator, noise: float) -> None:
    mean, covariance = random.normal(size=4), spread(random, 4)
    transition, q = ukf.constant_velocity(0.1), noise * np.diag([0.002, 0.002, 0.4, 0.4])
    means, covariances = reachability.propagate(mean, covariance, transition, q, 10, 2)
    for row, spread_row in zip(means, covariances, strict=True):
        mean, covariance = ukf.predict(mean, covariance, transition, q)
        assert row == pytest.approx(mean[:2], abs=1e-12)
        assert spread_row == pytest.approx([covariance[0, 0], covariance[0, 1], covariance[1, 1]], abs=1e-12)
