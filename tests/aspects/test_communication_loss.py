"""Losses against their laws: rates and runs, at 99.9 % confidence with fixed seeds."""

from __future__ import annotations

import math

import pytest
from scipy import stats

from epicycle.aspects import (
    GilbertElliott,
    MeasurementFailure,
    PacketLoss,
)
from tests.aspects.bench import Bench
from tests.aspects.laws import COUNT, SURE, lost_of, runs


@pytest.mark.slow
@pytest.mark.parametrize(
    ("p", "r", "loss_bad", "loss_good"), [(1 / 12, 0.25, 1, 0), (0.02, 0.1, 0.8, 0.05), (1, 1, 1, 0)]
)
def test_gilbert_elliott(p: float, r: float, loss_bad: float, loss_good: float) -> None:
    aspect = GilbertElliott(p=p, r=r, loss_bad=loss_bad, loss_good=loss_good)
    lost = lost_of(Bench(aspect).play(range(COUNT)), COUNT)
    mean = (p * loss_bad + r * loss_good) / (p + r)
    # Variance of the mean of a two-state chain: that of independent states times (1 + m) / (1 - m), m = 1 - p - r.
    share, memory = p / (p + r), 1 - p - r
    spread = (loss_bad - loss_good) ** 2 * share * (1 - share) * (1 + memory) / (1 - memory)
    spread += share * loss_bad * (1 - loss_bad) + (1 - share) * loss_good * (1 - loss_good)
    assert abs(lost.mean() - mean) <= stats.norm.ppf(0.9995) * math.sqrt(spread / COUNT) + 1 / COUNT
    if loss_bad == 1 and loss_good == 0:
        lengths = runs(lost)
        error = stats.norm.ppf(0.9995) * math.sqrt(1 - r) / r / math.sqrt(len(lengths))
        assert abs(lengths.mean() - 1 / r) <= error + 1e-12
        if r < 1:  # geometric: bursts are longer than those of independent losses of the same rate
            assert lengths.mean() > 2 / (1 - mean)


def test_gilbert_elliott_starts_in_its_stationary_law() -> None:
    starts = [lost_of(Bench(GilbertElliott(p=0.1, r=0.3), seed).play(range(1)), 1)[0] for seed in range(2000)]
    low, high = stats.binom.interval(SURE, 2000, 0.25)
    assert low <= sum(starts) <= high


def test_first_tag_spared() -> None:
    for aspect in (GilbertElliott(p=1, r=0, spare_first=True), PacketLoss(probability=1, spare_first=True)):
        assert Bench(aspect).play(range(5)).tokens == [0]
    assert Bench(MeasurementFailure(probability=0.5, burst=1e9, spare_first=True), seed=3).play(range(5)).tokens[0] == 0


def test_the_first_tag_is_that_of_the_first_token_and_not_of_the_first_loss() -> None:
    for cls in (PacketLoss, MeasurementFailure):
        bare = Bench(cls(probability=0.5), seed=1).play(range(50))
        assert 0 in bare.tokens  # it is not lost anyway
        assert Bench(cls(probability=0.5, spare_first=True), seed=1).play(range(50)).tokens == bare.tokens
