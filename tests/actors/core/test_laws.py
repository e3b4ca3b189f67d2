"""What the laws of random numbers are computed from, exactly; and that none of their numbers ever changes.

``python -m tests.actors.core.test_laws`` prints the digests of the numbers that are drawn now.
"""

from __future__ import annotations

import hashlib
import math
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np
import pytest

from epicycle.actors import random_stream
from epicycle.actors.core import laws
from epicycle.actors.core.random import RandomStream

DRAWS: dict[str, list[tuple[Any, ...]]] = {
    "binomial": [(10, 0.3), (10, 0.7), (500, 0.02), (500, 0.2), (10**6, 0.9), (10**15, 0.5), (21, 0.5)],
    "poisson": [(0.5,), (9.9,), (10.0,), (40.0,), (1e6,), (1e12,)],
    "geometric": [(0.001,), (0.5,), (1.0,)],
    "negative_binomial": [(3.0, 0.4), (200.0, 0.1)],
    "gamma": [(0.1, 2.0), (1.0, 1.0), (7.5, 0.5), (0.0, 1.0)],
    "beta": [(0.2, 0.3), (1.0, 1.0), (1.5, 0.5), (3.0, 4.0), (0.5, 1.5)],
    "chisquare": [(1.0,), (9.0,)],
    "standard_t": [(1.0,), (30.0,)],
    "f": [(3.0, 5.0)],
    "vonmises": [(0.0, 0.0), (1.0, 1e-9), (1.0, 2.0), (3.0, 50.0), (0.5, 1e7), (3.0, 1e7)],
    "triangular": [(-1.0, 0.0, 3.0), (0.0, 0.0, 1.0), (0.0, 1.0, 1.0)],
    "logistic": [(), (2.0, 3.0)],
    "laplace": [(), (2.0, 3.0)],
    "gumbel": [(), (2.0, 3.0)],
    "weibull": [(0.5,), (2.0,)],
    "pareto": [(3.0,)],
    "rayleigh": [(), (2.0,)],
    "lognormal": [(), (1.0, 0.5)],
    "normal": [(), (3.0, 0.1)],
    "exponential": [(), (5.0,)],
    "uniform": [(), (-3.0, 4.0)],
    "integers": [(10,), (-5, 5), (2**40,), (0, 2**63 - 1), (1, 2)],
    "multinomial": [(20, [0.2, 0.3, 0.5]), (5, [1.0, 0.0])],
    "choice": [(10,), ([3.0, 4.0, 5.0], 4, True, [0.5, 0.0, 0.5]), (9, 4, False), (9, 3, False, [0.0, *[0.125] * 8])],
    "permutation": [(12,)],
    "multivariate_normal": [([0.0, 1.0], [[2.0, 0.5], [0.5, 1.0]])],
}
DIGESTS = {
    "binomial": "4c984e75cbbdbfc3",
    "poisson": "f3f416cf46bc702b",
    "geometric": "eaf70f11d70930f3",
    "negative_binomial": "565c1518215d4c81",
    "gamma": "f8c03a752d9c7a6d",
    "beta": "0fedca3c62ee1865",
    "chisquare": "85dbce25543b7dbb",
    "standard_t": "f37b7219383f9430",
    "f": "93132ab11ba94794",
    "vonmises": "4a60df9820e0c2c6",
    "triangular": "3fe487a2aa660191",
    "logistic": "6802bf5dbd55c9a2",
    "laplace": "b30d9ab8662df5f3",
    "gumbel": "9265104e7d1c7f21",
    "weibull": "0f4bbb1083fc0a2f",
    "pareto": "e987b0e2a43b34c3",
    "rayleigh": "2983bf5e84f08682",
    "lognormal": "c49a44065b0811b8",
    "normal": "d9428c0069f296a5",
    "exponential": "064017679507b575",
    "uniform": "3b323f0a4cf95d0e",
    "integers": "16e4a23b1d505c29",
    "multinomial": "2fbd40a490e9bc90",
    "choice": "681fe7e624d6899c",
    "permutation": "ad978001fb6b7f42",
    "multivariate_normal": "a2dda1ad658bc5fb",
}


def digest(name: str) -> str:
    """Of 60 draws for each set of parameters."""
    drawn = []
    for number, parameters in enumerate(DRAWS[name]):
        stream = random_stream(11, name, str(number))
        for _ in range(60):
            drawn.append(np.asarray(getattr(stream, name)(*parameters)).ravel().tolist())
    return hashlib.sha256(repr(drawn).encode()).hexdigest()[:16]


@pytest.mark.parametrize("name", DRAWS)
def test_numbers_of_a_law(name: str) -> None:
    assert digest(name) == DIGESTS[name]


@pytest.mark.parametrize("bound", [2**64 - 1, 2**64, 2**64 + 1, 2**65, 2**66 + 3, 2**127, 2**128 + 1])
def test_bounds_about_the_size_of_a_word(bound: int) -> None:
    stream = random_stream(5, "bounds", str(bound))
    drawn = [stream.below(bound) for _ in range(400)]
    assert 0 <= min(drawn) < bound // 50
    assert bound - bound // 50 < max(drawn) < bound


def test_a_bound_uses_every_bit_of_a_word() -> None:
    """The product of 3 and this word ends in the least 64 bits that are not refused."""
    words = [0xAAAA_AAAA_AAAA_AAAB, 0x5555_5555_5555_5556, 0, 0xAAAA_AAAA_AAAA_AAAB]
    stream: Any = SimpleNamespace(word=lambda: words.pop(0))
    assert [RandomStream.below(stream, 3) for _ in range(3)] == [2, 1, 2]
    assert not words  # the third one is refused


def test_a_wait_for_what_hardly_ever_comes_is_as_long_as_an_integer_can_be() -> None:
    assert random_stream(5, "geometric", "rare").geometric(1e-300) == 2**63 - 1


def test_binomial_numbers_are_weighed_against_the_likeliest_one() -> None:
    """It is 27 of 56 for this probability, one more than the mean rounded down: two draws hang on that."""
    stream = random_stream(1, "a", "b")
    drawn = [stream.binomial(56, 0.47609624449125754) for _ in range(126)]
    assert drawn[114:] == [30, 28, 23, 30, 28, 23, 24, 28, 27, 31, 23, 26]


@pytest.mark.parametrize("k", [1, 2, 5, 9, 14, 15, 16, 17, 20, 50, 1000, 10**6])
def test_what_stirling_leaves_of_a_factorial(k: int) -> None:
    with mpmath.workdps(40):
        exact = mpmath.loggamma(k + 1) - (k * mpmath.log(k) - k + mpmath.log(2 * mpmath.pi * k) / 2)
        assert laws._stirling(k) == pytest.approx(float(exact), rel=3e-12, abs=2e-15)


@pytest.mark.parametrize(("n", "p"), [(1, 0.25), (20, 0.5), (37, 0.1), (200, 0.75), (1000, 0.02)])
def test_the_logarithm_of_a_binomial_probability(n: int, p: float) -> None:
    for k in {0, 1, n // 3, n // 2, int(n * p), n - 1, n}:
        exact = math.comb(n, k) * Fraction(p) ** k * (1 - Fraction(p)) ** (n - k)
        with mpmath.workdps(40):
            truth = float(mpmath.log(mpmath.mpf(exact.numerator) / exact.denominator))
        assert laws._log_binomial(k, n, p) == pytest.approx(truth, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("geometric", (1.5,), "p = 1.5 is not > 0 and <= 1"),
        ("geometric", (0.0,), "p = 0 is not > 0 and <= 1"),
        ("poisson", (-0.1,), "lam = -0.1 is not between 0 and 1e18"),
        ("poisson", (2e18,), "lam = 2e+18 is not between 0 and 1e18"),
        ("triangular", (0.0, 2.0, 1.0), "left = 0, mode = 2 and right = 1 are not in ascending order"),
        ("binomial", (-1, 0.5), "n = -1 is not between 0 and 2^63 - 1"),
    ],
)
def test_parameters_that_are_none(name: str, parameters: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 (the message is compared)
        getattr(random_stream(1, "a", "b"), name)(*parameters)
    assert str(caught.value) == message


if __name__ == "__main__":
    for each in DRAWS:
        print(f'    "{each}": "{digest(each)}",')
