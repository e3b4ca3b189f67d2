"""The steps of an ODE: what must not hide in a long one, and what they cost."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import trajectory
from epicycle.actors.expression import Formula
from epicycle.actors.integration import STEPPERS
from epicycle.runner import load_model
from epicycle.runner.execution.engine import Simulation
from tests.actors.feeding import feed, ticks

CLOCK: dict[str, Any] = {"type": "ODE", "initial": {"t": 0}, "derivatives": {"t": 1}}
REST: dict[str, Any] = {"type": "ODE", "initial": {"x": 0}, "derivatives": {"x": 0}}


@pytest.mark.parametrize("method", ["DOP853", "BDF", "Radau"])
@pytest.mark.parametrize(
    ("actor", "times"),
    [
        ({**REST, "crossings": {"c": "1 if 1000 < time < 1000.3 else -1"}}, [1000.0, 1000.3]),
        ({**CLOCK, "crossings": {"c": "1 if 1000 < t < 1000.3 else -1"}}, [1000.0, 1000.3]),
        ({**CLOCK, "crossings": {"c": "0.5 - exp(-(8 * (t - 1000)) ** 2)"}}, [999.895930674, 1000.104069326]),
        ({**CLOCK, "crossings": {"c": "1 / (1 + 50 * (t - 1000) ** 2) - 0.5"}}, [999.858578644, 1000.141421356]),
        ({**CLOCK, "crossings": {"c": "(t - 1000) ** 2 - 0.04"}}, [999.8, 1000.2]),
        ({**CLOCK, "crossings": {"c": "t ** 2 - 2000 * t + 999999.96"}}, [999.8, 1000.2]),
        ({**CLOCK, "crossings": {"c": "abs(t - 1000) - 0.1"}}, [999.9, 1000.1]),
        ({**REST, "crossings": {"c": "sin(2 * pi * time / 512)"}}, [256.0, 512.0, 768.0, 1024.0]),
        ({**REST, "crossings": {"c": "[1, -1][int(time / 300) % 2]"}}, [300.0, 600.0, 900.0]),
        ({**REST, "crossings": {"c": "x - 0.5"}, "derivatives": {"x": "1 if 1000 < time < 1001 else 0"}}, [1000.5]),
        (
            {**REST, "crossings": {"c": "x - 0.0625"}, "derivatives": {"x": "max(0, min(time - 1000, 1001 - time))"}},
            [1000 + 0.125**0.5],
        ),
        (
            {
                "type": "ODE",
                "initial": {"t": 0, "x": 0},
                "derivatives": {"t": 1, "x": "exp(-(t - 1000) ** 2)"},
                "crossings": {"c": f"x - {math.sqrt(math.pi) / 2}"},
            },
            [1000.0],
        ),
    ],
)
def test_what_is_short_does_not_hide_in_a_long_step(actor: dict[str, Any], times: list[float], method: str) -> None:
    """Nothing else happens for 1,000 s: without a look at where things may hide, a step would jump over it."""
    _, sent, _ = feed({**actor, "method": method}, {}, until=1100.0)
    # What a stiff solver makes of a rate that jumps is not good to nine digits.
    tolerance = 1e-5 if method in ("BDF", "Radau") and "time" in str(actor["derivatives"]) else 2e-8
    assert [time for time, _ in sent["c"]] == pytest.approx(times, abs=tolerance)


def formulas_evaluated(monkeypatch: pytest.MonkeyPatch, actor: dict[str, Any], until: float) -> int:
    count = 0

    def counted(formula: Formula, values: dict[str, Any], *what: object) -> float:
        nonlocal count
        count += 1
        return number_of(formula, values, *what)

    number_of = trajectory.number_of
    with monkeypatch.context() as patch:
        patch.setattr(trajectory, "number_of", counted)
        patch.setattr(trajectory, "all_translated", lambda *_: None)
        feed(actor, {"trigger": ticks(until / 100, until)}, until=until)
    return count


@pytest.mark.parametrize("crossings", [{}, {"low": "charge - 100"}])
@pytest.mark.parametrize(
    ("rate", "most"),
    [
        ("-5 - 1e-5 * charge", 500),
        ("-5 - 4 * sin(2 * pi * time / 86400)", 500),
        ("-max(1, min(5, charge / 1000))", 700),
        ("-5 if charge > 1 else 0", 500),
    ],
)
def test_nobody_pays_for_steps_that_nothing_needs(
    monkeypatch: pytest.MonkeyPatch, rate: str, most: int, crossings: dict[str, str]
) -> None:
    """A battery for two hours, looked at a hundred times; steps of 1 s took 100,000 formulas."""
    actor = {"type": "ODE", "initial": {"charge": 1e5}, "derivatives": {"charge": rate}, "crossings": crossings}
    assert formulas_evaluated(monkeypatch, actor, 7200.0) < most


def test_a_bound_that_is_given_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    actor = {"type": "ODE", "initial": {"x": 0}, "derivatives": {"x": "1 + 0 * x * x"}, "max_step": 1}
    assert 12 * 700 < formulas_evaluated(monkeypatch, actor, 700.0) < 13 * 800


def test_a_guard_that_is_always_near_zero_is_looked_at_a_minute_ahead_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """The step is a million seconds long; the run is not."""
    actor = {**REST, "crossings": {"c": "0.1 + x - x + sin(1e5 * (time - time))"}}
    assert formulas_evaluated(monkeypatch, actor, 10.0) < 1500


def test_steps_of_a_nanosecond() -> None:
    actor = {**CLOCK, "max_step": 1e-9, "crossings": {"c": "t - 1.0004e-6"}}
    _, sent, _ = feed(actor, {"trigger": [(2e-6, 0)]}, until=2e-6)
    assert sent["c"] == [(1e-6, 0)]
    assert dict(sent["t"])[2e-6] == pytest.approx(2e-6, rel=1e-12)


def test_what_was_seen_ahead_is_forgotten_with_the_solution() -> None:
    """Left alone, x would be above zero after 1 s; the search knows by 0.5 s, when the input turns it round."""
    actor = {
        "type": "ODE",
        "initial": {"x": -1},
        "derivatives": {"x": "u"},
        "crossings": {"up": "x", "down": "x"},
        "directions": {"up": "rising", "down": "falling"},
        "held": {"u": 1},
    }
    _, sent, _ = feed(actor, {"u": [(0.5, -1.0), (1.0, 1.0), (3.0, -1.0)]}, until=5.0)
    assert sent["up"] == [(2.0, 0)]
    assert sent["down"] == [(4.0, 0)]


@pytest.mark.parametrize("method", STEPPERS)
def test_the_solution_does_not_depend_on_when_it_is_looked_at(method: str) -> None:
    actor = {
        "type": "ODE",
        "initial": {"x": 1, "v": 0},
        "derivatives": {"x": "v", "v": "-x - 0.1 * v + 0.2 * sin(time / 7)"},
        "crossings": {"zero": "x"},
        "method": method,
        "relative_tolerance": 1e-5,
        "absolute_tolerance": 1e-7,
        **({"max_step": 0.01} if method == "Euler" else {}),
    }
    _, alone, _ = feed(actor, {"trigger": [(30.0, 0)]}, until=30.0)
    _, watched, _ = feed(actor, {"trigger": ticks(0.3, 30.0)}, until=30.0)
    assert watched["zero"] == alone["zero"] != []
    assert watched["v"][-1] == alone["v"][-1]


def test_a_step_of_one_window_is_not_tried_for_ever(tmp_path: Path) -> None:
    """Its ends, which are rounded, are further apart than its length."""
    path = tmp_path / "tank.yaml"
    path.write_text(
        """\
model: tank
actors:
  clock: {type: Clock, period: 1 s, values: [1.0]}
  tank:
    type: ODE
    initial: {level: 1.0}
    derivatives: {level: "flow * interpolate(level, [0, 1, 2], [1, 0.8, 0.2]) - 0.3 * sqrt(max(level, 0))"}
    crossings: {full: level - 1.4}
  look: {type: Clock, period: 0.5 s}
connections: [clock.output -> tank.flow, look.output -> tank.trigger]
run: {stop: 20 s, record: tank.level}
""",
        encoding="utf-8",
    )
    assert Simulation(load_model(path)).run()["tank.level"].tokens[-1] == pytest.approx(1.684408, abs=1e-6)
