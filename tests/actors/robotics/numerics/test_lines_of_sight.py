"""The update in the frames of the true lines of sight, against Bayes' rule on a grid."""

import importlib

import numpy as np
import pytest

PREFIX = "epicycle.actors.robotics.numerics."
sight, ukf = importlib.import_module(PREFIX + "lines_of_sight"), importlib.import_module(PREFIX + "ukf")
ALONG, ACROSS, NORMAL = 0.2, 2.0, 1e12  # m; so many degrees of freedom are a normal law
STAY, STILL = np.eye(4), np.zeros((4, 4))


def seen(random: np.random.Generator, target: np.ndarray, robots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Measurements (m, 7), the last of which is a range, and their noises."""
    rows, noises = [], []
    for robot in robots:
        line = (target - robot) / np.hypot(*(target - robot))
        a, b = ALONG * random.normal(), ACROSS * random.normal()
        value = target - robot + a * line + b * np.array([-line[1], line[0]])
        rows.append((ukf.RELATIVE_POSITION, *robot, *value, ALONG, ACROSS))
        noises += [a, b]
    a = ALONG * random.normal()
    rows.append((ukf.RANGE, 0.0, 0.0, np.hypot(*target) + a, 0.0, ALONG, ACROSS))
    return np.array(rows, dtype=float), np.array([*noises, a])


def test_at_the_target_the_noises_are_those_that_were_drawn() -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        target = random.uniform(-10, 10, 2)
        measurements, noises = seen(random, target, random.uniform(-10, 10, (3, 2)))
        assert sight.noises_at(target.reshape(1, 2), measurements)[0] == pytest.approx(noises, abs=1e-12)


def by_bayes(mean: np.ndarray, covariance: np.ndarray, measurement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance (2, 2) of the position given one relative position, on a grid of 0.05 m."""
    side = np.arange(-5, 5, 0.05)
    points = mean[:2] + np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    off = points - mean[:2]
    a, b = sight.noises_at(points, measurement).T
    misfit = (
        np.einsum("ni,ij,nj->n", off, np.linalg.inv(covariance[:2, :2]), off) + (a / ALONG) ** 2 + (b / ACROSS) ** 2
    )
    weights = np.exp(-0.5 * (misfit - misfit.min()))
    weights /= weights.sum()
    found = weights @ points
    return found, (points - found).T @ (weights[:, np.newaxis] * (points - found))


@pytest.mark.slow
def test_it_is_nearer_to_bayes_than_an_ellipse_turned_as_predicted() -> None:
    """Targets 5 m away that are known to within 0.7 m, where the direction is good to 8 degrees alone."""
    random = np.random.default_rng(2)
    misses: dict[str, list[float]] = {"here": [], "ukf": []}
    covariance = np.diag([0.5, 0.5, 1.0, 1.0])
    for _ in range(200):
        mean = np.array([5.0, 0.0, 0.0, 0.0])
        target = mean[:2] + random.normal(size=2) * 0.5**0.5
        measurement = seen(random, target, np.zeros((1, 2)))[0][:1]
        exact, spread = by_bayes(mean, covariance, measurement)
        here = sight.predict_and_fuse(mean, covariance, STAY, STILL, 0.0, measurement, NORMAL)
        there = ukf.predict_and_fuse(mean, covariance, STAY, STILL, 0.0, measurement, True)
        for name, found in (("here", here), ("ukf", there)):
            off = found[0][:2] - exact
            misses[name].append(float(off @ np.linalg.solve(spread, off)))
    assert np.mean(misses["here"]) < 0.5 * np.mean(misses["ukf"])


def test_far_away_it_is_the_kalman_filter() -> None:
    """Where a line of sight hardly turns, noise as large along it as across it makes a linear measurement."""
    mean, covariance = np.array([1e4, 0.0, 1.0, 2.0]), np.array([[2.0, 0.5, 1.0, 0.0], [0.5, 1.0, 0.0, 0.5]] * 2)
    covariance[2:] = [[1.0, 0.0, 3.0, 0.0], [0.0, 0.5, 0.0, 2.0]]
    measurement = np.array([[ukf.RELATIVE_POSITION, 0.0, 0.0, 1e4 + 1.0, -0.5, 0.5, 0.5]])
    then, spread, _ = sight.predict_and_fuse(mean, covariance, STAY, STILL, 0.0, measurement, NORMAL)
    gain = covariance[:, :2] @ np.linalg.inv(covariance[:2, :2] + 0.25 * np.eye(2))
    assert then == pytest.approx(mean + gain @ [1.0, -0.5], abs=1e-3)
    assert spread == pytest.approx(covariance - gain @ covariance[:2], abs=1e-3)


def test_a_surprise_widens_the_estimate() -> None:
    mean, covariance = np.array([10.0, 0.0, 0.0, 0.0]), np.diag([0.1, 0.1, 1.0, 1.0])
    for x, is_wider in ((10.1, False), (13.0, True)):
        measurement = np.array([[ukf.RELATIVE_POSITION, 0.0, 0.0, x, 0.0, ALONG, ACROSS]])
        robust, normal = (
            sight.predict_and_fuse(mean, covariance, STAY, STILL, 0.0, measurement, freedom)[:2]
            for freedom in (4.0, NORMAL)
        )
        assert robust[0] == pytest.approx(normal[0])
        assert (np.trace(robust[1]) > 1.5 * np.trace(normal[1])) == is_wider


def test_nothing_measured_and_nothing_finite() -> None:
    mean, covariance = np.zeros(4), np.eye(4)
    for measurements in (np.zeros((0, 7)), np.array([[ukf.RANGE, 0.0, 0.0, np.inf, 0.0, ALONG, ACROSS]])):
        then, spread, fused = sight.predict_and_fuse(mean, covariance, STAY, np.eye(4), 0.0, measurements, 4.0)
        assert not fused
        assert then == pytest.approx(mean)
        assert spread == pytest.approx(2 * np.eye(4))
