"""Intervals that cover as often as they say, and tests that agree with SciPy's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from epicycle.runner.study.inference import half_width, holm, is_usable, mean, paired_difference, rate
from epicycle.runner.support.student import student_quantile, student_tail

RUNS = 3000


def is_covered_as_said(hits: int, level: float, runs: int = RUNS) -> bool:
    """At a confidence of 99.9 %."""
    low, high = stats.binom.interval(0.999, runs, level)
    return bool(low <= hits <= high)


@pytest.mark.parametrize(("count", "level"), [(2, 0.95), (6, 0.95), (6, 0.8)])
def test_students_interval_covers_the_mean_of_normal_values(count: int, level: float) -> None:
    draws = np.random.default_rng(5).normal(3.0, 2.0, (RUNS, count))
    estimates = [mean(row.tolist(), level) for row in draws]
    assert is_covered_as_said(sum(each.low < 3.0 < each.high for each in estimates), level)
    assert estimates[0].value == pytest.approx(draws[0].mean())
    assert estimates[0].error == pytest.approx(stats.sem(draws[0]))
    assert estimates[0].high - estimates[0].value == pytest.approx(half_width(draws[0].tolist(), level))


def test_wilsons_interval_covers_a_rate_on_average() -> None:
    """For a single rate its coverage swings around the level; over many rates it is the level."""
    random = np.random.default_rng(7)
    shares = random.uniform(0.05, 0.95, RUNS)
    hits = 0
    for share in shares:
        found = rate(int(random.binomial(50, share)), 50)
        hits += found.low <= share <= found.high
    assert is_covered_as_said(hits, 0.95)
    assert rate(0, 10).low == 0.0
    assert 0.2 < rate(0, 10).high < 0.35


def test_paired_difference_is_scipys_paired_test() -> None:
    random = np.random.default_rng(1)
    first = {each: float(value) for each, value in enumerate(random.normal(0, 1, 20))}
    second = {each: value + 0.2 + float(random.normal(0, 0.3)) for each, value in first.items()}
    expected = stats.ttest_rel(list(second.values()), list(first.values()))
    low, high = expected.confidence_interval(0.95)
    # A replication that one of them has not is left out of both.
    found = paired_difference({**first, 77: 5.0}, {**second, 78: -5.0})
    assert found.p == pytest.approx(expected.pvalue)
    assert (found.estimate.low, found.estimate.high) == pytest.approx((low, high))
    assert found.estimate.count == 20


def test_holm_is_the_correction_of_the_textbook() -> None:
    # Worked by hand: 0.005 * 4, 0.01 * 3, 0.03 * 2, and 0.04 * 1 raised to the one before.
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, 0.9]) == [1.0, 1.0]
    assert holm([]) == []
    corrected = holm([math.nan, 0.02, 0.03])
    assert math.isnan(corrected[0])
    assert corrected[1:] == pytest.approx([0.04, 0.04])


def test_holm_keeps_the_rate_of_false_alarms() -> None:
    alarms = sum(min(holm(row)) < 0.05 for row in np.random.default_rng(2).uniform(size=(RUNS, 5)).tolist())
    # 1 - 0.99 ** 5, for five independent tests of true hypotheses.
    assert is_covered_as_said(alarms, 1 - 0.99**5)


def test_few_values_give_no_false_certainty() -> None:
    assert half_width([1.0]) == math.inf
    none, one = mean([]), mean([4.0])
    assert (math.isnan(none.value), none.count) == (True, 0)
    assert (one.value, one.low, one.high) == (4.0, -math.inf, math.inf)
    assert rate(0, 0).high == 1.0
    assert math.isnan(paired_difference({1: 2.0}, {1: 3.0}).p)
    assert paired_difference({1: 2.0, 2: 2.0}, {1: 2.0, 2: 2.0}).p == 1.0
    # Without any spread there is the sign test alone, and rounding is no spread.
    before = {each: 0.1 * each for each in range(8)}
    for gap in (1.0, 0.1, -0.7):
        found = paired_difference(before, {each: value + gap for each, value in before.items()})
        assert found.p == pytest.approx(stats.binomtest(0, 8).pvalue)
        assert found.estimate.error == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("exponent", [-1060, -600, 600, 1000])
def test_numbers_may_be_as_small_or_large_as_floats_are(exponent: int) -> None:
    """A power of 2 changes the exponents of all numbers, and nothing else."""
    values = [3.0, 5.0, 4.0, 8.0]
    usual, other = mean(values), mean([math.ldexp(each, exponent) for each in values])
    assert (other.value, other.error) == pytest.approx(
        (math.ldexp(usual.value, exponent), math.ldexp(usual.error, exponent)), rel=1e-3
    )
    first, second = dict(enumerate(values)), dict(enumerate([4.0, 7.0, 9.0, 8.0]))
    scaled = [{at: math.ldexp(each, exponent) for at, each in side.items()} for side in (first, second)]
    assert paired_difference(scaled[0], scaled[1]).p == pytest.approx(paired_difference(first, second).p, rel=1e-3)


def test_numbers_near_the_end_of_the_range_of_floats_are_not_used() -> None:
    values = [None, math.nan, math.inf, -math.inf, 1.5e308, -1e306, 10**400, -9e304, 0.0, 1, True]
    assert [each for each in values if is_usable(each)] == [-9e304, 0.0, 1, True]
    found = paired_difference(dict.fromkeys(range(3), -9e304), {0: 9e304, 1: 0.0, 2: 1.0})
    assert (math.isfinite(found.p), math.isfinite(found.estimate.high), found.estimate.count) == (True, True, 3)


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 9, 19, 29, 60, 199, 200, 201, 999, 5_000])
def test_students_t_is_scipys_to_twelve_digits(freedom: int) -> None:
    for p in (0.001, 0.025, 0.3, 0.6, 0.9, 0.975, 0.995, 0.99999):
        assert student_quantile(p, freedom) == pytest.approx(stats.t.ppf(p, freedom), rel=1e-12)
    for number in (0.0, 0.3, 1.0, 2.0, 5.0, 40.0, 1e6, -1.5):
        expected = stats.t.sf(number, freedom)
        assert student_tail(number, freedom) == pytest.approx(expected, rel=1e-11, abs=1e-290)


def test_students_t_at_its_ends() -> None:
    # With one and with two degrees of freedom there are closed forms.
    assert student_tail(1.0, 1) == pytest.approx(0.25, rel=1e-14)
    assert student_tail(1e-9, 1) == pytest.approx(0.5 - 1e-9 / math.pi, rel=1e-14)
    assert student_quantile(0.75, 1) == pytest.approx(1.0, rel=1e-14)
    assert student_quantile(0.9, 2) == pytest.approx(0.8 / math.sqrt(2 * 0.9 * 0.1), rel=1e-14)
    assert student_quantile(0.5, 7) == 0.0
    assert student_quantile(0.25, 7) == -student_quantile(0.75, 7)
    assert (student_tail(math.inf, 3), student_tail(-math.inf, 3)) == (0.0, 1.0)
    assert math.isnan(student_tail(math.nan, 3))
    z = 1.959963984540054
    assert student_quantile(0.975, 100_000) == pytest.approx(z + (z**3 + z) / 400_000, rel=1e-9)
    for p, freedom in ((0.0, 3), (1.0, 3), (math.nan, 3), (0.5, 0)):
        with pytest.raises(ValueError, match="there is no quantile"):
            student_quantile(p, freedom)


def test_wilsons_interval_is_scipys() -> None:
    for successes, count in ((0, 7), (3, 7), (7, 7), (120, 4000)):
        expected = stats.binomtest(successes, count).proportion_ci(0.9, method="wilson")
        found = rate(successes, count, 0.9)
        assert found.low == pytest.approx(expected.low, abs=1e-15)
        assert found.high == pytest.approx(expected.high, rel=1e-13)


def test_students_t_has_these_bits() -> None:
    """Made of + - * / and square roots, they are the same everywhere."""
    found = [student_quantile(p, freedom).hex() for p, freedom in ((0.975, 19), (0.995, 9), (0.95, 250))]
    assert found == ["0x1.0be83653b666fp+1", "0x1.9ffa9c6c4220ep+1", "0x1.a6a6114b5ff1bp+0"]
