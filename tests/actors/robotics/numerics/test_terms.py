"""The constraint functions and the mutual information at one point: derivatives, and points where they have none."""

import importlib

import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import PREFIX, Six, check_derivatives, negative_information, spread

definitions = importlib.import_module(PREFIX + "definitions")
information = importlib.import_module(PREFIX + "mutual_information")
terms = importlib.import_module(PREFIX + "terms")
ukf = importlib.import_module(PREFIX + "ukf")


def test_derivatives_of_constraints(random: np.random.Generator) -> None:
    for _ in range(200):
        x, y, cx, cy = random.normal(scale=5.0, size=4)
        c = spread(random, 2)
        check_derivatives(lambda x, y, cx=cx, cy=cy: terms.stay_near(x, y, cx, cy, 1.5), x, y, 1e-5)
        check_derivatives(lambda x, y, cx=cx, cy=cy: terms.keep_away(x, y, cx, cy, 1.5), x, y, 1e-5)

        def uncertain(x: float, y: float, cx: float = cx, cy: float = cy, c: np.ndarray = c) -> Six:
            return terms.keep_away_uncertain(x, y, cx, cy, c[0, 0], c[0, 1], c[1, 1], 2.0, 2.0)

        if np.hypot(x - cx, y - cy) > 0.3:
            check_derivatives(uncertain, x, y, 1e-5)


def test_an_obstacle_on_top_of_the_robot_lies_along_x() -> None:
    value, gx, gy, hxx, hxy, hyy = terms.keep_away_uncertain(1.0, 2.0, 1.0, 2.0, 0.04, 0.01, 0.09, 1.0, 2.0)
    assert value == pytest.approx(1.0 + 2.0 * 0.2)
    assert gx == -1.0
    assert all(map(np.isfinite, (gy, hxx, hxy, hyy)))
    # Without a covariance's slant there is no direction to turn to, and the distance bends as one to a point does.
    _, gx, gy, hxx, hxy, hyy = terms.keep_away_uncertain(1.0, 2.0, 1.0, 2.0, 0.04, 0.0, 0.04, 1.0, 2.0)
    assert (gx, gy, hxx, hxy) == (-1.0, 0.0, 0.0, 0.0)
    assert hyy == pytest.approx(-1e9)


@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_derivatives_of_mutual_information(random: np.random.Generator, kappa: float) -> None:
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
            return negative_information(x, y, p, w, d, 2.0)

        check_derivatives(negative, *own, tolerance=1e-5)


def test_information_on_top_of_a_sigma_point_is_finite() -> None:
    points, weights = np.array([[1.0, 2.0], [3.0, 2.0], [0.0, 5.0]]), np.array([0.5, 0.25, 0.25])
    found = negative_information(1.0, 2.0, points, weights, np.zeros((3, 3)), 2.0)
    expected = definitions.mutual_information(points[0], points, weights, 2.0, np.zeros((3, 3)))
    assert found[0] == pytest.approx(-expected)
    assert np.isfinite(found).all()
