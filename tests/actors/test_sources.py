"""Clocks, single events, triggered and random sources."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from epicycle.actors import Actor
from epicycle.runner.execution.engine import ActorError
from tests.actors.feeding import Feed
from tests.actors.library_parts import Feeds, behave, problem, text, tokens
from tests.engine.engine_parts import load

THREE: list[list[Any]] = [[0, "a"], [1, "b"], [1, "c"]]


@pytest.mark.parametrize(
    ("clock", "feeds", "expected"),
    [
        ("{period: 2 s}", [], [(0, 1, 0), (2, 1, 1), (4, 1, 2)]),
        ("{period: 2 s, offset: 1 s}", [], [(1, 1, 0), (3, 1, 1), (5, 1, 2)]),
        ("{period: 3 s, offsets: [0, 0, 1 s], values: [a, b]}", [],
         [(0, 1, "a"), (0, 2, "b"), (1, 1, "a"), (3, 1, "b"), (3, 2, "a"), (4, 1, "b")]),
        ("{period: 1 s, offset: 2 s, stop_time: 3 s}", [], [(2, 1, 0), (3, 1, 1)]),
        ("{period: 1 s, stop_time: 3.9 s, offset: 4 s}", [], []),
        # A start begins a new series, at once or after the offset; what was under way is forgotten.
        ("{period: 2 s}", [("start", [[1, 0], [4, 0]])], [(1, 1, 0), (3, 1, 1), (4, 1, 0)]),
        ("{period: 2 s, offset: 0.5 s}", [("start", [[1, 0], [3, 0]])], [(1.5, 1, 0), (3.5, 1, 0)]),
        # A stop comes before the tick of its own tag, and before a start.
        ("{period: 1 s}", [("stop", [[2, 0]])], [(0, 1, 0), (1, 1, 1)]),
        ("{period: 1 s}", [("start", [[0, 0], [3, 0]]), ("stop", [[1, 0], [3, 0]])], [(0, 1, 0)]),
        ("{period: 1 s}", [("start", [[0, 0], [3.5, 0]]), ("stop", [[1, 0]])], [(0, 1, 0), (3.5, 1, 0), (4.5, 1, 1)]),
        # A new period counts from the next cycle on; the cycle that begins with it is already one of them.
        ("{period: 2 s}", [("period", [[1, 1], [3, 2]])], [(0, 1, 0), (2, 1, 1), (3, 1, 2), (5, 1, 3)]),
    ],
)  # fmt: skip
def test_clock(clock: str, feeds: Feeds, expected: list[tuple[float, int, Any]]) -> None:
    sends = behave(clock.replace("{", "{type: Clock, ", 1), feeds, until=5)
    assert [(time, microstep, token) for time, microstep, _, token in sends] == expected


def test_a_clock_does_not_drift() -> None:
    sends = behave("{type: Clock, period: 0.1 s, offsets: [0, 0.03 s]}", [], until=1000)
    assert (len(sends), sends[-1][0]) == (20_001, 1000.0)
    assert all(abs(time - (n // 2 / 10 + n % 2 * 0.03)) < 1e-12 * max(1, time) for n, (time, *_) in enumerate(sends))


@pytest.mark.parametrize(
    ("clock", "message"),
    [
        ("offsets: [1 s, 0]", "it: offsets: [1.0, 0.0] is not an ascending list of times"),
        ("offsets: []", "it: offsets: [] is not an ascending list of times"),
        ("offsets: [0, 2.5 s]", "it: offsets: 2.5 s is not within the period of 2 s"),
        ("values: []", "it: values: the list is empty; give at least one value"),
    ],
)
def test_wrong_clocks(clock: str, message: str) -> None:
    assert problem(f"{{type: Clock, period: 2 s, {clock}}}") == message


def test_a_period_that_leaves_no_room_for_the_offsets() -> None:
    with pytest.raises(ActorError) as caught:
        behave("{type: Clock, period: 2 s, offsets: [0, 1 s]}", [("period", [[0, 0.5]])])
    assert str(caught.value.reason) == "offsets: 1 s is not within the period of 0.5 s"


def test_poisson_clock() -> None:
    clock = "{type: PoissonClock, mean_interval: 20 ms, values: [x, y]}"
    sends = behave(clock, [], until=100, seed=3)
    assert sends[0] == (0.0, 1, "output", "x")
    assert tokens(sends)[:3] == ["x", "y", "x"]
    gaps = np.diff([time for time, *_ in sends])
    # Theory: exponential gaps without memory. 1e-3: one of a thousand seeds would fail.
    assert stats.kstest(gaps, stats.expon(scale=0.02).cdf).pvalue > 1e-3
    assert abs(np.corrcoef(gaps[1:], gaps[:-1])[0, 1]) < 4 / np.sqrt(len(gaps))
    assert sends == behave(clock, [], until=100, seed=3) != behave(clock, [], until=100, seed=4)
    later = behave("{type: PoissonClock, mean_interval: 20 ms, fire_at_start: false, stop_time: 1 s}", [], seed=3)
    assert 0 < later[0][0] < later[-1][0] <= 1
    assert tokens(later) == list(range(len(later)))


@pytest.mark.parametrize(
    ("source", "feeds", "expected"),
    [
        ("SingleEvent", [], [(0, 1, True)]),
        ("SingleEvent, time: 1.5 s, value: {a: 1}", [], [(1.5, 1, {"a": 1})]),
        ("Const", [], [(0, 1, 1)]),
        ("Const, value: 2.5", [("trigger", THREE)], [(0, 1, 2.5), (1, 1, 2.5), (1, 1, 2.5)]),
        ("Ramp", [("trigger", THREE)], [(0, 1, 0), (1, 1, 1), (1, 1, 2)]),
        ("Ramp, init: 5, step: -0.5", [("trigger", THREE)], [(0, 1, 5), (1, 1, 4.5), (1, 1, 4.0)]),
        ("Ramp", [("trigger", THREE), ("step", [[1, 10]])], [(0, 1, 0), (1, 1, 10), (1, 1, 20)]),
        ("Sequence, values: [p, q]", [("trigger", THREE)], [(0, 1, "p"), (1, 1, "q")]),
        ("Sequence, values: [p, q], repeat: true", [("trigger", THREE)], [(0, 1, "p"), (1, 1, "q"), (1, 1, "p")]),
        ("Sequence, values: []", [("trigger", THREE)], []),
        ("Sequence, values: [], repeat: true", [("trigger", THREE)], []),
        ("Sequence, values: [1, 2]", [("enable", [[0, True], [1, False], [2, True]])], [(0, 1, 1), (2, 1, 2)]),
        ("Sequence, values: [1, 2]", [("trigger", THREE), ("enable", [[0, False], [1, True]])],
         [(1, 1, 1), (1, 1, 2)]),
        ("CurrentTime", [("trigger", THREE)], [(0, 1, 0.0), (1, 1, 1.0), (1, 1, 1.0)]),
        ("CurrentMicrostep", [("trigger", THREE)], [(0, 1, 1), (1, 1, 1), (1, 1, 1)]),
    ],
)  # fmt: skip
def test_simple_sources(source: str, feeds: Feeds, expected: list[tuple[float, int, Any]]) -> None:
    sends = behave(f"{{type: {source}}}", feeds)
    assert [(time, microstep, token) for time, microstep, _, token in sends] == expected
    assert [type(token) for *_, token in sends] == [type(token) for *_, token in expected]


@pytest.mark.parametrize(
    ("source", "port_type"),
    [
        ("Clock, period: 1 s", int),
        ("Clock, period: 1 s, values: [1, 2.5]", float),
        ("Const, value: text", str),
        ("SingleEvent", bool),
        ("Sequence, values: [1, a]", int | str),
        ("Random, distribution: {type: RandomInteger}", int),
        ("Random, distribution: {type: Choice, values: [a, b]}", str),
    ],
)
def test_outputs_have_the_type_of_what_they_send(source: str, port_type: Any) -> None:
    feeds: Feeds = [("trigger", [[0, 0]])] if source.startswith(("Sequence", "Random")) else []
    actor: Actor = load(text(f"{{type: {source}}}", feeds), types=[Feed]).graph.actors["it"]
    assert actor.outputs["output"].type == port_type


# -- random tokens ------------------------------------------------------------------------------------------------

N = 4000


def draw(distribution: str) -> list[Any]:
    return tokens(behave(f"{{type: Random, distribution: {distribution}}}", [("trigger", [[0, 0]] * N)], seed=11))


@pytest.mark.parametrize(
    ("distribution", "law"),
    [
        ("{type: Uniform, low: -1, high: 3}", stats.uniform(-1, 4)),
        ("{type: Normal, mean: 2, standard_deviation: 0.5}", stats.norm(2, 0.5)),
        ("{type: LogNormal, median: 3, sigma: 0.4}", stats.lognorm(0.4, scale=3)),
        ("{type: Exponential, mean: 4}", stats.expon(scale=4)),
        ("{type: Gamma, shape: 3, mean: 6}", stats.gamma(3, scale=2)),
        ("{type: Triangular, low: 1, mode: 2, high: 5}", stats.triang(0.25, 1, 4)),
    ],
)
def test_numbers_follow_their_law(distribution: str, law: Any) -> None:
    found = draw(distribution)
    assert stats.kstest(found, law.cdf).pvalue > 1e-3
    assert {type(token) for token in found} == {float}


@pytest.mark.parametrize(
    ("distribution", "expected"),
    [
        ("{type: Bernoulli, probability: 0.3}", {True: 0.3, False: 0.7}),
        ("{type: RandomInteger, low: -1, high: 2}", dict.fromkeys((-1, 0, 1, 2), 0.25)),
        ("{type: Choice, values: [a, b]}", {"a": 0.5, "b": 0.5}),
        ("{type: Choice, values: [a, b, c], weights: [1, 0, 3]}", {"a": 0.25, "c": 0.75}),
    ],
)
def test_choices_follow_their_weights(distribution: str, expected: dict[Any, float]) -> None:
    found = draw(distribution)
    assert set(found) == set(expected)
    assert {type(token) for token in found} == {type(token) for token in expected}
    counts = [found.count(value) for value in expected]
    assert stats.chisquare(counts, [N * p for p in expected.values()]).pvalue > 1e-3


def test_distributions_without_width() -> None:
    assert set(draw("{type: Constant, value: 2}")) == {2.0}
    assert set(draw("{type: Uniform, low: 2, high: 2}")) == {2.0}
    assert set(draw("{type: Triangular, low: 2, mode: 2, high: 2}")) == {2.0}
    assert set(draw("{type: Bernoulli, probability: 0}")) == {False}
    assert set(draw("{type: Bernoulli, probability: 1}")) == {True}


NAMES = (
    "Bernoulli, Binomial, Cauchy, ChiSquare, Choice, Constant, Exponential, Gamma, LogNormal, NegativeBinomial, "
    "Normal, Poisson, RandomInteger, StudentT, Triangular, Uniform, VonMises"
)


@pytest.mark.parametrize(
    ("distribution", "message"),
    [
        ("{type: Uniform, low: 2}", "low is 2 and high is 1: low must not be above high"),
        ("{type: RandomInteger, low: 2}", "low is 2 and high is 1: low must not be above high"),
        ("{type: Triangular, mode: 2}", "mode is 2 and high is 1: mode must not be above high"),
        ("{type: Gamma, shape: 0}", "Gamma.shape: 0 is out of bounds, expected a number > 0"),
        ("{type: Choice, values: []}", "Choice.values: the list is empty; give at least one value"),
        ("{type: Choice, values: [1, 2], weights: [1]}",
         "Choice.weights: [1.0] must have one weight for each of 2 values"),
        ("{type: Choice, values: [1, 2], weights: [0, 0]}",
         "Choice.weights: [0.0, 0.0] must have one weight for each of 2 values"),
        ("{type: Gaussian}", f"'Gaussian' is not one of {NAMES}"),
    ],
)  # fmt: skip
def test_wrong_distributions(distribution: str, message: str) -> None:
    actor = f"{{type: Random, distribution: {distribution}}}"
    assert problem(actor, [("trigger", [])]) == f"it.distribution: {message}"
