"""Systems of python-control as actors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

control = pytest.importorskip("control")

from epicycle.actors import Clock, ParameterError  # noqa: E402
from epicycle.bridges import linear  # noqa: E402
from epicycle.runner import Model, Simulation  # noqa: E402


def response(system: Any, period: float, values: list[float]) -> Any:
    """What a system makes of values that are held for a period each."""
    model = Model("test", stop=period * (len(values) - 1))
    clock = model.add(Clock("clock", period=period, values=values, cycles=len(values)))
    plant: Any = model.add(linear("plant", system))
    model.connect(clock.output, plant.input)
    model.connect(clock.output, plant.trigger)
    model.record(plant.output)
    return Simulation(model).run()["plant.output"].values


VALUES = [float(np.sin(number * number)) for number in range(40)]
SYSTEMS = {
    "tf": control.tf([1.0], [1.0, 0.4, 2.0]),
    "lead": control.tf([2.0, 1.0], [0.5, 1.0]),
    "ss": control.ss([[0.0, 1.0], [-2.0, -0.3]], [[0.0], [1.0]], [[1.0, 0.5]], [[0.1]]),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_system_in_continuous_time(name: str) -> None:
    held = control.c2d(SYSTEMS[name], 0.1, method="zoh")
    expected = control.forced_response(held, np.arange(40) * 0.1, VALUES).outputs
    assert response(SYSTEMS[name], 0.1, VALUES) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_system_in_discrete_time(name: str) -> None:
    sampled = control.c2d(SYSTEMS[name], 0.1, method="zoh")
    expected = control.forced_response(sampled, np.arange(40) * 0.1, VALUES).outputs
    assert response(sampled, 0.1, VALUES) == pytest.approx(expected, abs=1e-9)


def test_several_inputs_and_outputs() -> None:
    system = control.ss(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
    plant: Any = linear("plant", system, initial=[1.0, 2.0])
    assert plant.initial.tolist() == [1.0, 2.0]
    assert np.array_equal(plant.a, -np.eye(2))


@pytest.mark.parametrize(
    ("system", "given", "message"),
    [
        (3.0, {}, "plant: float is no linear system of python-control: a StateSpace or a TransferFunction; make one "),
        (
            control.tf([[[1], [1]]], [[[1, 1], [1, 2]]]),
            {},
            "plant: a transfer function with 2 inputs and 1 outputs is too large for a block ",
        ),
        (SYSTEMS["tf"], {"denominator": [1]}, "plant: 'denominator' is that of the system"),
        (control.ss([], [], [], [[2.0]]), {}, "plant: a system without states is a gain: use the actor Scale"),
    ],
)
def test_what_is_no_such_system_is_reported(system: Any, given: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        linear("plant", system, **given)
    assert str(caught.value).startswith(message)
