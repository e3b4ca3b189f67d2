"""The elementary functions: near the truth, as the module math where a value is none, and the same when compiled."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from benchmarks.elementary import TRUTH, compiled_by, points, worst
from epicycle.actors.core import elementary
from epicycle.actors.core.elementary.in_numba import register

register()
SPECIAL = [0.0, 5e-324, 1e-310, 2.2250738585072014e-308, 1e-200, 1e-17, 1e-9, 0.25, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 20.0]
SPECIAL += [39.0, 41.0, 307.5, 709.5, 709.79, 711.0, 745.2, 800.0, 1e6, 2.0**53 - 1.0, 2.0**53, 1e22, 1e200, 1.7e308]
SPECIAL += [math.inf]
SPECIAL = [math.nan, *SPECIAL, *(-x for x in SPECIAL)]


def answer(function: Callable[..., float], *at: float) -> float | str:
    """What a function returns, or raises."""
    try:
        return function(*at)
    except (ValueError, OverflowError) as error:
        return type(error).__name__


def same(one: float | str, other: float | str, ulps: float = 0.0) -> bool:
    """Equal with sign and type, NaN being itself, or nearly equal."""
    if isinstance(one, str) or isinstance(other, str) or math.isnan(one) or math.isnan(other):
        return repr(one) == repr(other)
    if one == other:
        return math.copysign(1.0, one) == math.copysign(1.0, other)
    return abs(one - other) <= ulps * math.ulp(other)


def arguments(name: str) -> list[tuple[float, ...]]:
    """All special values, or pairs of them."""
    return list(itertools.product(SPECIAL, repeat=2 if name in ("atan2", "pow", "hypot") else 1))


@pytest.mark.parametrize("name", TRUTH)
def test_special_values_are_those_of_math(name: str) -> None:
    wrong = []
    for at in arguments(name):
        ours, theirs = answer(getattr(elementary, name), *at), answer(getattr(math, name), *at)
        if not same(ours, theirs, 1.0):
            wrong.append((at, ours, theirs))
    assert not wrong


@pytest.mark.parametrize("name", TRUTH)
def test_compiled_code_gives_the_same_bits_and_no_exception(name: str) -> None:
    function = getattr(elementary, name)
    at = points(name, 3_000, seed=2)
    special = np.array(arguments(name)).T
    at = tuple(np.concatenate(both) for both in zip(at, special, strict=True))
    found = compiled_by(elementary, name, len(at))(*at)
    for one, value in zip(zip(*(x.tolist() for x in at), strict=True), found.tolist(), strict=True):
        interpreted = answer(function, *one)
        if isinstance(interpreted, str):
            assert math.isinf(value) or math.isnan(value), one
        else:
            assert same(interpreted, value), one


@pytest.mark.parametrize("name", TRUTH)
def test_within_an_ulp_of_the_truth(name: str) -> None:
    at = points(name, 10_000, seed=3)
    error, where = worst(name, at, compiled_by(elementary, name, len(at))(*at))
    assert error < 0.8, where


def test_lengths_in_space() -> None:
    assert elementary.hypot(2.0, 3.0, 6.0) == 7.0
    assert elementary.hypot(1e300, 1e300, 1e300, 1e300) == 2e300
    assert elementary.hypot(1e-320, 0.0, 0.0) == 1e-320
    assert elementary.hypot(-3.0) == 3.0
    assert elementary.hypot(1.0, math.nan, math.inf) == math.inf
    assert math.isnan(elementary.hypot(1.0, 2.0, math.nan))
    assert elementary.distance((1.0, 2.0, 3.0), (3.0, 5.0, 9.0)) == 7.0
    assert elementary.distance([1.0, 1.0], [4.0, 5.0]) == 5.0
    random = np.random.default_rng(1)
    for vector in random.normal(0.0, 10.0, (1000, 5)).tolist():
        assert same(elementary.hypot(*vector), math.hypot(*vector), 1.0)


def test_the_logarithm_of_the_gamma_function() -> None:
    random = np.random.default_rng(1)
    for x in [1.0, 2.0, 1e-300, 0.5, 9.9, 10.0, 171.0, 1e15, 1e300, *(10.0 ** random.uniform(-3, 6, 2000)).tolist()]:
        truth = float(mpmath.loggamma(x))
        assert abs(elementary.log_gamma(x) - truth) <= 1e-14 * max(1.0, abs(truth)), x
    assert elementary.log_gamma(math.inf) == math.inf
    with pytest.raises(ValueError, match=r"^math domain error$"):
        elementary.log_gamma(0.0)
