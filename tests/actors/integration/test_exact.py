"""Lines and exponentials, whose solution is known."""

from __future__ import annotations

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest

from epicycle.actors.expression.affine import factors_of
from epicycle.actors.integration import Exact
from epicycle.runner.execution.engine import ActorError
from tests.actors.feeding import feed


def test_a_state_is_exact_to_the_last_places() -> None:
    draw = np.random.default_rng(1)
    worst = 0.0
    for start, rate, side, size, at in draw.uniform(-1.0, 1.0, (2_000, 5)).tolist():
        pull = math.copysign(10.0 ** (6.5 * size - 5.5), side)
        time = 10.0 ** (5.0 * at - 4.0)
        with localcontext() as context:
            context.prec = 60
            speed = Decimal(rate) + Decimal(pull) * Decimal(start)
            change = speed * ((Decimal(pull) * Decimal(time)).exp() - 1) / Decimal(pull)
            expected = Decimal(start) + change
            found = Decimal(Exact([start], [rate], [pull]).at(time)[0])
            scale = abs(Decimal(start)) + (abs(Decimal(rate)) + abs(Decimal(pull * start))) * abs(change / speed)
            worst = max(worst, float(abs(found - expected) / scale))
    assert worst < 2e-15


def test_a_line_is_computed_as_one() -> None:
    exact = Exact([1.0, 0.25], [2.0, 0.0], [0.0, 0.0])
    assert exact.at(0.125) == [1.25, 0.25]
    assert exact.bounds(0.0, 4.0) == [(1.0, 9.0), (0.25, 0.25)]


def test_at_its_level_an_exponential_stays_there() -> None:
    exact = Exact([5.0], [-10.0], [2.0])
    assert exact.step()
    assert exact.time == 1e6
    assert exact.at(1e6) == [5.0]


@pytest.mark.parametrize(
    ("source", "factors"),
    [
        ("-1 / 3600", {"": "-1 / 3600"}),
        ("(1 - x) / tau", {"": "1 / tau", "x": "-1.0 / tau"}),
        ("gain * (x - (2 * x + y)) + k", {"": "k", "x": "gain * (1.0 - 2 * 1.0)", "y": "gain * -1.0"}),
        ("+x - sqrt(k)", {"": "-sqrt(k)", "x": "+1.0"}),
        ("0 if k else 1", {"": "0 if k else 1"}),
    ],
)
def test_a_linear_expression_is_taken_apart(source: str, factors: dict[str, str]) -> None:
    found = factors_of(source, frozenset("xy"))
    assert found is not None
    assert {name: formula.source for name, formula in found.items()} == factors


@pytest.mark.parametrize("source", ["x * y", "1 / x", "x ** 2", "sin(x)", "0 if x > 1 else 1", "x % 2", "min(x, 1)"])
def test_another_is_left_as_it_is(source: str) -> None:
    assert factors_of(source, frozenset("xy")) is None


def test_a_charge_crosses_its_levels_at_the_nearest_nanosecond() -> None:
    battery = {
        "type": "ODE",
        "initial": {"charge": 0.2, "used": 0},
        "derivatives": {"charge": "(1 - charge) / 720", "used": "0.01"},
        "crossings": {"full": "charge - 0.9", "third": "used - 1 / 3"},
    }
    _, sent, _ = feed(battery, {}, until=3600)
    assert [time for time, _ in sent["full"]] == [round(720 * math.log(8), 9)]
    assert [time for time, _ in sent["third"]] == [round(100 / 3, 9)]


@pytest.mark.parametrize("rate", [2, 2.0])
def test_an_input_bends_the_line(rate: float) -> None:
    tank = {
        "type": "ODE",
        "initial": {"level": 1},
        "derivatives": {"level": "flow"},
        "crossings": {"full": "level - 8"},
    }
    _, sent, _ = feed(tank, {"flow": [(1.0, rate), (2.0, 0), (5.0, -1.5), (6.0, 6.5)]}, until=10)
    assert [time for time, _ in sent["full"]] == [7.0]
    assert [value for _, value in sent["level"]] == [8.0]


def test_growth_ends_with_the_range_of_numbers() -> None:
    growing = {"type": "ODE", "initial": {"x": 1}, "derivatives": {"x": "x"}, "crossings": {"large": "x - 1e308"}}
    _, sent, _ = feed(growing, {}, until=709.7)
    assert [time for time, _ in sent["large"]] == [round(308 * math.log(10), 9)]
    with pytest.raises(ActorError, match=r"at \(709\.783 s, 1\): the solution cannot be continued"):
        feed(growing, {}, until=800)
