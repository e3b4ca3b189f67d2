"""Robots that fly: their limits, what they see past what stands on the ground, and the packaged model."""

import importlib
import math

import numpy as np
import pytest

from epicycle.actors import BodyState, DoubleIntegrator, Estimate, Measurement, Plan, Sensor
from epicycle.actors.robotics.sight import disturbed
from epicycle.actors.testing import Harness
from epicycle.runner import Results, Simulation, load_model

sight = importlib.import_module("epicycle.actors.robotics.sight")
dynamics = importlib.import_module("epicycle.actors.robotics.dynamics")
ukf = importlib.import_module("epicycle.actors.robotics.numerics.ukf")


def test_lines_of_sight_against_their_points() -> None:
    """Whether one of many points of the line is in a cylinder; lines that just touch one are left out."""
    random, hidden = np.random.default_rng(5), 0
    shares = np.linspace(0.0, 1.0, 20001)[:, np.newaxis]
    for _ in range(300):
        eye, target = random.uniform(-6.0, 6.0, size=(2, 3))
        eye[2], target[2] = random.uniform(0.0, 6.0), random.choice([0.0, 2.0])
        x, y, radius, height = random.normal(), random.normal(), random.uniform(0.3, 2.0), random.uniform(0.5, 4.0)
        points = eye + shares * (target - eye)
        away = np.hypot(points[:, 0] - x, points[:, 1] - y) - radius
        found = [bool(((away < edge) & (points[:, 2] < height + edge)).any()) for edge in (-1e-2, 1e-2)]
        if found[0] == found[1]:
            hidden += found[0]
            assert sight.is_hidden(eye.tolist(), target.tolist(), [(x, y, radius, height)]) == found[0]
    assert 50 < hidden < 250


@pytest.mark.parametrize(
    ("eye", "target", "expected"),
    [
        ((0.0, 0.0, 9.0), (0.0, 0.0, 0.0), True),  # straight down into it
        ((0.0, 0.0, 9.0), (0.0, 0.0, 4.0), False),  # down to its top
        ((2.0, 0.0, 9.0), (2.0, 0.0, 0.0), False),  # down beside it
        ((-5.0, 0.0, 3.0), (5.0, 0.0, 3.0), True),
        ((-5.0, 0.0, 4.0), (5.0, 0.0, 4.0), False),  # level with its top
        ((-5.0, 1.0, 0.0), (5.0, 1.0, 0.0), False),  # touches its side
        ((-5.0, 0.0, 0.0), (-2.0, 0.0, 0.0), False),  # ends before it
        ((2.0, 0.0, 0.0), (5.0, 0.0, 0.0), False),  # begins behind it
    ],
)
def test_lines_of_sight_past_a_pillar(eye: tuple[float, ...], target: tuple[float, ...], expected: bool) -> None:
    assert sight.is_hidden(eye, target, [(0.0, 0.0, 1.0, 4.0)]) is expected


def test_what_is_longer_than_the_limit_is_shortened_in_its_direction() -> None:
    ratio = 8.0 / 2.0
    kept = dynamics.shortened((3.0, 0.0, 1.0), 8.0, ratio)
    assert kept == (3.0, 0.0, 1.0)
    x, y, z = dynamics.shortened((6.0, 8.0, 5.0), 8.0, ratio)
    assert (x / 6.0, y / 8.0) == pytest.approx((z / 5.0, z / 5.0))
    assert (x * x + y * y) / 64.0 + z * z / 4.0 == pytest.approx(1.0)


def test_messages_have_as_many_numbers_as_they_should() -> None:
    flat, high = BodyState((1.0, 2.0), (0.0, 0.0), 0.0), BodyState((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), 0.0)
    assert flat.finite
    assert high.finite
    assert not BodyState((1.0, 2.0, 3.0), (0.0, 0.0), 0.0).finite
    assert not BodyState((1.0,), (0.0,), 0.0).finite
    assert Plan("a", 0.0, high, np.zeros((3, 3))).finite
    assert not Plan("a", 0.0, high, np.zeros((3, 2))).finite
    assert not Plan("a", 0.0, flat, np.zeros((3, 3))).finite
    assert Measurement("a", (0.0, 0.0, 9.0), "relative_position", (1.0, 2.0, -9.0), 0.2, 2.0, 0.0).finite
    assert not Measurement("a", (0.0, 0.0, 9.0), "relative_position", (1.0, 2.0), 0.2, 2.0, 0.0).finite
    assert Measurement("a", (0.0, 0.0, 9.0), "range", (9.0,), 0.2, 2.0, 0.0).finite
    assert Estimate(np.zeros(6), np.eye(6), 0.0).finite
    assert not Estimate(np.zeros(6), np.eye(4), 0.0).finite


def test_a_target_on_the_ground_seen_from_above() -> None:
    """The filter against the textbook's update with a linear measurement of three numbers."""
    random = np.random.default_rng(3)
    root = random.normal(size=(4, 4))
    mean, covariance = random.normal(size=4), root @ root.T + np.eye(4)
    eye, value = np.array([4.0, -3.0, 8.0]), np.array([-3.5, 2.6, -7.9])
    rows = np.array([[ukf.RELATIVE_POSITION, *eye, *value, 0.2, 2.0]])
    points, weights = ukf.sigma_points(mean, covariance, 0.0)
    noise = np.zeros((3, 3))
    for point, weight in zip(points, weights, strict=True):
        n = np.array([*point[:2], 0.0]) - eye
        n /= np.linalg.norm(n)
        noise += weight * (4.0 * np.eye(3) + (0.04 - 4.0) * np.outer(n, n))
    noises = ukf.measurement_noise(points, weights, rows)
    assert noises[0] == pytest.approx(noise[np.triu_indices(3)])
    observed = np.eye(3, 4)
    observed[2, 2] = 0.0  # the height is known
    gain = covariance @ observed.T @ np.linalg.inv(observed @ covariance @ observed.T + noise)
    expected = mean + gain @ (value - (observed @ mean - eye))
    then, spread = ukf.update(mean, covariance, 0.0, rows, noises)
    assert then == pytest.approx(expected)
    assert spread == pytest.approx(covariance - gain @ observed @ covariance)


@pytest.fixture(scope="module")
def run() -> Results:
    model = load_model("flying_observers", set={"observers": 2, "lowest": 7.0})
    return Simulation(model, seed=2, keep_log=True).run(until=4)


def test_observers_keep_their_heights_and_limits(run: Results) -> None:
    for index in range(2):
        states = run.signals[f"observer[{index}].state"].tokens
        places, speeds = (np.array([getattr(each, name) for each in states]) for name in ("position", "velocity"))
        assert places.shape[1] == 3
        assert 7.0 - 1e-6 <= places[:, 2].min() <= places[:, 2].max() <= 11.0 + 1e-6
        assert ((speeds[:, :2] ** 2).sum(axis=1) / 144.0 + speeds[:, 2] ** 2 / 9.0).max() <= 1.0 + 1e-9
        pushes = np.diff(speeds, axis=0) / 0.1
        assert ((pushes[:, :2] ** 2).sum(axis=1) / 64.0 + pushes[:, 2] ** 2 / 9.0).max() <= 1.0 + 1e-9


def test_measurements_come_from_where_the_line_of_sight_is_free(run: Results) -> None:
    """From the states alone; what is behind a pillar is not measured, and everything else is."""
    pillars = [(21.0, 0.5), (17.0, -5.0), (15.5, 5.0), (7.0, -4.0), (6.0, 3.5)]
    measured = {
        (record.value.robot, round(record.value.time, 6))
        for record in run.log.records
        if isinstance(record.value, Measurement) and record.actor.endswith(".sensor")
    }
    targets = {round(each.time, 6): each.position for each in run.signals["obstacle.state"].tokens}
    free = hidden = 0
    for robot in ("main", "observer[0]", "observer[1]"):
        for state in run.signals[f"{robot}.state"].tokens:
            time = round(state.time, 6)
            eye, target = np.zeros(3), np.array([*targets[time], 0.0])
            eye[: len(state.position)] = state.position
            points = eye + np.linspace(0.0, 1.0, 5001)[:, np.newaxis] * (target - eye)
            behind = any(
                ((np.hypot(points[:, 0] - x, points[:, 1] - y) < 1.5) & (points[:, 2] < 6.0)).any() for x, y in pillars
            )
            assert ((robot, time) in measured) == (not behind)
            hidden, free = hidden + behind, free + (not behind)
    assert min(free, hidden) > 10


def test_the_main_robot_keeps_out_of_the_pillars(run: Results) -> None:
    places = np.array([each.position for each in run.signals["main.state"].tokens])
    for x, y in [(21.0, 0.5), (17.0, -5.0), (15.5, 5.0), (7.0, -4.0), (6.0, 3.5)]:
        assert np.hypot(places[:, 0] - x, places[:, 1] - y).min() >= 2.5 - 1e-6


def test_braking_against_any_velocity_is_within_the_limits_of_climbing() -> None:
    motion = DoubleIntegrator(dimensions=3, max_acceleration=8.0, climb_acceleration=2.0)
    for velocity in np.random.default_rng(1).normal(0.0, 5.0, (50, 3)).tolist():
        braking = np.array(motion.braking([0.0, 0.0, 0.0, *velocity], 0.1))
        assert np.cross(braking, velocity) == pytest.approx(np.zeros(3), abs=1e-9)
        assert braking @ velocity < 0.0
        (share,) = np.array(motion.control_limits(braking))  # below 0 within the limits, in (m/s^2)^2
        assert share == pytest.approx((0.95**2 - 1.0) * 64.0)


def test_errors_in_space_are_along_across_and_upright() -> None:
    """To the line of sight: three directions at right angles, the second of them level."""
    offset, level, length = (2.0, 3.0, 6.0), math.sqrt(13.0), 7.0
    errors = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    axes = np.array([disturbed(offset, level, length, *each) for each in errors]) - offset
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert axes[0] == pytest.approx(np.array(offset) / 7.0)
    assert axes[1] == pytest.approx(np.array([-3.0, 2.0, 0.0]) / level)
    assert axes[2, 2] > 0.0


@pytest.mark.parametrize(("height", "is_near"), [(3.0, True), (3.1, False)])
def test_a_target_in_the_plane_is_on_the_ground(height: float, is_near: bool) -> None:
    sensor = Harness(Sensor("s", max_range=5.0))
    above = BodyState((0.0, 0.0, height), np.zeros(3), 0.0)
    sensor.fire(0.0, robot=above, target=BodyState((4.0, 0.0), np.zeros(2), 0.0))
    assert (len(sensor.tokens("measurement")) == 1) == is_near
