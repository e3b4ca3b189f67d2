"""The ODE actor against closed forms and SciPy's solve_ivp."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import scipy.integrate

from epicycle.actors import trajectory
from epicycle.actors.core import EpicycleError
from epicycle.actors.expression import ExpressionError, Formula, evaluate
from epicycle.runner.execution.engine import ActorError, Simulation
from epicycle.runner.model.text.problems import ModelError
from tests.actors.feeding import feed, load, model_of, ticks, tokens

GRAVITY = 9.81
BALL: dict[str, Any] = {
    "type": "ODE",
    "initial": {"height": 10, "speed": 0},
    "derivatives": {"height": "speed", "speed": -GRAVITY},
    "crossings": {"bounce": "height"},
    "directions": {"bounce": "falling"},
    "resets": {"bounce": {"height": 0, "speed": "-0.8 * speed"}},
}


def bounce_times(count: int, height: float = 10.0, keep: float = 0.8) -> list[float]:
    """When a ball bounces that falls from a height: after the first, each flight lasts 2 v e^k / g."""
    speed = math.sqrt(2 * GRAVITY * height)
    flights = [2 * speed * keep**k / GRAVITY for k in range(1, count)]
    return (speed / GRAVITY + np.concatenate([[0.0], np.cumsum(flights)])).tolist()  # type: ignore[no-any-return]


@pytest.mark.parametrize("method", ["DOP853", "RK45", "Radau", "BDF"])
def test_a_ball_bounces_when_it_should(method: str) -> None:
    # The implicit solvers are made for stiff systems, not for nine digits.
    tolerance = {"DOP853": 1e-9, "RK45": 2e-9, "Radau": 2e-6, "BDF": 2e-5}[method]
    _, sent, _ = feed({**BALL, "method": method}, {}, until=12.5)
    times = [time for time, _ in sent["bounce"]]
    expected = bounce_times(len(times))
    assert len(times) >= 16
    assert times == pytest.approx(expected, abs=tolerance)
    assert tokens(sent, "bounce") == list(range(len(times)))
    speeds = [math.sqrt(2 * GRAVITY * 10) * 0.8**k for k in range(1, len(times) + 1)]
    assert tokens(sent, "speed") == pytest.approx(speeds, abs=100 * tolerance)
    assert tokens(sent, "height") == [0.0] * len(times)


def test_a_ball_that_is_not_set_on_the_ground_bounces_as_well() -> None:
    """Without the reset of the height, rounding leaves it a hair above or below the ground."""
    _, sent, _ = feed({**BALL, "resets": {"bounce": {"speed": "-0.8 * speed"}}}, {}, until=12.5)
    times = [time for time, _ in sent["bounce"]]
    assert times == pytest.approx(bounce_times(len(times)), abs=2e-9)


def test_a_ball_that_comes_to_rest_is_told_of() -> None:
    with pytest.raises(ActorError) as caught:
        feed(BALL, {}, until=20.0)
    message = str(caught.value).partition("\n")[0]
    assert message.startswith("it failed in fire() at (12.8")
    assert message.endswith(
        "which is less than min_interval, 1e-06 s: it may repeat without end (Zeno); "
        "end the run earlier, for example after a number of 'bounce'"
    )


def test_looking_does_not_change_what_is_seen() -> None:
    _, alone, _ = feed(BALL, {}, until=9.0)
    _, watched, _ = feed(BALL, {"trigger": ticks(0.05, 9.0)}, until=9.0)
    assert watched["bounce"] == alone["bounce"]
    seen = dict(watched["speed"])
    assert [seen[time] for time, _ in alone["bounce"]] == tokens(alone, "speed")


def test_states_are_those_of_solve_ivp() -> None:
    mu = 3.0
    actor = {
        "type": "ODE",
        "initial": {"x": 1, "v": 0},
        "derivatives": {"x": "v", "v": f"{mu} * (1 - x ** 2) * v - x + 0.1 * sin(time)"},
    }
    _, sent, _ = feed(actor, {"trigger": ticks(0.5, 10.0)})
    times = np.arange(21) * 0.5
    solution = scipy.integrate.solve_ivp(
        lambda t, y: [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0] + 0.1 * math.sin(t)],
        (0, 10), [1.0, 0.0], "Radau", times, rtol=1e-10, atol=1e-12,
    )  # fmt: skip
    assert [time for time, _ in sent["x"]] == times.tolist()
    assert tokens(sent, "x") == pytest.approx(solution.y[0].tolist(), abs=2e-7)
    assert tokens(sent, "v") == pytest.approx(solution.y[1].tolist(), abs=2e-6)


def test_inputs_are_held_and_bend_the_solution_from_then_on() -> None:
    """x' = u - x between steps of u: an exponential towards each u."""
    actor = {"type": "ODE", "initial": {"x": 1}, "derivatives": {"x": "u - x"}, "held": {"u": 2}}
    steps = [(1.0, 5), (2.5, -1), (2.5, 0.5)]
    looks = ticks(0.25, 4.0)
    _, sent, _ = feed(actor, {"u": steps, "trigger": looks})
    expected, x, u, before = [], 1.0, 2.0, 0.0
    for now in [time for time, _ in looks]:
        x, before = u + (x - u) * math.exp(before - now), now
        expected.append(x)
        u = {1.0: 5.0, 2.5: 0.5}.get(now, u)
    assert tokens(sent, "x") == pytest.approx(expected, abs=1e-9)


def test_an_input_overtakes_a_crossing_that_was_in_sight() -> None:
    actor = {
        "type": "ODE",
        "initial": {"x": 0},
        "derivatives": {"x": "u"},
        "crossings": {"full": "x - 1"},
        "held": {"u": 1},
        "max_step": 10,
    }
    assert [time for time, _ in feed(actor, {"u": []})[1]["full"]] == [1.0]
    _, sent, _ = feed(actor, {"u": [(0.5, 0.1), (2.5, -1.0), (3.0, 1.0)]})
    # 0.5 at 0.5 s, 0.7 at 2.5 s, 0.2 at 3 s, 1 at 3.8 s.
    assert [time for time, _ in sent["full"]] == [pytest.approx(3.8, abs=1e-9)]


def test_crossings_by_direction() -> None:
    circle = {"type": "ODE", "initial": {"x": 1, "y": 0}, "derivatives": {"x": "-y", "y": "x"}}
    names = {"up": "rising", "down": "falling", "any": "both"}
    _, sent, _ = feed({**circle, "crossings": dict.fromkeys(names, "y"), "directions": names}, {}, until=20.0)
    # y = sin(t) starts at zero, which is no crossing.
    zeros = [k * math.pi for k in range(1, 7)]
    assert [time for time, _ in sent["any"]] == pytest.approx(zeros, abs=1e-8)
    assert [time for time, _ in sent["down"]] == pytest.approx(zeros[::2], abs=1e-8)
    assert [time for time, _ in sent["up"]] == pytest.approx(zeros[1::2], abs=1e-8)


def test_a_thermostat_switches_by_resetting_a_state() -> None:
    """x' = -x + 2 * on: up to 1.2, down to 0.8; each way takes ln(1.2 / 0.8)."""
    actor = {
        "type": "ODE",
        "initial": {"x": 1, "on": 1},
        "derivatives": {"x": "2 * on - x", "on": 0},
        "crossings": {"hot": "x - 1.2", "cold": "x - 0.8"},
        "directions": {"hot": "rising", "cold": "falling"},
        "resets": {"hot": {"on": 0}, "cold": {"on": 1}},
    }
    _, sent, _ = feed(actor, {}, until=10.0)
    times = sorted(time for name in ("hot", "cold") for time, _ in sent[name])
    assert times[0] == pytest.approx(math.log(1 / 0.8), abs=1e-8)
    assert [b - a for a, b in pairwise(times)] == pytest.approx([math.log(1.5)] * (len(times) - 1), abs=1e-8)
    assert len(times) == 1 + int((10.0 - times[0]) / math.log(1.5))


def test_a_jump_crosses_one_microstep_later() -> None:
    actor = {
        "type": "ODE",
        "initial": {"x": 0},
        "derivatives": {"x": 0},
        "crossings": {"over": "u - 1"},
        "directions": {"over": "rising"},
        "resets": {"over": {"x": "x + u"}},
    }
    _, sent, results = feed(actor, {"u": [(1.0, 2.5), (2.0, 3.0), (3.0, 0.0), (4.0, 7.0)]})
    assert sent["over"] == [(1.0, 0), (4.0, 1)]
    assert sent["x"] == [(1.0, 2.5), (4.0, 9.5)]
    assert {r.tag.microstep for r in results.log.records if r.actor == "it"} == {2}


def test_equal_crossings_come_together() -> None:
    actor = {
        **BALL,
        "crossings": {"bounce": "height", "also": "2 * height"},
        "directions": {"bounce": "falling", "also": "falling"},
    }
    _, sent, _ = feed(actor, {}, until=8.0)
    assert sent["also"] == sent["bounce"] != []


def test_an_integrate_and_fire_neuron_spikes_at_its_rate() -> None:
    """x' = i - x with a threshold at 1 and a reset to 0 spikes every ln(i / (i - 1))."""
    actor = {
        "type": "ODE",
        "initial": {"x": 0},
        "derivatives": {"x": "1.5 - x"},
        "crossings": {"spike": "x - 1"},
        "directions": {"spike": "rising"},
        "resets": {"spike": {"x": 0}},
    }
    _, sent, _ = feed(actor, {}, until=30.0)
    period = math.log(3)
    expected = [k * period for k in range(1, int(30 / period) + 1)]
    assert [time for time, _ in sent["spike"]] == pytest.approx(expected, abs=1e-8)


def test_a_loop_through_the_states_needs_no_delay() -> None:
    """A controller u = -x, sampled: x[k+1] = x[k] - h x[k]."""
    model = (
        "model: m\n"
        "actors:\n"
        "  clock: {type: Clock, period: 100 ms}\n"
        "  plant: {type: ODE, initial: {x: 1}, derivatives: {x: u}}\n"
        "  control: {type: Scale, factor: -1}\n"
        "  keep: {type: Recorder}\n"
        "connections:\n"
        "  - clock.output -> plant.trigger\n"
        "  - plant.x -> control.input, keep.input\n"
        "  - control.output -> plant.u\n"
    )
    simulation = Simulation(load(model))
    simulation.run(until=2.0)
    assert simulation["keep"].tokens == pytest.approx([0.9**k for k in range(21)], abs=1e-9)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"initial": {}}, "it: initial: the mapping is empty; give at least one state"),
        ({"initial": [1]}, "it.initial: [1] is not a mapping of names to number"),
        ({"initial": {"pi": 1}}, "it: initial: 'pi' is a constant in expressions; choose another name"),
        ({"initial": {"height": "x", "speed": 0}}, "it.initial: height: 'x' is not a number"),
        ({"derivatives": {"height": "speed"}}, "it: derivatives: 'speed' is missing"),
        (
            {"derivatives": {"height": "speed", "sped": 1}},
            "it: derivatives: there is no state 'sped', did you mean 'speed'?; states: height, speed",
        ),
        (
            {"derivatives": {"height": "speed +", "speed": 1}},
            "it.derivatives: height: 'speed +' is not an expression: invalid syntax",
        ),
        (
            {"directions": {"bounce": "down"}},
            "it.directions: bounce: 'down' is not one of rising, falling, both",
        ),
        (
            {"resets": {"bounze": {}}},
            "it: resets: there is no crossing 'bounze', did you mean 'bounce'?; crossings: bounce",
        ),
        (
            {"resets": {"bounce": {"sped": 0}}},
            "it: resets: bounce: there is no state 'sped', did you mean 'speed'?; states: height, speed",
        ),
        ({"held": {"u": 1}}, "it: held: there is no input 'u'; inputs: none"),
        (
            {"crossings": {"height": "speed"}, "directions": {}, "resets": {}},
            "it: crossings: 'height' is also the name of a state",
        ),
        (
            {"derivatives": {"height": "bounce", "speed": 1}},
            "it: 'bounce' uses 'bounce', which is a crossing and has no value",
        ),
    ],
)
def test_what_is_wrong_is_told_at_load(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError) as caught:
        model_of({**BALL, **change}, {})
    assert [problem.message for problem in caught.value.problems] == [message]


TOO_SMALL = "the required step is shorter than the spacing between numbers"


@pytest.mark.parametrize("method", ["DOP853", "RK45"])
@pytest.mark.parametrize(
    ("rate", "message"),
    [
        ("1 / (x - 1)", "derivative of x: '1 / (x - 1)': 1 / (x - 1) divides by zero, with x = 1.0"),
        ("x > 0", "derivative of x: 'x > 0' gives True, which is not a number"),
        ("x ** 2", f"the solution cannot be continued beyond 1 s from here: {TOO_SMALL}"),
        ("x * x * 1e300", f"the solution cannot be continued beyond 0 s from here: {TOO_SMALL}"),
        ("inf * x", "derivative of x: 'inf * x': inf * x: the result is not a number (NaN), with x = nan"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_what_goes_wrong_on_the_way(rate: str, message: str, method: str) -> None:
    actor = {"type": "ODE", "initial": {"x": 1}, "derivatives": {"x": rate}, "method": method}
    with pytest.raises(ActorError) as caught:
        feed(actor, {"trigger": [(5.0, 0)]})
    where = "fire() at (5 s, 1)" if "beyond" in message else "initialize() at (0 s, 1)"
    assert str(caught.value).partition("\n")[0] == f"it failed in {where}: {message}"


def test_a_crossing_that_fails_is_told_of() -> None:
    actor = {"type": "ODE", "initial": {"x": 1}, "derivatives": {"x": -1}, "crossings": {"c": "sqrt(x - 0.5) + 1"}}
    with pytest.raises(ActorError) as caught:
        feed(actor, {})
    message = str(caught.value).partition("\n")[0]
    assert message.startswith("it failed in fire() at (")
    assert "crossing c: 'sqrt(x - 0.5) + 1': sqrt(x - 0.5): sqrt is not defined for -" in message


def test_euler_goes_along_straight_lines() -> None:
    actor = {"type": "ODE", "initial": {"x": 1, "y": 0}, "derivatives": {"x": "x * y", "y": "1"}}
    euler = {**actor, "method": "Euler", "max_step": 0.5}
    _, sent, _ = feed(euler, {"trigger": [(0.5, 0), (0.75, 0), (1.0, 0), (1.5, 0)]}, until=2.0)
    assert [value for _, value in sent["x"]] == [1.0, 1.125, 1.25, 1.875]
    with pytest.raises(ModelError, match="max_step: it is missing; Euler takes steps of this length"):
        feed({**actor, "method": "Euler"}, {}, until=1.0)


def test_quantities_are_said_once() -> None:
    actor = {
        "type": "ODE",
        "initial": {"x": 1, "v": 0},
        "where": {"pull": "k * x", "force": "pull + 2 * v"},
        "derivatives": {"x": "v", "v": "-force"},
        "crossings": {"weak": "force - 0.5"},
        "resets": {"weak": {"x": "x + pull"}},
        "held": {"k": 3},
    }
    plain = {
        **actor,
        "where": {},
        "derivatives": {"x": "v", "v": "-(k * x + 2 * v)"},
        "crossings": {"weak": "(k * x + 2 * v) - 0.5"},
        "resets": {"weak": {"x": "x + k * x"}},
    }
    asked = {"trigger": [(0.7, 0), (1.3, 0)], "k": [(0.0, 3)]}
    _, short, _ = feed(actor, asked, until=2.0)
    _, long, _ = feed(plain, asked, until=2.0)
    assert short == long
    assert short["weak"]


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ({"x": "1"}, "where: 'x' is the name of something else; choose another"),
        ({"inf": "1"}, "where: 'inf' is a constant in expressions; choose another name"),
        (
            {"a": "x + 1", "b": "[a for a in [1]][0] + a"},
            "where: b, with the quantities of 'where' in it: 'a' has another meaning outside of this list; rename it",
        ),
    ],
)
def test_names_of_quantities(where: dict[str, str], message: str) -> None:
    with pytest.raises(ModelError) as told:
        feed({"type": "ODE", "initial": {"x": 1}, "derivatives": {"x": "x"}, "where": where}, {}, until=1.0)
    assert message in str(told.value)


def test_a_run_ends_at_the_first_crossing() -> None:
    text = """
model: m
actors:
  ball:
    type: ODE
    initial: {height: 10, speed: 0}
    derivatives: {height: speed, speed: -9.81}
    crossings: {bounce: height}
    directions: {bounce: falling}
    resets: {bounce: {speed: -0.8 * speed}}
run: {stop: 20 s, stop_when: ball.bounce}
"""
    results = Simulation(load(text)).run()
    assert results.stopped == "stop_when"
    assert results.end == pytest.approx(math.sqrt(2 * 10 / 9.81), abs=1e-6)


@pytest.mark.parametrize("method", ["DOP853", "RK23", "Radau"])
@pytest.mark.parametrize(
    ("angle", "speed"),
    [
        ("speed", "-9.81 * sin(angle) - 0.1 * speed + push"),
        ("speed if angle < 0.9 else 0", "-max(angle, 0.2) / (1 + time ** 2) + min(push, 1)"),
        ("-0.5", "1 - 1 * angle + 0 * push"),
        ("speed / (push - 0.3)", "abs(angle) - push"),
        ("speed", "1e308 * (1 + push) * 10"),
    ],
)
def test_derivatives_in_one_function_are_those_of_the_evaluator(
    monkeypatch: pytest.MonkeyPatch, method: str, angle: str, speed: str
) -> None:
    """To the bit, with what they refuse."""
    actor = {
        "type": "ODE",
        "initial": {"angle": 0.5, "speed": 1.0},
        "derivatives": {"angle": angle, "speed": speed},
        "crossings": {"low": "angle + 0.1"},
        "method": method,
        "relative_tolerance": 1e-6,
    }

    def outcome() -> Any:
        try:
            return repr(feed(actor, {"trigger": ticks(0.25, 3.0), "push": [(0.6, 0.3), (1.2, 2)]}, until=3.0)[1])
        except (ActorError, EpicycleError) as error:
            return str(error).split("m.yaml")[-1]  # without the folder, which is a new one

    found = outcome()
    monkeypatch.setattr(trajectory, "all_translated", lambda *_: None)
    monkeypatch.setattr(Formula, "__call__", evaluated)
    assert outcome() == found


def evaluated(formula: Formula, values: Any) -> Any:
    """The value of a formula, node by node."""
    try:
        return evaluate(formula.source, values)
    except ExpressionError as error:
        given = ", ".join(f"{name} = {values[name]!r}" for name in formula.names if name in values)
        raise EpicycleError(f"{formula.source!r}: {error}{f', with {given}' if given else ''}") from None
