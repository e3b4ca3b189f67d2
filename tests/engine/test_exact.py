"""Small parts of the engine, exactly: quantiles by weight, cells of tables, long signals in short."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from epicycle.runner.execution.engine import Results
from epicycle.runner.execution.engine.statistic import Quantile, Spread, TimeQuantile
from epicycle.runner.execution.results.encoding import cell
from tests.engine.engine_parts import simulate


@pytest.mark.parametrize(("p", "value"), [(0.0, 1.0), (0.25, 1.0), (0.26, 2.0), (0.75, 2.0), (0.76, 3.0), (1.0, 3.0)])
def test_quantiles_by_time(p: float, value: float) -> None:
    quantile = TimeQuantile(p)
    assert quantile.value is None
    for number, nanoseconds in ((2.0, 1), (1.0, 1), (3.0, 1), (2.0, 1)):
        quantile.add(number, nanoseconds)
    assert quantile.value == value


@pytest.mark.parametrize(("p", "value"), [(0.0, 1.0), (0.25, 1.75), (0.5, 2.5), (1.0, 5.0)])
def test_quantiles_by_count(p: float, value: float) -> None:
    quantile = Quantile(p)
    assert quantile.value is None
    for number in (5.0, 1.0, 3.0, 2.0):
        quantile.add(number, 1)
    assert quantile.value == value


@pytest.mark.parametrize(("sample", "deviation"), [(True, math.sqrt(10.0)), (False, math.sqrt(8.0))])
def test_spread(sample: bool, deviation: float) -> None:
    spread = Spread(sample=sample)
    assert spread.value is None
    for number in (2.0, 4.0, 6.0, 8.0, 10.0):
        spread.add(number, 1)
    assert spread.value == pytest.approx(deviation, rel=1e-15)
    one = Spread(sample=sample)
    one.add(3.0, 1)
    assert one.value == (None if sample else 0.0)


@pytest.mark.parametrize(
    ("leaf", "expected"),
    [
        (None, ("none", None, None)),
        (True, ("bool", 1.0, None)),
        (3, ("int", 3.0, None)),
        (2**53 + 1, ("int", 2.0**53, str(2**53 + 1))),
        (10**400, ("int", math.inf, str(10**400))),
        (-(10**400), ("int", -math.inf, str(-(10**400)))),
        (np.float32(0.5), ("float", 0.5, None)),
        ("a", ("text", None, "a")),
    ],
)
def test_cells(leaf: Any, expected: tuple[str, float | None, str | None]) -> None:
    assert cell(leaf) == expected


def run(ticks: int) -> Results:
    text = (
        "actors: {t: {type: Ticker}, p: {type: Probe}}\nconnections: [t.output -> p.input]\nrun: {record: [t.output]}"
    )
    return simulate(text, until=ticks - 1)[1]


def test_a_long_signal_is_shown_in_short() -> None:
    shown = [run(ticks)["t.output"]._tables()[0].rows for ticks in (1, 16, 17, 40)]
    lengths = [len(rows) for rows in shown]
    assert lengths[0] == 1
    assert lengths[1] == 16
    assert lengths[2] == lengths[3] == 17
    times = [*map(str, range(8)), "...", *map(str, range(32, 40))]
    assert [row[0] for row in shown[3]] == times
