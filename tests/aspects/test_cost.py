"""Aspects cost nothing where they do not stand, counted in calls of functions: the same in every run of the bench."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

BENCH = Path(__file__).parents[2] / "benchmarks" / "aspects.py"
sys.path.insert(0, str(BENCH.parent))  # what it shares with the others


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    spec = importlib.util.spec_from_file_location("cost_of_aspects", BENCH)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.calls(module.model("nowhere", "25 ms"))  # what is imported when it is needed is there from now on
    return module


def further(bench: ModuleType, place: str, stop: str) -> int:
    """Calls that a run makes beyond those of the model without aspects."""
    found = bench.calls(bench.model(place, stop)) - bench.calls(bench.model("bare", stop))
    assert isinstance(found, int)
    return found


def test_an_aspect_that_is_off_costs_nothing(bench: ModuleType) -> None:
    assert further(bench, "off", "25 ms") == 0


@pytest.mark.parametrize("place", ["nowhere", "elsewhere", "around"])
def test_an_aspect_elsewhere_costs_the_same_however_long_the_run(bench: ModuleType, place: str) -> None:
    assert 0 < further(bench, place, "25 ms") == further(bench, place, "75 ms") < 100
    assert further(bench, "here", "75 ms") > 2.5 * further(bench, "here", "25 ms") > 500 / 3
