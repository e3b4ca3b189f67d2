"""Limiter, Quantizer, DeadZone and Hysteresis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors import DeadZone, EpicycleError, Hysteresis, Limiter, ParameterError, Quantizer
from epicycle.actors.testing import Harness

signals = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30)


def passed(actor: Any, samples: list[float]) -> list[float]:
    harness = Harness(actor)
    harness.run(1e6, input=[(float(k), sample) for k, sample in enumerate(samples)])
    return harness.tokens("output")


@given(signals)
def test_saturation_and_dead_zone_are_clipping(samples: list[float]) -> None:
    assert passed(Limiter("it", low=-3, high=5), samples) == np.clip(samples, -3, 5).tolist()
    assert passed(DeadZone("it", low=-3, high=5), samples) == (np.array(samples) - np.clip(samples, -3, 5)).tolist()


@given(signals, st.floats(0, 1e6), st.floats(0, 1e6))
def test_steps_are_no_larger_than_the_rates_allow(samples: list[float], rising: float, falling: float) -> None:
    found = passed(Limiter("it", rising=rising, falling=falling), samples)
    at, wanted = samples[0], []
    for sample in samples:
        at = min(max(sample, at - falling), at + rising)
        wanted.append(at)
    assert found == wanted


def test_a_limiter_is_on_its_way_between_tokens() -> None:
    harness = Harness(Limiter("it", rising=2, falling=4, high=5, initial=0))
    harness.run(
        9.0, input=[(1.0, 9.0), (4.0, -7.0)], trigger=[(0.5, 0), (2.0, 0), (3.0, 0), (4.0, 0), (5.0, 0), (8, 0)]
    )
    assert harness.sent["output"] == [
        (0.5, 0.0), (1.0, 1.0), (2.0, 3.0), (3.0, 5.0), (4.0, 1.0), (5.0, -3.0), (8.0, -7.0)
    ]  # fmt: skip
    quiet = Harness(Limiter("it", rising=1))
    quiet.run(9.0, input=[(5.0, 100.0)], trigger=[(1.0, 0)])
    assert quiet.sent["output"] == [(5.0, 100.0)]  # before the first token there is nothing to tell


@given(signals, st.sampled_from([0.5, 0.25, 3.0]), st.sampled_from([0.0, 0.125]))
def test_quantizers_round_as_numpy_does(samples: list[float], step: float, offset: float) -> None:
    for rounding, function in (("nearest", np.rint), ("down", np.floor), ("up", np.ceil)):
        found = passed(Quantizer("it", step=step, offset=offset, rounding=rounding), samples)
        assert found == [offset + float(function((each - offset) / step)) * step for each in samples]


def test_a_relay_stays_between_its_borders_as_it_is() -> None:
    harness = Harness(Hysteresis("it", upper=1, lower=-1, on=10, off=-10))
    harness.run(99.0, input=list(enumerate([0.0, 0.9, 1.0, 0.0, -0.9, -1.0, 0.5, 2.0])))
    assert harness.tokens("output") == [-10, -10, 10, 10, 10, -10, -10, 10]
    assert harness.sent["switched"] == [(2.0, True), (5.0, False), (7.0, True)]
    assert passed(Hysteresis("it", upper=1, lower=-1, initial=True), [0.0]) == [1.0]


@pytest.mark.parametrize(
    ("kind", "parameters", "message"),
    [
        (Limiter, {"low": 2, "high": 1}, "low is 2 and high is 1: low must not be above high"),
        (Limiter, {"high": 1, "initial": 2}, "initial: 2 is not within -inf and 1"),
        (DeadZone, {"low": 2, "high": 1}, "low is 2 and high is 1: low must not be above high"),
        (Hysteresis, {"lower": 1, "upper": 1}, "lower is 1 and upper is 1: lower must be below upper"),
        (Quantizer, {"step": 0}, "it: Quantizer.step: 0 is out of bounds, expected a number > 0"),
    ],
)
def test_limits_that_are_none(kind: Any, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        kind("it", **parameters)
    assert str(caught.value) == message


def test_what_has_too_many_steps() -> None:
    harness = Harness(Quantizer("it", step=1e-300))
    with pytest.raises(EpicycleError) as caught:
        harness.fire(0.0, input=1e300)
    assert str(caught.value) == "1e+300 is too large or not a number, and cannot be rounded to steps of 1e-300"
