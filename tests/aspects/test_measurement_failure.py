"""Sensors that fail or are stuck, against their laws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from epicycle.aspects import (
    MeasurementFailure,
    StuckAt,
)
from tests.aspects.bench import Bench
from tests.aspects.execution.execution_parts import chain, sent
from tests.aspects.laws import COUNT, SURE, lost_of, runs


@pytest.mark.slow
@pytest.mark.parametrize(("probability", "burst"), [(0.25, 4.0), (0.5, 10.0), (0.1, 1.0)])
def test_failures_in_runs(probability: float, burst: float) -> None:
    lost = lost_of(Bench(MeasurementFailure(probability=probability, burst=burst)).play(range(COUNT)), COUNT)
    r = 1 / burst
    memory = 1 - r - r * probability / (1 - probability)
    spread = probability * (1 - probability) * (1 + memory) / (1 - memory)
    assert abs(lost.mean() - probability) <= stats.norm.ppf(0.9995) * math.sqrt(spread / COUNT)
    lengths = runs(lost)
    assert (
        abs(lengths.mean() - burst)
        <= stats.norm.ppf(0.9995) * math.sqrt(1 - r) * burst / math.sqrt(len(lengths)) + 1e-9
    )


def test_stuck() -> None:
    bench = Bench(StuckAt(p=0.05, r=0.2)).play(range(COUNT))
    values = np.array(bench.tokens)
    stuck = values != np.arange(COUNT)
    starts = np.flatnonzero(~stuck[:-1] & stuck[1:])
    assert all((values[start + 1] == start) for start in starts)
    assert not stuck[0]
    lengths = runs(stuck)
    assert abs(lengths.mean() - 5) <= stats.norm.ppf(0.9995) * math.sqrt(0.8) / 0.2 / math.sqrt(len(lengths))
    low, high = stats.binom.interval(SURE, int((~stuck).sum()), 0.05)
    assert low <= len(starts) <= high
    assert Bench(StuckAt(p=1)).play(range(4)).tokens == [0, 0, 0, 0]


def test_a_sensor_that_sticks_again_repeats_nothing_from_before_it_worked() -> None:
    _, results = chain("type: StuckAt, p: 1, until: 2 s, every: 4 s, at: t.output")
    assert [token for _, token in sent(results)] == [0, 0, 2, 3, 4, 4]
