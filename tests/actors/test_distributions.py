"""Distributions, against SciPy's."""

from __future__ import annotations

import math
from typing import Any

import pytest
from scipy import stats

from tests.actors.library_parts import behave, problem, tokens


@pytest.mark.parametrize(
    ("distribution", "law"),
    [
        ("{type: ChiSquare, freedom: 3}", stats.chi2(3)),
        ("{type: StudentT, freedom: 4}", stats.t(4)),
        ("{type: Cauchy, median: 1, scale: 2}", stats.cauchy(1, 2)),
        ("{type: VonMises, mean: 1, concentration: 3}", stats.vonmises(3, loc=1)),
    ],
)
def test_distributions(distribution: str, law: Any) -> None:
    sends = behave(f"{{type: Random, distribution: {distribution}}}", [("trigger", [[0, 0]] * 2000)], seed=2)
    assert stats.kstest(tokens(sends), law.cdf).pvalue > 1e-3


@pytest.mark.parametrize(
    ("distribution", "law"),
    [
        ("{type: Poisson, mean: 20}", stats.poisson(20)),
        ("{type: Binomial, trials: 30, probability: 0.4}", stats.binom(30, 0.4)),
        ("{type: NegativeBinomial, successes: 3, probability: 0.25}", stats.nbinom(3, 0.25)),
    ],
)
def test_distributions_of_whole_numbers(distribution: str, law: Any) -> None:
    sends = behave(f"{{type: Random, distribution: {distribution}}}", [("trigger", [[0, 0]] * 2000)], seed=2)
    drawn = tokens(sends)
    assert all(type(each) is int for each in drawn)
    assert abs(sum(drawn) / 2000 - law.mean()) < 4 * law.std() / math.sqrt(2000)


def test_a_cauchy_distribution_that_is_cut_off() -> None:
    sends = behave(
        "{type: Random, distribution: {type: Cauchy, median: 1, scale: 2, cut: 3}}", [("trigger", [[0, 0]] * 2000)]
    )
    law, drawn = stats.cauchy(1, 2), tokens(sends)
    low, high = law.cdf(-2.0), law.cdf(4.0)
    assert stats.kstest(drawn, lambda x: (law.cdf(x) - low) / (high - low)).pvalue > 1e-3
    assert -2.0 <= min(drawn) < -1.9 < 3.9 < max(drawn) <= 4.0


@pytest.mark.parametrize(
    ("distribution", "message"),
    [
        ("{type: Gamma, shape: .inf}", "Gamma.shape: inf is not a finite number"),
        ("{type: Uniform, low: -.inf}", "Uniform.low: -inf is not a finite number"),
        ("{type: Constant, value: .inf}", "Constant.value: inf is not a finite number"),
    ],
)
def test_distributions_without_end(distribution: str, message: str) -> None:
    actor = f"{{type: Random, distribution: {distribution}}}"
    assert problem(actor, [("trigger", [])]) == f"it.distribution: {message}"
