"""Errors of measurements against their laws."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.aspects import (
    Bias,
    Drift,
    Noise,
    Outlier,
    Quantise,
    Saturate,
)
from tests.aspects.bench import Bench
from tests.aspects.laws import SURE, Reading


@pytest.mark.parametrize(
    ("distribution", "law"),
    [
        ("normal", stats.norm(0, 3)),
        ("uniform", stats.uniform(-3 * 3**0.5, 6 * 3**0.5)),
        ("laplace", stats.laplace(0, 3 / 2**0.5)),
        (
            {"type": "Triangular", "low": -(6**0.5), "mode": 0, "high": 6**0.5},
            stats.triang(0.5, -3 * 6**0.5, 6 * 6**0.5),
        ),
    ],
)
def test_noise(distribution: Any, law: Any) -> None:
    bench = Bench(Noise(deviation=3, distribution=distribution)).play([float(i) for i in range(5000)])
    errors = np.array(bench.tokens) - np.arange(5000)
    assert stats.kstest(errors, law.cdf).pvalue > 1 - SURE
    assert law.std() == pytest.approx(3)
    assert abs(np.corrcoef(errors[1:], errors[:-1])[0, 1]) < stats.norm.ppf(0.9995) / math.sqrt(5000)


def test_outliers() -> None:
    bench = Bench(Outlier(probability=0.1, deviation=50)).play([np.zeros(2)] * 5000)
    errors = np.array(bench.tokens)
    low, high = stats.binom.interval(SURE, 10_000, 0.1)
    assert low <= (errors != 0).sum() <= high
    assert stats.kstest(errors[errors != 0], stats.norm(0, 50).cdf).pvalue > 1 - SURE


@pytest.mark.slow
def test_drift() -> None:
    steady = Bench(Drift(rate=2.0)).play([1.0] * 1001)
    assert steady.tokens == pytest.approx(1 + 2e-3 * np.arange(1001))
    ends = [Bench(Drift(walk=2.0), seed).play([0.0] * 51, period=20).tokens[-1] for seed in range(400)]
    assert stats.kstest(ends, stats.norm(0, 2).cdf).pvalue > 1 - SURE  # W(1 s) has variance 1
    both = Bench(Drift(walk=1.0)).play([Reading("a", [0.0, 0.0])] * 10)
    first, second = np.array([token.value for token in both.tokens]).T
    assert not np.allclose(first[1:], second[1:])


def test_quantise_saturate_bias() -> None:
    assert Bench(Quantise(step=0.5)).play([0.2, 0.3, 0.75, -1.1]).tokens == [0.0, 0.5, 1.0, -1.0]
    assert Bench(Quantise(step=1e-10)).play([1e300, -math.inf]).tokens == [1e300, -math.inf]  # 1e310 steps
    assert Bench(Saturate(low=-1, high=2)).play([-3.0, 0.5, 7]).tokens == [-1.0, 0.5, 2]
    assert Bench(Bias(by=0.5)).play([1.0, Reading("a", 2.0)], period=1).tokens == [1.5, Reading("a", 2.5)]


def test_each_field_drifts_by_itself() -> None:
    ends = np.array(
        [
            list(Bench(Drift(walk=1.0), seed).play([{"x": 0.0, "y": 0.0}] * 3, period=500).tokens[-1].values())
            for seed in range(400)
        ]
    )
    low, high = stats.chi2.interval(SURE, 400)
    for variance in ends.var(axis=0):
        assert low <= 400 * variance <= high
    assert abs(np.corrcoef(ends.T)[0, 1]) < 4 / math.sqrt(400)
