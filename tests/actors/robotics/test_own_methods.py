"""What is said of a method of one's own that gives something else than it should."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from epicycle.actors import (
    BodyState,
    Casadi,
    Dynamics,
    EpicycleError,
    Objective,
    ParameterError,
    RobustController,
    Sensor,
    SensorModel,
    Vehicle,
)
from epicycle.actors.testing import Harness

BOTH = (
    "take functions of a state, a control or a trajectory from epicycle.actors.symbolic, not from math, and write no "
    "condition on them"
)


class Sledge(Dynamics):
    """Right in all that it says."""

    states, controls = 3, 1

    def step(self, state: Any, control: Any, period: float) -> Any:
        return [state[0] + period * state[2], state[1], state[2] + period * control[0]]

    def velocity(self, state: Any) -> Any:
        return [state[2], 0.0]

    def state_limits(self, state: Any) -> Any:
        return [state[2] - 5.0]

    def control_limits(self, control: Any) -> Any:
        return [control[0] - 1.0, -1.0 - control[0]]


class Ahead(Objective):
    """Right in what it says."""

    def cost(self, trajectory: Any, beliefs: Any) -> Any:
        return -trajectory.positions[-1][0]


class Rate(SensorModel):
    """Right in all that it says."""

    def h(self, target: Any, observer: Any) -> Any:
        return [target[2], target[3]]

    def noise(self, target: Any, observer: Any) -> Any:
        return [[0.25, 0.0], [0.0, 0.25]]


def changed(base: type, **methods: Any) -> Any:
    """An instance of a class with other methods."""
    return type(base.__name__, (base,), {name: lambda *given, made=made: made for name, made in methods.items()})()


@pytest.mark.parametrize(
    ("method", "given", "reason"),
    [
        ("at_rest", [0.0, 0.0], "gave 2 numbers; expected 3, as 'states' says"),
        ("step", [0.0] * 4, "gave 4 numbers; expected 3, as 'states' says"),
        ("step", None, "gave null; expected a list of 3 numbers, as 'states' says"),
        ("velocity", [0.0], "gave 1 number; expected 2, as 'dimensions' says"),
        ("braking", 0.0, "gave 0.0; expected a list of 1 number, as 'controls' says"),
        ("state_limits", -1.0, "gave -1.0; expected a list of numbers"),
        ("control_limits", ["slow"], "gave ['slow']; expected a list of numbers"),
        ("limited_state", [0.0], "gave 1 number; expected 3, as 'states' says"),
        ("limited_control", [0.0, 0.0], "gave 2 numbers; expected 1, as 'controls' says"),
    ],
)
def test_a_method_of_a_dynamics(method: str, given: Any, reason: str) -> None:
    """It is found before a run, by the vehicle and by the controller."""
    wrong = changed(Sledge, **{method: given})
    for make in (
        lambda motion: Vehicle("v", dynamics=motion, start=[1, 2]),
        lambda motion: RobustController("c", dynamics=motion, solver=Casadi()),
    ):
        make(Sledge())
        with pytest.raises(ParameterError) as caught:
            make(wrong)
        assert str(caught.value) == f"Sledge.{method} {reason}"


@pytest.mark.parametrize(
    ("methods", "reason"),
    [
        ({"h": 1.0}, "Rate.h gave 1.0; expected a list of numbers"),
        ({"noise": [1.0]}, "Rate.noise gave [1.0]"),
        ({"noise": [[1.0, 0.0]]}, "Rate.noise gave [[1.0, 0.0]]"),
        ({"noise": [[1.0], [0.0]]}, "Rate.noise gave [[1.0], [0.0]]"),
        ({"noise": [[1.0, 0.0], [0.0, -0.1]]}, "Rate.noise gave [[1.0, 0.0], [0.0, -0.1]]"),
        ({"noise": [[math.nan, 0.0], [0.0, 1.0]]}, "Rate.noise gave [[nan, 0.0], [0.0, 1.0]]"),
    ],
)
def test_a_method_of_a_sensor_model(methods: dict[str, Any], reason: str) -> None:
    here, there = BodyState((0.0, 0.0), (0.0, 0.0), 0.0), BodyState((3.0, 0.0), (1.0, 2.0), 0.0)
    right = Harness(Sensor("s", model=Rate()))
    right.fire(0.0, robot=here, target=there)
    assert right.last("measurement").value == pytest.approx([1.0, 2.0], abs=3.0)
    harness = Harness(Sensor("s", model=changed(Rate, **methods)))
    with pytest.raises(EpicycleError) as caught:
        harness.fire(0.0, robot=here, target=there)
    expected = "; expected a covariance: 2 rows of 2 numbers, with variances of at least 0 on the diagonal"
    assert str(caught.value) == reason + (expected if "noise" in methods else "")


def test_methods_that_are_missing() -> None:
    for part, method, given in (
        (Dynamics(), "step", ([0.0] * 4, [0.0] * 2, 0.1)),
        (Objective(), "cost", (None, None)),
        (SensorModel(), "h", ([], [])),
        (SensorModel(), "noise", ([], [])),
    ):
        with pytest.raises(NotImplementedError) as caught:
            getattr(part, method)(*given)
        assert str(caught.value) == f"{type(part).__name__} has no {method}()"


class Numeric(Objective):
    """Takes a function of math."""

    def cost(self, trajectory: Any, beliefs: Any) -> Any:
        return math.cos(trajectory.positions[-1][0])


class NumericWithin(Objective):
    """Takes a function of math in what counts where it is positive."""

    def cost(self, trajectory: Any, beliefs: Any) -> Any:
        return trajectory.positive(math.hypot(*trajectory.positions[-1]) - 2.0)


class Comparing(Objective):
    """Asks whether a symbol is positive."""

    def cost(self, trajectory: Any, beliefs: Any) -> Any:
        return max(0.0, trajectory.positions[-1][0])


class Rolling(Sledge):
    """Takes a function of math."""

    def step(self, state: Any, control: Any, period: float) -> Any:
        return [state[0] + period * math.cos(state[2]), state[1], state[2] + period * control[0]]


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ({"objective": Numeric()}, f"Numeric gave NaN for symbols: {BOTH}"),
        ({"objective": NumericWithin()}, f"NumericWithin gave NaN for symbols: {BOTH}"),
        ({"dynamics": Rolling()}, f"Rolling gave NaN for symbols: {BOTH}"),
        (
            {"objective": Comparing()},
            (
                "a symbol cannot be used so, 'Cannot compute the truth value of a CasADi SXElem symbolic expression.': "
                f"{BOTH}"
            ),
        ),
        ({"objective": changed(Ahead, cost=None)}, "Ahead.cost gave null; expected a number"),
        ({"objective": changed(Ahead, cost=["much"])}, "Ahead.cost gave ['much']; expected a number"),
    ],
)
def test_symbols_that_are_lost(parts: dict[str, Any], reason: str) -> None:
    """A robot once stood still, without a word, where its functions were those of math."""
    pytest.importorskip("casadi")
    usual: dict[str, Any] = {"dynamics": Sledge(), "objective": Ahead(), "solver": Casadi()}
    body = Sledge().body([1.0, 2.0, 3.0], 0.0)
    right = Harness(RobustController("c", **usual))
    right.fire(0.0, trigger=0, state=body)
    assert np.array(right.last("control")) == pytest.approx([1.0], abs=1e-3)
    harness = Harness(RobustController("c", **(usual | parts)))
    with pytest.raises(EpicycleError) as caught:
        harness.fire(0.0, trigger=0, state=body)
    assert str(caught.value) == reason
