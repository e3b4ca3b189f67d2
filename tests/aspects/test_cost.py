"""Aspects cost nothing where they do not stand, counted in calls of functions: the same in every run of the bench."""

from __future__ import annotations

import pytest

from benchmarks import aspects


@pytest.fixture(scope="module", autouse=True)
def imported() -> None:
    """What is imported when it is needed is there from now on."""
    for place in ("nowhere", "elsewhere", "around", "here"):
        aspects.calls(aspects.model(place, "25 ms"))


def further(place: str, stop: str) -> int:
    """Calls that a run makes beyond those of the model without aspects."""
    found = aspects.calls(aspects.model(place, stop)) - aspects.calls(aspects.model("bare", stop))
    assert isinstance(found, int)
    return found


def test_an_aspect_that_is_off_costs_nothing() -> None:
    assert further("off", "25 ms") == 0


@pytest.mark.parametrize("place", ["nowhere", "elsewhere", "around"])
def test_an_aspect_elsewhere_costs_the_same_however_long_the_run(place: str) -> None:
    assert 0 < further(place, "25 ms") == further(place, "75 ms") <= 100
    assert further("here", "75 ms") - further("here", "25 ms") >= 50  # one for each token, however much is compiled
