"""Every packaged model is valid, says what it is, and runs."""

from __future__ import annotations

import math

import pytest

from epicycle.runner import Simulation, load_model
from epicycle.runner.model.catalogue.packaged import packaged_models
from tests.demo_models import DURATIONS


@pytest.mark.parametrize("name", sorted(packaged_models()))
def test_packaged_model_runs(name: str) -> None:
    model = load_model(name)
    assert model.name == name
    assert model.doc
    results = Simulation(model).run(until=DURATIONS.get(name))
    assert results.events > 0


@pytest.mark.parametrize("observers", [0, 1, 6])
def test_scenario_runs_for_any_number_of_observers(observers: int) -> None:
    model = load_model("collision_avoidance", set=[f"observers={observers}", "disturbance=0.5"])
    results = Simulation(model, seed=3).run(until=1.0)
    states = [signal for name, signal in results.signals.items() if name.endswith(".state")]
    assert [len(signal.tokens) for signal in states] == [11] * (observers + 2)
    for signal in states:
        assert all(math.isfinite(x) for token in signal.tokens for x in (*token.position, *token.velocity))


def test_scenario_parameters_reach_every_robot() -> None:
    model = load_model(
        "collision_avoidance",
        set=[
            "observers=2",
            "measurement_range=15 m",
            "observer[*].sensor.max_range=5 m",
            "safe_distance=2.5",
            "kappa=0.5",
            "velocity_noise=0.3",
        ],
    )
    actors = model.graph.actors
    assert actors["observer[1].controller"].objective.range == 15.0  # type: ignore[attr-defined]
    assert [actors[f"{robot}.sensor"].max_range for robot in ("main", "observer[0]", "observer[1]")] == [  # type: ignore[attr-defined]
        None,
        5.0,
        5.0,
    ]
    assert actors["main.controller"].safe_distance == 2.5  # type: ignore[attr-defined]
    # What a filter and a controller assume of the obstacle is one.
    parts = [actors[f"{robot}.{part}"] for robot in ("main", "observer[1]") for part in ("estimator", "controller")]
    assert {(part.kappa, part.velocity_noise) for part in parts} == {(0.5, 0.3)}  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", ["relative_position", "range"])
def test_sensors_of_both_kinds_bring_the_main_robot_home(kind: str) -> None:
    model = load_model("collision_avoidance", set=["observers=2", f"measurement_kind={kind}"])
    results = Simulation(model, seed=1).run()
    assert results.metrics["arrival_time"] is not None
    assert results.metrics["arrival_time"] < 15.0
