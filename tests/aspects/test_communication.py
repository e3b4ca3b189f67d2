"""Messages that come late, twice, in another order or damaged, against their laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.aspects import (
    Corrupt,
    Duplicate,
    Latency,
    Reorder,
    Throttle,
)
from tests.aspects.bench import Bench
from tests.aspects.execution.execution_parts import chain, sent
from tests.aspects.laws import COUNT, SURE, Reading


@pytest.mark.parametrize(
    ("distribution", "law"),
    [
        ("uniform", stats.uniform(3, 4)),
        ("normal", stats.norm(5, 2)),
        ("exponential", stats.expon(5, 2)),
        ({"type": "Gamma", "shape": 2, "mean": 1}, stats.gamma(2, 5, 1)),
    ],
)
def test_latency_follows_its_law(distribution: Any, law: Any) -> None:
    aspect = Latency(delay="5 ms", jitter="2 ms", distribution=distribution, reordering=True)
    bench = Bench(aspect).play(range(5000), period=0.5)
    delays = np.array([time - 0.5 * token for time, token in bench.passed])
    if distribution == "normal":
        assert (delays >= 0).all()  # cut off there
        delays = delays[delays > 1e-3]
    assert stats.kstest(delays, law.cdf).pvalue > 1 - SURE
    assert bench.tokens != sorted(bench.tokens)
    assert len(bench.told) == sum(time != 0.5 * token for time, token in bench.passed)
    assert {act for act, _ in bench.told} == {"delayed"}
    arrivals = {token: time for time, token in bench.passed}
    for _, (token, delay) in bench.told[:50]:
        assert delay == pytest.approx((arrivals[token] - 0.5 * token) * 1e-3, abs=1e-9)


def test_latency_in_order() -> None:
    bench = Bench(Latency(delay="5 ms", jitter="20 ms", distribution="exponential")).play(range(500))
    assert bench.tokens == list(range(500))
    free = Bench(Latency(delay="5 ms", jitter="20 ms", distribution="exponential", reordering=True)).play(range(500))
    own = {token: time for time, token in free.passed}
    latest = 0.0
    for time, token in bench.passed:  # each at its own time, or together with the one before it
        latest = max(latest, own[token])
        assert time == pytest.approx(latest, abs=1e-5)


def test_latency_keeps_the_order_late_in_a_long_run() -> None:
    late = [(1e7 + number / 1000, "a.port", number) for number in range(1000)]
    bench = Bench(Latency(delay="5 ms", jitter="5 ms")).play_at(late)
    assert bench.tokens == list(range(1000))


def test_constant_latency() -> None:
    assert Bench(Latency(delay="5 ms")).play("ab").passed == [(5.0, "a"), (6.0, "b")]


def test_duplicates() -> None:
    bench = Bench(Duplicate(probability=0.3, copies=2, spacing="0.25 ms")).play(range(COUNT // 10))
    counts = np.bincount(bench.tokens)
    assert set(counts) == {1, 3}
    low, high = stats.binom.interval(SURE, len(counts), 0.3)
    assert low <= (counts == 3).sum() <= high
    twice = int(np.argmax(counts == 3))
    assert [time - twice for time, token in bench.passed if token == twice] == pytest.approx([0, 0.25, 0.5])
    assert bench.told[0] == ("duplicated", [twice, 2])


def test_reordering() -> None:
    always = Bench(Reorder(probability=0.25, overtaken_by=2)).play(range(2000))
    places = {token: place for place, token in enumerate(always.tokens)}
    held = [token for event, token in always.told if event == "held"]
    low, high = stats.binom.interval(SURE, 2000, 0.25)
    assert low <= len(held) <= high
    for token in held:
        if token in places:
            assert sum(places[other] < places[token] for other in range(token + 1, 2000) if other in places) >= 2
    free = [token for token in always.tokens if token not in set(held)]
    assert free == sorted(free)
    assert len(always.tokens) + len(set(held) - set(always.tokens)) == 2000


def test_messages_are_released_after_the_aspect_has_ended() -> None:
    _, results = chain("type: Reorder, probability: 1, overtaken_by: 2, until: 2 s, at: a.input")
    assert [token for _, token in sent(results)] == [2, 3, 0, 1, 4, 5]


@pytest.mark.parametrize("excess", ["drop", "delay"])
def test_throttle(excess: str) -> None:
    aspect = Throttle(rate=100, burst=5, excess=excess)
    bench = Bench(aspect).play(range(1000))  # 1,000 messages a second for a second
    times = np.array([time for time, _ in bench.passed])
    assert (times[:5] == np.arange(5)).all()
    for width in (100.0, 500.0):  # never more than burst + rate * time in any window
        inside = [np.count_nonzero((times >= start) & (times < start + width)) for start in times]
        assert max(inside) <= 5 + 0.1 * width
    if excess == "drop":
        assert len(bench.passed) == 5 + 99
        assert bench.tokens == sorted(bench.tokens)
    else:
        assert bench.tokens == list(range(1000))
        assert np.diff(times[5:]) == pytest.approx(10.0)


def test_throttle_lets_what_is_on_time_pass() -> None:
    for excess in ("drop", "delay"):
        assert len(Bench(Throttle(rate=10, excess=excess)).play(range(200), period=100).passed) == 200
        assert Bench(Throttle(rate=10, excess=excess)).play(range(200), period=100).told == []
        late = [(1e7 + number / 10, "a.port", number) for number in range(200)]  # after some months
        assert Bench(Throttle(rate=10, excess=excess)).play_at(late).told == []


@pytest.mark.parametrize("kind", ["gaussian", "bit_flip"])
def test_corruption(kind: str) -> None:
    sent = [Reading(str(i), np.array([float(i), 2.0])) for i in range(4000)]
    bench = Bench(Corrupt(probability=0.2, kind=kind, deviation=3, fields=["value"])).play(sent)
    old = np.array([reading.value for reading in sent])
    new = np.array([reading.value for reading in bench.tokens])
    hit = (new.view(np.uint64) != old.view(np.uint64)).any(axis=1)
    low, high = stats.binom.interval(SURE, 4000, 0.2)
    assert low <= hit.sum() <= high
    assert [reading.name for reading in bench.tokens] == [reading.name for reading in sent]
    if kind == "gaussian":
        assert stats.kstest((new - old)[hit].ravel(), stats.norm(0, 3).cdf).pvalue > 1 - SURE
    else:
        flipped = old[hit].view(np.uint64) ^ new[hit].view(np.uint64)
        which = np.log2(flipped.astype(float)).ravel()
        assert (which == which.round()).all()
        assert stats.chisquare(np.bincount(which.astype(int), minlength=64)).pvalue > 1 - SURE
