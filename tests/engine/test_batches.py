"""Exact sums, batches, warm-up and intervals: what a metric keeps of a run, and what that says of its value."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.runner.execution.engine.batches import MOST, TimeBatches, TokenBatches, batch_interval, mser
from epicycle.runner.execution.engine.measurement import Measurement, Outcome
from epicycle.runner.execution.engine.statistic import Total
from epicycle.runner.model.catalogue.metrics import MetricSpec
from epicycle.runner.model.graph.outputs import Metric
from tests.engine.engine_parts import SECOND, measured


@given(st.lists(st.floats(-1e200, 1e200, allow_subnormal=True), max_size=60), st.integers(1, 40))
def test_sums_are_exact_however_many_there_are(values: list[float], times: int) -> None:
    total = Total()
    for value in values * times:
        total.add(value)
    assert total.value == float(sum(map(Fraction, values)) * times)


@given(st.lists(st.tuples(st.integers(0, 10**12), st.integers(0, 10**11), st.integers(-9, 9)), max_size=30))
@settings(max_examples=60)
def test_slices_of_time_hold_what_stood_in_them(spans: list[tuple[int, int, int]]) -> None:
    batches = TimeBatches(0)
    for begin, length, value in spans:
        if length:
            batches.add(float(value), begin, begin + length)
    end = max((begin + length for begin, length, _ in spans), default=0)
    sums, covered = batches.batches(end)
    assert len(sums) <= MOST
    width = batches._width
    first = end // width - len(sums)
    for index, (found, weight) in enumerate(zip(sums, covered, strict=True)):
        low, high = (first + index) * width, (first + index + 1) * width
        inside = [(value, min(begin + length, high) - max(begin, low)) for begin, length, value in spans]
        assert found == sum(value * length for value, length in inside if length > 0)
        assert weight == sum(length for _, length in inside if length > 0)


def test_batches_of_tokens_stay_few() -> None:
    batches = TokenBatches()
    for value in range(100_000):
        batches.add(float(value))
    sums, weights = batches.batches()
    assert MOST // 2 <= len(sums) < MOST
    size = int(weights[0])
    assert sums == [float(sum(range(at * size, (at + 1) * size))) for at in range(len(sums))]


@given(st.lists(st.integers(-50, 50).map(float), min_size=10, max_size=40))
def test_mser_is_its_definition(means: list[float]) -> None:
    def error(cut: int) -> Fraction:
        rest = [Fraction(each) for each in means[cut:]]
        mean = sum(rest) / len(rest)
        return sum((each - mean) ** 2 for each in rest) / len(rest) ** 2

    errors = {cut: error(cut) for cut in range(len(means) - 4)}  # a mean of fewer than five says nothing
    least = min(errors.values())
    found = mser(means)
    good = [cut for cut, value in errors.items() if float(value) == pytest.approx(float(least), rel=1e-9)]
    assert (found in good) or (found is None and max(good) > len(means) // 2)


def test_mser_cuts_off_what_has_not_settled() -> None:
    assert mser([9.0, 5.0, 3.0] + [1.0, 2.0] * 20) == 3
    assert mser([1.0] * 40) == 0
    assert mser([float(each) for each in range(40)]) is None


def test_a_warm_up_that_is_found_is_told() -> None:
    values = [100.0] * 20 + [1.0, 3.0] * 200
    tokens = [("a.out", place * SECOND, value) for place, value in enumerate(values)]
    found = measured(tokens, 420 * SECOND, take="mean", after="mser5", interval=0.95)
    assert (found.value, found.after) == (2.0, 20.0)
    assert found.remarks[-1] == "after 20 s"
    over_time = measured(tokens, 420 * SECOND, take="time_mean", after="mser5")
    assert (over_time.value, over_time.after) == (2.0, 20.0)
    # Hardly anything comes at first, and then two a second.
    slow = [("a.out", place * 20 * SECOND, 0) for place in range(5)]
    rush = [("a.out", 100 * SECOND + place * SECOND // 2, 0) for place in range(800)]
    rate = measured(slow + rush, 500 * SECOND, take="rate", after="mser5")
    assert rate.value == pytest.approx(2.0, rel=0.01)
    assert 95 <= rate.after <= 110


def test_interval_by_hand() -> None:
    values = [1.0, 2.0, 4.0, 3.0] * 5
    tokens = [("a.out", place * SECOND, value) for place, value in enumerate(values)]
    found = measured(tokens, 20 * SECOND, take="mean", interval=0.95).interval
    assert found is not None
    deviations = np.array(values) - 2.5
    correlation = float((deviations[1:] * deviations[:-1]).sum() / (deviations**2).sum())
    assert found.autocorrelation == pytest.approx(correlation)
    widening = max(correlation + 0.05, 0.0)
    half = 2.0930240544 * np.std(values, ddof=1) / math.sqrt(20) * math.sqrt((1 + widening) / (1 - widening))
    assert (found.low, found.high) == (pytest.approx(2.5 - half), pytest.approx(2.5 + half))
    assert (found.batches, found.level, found.is_shaky) == (20, 0.95, False)


def test_too_few_tokens_have_no_interval_and_too_short_a_run_is_told() -> None:
    tokens = [("a.out", place * SECOND, float(place)) for place in range(40)]
    found = measured(tokens[:19], 19 * SECOND, take="mean", interval=0.9)
    assert (found.value, found.interval) == (9.0, None)
    assert found.remarks == ["no interval, because 19 tokens are too few for 20 batches"]
    found = measured(tokens, 40 * SECOND, take="time_mean", interval=0.9)
    assert found.remarks == ["90 % interval, autocorrelation 0.85 (too high: make the run longer)"]
    same = measured([("a.out", place, 3.0) for place in range(40)], 40, take="mean", interval=0.9)
    assert same.interval is not None
    assert (same.interval.low, same.interval.high, same.interval.autocorrelation) == (3.0, 3.0, 0.0)


def test_a_batch_in_which_nothing_counts_has_no_mean() -> None:
    weights = [1.0] * 40
    weights[12:14] = [0.0, 0.0]
    assert batch_interval([2.0] * 40, weights, 2.0, 0.95) is None
    weights[12] = 1.0
    assert batch_interval([2.0] * 40, weights, 2.0, 0.95) is not None


def is_covered(outcome: Outcome, truth: float) -> bool:
    found = outcome.interval
    return found is not None and found.low <= truth <= found.high


def test_intervals_cover_the_mean_of_what_hangs_together() -> None:
    """AR(1) with 0.9: the naive interval of a thousand such numbers covers the mean in 36 of 100 runs."""
    random, runs, length = np.random.default_rng(11), 400, 1000
    shocks = random.normal(size=(length, runs))
    series = np.empty((length, runs))
    series[0] = shocks[0] / math.sqrt(1 - 0.81)
    for place in range(1, length):
        series[place] = 0.9 * series[place - 1] + shocks[place]
    hits = 0
    for column in series.T.tolist():
        measurement = Measurement(Metric("m", ["a"], MetricSpec(take="mean", interval=0.95)))
        for place, value in enumerate(column):
            measurement.add("a", place, value)
        hits += is_covered(measurement.outcome(length), 0.0)
    assert 0.90 <= hits / runs <= 0.98


def test_intervals_over_time_cover_the_mean_number_in_a_queue() -> None:
    """M/M/1 at 0.5, of which one is in the system on average and the server is busy half of the time."""
    random, runs, customers = np.random.default_rng(3), 120, 500
    hits = {"time_mean": 0, "share": 0, "rate": 0}
    for _ in range(runs):
        arrivals = np.cumsum(random.exponential(2.0, customers))
        services = random.exponential(1.0, customers)
        leaves = np.empty(customers)
        last = 0.0
        for place in range(customers):
            last = leaves[place] = max(arrivals[place], last) + services[place]
        events = sorted([(int(each * 1e9), 1) for each in arrivals] + [(int(each * 1e9), -1) for each in leaves])
        measurements = {
            take: Measurement(
                Metric("m", ["a"], MetricSpec(take=take, initial=0, after=50.0, interval=0.95, when=when))
            )
            for take, when in (("time_mean", None), ("share", "value > 0"))
        }
        coming = Measurement(Metric("m", ["a"], MetricSpec(take="rate", after=50.0, interval=0.95)))
        number = 0
        for time, change in events:
            number += change
            for measurement in measurements.values():
                measurement.add("a", time, number)
            if change > 0:
                coming.add("a", time, number)
        end = int(arrivals[-1] * 1e9)
        hits["time_mean"] += is_covered(measurements["time_mean"].outcome(end), 1.0)
        hits["share"] += is_covered(measurements["share"].outcome(end), 0.5)
        hits["rate"] += is_covered(coming.outcome(end), 0.5)
    for take, count in hits.items():
        assert 0.88 <= count / runs <= 0.985, take
