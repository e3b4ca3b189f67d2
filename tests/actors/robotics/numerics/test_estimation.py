"""The unscented Kalman filter's kernels against FilterPy, and what must hold for any filter."""

import importlib

import numpy as np
import pytest
from filterpy.kalman import JulierSigmaPoints, UnscentedKalmanFilter
from hypothesis import given, settings
from hypothesis import strategies as st

ukf = importlib.import_module("epicycle.actors.robotics.numerics.ukf")

PROCESS_NOISE = np.diag([0.002, 0.002, 0.4, 0.4])
PRIOR = np.array([10.0, 0.0, 0.0, 0.0]), np.diag([400.0, 400.0, 4.0, 4.0])


def test_sigma_points_are_julier_s() -> None:
    random = np.random.default_rng(5)
    for kappa in (0.0, 0.5, 3.0):
        root = random.normal(size=(4, 4))
        mean, covariance = random.normal(size=4), root @ root.T + 0.1 * np.eye(4)
        points, weights = ukf.sigma_points(mean, covariance, kappa)
        theirs = JulierSigmaPoints(4, kappa=kappa)
        # FilterPy takes rows of the upper factor, the same as our columns of the lower one.
        assert points == pytest.approx(theirs.sigma_points(mean, covariance), abs=1e-12)
        assert weights == pytest.approx(theirs.Wm, abs=1e-15)
        assert weights @ points == pytest.approx(mean, abs=1e-12)
        assert (points - mean).T @ np.diag(weights) @ (points - mean) == pytest.approx(covariance, abs=1e-12)


def measure(random: np.random.Generator, kind: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Observers (count, 2) and what they see of a target near (12, 0)."""
    observers = random.uniform(-20.0, 30.0, size=(count, 2))
    target = np.array([12.0, 0.0]) + random.normal(size=2)
    offsets = target - observers
    values = offsets + random.normal(size=(count, 2))
    if kind == ukf.RANGE:
        values = np.column_stack([np.hypot(*offsets.T) + 0.2 * random.normal(size=count), np.zeros(count)])
    return observers, values


@pytest.mark.parametrize("kind", [ukf.RELATIVE_POSITION, ukf.RANGE])
def test_200_steps_agree_with_filterpy(kind: int) -> None:
    """Both follow the textbook: points are drawn again from the prediction before the update.

    FilterPy does so since 1.4.1; setting ``sigmas_f`` here makes older releases do so too.  All measurements of
    a step are stacked in both, with the noise ellipses turned along the predicted lines of sight.  The prior is
    of moderate size: FilterPy's form of the posterior, P - K S K', loses digits that ours keeps.
    """
    random = np.random.default_rng(7)
    mean, covariance = PRIOR[0], np.diag([4.0, 4.0, 4.0, 4.0])
    points = JulierSigmaPoints(4, kappa=0.0)
    oracle = UnscentedKalmanFilter(4, 2, 0.1, hx=None, fx=lambda x, dt: ukf.constant_velocity(dt) @ x, points=points)
    oracle.x, oracle.P, oracle.Q = mean.copy(), covariance.copy(), PROCESS_NOISE
    for step in range(200):
        mean, covariance = ukf.predict(mean, covariance, ukf.constant_velocity(0.1), PROCESS_NOISE)
        oracle.predict()
        count = int(random.integers(0, 7)) if step else 3  # up to 12 rows, and 9 sigma points
        if count:
            observers, values = measure(random, kind, count)
            width = 1 if kind == ukf.RANGE else 2
            noise = np.zeros((width * count, width * count))
            rows = table(kind, observers, values, 0.2, 2.0)
            noises = noise_along(mean, rows)
            for row, (xx, xy, yy) in enumerate(noises):
                block = np.array([[xx, xy], [xy, yy]])[:width, :width]
                noise[width * row : width * (row + 1), width * row : width * (row + 1)] = block

            def observe(x: np.ndarray, places: np.ndarray = observers) -> np.ndarray:
                away = x[:2] - places
                return np.hypot(*away.T) if kind == ukf.RANGE else away.ravel()

            oracle.sigmas_f = points.sigma_points(oracle.x, oracle.P)
            oracle.update(values[:, :width].ravel(), R=noise, hx=observe)
            mean, covariance = ukf.update(mean, covariance, 0.0, rows, noises)
        assert mean == pytest.approx(oracle.x, abs=1e-9)
        assert covariance == pytest.approx(oracle.P, abs=1e-9)


def table(kind: int, observers: np.ndarray, values: np.ndarray, along: float, across: float) -> np.ndarray:
    """Measurements of one kind as the kernels take them."""
    count = len(observers)
    return np.column_stack([np.full(count, kind), observers, values, np.full(count, along), np.full(count, across)])


def noise_along(mean: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The noise ellipses turned along the directions to the mean."""
    return ukf.measurement_noise(mean[np.newaxis], np.ones(1), rows)


def test_expected_noise_is_the_average_over_the_sigma_points() -> None:
    mean, covariance = np.array([2.0, 1.0, 0.0, 0.0]), np.diag([0.3, 1.2, 1.0, 1.0])
    points, weights = ukf.sigma_points(mean, covariance, 0.5)
    expected = np.zeros((2, 2))
    for point, weight in zip(points, weights, strict=True):
        along = point[:2] / np.linalg.norm(point[:2])
        across = np.array([-along[1], along[0]])
        expected += weight * (0.04 * np.outer(along, along) + 4.0 * np.outer(across, across))
    origin = np.zeros((1, 2))
    noises = ukf.measurement_noise(points, weights, table(ukf.RELATIVE_POSITION, origin, origin, 0.2, 2.0))
    assert noises[0] == pytest.approx([expected[0, 0], expected[0, 1], expected[1, 1]])
    assert noises[0, 0] + noises[0, 2] == pytest.approx(0.04 + 4.0)  # turning keeps the trace


def test_measurement_noise_is_an_ellipse_along_the_line_of_sight() -> None:
    origin = np.zeros((1, 2))
    ((xx, xy, yy),) = noise_along(np.array([3.0, 4.0]), table(ukf.RELATIVE_POSITION, origin, origin, 0.2, 2.0))
    values, vectors = np.linalg.eigh([[xx, xy], [xy, yy]])
    assert values == pytest.approx([0.04, 4.0])
    assert abs(vectors[:, 0] @ [0.6, 0.8]) == pytest.approx(1.0)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    prior=st.floats(-6.0, 8.0), along=st.floats(-3.0, 1.0), across=st.floats(-3.0, 1.0),
    seed=st.integers(0, 2**32), ranged=st.booleans(), count=st.integers(1, 5),
)  # fmt: skip
def test_covariance_stays_positive_definite(
    prior: float, along: float, across: float, seed: int, ranged: bool, count: int
) -> None:
    # Variances span 14 digits at most: with 17, what two sensors tell apart is less than the last bit.
    random = np.random.default_rng(seed)
    kind = ukf.RANGE if ranged else ukf.RELATIVE_POSITION
    mean, covariance = np.array([10.0, 0.0, 0.0, 0.0]), np.diag([10.0**prior, 10.0**prior, 4.0, 4.0])
    for step in range(12):
        mean, covariance = ukf.predict(mean, covariance, ukf.constant_velocity(0.1), PROCESS_NOISE)
        if step % 3 != 2:  # a gap now and then
            rows = table(kind, *measure(random, kind, count), 10.0**along, 10.0**across)
            mean, covariance = ukf.update(mean, covariance, 0.0, rows, noise_along(mean, rows))
        assert np.isfinite(mean).all()
        assert (covariance == covariance.T).all()
        # From sizes 1e8 and more, the smallest eigenvalue is known up to rounding of the largest only.
        eigenvalues = np.linalg.eigvalsh(covariance)
        assert eigenvalues[0] > -1e-13 * eigenvalues[-1]


def test_huge_prior_and_tiny_noise_are_positive_definite_strictly() -> None:
    mean, covariance = np.zeros(4), np.diag([1e8, 1e8, 4.0, 4.0])
    rows = table(ukf.RELATIVE_POSITION, np.zeros((1, 2)), np.ones((1, 2)), 1e-3, 1e-3)
    for _ in range(50):
        mean, covariance = ukf.update(mean, covariance, 0.0, rows, np.array([[1e-6, 0.0, 1e-6]]))
        mean, covariance = ukf.predict(mean, covariance, ukf.constant_velocity(0.1), PROCESS_NOISE)
        assert np.linalg.eigvalsh(covariance)[0] > 0.0


def test_noise_is_an_ellipse_along_the_line_of_sight() -> None:
    """Seen from (1, 2), a target at (4, 6) lies along (0.6, 0.8)."""
    rows = np.array([[ukf.RELATIVE_POSITION, 1.0, 2.0, 9.0, 9.0, 0.5, 2.0], [ukf.RANGE, 1.0, 2.0, 9.0, 9.0, 0.5, 2.0]])
    noises = ukf.measurement_noise(np.array([[4.0, 6.0]]), np.ones(1), rows)
    a, b = 0.25, 4.0
    expected = [a * 0.36 + b * 0.64, (a - b) * 0.48, a * 0.64 + b * 0.36]
    assert noises == pytest.approx(np.array([expected, [a, 0.0, 0.0]]))
    # The mean over what is there with weights, one of them straight above; who stands on the target looks along x.
    both = ukf.measurement_noise(np.array([[4.0, 6.0], [1.0, 7.0], [1.0, 2.0]]), np.array([0.5, 0.3, 0.2]), rows)
    expected = 0.5 * np.array(expected) + 0.3 * np.array([b, 0.0, a]) + 0.2 * np.array([a, 0.0, b])
    assert both[0] == pytest.approx(expected)
    assert both[1].tolist() == [a, 0.0, 0.0]


def test_sigma_points_of_what_rounding_has_spoilt_are_finite() -> None:
    """A correlation just above 1: its smaller eigenvalue counts as none."""
    covariance = np.array([[1.0, 1.0 + 1e-9], [1.0 + 1e-9, 1.0]])
    points, _ = ukf.sigma_points(np.zeros(2), covariance, 0.0)
    assert points[1:3] == pytest.approx(np.array([[np.sqrt(2.0), np.sqrt(2.0)], [0.0, 0.0]]), abs=1e-8)
    assert (points[3:] == -points[1:3]).all()


def test_no_measurement_changes_nothing() -> None:
    mean, covariance = ukf.update(*PRIOR, 0.0, np.empty((0, 7)), np.empty((0, 3)))
    assert (mean == PRIOR[0]).all()
    assert (covariance == PRIOR[1]).all()


@pytest.mark.parametrize("averaged", [True, False])
def test_a_step_is_prediction_noise_and_update_in_turn(averaged: bool) -> None:
    random, transition = np.random.default_rng(3), ukf.constant_velocity(0.1)
    observed, deviations = random.normal(size=(3, 4)), random.uniform(0.1, 2.0, size=(3, 2))
    rows = np.column_stack([[0.0, 1.0, 0.0], observed, deviations])
    predicted = ukf.predict(*PRIOR, transition, PROCESS_NOISE)
    points, weights = ukf.sigma_points(*predicted, 0.5) if averaged else (predicted[0][np.newaxis], np.ones(1))
    expected = ukf.update(*predicted, 0.5, rows, ukf.measurement_noise(points, weights, rows))
    mean, covariance, fused = ukf.predict_and_fuse(*PRIOR, transition, PROCESS_NOISE, 0.5, rows, averaged)
    assert (mean.tolist(), covariance.tolist(), fused) == (expected[0].tolist(), expected[1].tolist(), True)
    # Without measurements, and where the result would not be finite, the prediction stands.
    rows[1, 3] = np.inf
    for useless in (np.empty((0, 7)), rows):
        mean, covariance, fused = ukf.predict_and_fuse(*PRIOR, transition, PROCESS_NOISE, 0.5, useless, averaged)
        assert (mean.tolist(), covariance.tolist(), fused) == (predicted[0].tolist(), predicted[1].tolist(), False)


def test_a_direction_without_variance_gains_nothing() -> None:
    assert ukf._gain(np.diag([4.0, 0.0]), np.array([[1.0, 5.0]])).tolist() == [[0.25, 0.0]]
