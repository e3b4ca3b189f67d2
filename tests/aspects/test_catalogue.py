"""What all aspects of the catalogue have in common."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from epicycle.actors import BodyState, EpicycleError, ParameterError, Plan
from epicycle.aspects import (
    Aspect,
    Bias,
    FieldError,
    GilbertElliott,
    Latency,
    MeasurementFailure,
    Saturate,
    StuckAt,
)
from tests.aspects.bench import Bench
from tests.aspects.laws import Reading
from tests.aspects.strengths import AT_WORK, AT_ZERO, at_ports, concrete_aspects


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
        (
            Bias(by=1, fields=["x"]),
            1.0,
            "a token of type float has no fields; leave out 'fields' to alter all its numbers",
        ),
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
        (lambda: Saturate(low=2, high=1), "low is 2 and high is 1: low must not be above high"),
        (
            lambda: MeasurementFailure(probability=0.9, burst=2),
            (
                "failures with probability 0.9 cannot come in runs of 2 on average: a working sensor works for at "
                "least one measurement; burst must be >= 9"
            ),
        ),
        (
            lambda: MeasurementFailure(probability=1, burst=2),
            (
                "failures with probability 1 cannot come in runs of 2 on average: a working sensor works for at "
                "least one measurement; leave out 'burst'"
            ),
        ),
        (lambda: MeasurementFailure(probability=0.5, burst=math.inf), "burst: the mean of runs must be finite"),
    ],
)
def test_wrong_parameters(make: Callable[[], Aspect], message: str) -> None:
    with pytest.raises((ParameterError, EpicycleError)) as caught:
        make()
    assert str(caught.value) == message
