"""Media against theory, at 99.9 % confidence with fixed seeds: queues, ALOHA, carrier sense and backoff."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize, stats

from epicycle.actors import EpicycleError
from epicycle.aspects import Bus, FieldError, Medium, RadioMedium
from tests.aspects.bench import SECOND, Bench

SURE = 0.999


def poisson(rate: float, count: int, seed: int) -> NDArray[np.float64]:
    """Times of arrival, in whole nanoseconds."""
    gaps = np.random.default_rng(seed).exponential(1 / rate, count)
    return np.round(np.cumsum(gaps) * SECOND) / SECOND


def is_mean(values: NDArray[np.float64], mean: float, batches: int = 40) -> bool:
    """Whether a correlated series has this mean: batch means, Student's t."""
    means = values[: len(values) // batches * batches].reshape(batches, -1).mean(axis=1)
    spread = stats.t.ppf(0.5 + SURE / 2, batches - 1) * means.std(ddof=1) / math.sqrt(batches)
    return bool(abs(means.mean() - mean) <= spread)


# -- the bus -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("load", [0.3, 0.8])
def test_bus_is_an_m_d_1_queue(load: float) -> None:
    service, count = 1e-3, 40_000
    times = poisson(load / service, count, seed=3)
    ports = np.random.default_rng(4).choice(["a", "b", "c"], count)
    bus = Bus(factor="0.5 ms", message_length=2)
    bench = Bench(a=bus, b=bus, c=bus).play_at(zip(times, ports, range(count), strict=True))
    assert [(port, token) for _, port, token in bench.out] == list(zip(ports, range(count), strict=True))
    ends = np.array([time for time, _, _ in bench.out])
    free, expected = 0.0, []
    for time in times:  # Lindley's recursion
        free = max(time, free) + service
        expected.append(free)
    assert ends == pytest.approx(expected, abs=1e-9)
    waits = ends - times - service
    assert is_mean(waits, load * service / (2 * (1 - load)))
    report = bench.report()
    assert report["mean_wait"] == pytest.approx(waits.mean(), abs=1e-12)
    assert report["mean_queue"] == pytest.approx(waits.sum() / ends[-1])  # Little
    low, high = stats.poisson.interval(SURE, load / service * ends[-1])
    assert low * service <= report["utilisation"] * ends[-1] <= high * service
    assert len(bench.of("delayed")) == count


@pytest.mark.slow
def test_priorities_follow_cobham() -> None:
    count, service, loads = 60_000, 1e-3, (0.3, 0.5)
    times = poisson(sum(loads) / service, count, seed=5)
    urgent = np.random.default_rng(6).random(count) < loads[0] / sum(loads)
    bench = Bench(low=Bus(factor=service, priority=2), high=Bus(factor=service, priority=1)).play_at(
        (time, "high" if first else "low", index) for index, (time, first) in enumerate(zip(times, urgent, strict=True))
    )
    waits = np.empty(count)
    for time, _, index in bench.out:
        waits[index] = time - times[index] - service
    residual = sum(loads) * service / 2
    assert is_mean(waits[urgent], residual / (1 - loads[0]))
    assert is_mean(waits[~urgent], residual / ((1 - loads[0]) * (1 - sum(loads))))
    for class_ in (urgent, ~urgent):  # first in, first out
        assert (np.diff(times[class_] + waits[class_]) > 0).all()


@pytest.mark.slow
def test_bus_without_a_place_to_wait_loses_as_erlang_says() -> None:
    service, count, load = 1e-3, 40_000, 0.8
    bench = Bench(a=Bus(factor=service, capacity=0)).play_at(
        zip(poisson(load / service, count, seed=7), itertools.repeat("a"), range(count))
    )
    dropped = len(bench.of("dropped"))
    # Those that come while one is carried: Poisson with mean load for each that is.
    low, high = stats.poisson.interval(SURE, (count - dropped) * load)
    assert low <= dropped <= high
    assert dropped / count == pytest.approx(load / (1 + load), rel=0.02)
    assert bench.report()["mean_wait"] == 0.0


@pytest.mark.parametrize(
    ("overflow", "priorities", "arriving", "dropped"),
    [
        ("newest", "000000", "abc", "def"),
        ("oldest", "000000", "aef", "bcd"),
        ("newest", "021012", "adc", "bef"),
        ("oldest", "021012", "ade", "bcf"),
    ],
)
def test_overflow(overflow: str, priorities: str, arriving: str, dropped: str) -> None:
    tokens = [{"name": name, "urgency": int(number)} for name, number in zip("abcdef", priorities, strict=True)]
    bus = Bus(factor=1, capacity=2, overflow=overflow, priority_field="urgency")
    bench = Bench(a=bus).play_at((0.1 * index, "a", token) for index, token in enumerate(tokens))
    assert "".join(token["name"] for _, _, token in bench.out) == arriving
    assert "".join(token["name"] for token in bench.of("dropped")) == dropped


def test_length_of_a_message() -> None:
    @dataclass
    class Image:
        name: str
        pixels: NDArray[np.float64]
        bits: Any = 40

    def took(token: Any, **parameters: Any) -> float:
        return Bench(a=Bus(factor="1 ms", **parameters)).play_at([(0.0, "a", token)]).out[0][0]

    image = Image("x", np.zeros((2, 3)))
    assert took(image) == 0.001
    assert took(image, message_length=4, number_length=0.5) == 0.0075
    assert took(image, message_length=4, length_field="bits") == 0.04
    assert took([1, (2.0, "three"), {"four": True}, None], message_length=0, number_length=1) == 0.002
    for token, parameters, message in (
        (1.0, {"length_field": "bits"}, "a token of type float has no fields"),
        (image, {"length_field": "bit"}, "Image has no field 'bit'; its fields: name, pixels, bits"),
        (
            image,
            {"length_field": "name"},
            "Image.name is 'x', but the length of a message must be a finite number",
        ),
        (Image("x", np.zeros(1), -1), {"length_field": "bits"}, "Image.bits is -1, but a length must be >= 0"),
        (
            Image("x", np.zeros(1), math.nan),
            {"priority_field": "bits"},
            "Image.bits is nan, but the priority of a message must be a finite number",
        ),
        (object(), {"number_length": 1}, "a token of type object holds no numbers to count"),
    ):
        with pytest.raises(FieldError) as caught:
            took(token, **parameters)
        assert str(caught.value) == message


def test_a_message_that_comes_as_another_is_through_finds_the_bus_free() -> None:
    # The second one's arrival is handled before the end of the first one, at the same instant.
    bench = Bench(a=Bus(factor=1, capacity=0)).play_at([(0.0, "a", 1), (1.0, "a", 2), (1.5, "a", 3), (2.0, "a", 4)])
    assert bench.out == [(1.0, "a", 1), (2.0, "a", 2), (3.0, "a", 4)]


# -- the radio ---------------------------------------------------------------------------------------------------------


def radio(**parameters: Any) -> RadioMedium:
    """An airtime of 1 ms, if nothing else is said."""
    return RadioMedium(**{"message_length": "1 kbit", "rate": "1 Mbit/s", **parameters})


@pytest.mark.slow
@pytest.mark.parametrize("load", [0.2, 1.0])
def test_aloha(load: float) -> None:
    count = 10_000
    aloha = radio(carrier_sense=False, window=1, retries=0)
    # Each message from a station of its own: n stations in the limit.
    bench = Bench(radio=aloha).play_at(
        (time, f"s{index}.radio", index) for index, time in enumerate(poisson(load / 1e-3, count, seed=8))
    )
    through = np.zeros(count)
    through[[token for _, _, token in bench.out]] = 1
    assert is_mean(through, math.exp(-2 * load))
    report = bench.report()
    assert report["collision_rate"] == pytest.approx(1 - through.mean())
    assert report["throughput"] == pytest.approx(load * math.exp(-2 * load), rel=0.1)
    assert report["mean_delay"] == pytest.approx(1e-3)
    assert len(bench.of("collided")) == len(bench.of("dropped")) == count - through.sum()


@pytest.mark.slow
@pytest.mark.parametrize(("robots", "window"), [(2, 4), (5, 16), (12, 32)])
def test_broadcasts_at_once_are_heard_if_their_backoffs_differ(robots: int, window: int) -> None:
    ticks = 1600
    bench = Bench(radio=radio(window=window, slot="20 us", retries=0)).play_at(
        (0.1 * tick, f"r{robot}.radio", tick) for tick in range(ticks) for robot in range(robots)
    )
    heard = np.bincount([token for _, _, token in bench.out], minlength=ticks)
    low, high = stats.binom.interval(SURE, ticks, math.prod(1 - taken / window for taken in range(robots)))
    assert low <= (heard == robots).sum() <= high
    assert is_mean(heard.astype(float), robots * (1 - 1 / window) ** (robots - 1))
    # One after the other: the airtime grows with the number of robots.
    transmissions = Counter(round(time / 0.1) for time, _, _, _ in bench.acts)
    assert len(transmissions) == ticks
    alone = heard == robots
    spans = np.zeros(ticks)
    for time, _, tick in bench.out:
        spans[tick] = max(spans[tick], time - 0.1 * tick)
    slots = (spans[alone] - robots * 1e-3) / 20e-6
    assert (slots > -1e-3).all()
    assert (slots < window).all()


def saturated(stations: int, each: int, **parameters: Any) -> Bench:
    return Bench(radio=radio(**parameters)).play_at(
        (0.0, f"s{station}.radio", number) for number in range(each) for station in range(stations)
    )


def transmissions(bench: Bench, until: float) -> NDArray[np.float64]:
    """1 for each transmission that collided, 0 for each that did not, in their order, as long as all have to send."""
    return np.array(
        [event == "collided" for time, _, event, _ in bench.acts if event in ("collided", "delayed") and time <= until],
        float,
    )


def all_busy(bench: Bench, each: int) -> float:
    """When the first station had nothing left to send."""
    sent = Counter[str]()
    for time, port, _ in bench.out:
        sent[port] += 1
        if sent[port] == each:
            return time
    raise AssertionError("no station has sent all")


@pytest.mark.slow
def test_two_stations_follow_the_markov_chain_of_their_backoffs() -> None:
    window, each = 4, 6000
    # State: the slots that each still has to count; it moves once a slot, a transmission being one slot, too.
    size = window * window
    step = np.zeros((size, size))
    draw = [(1 / window, number) for number in range(window)]
    for a, b in itertools.product(range(window), repeat=2):
        of_a = draw if a == 0 else [(1.0, a - 1)]
        of_b = draw if b == 0 else [(1.0, b - 1)]
        for (p, new_a), (q, new_b) in itertools.product(of_a, of_b):
            step[a * window + b, new_a * window + new_b] += p * q
    stationary = np.linalg.matrix_power(step, 4096)[0].reshape(window, window)
    collided = 2 * stationary[0, 0] / (stationary[0].sum() + stationary[:, 0].sum())
    bench = saturated(2, each, window=window, max_window=window, retries=10**6, slot="50 us")
    assert is_mean(transmissions(bench, all_busy(bench, each)), float(collided))


@pytest.mark.slow
def test_saturated_stations_follow_bianchi() -> None:
    stations, each, window, doublings, slot, airtime = 10, 1200, 32, 3, 50e-6, 1e-3

    def attempts(p: float) -> float:
        return 2 * (1 - 2 * p) / ((1 - 2 * p) * (window + 1) + p * window * (1 - (2 * p) ** doublings))

    p = optimize.brentq(lambda p: p - 1 + (1 - attempts(p)) ** (stations - 1), 1e-6, 0.49)
    t = attempts(p)
    someone = 1 - (1 - t) ** stations
    one = stations * t * (1 - t) ** (stations - 1)
    throughput = one * airtime / ((1 - someone) * slot + someone * airtime)
    bench = saturated(stations, each, window=window, max_window=window * 2**doublings, retries=10**6, slot=slot)
    end = all_busy(bench, each)
    found = transmissions(bench, end)
    assert found.mean() == pytest.approx(p, rel=0.03)  # his assumption of independence costs so much
    assert sum(time <= end for time, _, _ in bench.out) * airtime / end == pytest.approx(throughput, rel=0.01)


@pytest.mark.slow
def test_the_window_doubles() -> None:
    slot, tries = 50e-6, 6
    drawn: list[list[int]] = [[] for _ in range(tries)]
    bench = Bench(radio=radio(loss=1, window=4, max_window=64, retries=tries - 1, slot=slot)).play_at(
        (0.1 * index, "s.radio", index) for index in range(3000)
    )
    last = {}
    for time, _, event, token in bench.acts:
        if event == "lost":
            gap = (time - last.get(token, (0.1 * token, 0))[0] - 1e-3) / slot
            number = last.get(token, (0, 0))[1]
            last[token] = (time, number + 1)
            assert gap == pytest.approx(round(gap), abs=1e-3)
            drawn[number].append(round(gap))
    assert bench.out == []
    assert len(bench.of("dropped")) == 3000
    for number, values in enumerate(drawn):
        size = min(4 * 2**number, 64)
        counts = np.bincount(values, minlength=size)
        assert len(counts) == size
        assert stats.chisquare(counts).pvalue > 1 - SURE


@pytest.mark.slow
def test_capture_and_loss() -> None:
    count = 4000
    both = [(0.1 * index, f"{name}.radio", index) for index in range(count) for name in "ab"]
    bench = Bench(radio=radio(capture=0.6, window=1, retries=0)).play_at(both)
    low, high = stats.binom.interval(SURE, count, 0.6)
    assert low <= len(bench.out) <= high
    low, high = stats.binom.interval(SURE, len(bench.out), 0.5)
    assert low <= sum(port == "a.radio" for _, port, _ in bench.out) <= high
    assert len({token for _, _, token in bench.out}) == len(bench.out)  # never both
    bench = Bench(radio=radio(loss=0.3, retries=2)).play_at(both[::2])
    low, high = stats.binom.interval(SURE, count, 0.3**3)
    assert low <= len(bench.of("dropped")) <= high
    low, high = stats.binom.interval(SURE, len(bench.of("lost")) + len(bench.out), 0.3)
    assert low <= len(bench.of("lost")) <= high


def test_a_station_sends_one_message_at_a_time() -> None:
    def times(*tokens: tuple[float, str, int], **parameters: Any) -> tuple[dict[int, float], Bench]:
        bench = Bench(plan=radio(window=1, **parameters), picture=radio(window=1, message_length="2 kbit")).play_at(
            tokens
        )
        return {token: round(1000 * time, 6) for time, _, token in bench.out}, bench

    found, bench = times((0.0, "a.plan", 1), (0.0, "a.picture", 2), (0.0005, "a.plan", 3))
    assert found == {1: 1.0, 2: 3.0, 3: 4.0}
    assert bench.report() == {"utilisation": 1.0, "throughput": 1.0, "collision_rate": 0.0, "mean_delay": 7.5e-3 / 3}
    # The urgent one goes first; who comes while another sends waits, and collides with who has waited, too.
    found, bench = times((0.0, "a.plan", 1), (0.0001, "a.picture", 2), (0.0002, "a.plan", 3), priority=-1, capacity=1)
    assert found == {1: 1.0, 3: 2.0}
    assert [(port, token) for _, port, event, token in bench.acts if event == "dropped"] == [("a.picture", 2)]
    found, bench = times((0.0, "a.plan", 1), (0.0002, "b.plan", 2), (0.0003, "c.plan", 3), retries=0)
    assert found == {1: 1.0}
    assert bench.report()["collision_rate"] == pytest.approx(2 / 3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Bus(factor=-1), "Bus.factor: -1 is out of bounds, expected a number in s >= 0"),
        (lambda: Bus(factor=1, capacity=-1), "Bus.capacity: -1 is out of bounds, expected an integer >= 0"),
        (lambda: radio(rate=0), "RadioMedium.rate: 0 is out of bounds, expected a number in bit/s > 0"),
        (lambda: radio(loss=1.5), "RadioMedium.loss: 1.5 is out of bounds, expected a number from 0 to 1"),
        (
            lambda: radio(window=64, max_window=32),
            "max_window is 32 and window is 64: max_window must not be below window",
        ),
    ],
)
def test_wrong_parameters(make: Callable[[], Medium], message: str) -> None:
    with pytest.raises(EpicycleError) as caught:
        make()
    assert str(caught.value) == message


def test_a_radio_needs_a_length_of_its_messages() -> None:
    with pytest.raises(EpicycleError) as caught:
        RadioMedium(rate=1)
    assert str(caught.value) == ("messages take no time: give message_length, number_length, length_field or overhead")
    for given in ({"message_length": 1}, {"number_length": 1}, {"overhead": 1}, {"length_field": "bits"}):
        assert RadioMedium(rate=1, **given).window == 16


def test_times_of_a_radio_to_the_nanosecond() -> None:
    bench = Bench(radio=radio(window=1, overhead="1 us")).play_at([(0.0, "a.radio", 1), (0.01, "a.radio", 2)])
    assert bench.out == [(0.001001, "a.radio", 1), (0.011001, "a.radio", 2)]
    report = bench.report()
    assert report["mean_delay"] == 0.001001
    assert report["utilisation"] == report["throughput"] == 2 * 1_001_000 / 11_001_000
    assert Bench(radio=radio()).report() == pytest.approx(
        dict.fromkeys(("utilisation", "throughput", "collision_rate", "mean_delay"), math.nan), nan_ok=True
    )


def test_times_of_a_bus_to_the_nanosecond() -> None:
    bench = Bench(a=Bus(factor="1 ms")).play_at([(0.001, "a", 1), (0.0015, "a", 2), (0.0015, "a", 3)])
    assert bench.out == [(0.002, "a", 1), (0.003, "a", 2), (0.004, "a", 3)]
    assert bench.report() == pytest.approx({"utilisation": 0.75, "mean_wait": 0.002 / 3, "mean_queue": 0.5}, rel=1e-12)
