"""Filters of sampled signals, against scipy.signal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.actors import Butterworth, DiscreteFilter, EpicycleError, FirstOrder, ParameterError
from epicycle.actors.testing import Harness

SAMPLES = np.random.default_rng(0).normal(size=200).cumsum().tolist()


def filtered(samples: list[float], **parameters: Any) -> list[float]:
    harness = Harness(DiscreteFilter("it", **parameters))
    harness.run(1e6, input=[(float(k), sample) for k, sample in enumerate(samples)])
    return harness.tokens("output")


coefficients = st.lists(st.floats(-2, 2), min_size=1, max_size=5)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(numerator=coefficients, denominator=coefficients, first=st.sampled_from([-2.0, 1.0, 0.5]))
def test_difference_equations_are_lfilter(numerator: list[float], denominator: list[float], first: float) -> None:
    denominator = [first, *(0.2 * each for each in denominator)]
    wanted = scipy.signal.lfilter(numerator, denominator, SAMPLES)
    found = filtered(SAMPLES, numerator=numerator, denominator=denominator)
    assert found == pytest.approx(wanted.tolist(), rel=1e-9, abs=1e-9 * float(np.abs(wanted).max() + 1.0))


def test_a_fir_filter_needs_a_numerator_alone() -> None:
    weights = [0.25, 0.5, 0.25]
    assert filtered(SAMPLES, numerator=weights) == pytest.approx(
        np.convolve(SAMPLES, weights)[:200].tolist(), abs=1e-12
    )
    assert filtered([1.0, 0.0, 0.0], numerator=[0, 0, 3]) == [0.0, 0.0, 3.0]  # leading zeros are delays


@pytest.mark.parametrize("passes", ["low", "high"])
@pytest.mark.parametrize("order", [1, 2, 3, 4, 7, 12])
@pytest.mark.parametrize("cutoff", [0.002, 0.1, 0.45])  # of the rate of the samples
def test_butterworth_is_that_of_scipy(passes: str, order: int, cutoff: float) -> None:
    design = {"type": "Butterworth", "cutoff": cutoff / 0.01, "period": 0.01, "order": order, "passes": passes}
    sections = scipy.signal.butter(order, cutoff, btype=passes, fs=1.0, output="sos")
    assert filtered(SAMPLES, design=design) == pytest.approx(
        scipy.signal.sosfilt(sections, SAMPLES).tolist(), rel=1e-8, abs=1e-9
    )


@pytest.mark.parametrize("order", [1, 2, 5])
def test_half_of_the_power_passes_at_the_cutoff(order: int) -> None:
    _, response = np.array([1.0]), 1.0 + 0.0j
    for above, below in Butterworth(cutoff=5, period=0.01, order=order).sections():
        _, each = scipy.signal.freqz(above, below, worN=[2 * math.pi * 5 * 0.01])
        response *= each[0]
    assert abs(response) == pytest.approx(math.sqrt(0.5), rel=1e-12)


def test_a_lag_is_what_a_held_input_makes_of_it() -> None:
    """The same as the continuous system, looked at just before each sample."""
    found = filtered(SAMPLES, design={"type": "FirstOrder", "time_constant": "2 s", "period": "500 ms"})
    q, value, wanted = math.exp(-0.25), 0.0, []
    for sample in SAMPLES:
        value = q * value + (1 - q) * sample
        wanted.append(value)
    assert found == pytest.approx(wanted, rel=1e-12)
    assert FirstOrder(time_constant=1e9, period=1e-3).sections()[0][0][0] == pytest.approx(1e-12, rel=1e-12)


@pytest.mark.parametrize(
    "parameters",
    [
        {"numerator": [0.2, 0.3], "denominator": [1, -0.5, 0.2]},
        {"design": {"type": "Butterworth", "cutoff": 5, "period": 0.01, "order": 5}},
        {"design": {"type": "Butterworth", "cutoff": 5, "period": 0.01, "order": 4, "passes": "high"}},
    ],
)
def test_a_settled_filter_has_heard_the_first_sample_for_ever(parameters: dict[str, Any]) -> None:
    harness = DiscreteFilter("it", **parameters, start="settled")
    sections = [np.concatenate([np.pad(b, (0, 3 - len(b))), np.pad(a, (0, 3 - len(a)))]) for b, a in harness._sections]
    start = scipy.signal.sosfilt_zi(sections) * SAMPLES[0]
    wanted, _ = scipy.signal.sosfilt(sections, SAMPLES, zi=start)
    assert filtered(SAMPLES, **parameters, start="settled") == pytest.approx(wanted.tolist(), abs=1e-11)


def test_a_reset_begins_anew_and_tokens_of_one_tag_are_taken_in_turn() -> None:
    harness = Harness(DiscreteFilter("it", numerator=[1], denominator=[1, -1]))
    harness.run(5.0, input=[(0.0, 1), (0.0, 2), (1.0, 3), (2.0, 4)], reset=[(1.0, 0), (3.0, 0)])
    assert harness.sent["output"] == [(0.0, 1.0), (0.0, 3.0), (1.0, 3.0), (2.0, 7.0)]


def test_what_is_unstable_grows_until_it_cannot() -> None:
    assert filtered([1.0] * 11, denominator=[1, -(2.0**100)])[-1] == pytest.approx(2.0**1000)
    with pytest.raises(EpicycleError, match=r"^the output has grown too large for a float: the filter is unstable$"):
        filtered([1.0] * 12, denominator=[1, -(2.0**100)])


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({}, "give either a 'numerator' (and 'denominator') or a 'design'"),
        ({"numerator": [1], "design": {"type": "FirstOrder", "time_constant": 1, "period": 1}},
         "give either a 'numerator' (and 'denominator') or a 'design'"),
        ({"numerator": [1], "denominator": [0, 1]},
         "denominator: the first coefficient, that of the highest power, must not be 0 or missing"),
        ({"denominator": [1, -1], "start": "settled"},
         "start: a filter that integrates never settles (the coefficients of its denominator add up to 0)"),
        ({"design": {"type": "Butterworth", "cutoff": 50, "period": 0.01}},
         "it: DiscreteFilter.design: cutoff: 50 Hz is not below 50 Hz, half the rate of the samples"),
    ],
)  # fmt: skip
def test_filters_that_are_none(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        DiscreteFilter("it", **parameters)
    assert str(caught.value) == message
