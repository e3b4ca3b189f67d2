"""The constraint functions and the mutual information at one point: derivatives, and points where they have none."""

import importlib

import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import (
    PREFIX,
    Floats,
    check_derivatives,
    negative_information,
    packed,
    spread,
)

definitions = importlib.import_module(PREFIX + "definitions")
information = importlib.import_module(PREFIX + "mutual_information")
terms = importlib.import_module(PREFIX + "terms")
ukf = importlib.import_module(PREFIX + "ukf")


@pytest.mark.parametrize("d", [2, 3])
def test_derivatives_of_constraints(random: np.random.Generator, d: int) -> None:
    for _ in range(200):
        own, (*centre,) = random.normal(scale=5.0, size=d), random.normal(scale=5.0, size=d).tolist()
        there, c = tuple(centre), packed(spread(random, d))
        if np.linalg.norm(own - there) > 0.3:
            check_derivatives(lambda at, there=there: terms.stay_near(at, there, 1.5), own, 1e-5)
            check_derivatives(lambda at, there=there: terms.keep_away(at, there, 1.5), own, 1e-5)
            check_derivatives(lambda at, there=there, c=c: terms.keep_away_uncertain(at, there, c, 2.0, 2.0), own, 1e-5)
        check_derivatives(lambda at: terms.keep_level(at, 1.5, -1.0), own)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_right_above_an_obstacle_every_direction_is_level(random: np.random.Generator, sign: float) -> None:
    c = packed(spread(random, 3))
    check_derivatives(
        lambda at: terms.keep_away_uncertain(at, (1.0, 2.0, 3.0), c, 2.0, 2.0), np.array([1.0, 2.0, 3.0 + sign]), 1e-5
    )


def test_in_a_plane_of_space_constraints_are_those_of_the_plane(random: np.random.Generator) -> None:
    """What bends upwards aside."""
    for _ in range(20):
        own, there = (tuple(each) for each in random.normal(scale=5.0, size=(2, 2)).tolist())
        xx, xy, yy = packed(spread(random, 2))
        flat = terms.keep_away_uncertain(own, there, (xx, xy, yy), 2.0, 2.0)
        value, gx, gy, gz, hxx, hxy, hxz, hyy, hyz, _ = terms.keep_away_uncertain(
            (*own, 4.0), (*there, 4.0), (xx, xy, 0.0, yy, 0.0, 0.0), 2.0, 2.0
        )
        assert (value, gx, gy, hxx, hxy, hyy) == pytest.approx(flat, abs=1e-9)
        assert (gz, hxz, hyz) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_an_obstacle_on_top_of_the_robot_lies_along_x() -> None:
    value, gx, gy, hxx, hxy, hyy = terms.keep_away_uncertain((1.0, 2.0), (1.0, 2.0), (0.04, 0.01, 0.09), 1.0, 2.0)
    assert value == pytest.approx(1.0 + 2.0 * 0.2)
    assert gx == -1.0
    assert all(map(np.isfinite, (gy, hxx, hxy, hyy)))
    # Without a covariance's slant there is no direction to turn to, and the distance bends as one to a point does.
    _, gx, gy, hxx, hxy, hyy = terms.keep_away_uncertain((1.0, 2.0), (1.0, 2.0), (0.04, 0.0, 0.04), 1.0, 2.0)
    assert (gx, gy, hxx, hxy) == (-1.0, 0.0, 0.0, 0.0)
    assert hyy == pytest.approx(-1e9)


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_derivatives_of_mutual_information(random: np.random.Generator, kappa: float, d: int) -> None:
    for _ in range(50):
        state = random.normal(scale=3.0, size=4)
        points, weights = ukf.sigma_points(state, spread(random, 4), kappa)
        points = np.ascontiguousarray(np.pad(points[:, :2], ((0, 0), (0, d - 2))))  # on the ground
        others = random.normal(scale=10.0, size=(int(random.integers(0, 4)), d))
        own = random.normal(scale=10.0, size=d)
        distance = information.pairwise_distance(points, others[:, np.newaxis], 2.0)

        def negative(at: Floats, p: np.ndarray = points, w: np.ndarray = weights, e: np.ndarray = distance) -> Floats:
            return negative_information(at, p, w, e, 2.0)

        check_derivatives(negative, own, tolerance=1e-5)
        heavy = weights > 0.0
        misfit = definitions.misfit(points[heavy], others, 2.0)
        expected = definitions.mutual_information(own, points[heavy], weights[heavy], 2.0, misfit)
        assert negative(tuple(own.tolist()))[0] == pytest.approx(-expected, abs=1e-8)


@pytest.mark.slow
def test_information_on_top_of_a_sigma_point_is_finite() -> None:
    points, weights = np.array([[1.0, 2.0], [3.0, 2.0], [0.0, 5.0]]), np.array([0.5, 0.25, 0.25])
    found = negative_information((1.0, 2.0), points, weights, np.zeros((3, 3)), 2.0)
    expected = definitions.mutual_information(points[0], points, weights, 2.0, np.zeros((3, 3)))
    assert found[0] == pytest.approx(-expected)
    assert np.isfinite(found).all()
