"""What a message's arrays must be like where it enters an actor: a wrong shape is an error that names the port."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors import (
    FORMER,
    BodyState,
    Casadi,
    ClearanceMonitor,
    Detections,
    DistanceMonitor,
    Estimate,
    FilterPyEstimator,
    GoalMonitor,
    Inform,
    IntegratedOUEstimator,
    JPDATracker,
    Measurement,
    MultiTargetSensor,
    Objective,
    Parameter,
    ParameterError,
    Plan,
    ReachGoal,
    RobustController,
    SafeController,
    Sensor,
    SeparationMonitor,
    StayNear,
    TrackingError,
    Tracks,
    UnscentedEstimator,
    Vehicle,
)
from epicycle.actors.robotics.receiving import MessageError
from epicycle.actors.testing import Harness
from epicycle.runner import ModelError, load_model


class Flying(RobustController):
    """One whose robot flies."""

    dimensions = Parameter(int, 3)


def state(n: int = 2) -> BodyState:
    return BodyState(np.ones(n), np.zeros(n), 0.0)


def estimate(n: int = 2) -> Estimate:
    return Estimate(np.zeros(2 * n), np.eye(2 * n), 0.0)


MAKES: dict[type, Callable[[int], Any]] = {
    BodyState: state,
    Estimate: estimate,
    Measurement: lambda n: Measurement("a", np.zeros(n), "relative_position", np.ones(n), 0.2, 2.0, 0.0),
    Detections: lambda n: Detections(
        "a", np.zeros(n), "relative_position", np.ones((1, n)), 0.2, 2.0, 0.9, 0.1, 30.0, 0.0
    ),
    Tracks: lambda n: Tracks((1,), (estimate(n),), 0.0),
    Plan: lambda n: Plan("a", 0.0, state(n), np.zeros((11, n))),
}
ACTORS = [
    ClearanceMonitor, DistanceMonitor, FilterPyEstimator, Flying, GoalMonitor, IntegratedOUEstimator, JPDATracker,
    MultiTargetSensor, RobustController, SafeController, Sensor, SeparationMonitor, TrackingError, UnscentedEstimator,
]  # fmt: skip
PORTS = [(actor, name) for actor in ACTORS for name, port in actor("a").inputs.items() if port.type in MAKES]


def fire(actor: type, port: str, token: object) -> None:
    """Fire an actor with good tokens at all other ports."""
    harness, tokens = Harness(actor("main.a")), {}
    dimensions = 3 if actor is Flying else 2
    for name, each in harness.actor.inputs.items():
        if name in ("trigger", "body", "robot", "target", "a", "b", "state", "tracks", "others"):
            tokens[name] = MAKES[each.type](dimensions) if each.type in MAKES else 0
    harness.fire(0.0, **{**tokens, port: token})


@pytest.mark.parametrize(("actor", "port"), PORTS)
@pytest.mark.parametrize("numbers", [0, 1, 4, 6, 8])
def test_a_wrong_number_of_dimensions(actor: type, port: str, numbers: int) -> None:
    kind = actor("a").inputs[port].type
    with pytest.raises(MessageError) as caught:
        fire(actor, port, MAKES[kind](numbers))
    assert str(caught.value).startswith(f"main.a.{port} got {kind.__name__} with ")


@pytest.mark.parametrize("actor", [Flying, RobustController, SafeController])
def test_a_whole_message(actor: type) -> None:
    """The covariance of another state than the mean."""
    expected = "(4, 4) in the plane" + (" or (6, 6) in space" if actor is not SafeController else "")
    with pytest.raises(MessageError) as caught:
        fire(actor, "estimate", Estimate(np.zeros(4), np.eye(6), 0.0))
    assert str(caught.value) == (f"main.a.estimate got Estimate with 'covariance' of shape (6, 6); expected {expected}")


def test_only_what_does_not_fit_is_named() -> None:
    with pytest.raises(MessageError) as caught:
        fire(RobustController, "state", BodyState((1.0, 2.0), (1.0, 2.0, 3.0), 0.0))
    assert str(caught.value) == "main.a.state got BodyState with 'velocity' of shape (3,); expected (2,) in the plane"


@pytest.mark.parametrize("actor", [Flying, RobustController])
def test_an_estimate_in_space(actor: type) -> None:
    """It has process noise for six numbers."""
    fire(actor, "estimate", estimate(3))


@pytest.mark.parametrize("actor", [UnscentedEstimator, IntegratedOUEstimator, JPDATracker])
def test_an_unknown_kind(actor: type) -> None:
    port = "detections" if actor is JPDATracker else "measurements"
    make: Any = Detections if actor is JPDATracker else Measurement
    values = np.ones((1, 2)) if actor is JPDATracker else np.ones(2)
    more = (0.9, 0.1, 30.0) if actor is JPDATracker else ()
    with pytest.raises(MessageError) as caught:
        fire(actor, port, make("a", np.zeros(2), "smell", values, 0.2, 2.0, *more, 0.0))
    assert str(caught.value) == (
        f"main.a.{port} got {make.__name__} of the kind 'smell'; expected range or relative_position"
    )


def test_arrays_are_contiguous_floats() -> None:
    """However they were made: kernels go by addresses."""
    there = np.arange(16).reshape(4, 4)
    for array in (there.T, np.asfortranarray(there), np.arange(64).reshape(8, 8)[::2, ::2]):
        kept = Estimate(np.arange(8)[::2], array, 0.0)
        assert kept.mean.flags.c_contiguous
        assert kept.covariance.flags.c_contiguous
        assert kept.covariance.dtype == np.float64
        assert kept.covariance.tolist() == array.tolist()


# --- in space -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("objective", [ReachGoal(goal=(1, 2, 9)), StayNear(to={"target": 1.0}), Inform()])
def test_casadi_and_the_barrier_agree_in_space(objective: Objective) -> None:
    pytest.importorskip("casadi")
    found = []
    for more in ({}, {"solver": Casadi()}):
        harness = Harness(Flying("main.a", objective=objective, **more))
        there = BodyState((30.0, 0.0, 5.0), (0.0, 0.0, 0.0), 0.0)
        harness.fire(0.0, trigger=0, state=there, estimate=Estimate((9, 1, 0, 0), np.eye(4), 0.0))
        found.append(harness.last("control"))
    assert found[0] == pytest.approx(found[1], abs=0.01)


def test_a_monitor_of_a_goal_in_the_air() -> None:
    for goal, left in (((1, 1, 5), 4.0), ((1, 1), 1.0)):
        harness = Harness(GoalMonitor("m", goal=goal))
        harness.fire(0.0, state=state(3))
        assert harness.last("distance") == left


def test_a_goal_in_the_air_for_a_robot_on_the_ground() -> None:
    with pytest.raises(ParameterError) as caught:
        Harness(RobustController("main.a", objective=ReachGoal(goal=(1, 2, 9))))
    assert str(caught.value) == "'goal' has a height, and the robot does not fly; expected 2 numbers"


@pytest.mark.parametrize(
    ("actor", "given", "expected"),
    [
        (
            RobustController,
            {"dimensions": 3, "keep_out": [[1, 2, 3]]},
            "keep_out: a robot that flies is above what stands in the way; leave it out",
        ),
        (RobustController, {"start": [1, 2, 3]}, "start: it has 3 numbers; expected 2"),
        (RobustController, {"peers_at_start": [[1, 2, 3]]}, "peers_at_start: places have 3 numbers; expected 2"),
        (
            RobustController,
            {"dimensions": 3, "peers_at_start": [[1, 2]]},
            "peers_at_start: places have 2 numbers; expected 3",
        ),
        (
            RobustController,
            {"peers_at_start": [[1, 2, 3], [1, 2]]},
            "main.a: RobustController.peers_at_start: some places have a height, and others have none",
        ),
        (SafeController, {"dimensions": 3}, "dimensions: it is 3, and retreats are in the plane; leave it out"),
        (
            Vehicle,
            {"start": [1, 2], "start_velocity": [1, 2, 3]},
            "start_velocity: it has 3 numbers, and 'start' has 2",
        ),
        (Vehicle, {"start": [1]}, "main.a: Vehicle.start: it has 1 numbers; expected 2, or 3 with the height last"),
    ],
)
def test_what_flies_in_part_is_refused(actor: type, given: dict[str, Any], expected: str) -> None:
    with pytest.raises(ParameterError) as caught:
        actor("main.a", **given)
    assert str(caught.value) == expected


@pytest.mark.parametrize(
    ("actor", "name", "expected"),
    [(SafeController, "confidence", "sigma_margin"), (IntegratedOUEstimator, "freedom", "degrees_of_freedom")],
)
def test_parameters_that_have_another_name_now(actor: type, name: str, expected: str) -> None:
    with pytest.raises(ParameterError) as caught:
        actor("main.a", **{name: 2.0})
    told = f"main.a: {actor.__name__}'s parameter {name!r} is now called {expected!r}; valid parameters: "
    assert str(caught.value).startswith(told)


def test_types_that_are_others_now(tmp_path: Path) -> None:
    file = tmp_path / "model.yaml"
    for name, advice in FORMER.items():
        file.write_text(f"model: old\nactors:\n  a: {{type: {name}}}\n", encoding="utf-8")
        with pytest.raises(ModelError) as caught:
            load_model(file)
        assert str(caught.value) == (
            f"{file}:3:13: error: a: there is no actor type {name!r} any more\n    3 |   a: {{type: {name}}}\n"
            f"      |             {'^' * len(name)}\n   help: {advice}"
        )


# --- the safe controller --------------------------------------------------------------------------------


def test_a_safe_controller_informs() -> None:
    harness = Harness(SafeController("main.a", objective=Inform()))
    there = BodyState((30.0, 0.0), (0.0, 0.0), 0.0)
    harness.fire(0.0, trigger=0, state=there, estimate=Estimate((9, 1, 0, 0), np.eye(4), 0.0))
    assert np.hypot(*harness.last("control")) > 1.0


def test_tracks_are_retreated_from_as_an_estimate_is() -> None:
    """The same target at either port gives the same controls, though it is near enough for a retreat to decide."""
    sent = []
    for port, token in (("estimate", estimate()), ("tracks", Tracks((1,), (estimate(),), 0.0))):
        harness = Harness(SafeController("main.a", objective=ReachGoal(goal=(-20, 0))))
        harness.fire(0.0, trigger=0, state=BodyState((7.0, 0.0), (-6.0, 0.0), 0.0), **{port: token})
        sent.append([harness.last("overrides"), *harness.last("control")])
    assert sent[0] == sent[1]
    assert sent[0][0] == 1


@pytest.mark.parametrize(
    ("actor", "name"),
    [(SafeController, each) for each in ("position_noise", "velocity_noise", "covariance_noise")]
    + [(IntegratedOUEstimator, each) for each in ("position_noise", "velocity_noise")],
)
def test_noise_that_does_nothing_is_refused(actor: type, name: str) -> None:
    with pytest.raises(ParameterError) as caught:
        actor("a", **{name: False if name == "covariance_noise" else 0.1})
    assert str(caught.value).endswith(
        f"it has no effect in {actor.__name__}, whose target roams; leave it out, and set 'target_speed' "
        "and 'turn_time'"
    )
