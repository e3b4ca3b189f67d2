"""Every aspect against its law: rates, runs, delays and errors, at 99.9 % confidence with fixed seeds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.actors import BodyState, EpicycleError, ParameterError, Plan
from epicycle.aspects import (
    Aspect,
    Bias,
    Corrupt,
    Drift,
    Duplicate,
    FieldError,
    GilbertElliott,
    Latency,
    MeasurementFailure,
    Noise,
    Outlier,
    PacketLoss,
    Quantise,
    Reorder,
    Saturate,
    StuckAt,
    Throttle,
)
from tests.aspects.bench import Bench
from tests.aspects.strengths import AT_WORK, AT_ZERO, at_ports, concrete_aspects

MILLISECOND = 1_000_000
SURE = 0.999


@dataclass
class Reading:
    """A token with fields."""

    name: str
    value: Any
    valid: bool = True


def runs(lost: np.ndarray) -> np.ndarray:
    """Lengths of the runs of true values, those at the ends left out."""
    edges = np.flatnonzero(np.diff(lost.astype(int)))
    lengths = np.diff(edges)
    return lengths[0::2] if not lost[0] else lengths[1::2]


def lost_of(bench: Bench, count: int) -> np.ndarray:
    lost = np.ones(count, bool)
    lost[bench.tokens] = False
    return lost


COUNT = 40_000


# -- loss -----------------------------------------------------------------------------------------------------------


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


def test_first_tag_spared() -> None:
    for aspect in (GilbertElliott(p=1, r=0, spare_first=True), PacketLoss(probability=1, spare_first=True)):
        assert Bench(aspect).play(range(5)).tokens == [0]
    assert Bench(MeasurementFailure(probability=0.5, burst=1e9, spare_first=True), seed=3).play(range(5)).tokens[0] == 0


def test_the_first_tag_is_that_of_the_first_token_and_not_of_the_first_loss() -> None:
    for cls in (PacketLoss, MeasurementFailure):
        bare = Bench(cls(probability=0.5), seed=1).play(range(50))
        assert 0 in bare.tokens  # it is not lost anyway
        assert Bench(cls(probability=0.5, spare_first=True), seed=1).play(range(50)).tokens == bare.tokens


# -- delay, order, copies --------------------------------------------------------------------------------------------


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


# -- errors -----------------------------------------------------------------------------------------------------------


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
    assert Bench(Saturate(low=-1, high=2)).play([-3.0, 0.5, 7]).tokens == [-1.0, 0.5, 2]
    assert Bench(Bias(by=0.5)).play([1.0, Reading("a", 2.0)], period=1).tokens == [1.5, Reading("a", 2.5)]


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


def test_when_a_token_is_of_is_no_number_to_be_altered() -> None:
    """But for whoever names it.  A stuck sensor repeats what it saw, and does not know that this is old."""
    plan = Plan("b", 1.5, BodyState([1.0, 2.0], [0.0, 0.0], 1.5), np.zeros((2, 2)))
    biased, named = (Bench(Bias(by=1, fields=names)).play([plan]).tokens[0] for names in ((), ("time",)))
    assert (biased.time, biased.state.time, biased.state.position.tolist()) == (1.5, 1.5, [2.0, 3.0])
    assert (named.time, named.state.time, named.state.position.tolist()) == (2.5, 1.5, [1.0, 2.0])
    assert Bench(Bias(by=1)).play([{"time": 1.0, "speed": 2.0}]).tokens == [{"time": 1.0, "speed": 3.0}]
    states = [BodyState([float(n), 0.0], [0.0, 0.0], float(n)) for n in range(3)]
    stuck = Bench(StuckAt(p=1)).play(states).tokens
    assert [(each.position[0], each.time) for each in stuck] == [(0.0, 0.0), (0.0, 1.0), (0.0, 2.0)]
    stamped = [{"time": 0.0, "x": 1.0}, {"time": 1.0, "x": 2.0}, {"x": 3.0}]
    assert Bench(StuckAt(p=1)).play(stamped).tokens == [
        {"time": 0.0, "x": 1.0},
        {"time": 1.0, "x": 1.0},
        {"time": 0.0, "x": 1.0},
    ]


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


# -- what all have in common -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("aspect", at_ports(AT_ZERO), ids=repr)
def test_strength_zero_hands_on_the_very_tokens_and_leaves_no_trace(aspect: Aspect) -> None:
    sent = [1.5, 3, np.array([1.0, 2.0]), Reading("a", (1.0, [2.0])), {"x": 1.0}, -0.0, math.nan]
    bench = Bench(aspect, world={"a.at": [0.0, 0.0], "b.at": {"position": [3.0, 4.0]}}).play(sent, period=10)
    assert len(bench.tokens) == len(sent)
    assert all(out is token for out, token in zip(bench.tokens, sent, strict=True))
    assert [time for time, _ in bench.passed] == [10.0 * index for index in range(len(sent))]
    assert bench.told == []
    assert bench.points["a.port"].counts == {}


def test_every_aspect_has_strengths() -> None:
    assert concrete_aspects() == {type(aspect) for aspect in AT_ZERO} == {type(aspect) for aspect in AT_WORK}


@pytest.mark.parametrize("aspect", at_ports(AT_WORK), ids=repr)
def test_whatever_is_done_to_a_token_is_told(aspect: Aspect) -> None:
    """A token without an act has passed as it came, when it came."""
    sent = [Reading(str(index), 10.0 + index) for index in range(200)]
    bench = Bench(aspect, world={"a.at": [0.0], "b.at": [4.0], "c.at": [2.0]}).play(sent)
    told = {id(value[0] if isinstance(value, list) else value) for _, value in bench.told}
    passed = [(id(token), time) for time, token in bench.passed]
    untouched = [(id(token), float(index)) for index, token in enumerate(sent) if id(token) not in told]
    assert [each for each in passed if each[0] not in told and each in untouched] == untouched
    assert told
    assert {event for event, _ in bench.told} <= set(aspect.events)


def test_tokens_of_every_kind_keep_their_type() -> None:
    tokens = [2, np.array([1, 2]), np.float32(1.5), Reading("a", [1.0, (2, "x", None, True)]), {"x": {"y": 2.0}}]
    out = Bench(Bias(by=0.4)).play(tokens).tokens
    assert out[0] == 2  # integers are rounded
    assert out[1].tolist() == [1.0, 2.0]
    assert out[2] == pytest.approx(1.9)
    assert out[3] == Reading("a", [1.4, (2, "x", None, True)])
    assert out[4] == {"x": {"y": 2.4}}
    assert Bench(Bias(by=1, fields=["value"])).play([Reading("a", 1.0), {"name": "b", "value": 2.0}]).tokens == [
        Reading("a", 2.0),
        {"name": "b", "value": 3.0},
    ]


@pytest.mark.parametrize(
    ("aspect", "token", "message"),
    [
        (Bias(by=1), object(), "a token of type object holds no numbers to alter"),
        (Bias(by=1, fields=["x"]), 1.0, "a token of type float has no fields; leave out 'fields' to alter all of it"),
        (Bias(by=1, fields=["x"]), Reading("a", 1.0), "Reading has no field 'x'; its fields: name, value, valid"),
    ],
)
def test_tokens_that_cannot_be_altered(aspect: Aspect, token: Any, message: str) -> None:
    with pytest.raises(FieldError) as caught:
        Bench(aspect).play([token])
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GilbertElliott(p=1.5), "GilbertElliott.p: 1.5 is out of bounds, expected a number from 0 to 1"),
        (lambda: Latency(delay=-1), "Latency.delay: -1 is out of bounds, expected a number in s >= 0"),
        (lambda: Saturate(low=2, high=1), "low 2 is above high 1"),
        (
            lambda: MeasurementFailure(probability=0.9, burst=2),
            (
                "a failure probability of 0.9 cannot come in runs of 2 in the mean: a working sensor works for one "
                "measurement at least; burst must be >= 9"
            ),
        ),
    ],
)
def test_wrong_parameters(make: Callable[[], Aspect], message: str) -> None:
    with pytest.raises((ParameterError, EpicycleError)) as caught:
        make()
    assert str(caught.value) == message
