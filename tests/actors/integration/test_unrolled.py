"""Steps written as one function: the same bits as stage by stage."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from epicycle.actors import trajectory
from epicycle.actors.expression import Formula
from epicycle.actors.integration import RungeKutta, State, unrolled
from epicycle.actors.integration.runge_kutta import DOP853, RK23, RK45
from epicycle.actors.trajectory import Trajectory
from tests.actors.feeding import feed, ticks

METHODS = {"RK23": RK23, "RK45": RK45, "DOP853": DOP853}
PENDULUM = {"theta": "omega", "omega": "9.81 * sin(theta) + u - 0.1 * omega + cos(time)"}
LORENZ = {"x": "s * (y - x)", "y": "x * (28 - z) - y", "z": "x * y - 8 / 3 * z"}


def along(method: str, rates: dict[str, str], held: dict[str, Any], start: State) -> tuple[list[Any], RungeKutta]:
    """What a solution is at 40 times, and its stepper; it begins in the middle of a run."""
    solver: dict[str, Any] = {"method": method, "tolerance": (1e-9, 1e-12), "max_step": None}
    made = Trajectory({name: Formula(text) for name, text in rates.items()}, held, **solver)
    made.begin(1_234_567_891, 3.2e-10, start)
    states = [made.solution.at(0.05 * number) for number in range(1, 41)]
    stepper = made.solution.stepper
    assert isinstance(stepper, RungeKutta)
    return [(states, stepper.time, stepper.piece().bounds(stepper.time - 1e-3, stepper.time))], stepper


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("rates", "held", "start"), [(PENDULUM, {"u": 0.3}, [0.1, 0.0]), (LORENZ, {"s": 10}, [1.0, 1.0, 20.0])]
)
def test_the_same_bits(
    monkeypatch: pytest.MonkeyPatch, method: str, rates: dict[str, str], held: dict[str, Any], start: State
) -> None:
    found, stepper = along(method, rates, held, start)
    assert stepper._unrolled is not None
    monkeypatch.setattr(trajectory, "_unrolled", lambda *_: None)
    by_stages, stepper = along(method, rates, held, start)
    assert stepper._unrolled is None
    assert found == by_stages


def functions(*rates: str) -> dict[str, Callable[..., Any]]:
    made: dict[str, Any] = {"abs": abs, "sqrt": math.sqrt, "UNDECIDED": (ArithmeticError,)}
    exec(unrolled(RK45, rates, 1, 1), made)
    return made


def test_a_derivative_that_gives_up_leaves_the_step_to_the_stages() -> None:
    made = functions("v2 / (v1 - v1)")
    assert made["attempt"](0.0, 0.1, [1.0], [1.0], 1e-9, 1e-12, 0.0, [0.0], [2.0]) is None
    made = functions("v2 * v1")
    rates, state, errors = made["attempt"](0.0, 0.1, [1.0], [2.0], 1e-9, 1e-12, 0.0, [0.0], [2.0])
    assert (len(rates), len(state), len(errors)) == (7, 1, 1)
    assert state[0] == pytest.approx(math.exp(0.2), rel=1e-6)
    assert len(made["dense"](0.0, 0.1, [1.0], rates, 0.0, [0.0], [2.0])) == 4


def test_long_steps_are_not_written() -> None:
    assert unrolled(DOP853, ["v1"] * 8, 1, 0)
    assert not unrolled(DOP853, ["v1"] * 9, 1, 0)
    assert not unrolled(DOP853, [f"({' + '.join(['v1'] * 500)})"], 1, 0)


def test_a_flow_beside_variables_of_all_kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the flow does not use does not keep it from being a function."""
    machine = {
        "type": "StateMachine",
        "variables": {"x": 1.0, "name": "one", "list": [1, 2]},
        "modes": {"a": {"flow": {"x": "sin(x) + 0.1 * x * x + mode_time"}}, "b": {}},
        "transitions": ["a -> b when x >= 3 do name = 'two'"],
    }
    inputs = {"trigger": ticks(0.25, 3.0)}
    found = feed(machine, inputs, until=3.0)[1]
    calls = set()
    monkeypatch.setattr(trajectory, "all_translated", lambda *given: calls.add(given))
    assert feed(machine, inputs, until=3.0)[1] == found
    assert calls == {(("sin(x) + 0.1 * x * x + mode_time",), ("time", "mode_time", "x"))}
