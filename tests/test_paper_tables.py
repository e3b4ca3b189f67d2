"""Tables I to III of the paper, number by number, and what becomes of the robots when one of the numbers is another.

A number stands here as it is printed in the paper, and is looked for where it counts: in the actors of the elaborated
model, in the class of robots that other models may use, and in the defaults of the actors' types.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterable, Mapping
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors import (
    Actor,
    CircularMotion,
    FilterPyEstimator,
    GoalMonitor,
    Inform,
    ReachGoal,
    RobustController,
    Sensor,
    UnscentedEstimator,
    Vehicle,
)
from epicycle.runner import Model, Simulation, load_model
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.language.study import read_study

MAIN, OBSERVERS = "main", tuple(f"observer[{number}]" for number in range(4))

# Table I
RANGES = [5.0, 10.0, 15.0, 30.0]  # Dmax, m
LEVELS = [0.0, 0.25, 0.5]  # probability of packet loss, and of failing to measure
NUMBERS = [0, 1, 2, 3, 4]  # of the observation robots
RUNS = 100  # of each condition

# Table II
QP, QV = 0.002, 0.004  # m^2; (m per step)^2
SIGMA_D, SIGMA_B = 0.2, 2.0  # m

# Table III
OBSTACLE_START, OBSTACLE_SPEED, OBSTACLE_TURN_RATE = [12.0, 2.0], 1.26, 0.628  # m, m/s, rad/s
V_MAX = {MAIN: 8.0, **dict.fromkeys(OBSERVERS, 16.0)}  # m/s
A_MAX = {MAIN: 8.0, **dict.fromkeys(OBSERVERS, 16.0)}  # m/s^2
D_MIN = 2.0  # m
ALPHA, SIGMA_R0, BETA = 2.0, 0.2, 0.4  # 1, m, m
GAMMA = 0.001
DELTA_T, N = 0.1, 10  # s, steps

# Section II.B, and the authors' model where the paper is silent (docs/paper.md).
START, GOAL = [30.0, 0.0], [0.0, 0.0]
OBSERVER_STARTS = [[20.0, 2.0], [20.0, -2.0], [20.0, -6.0], [20.0, 6.0]]
ETA, KAPPA = 2.0, 0.0
PRIOR = ([10.0, 0.0, 0.0, 0.0], [400.0, 400.0, 4.0, 4.0])

# What a part of a robot holds, whatever the robot.
ESTIMATOR = {
    "period": DELTA_T,
    "position_noise": QP,
    "velocity_noise": QV / DELTA_T**2,
    "kappa": KAPPA,
    "prior_mean": PRIOR[0],
    "prior_variance": PRIOR[1],
    "noise_direction": "expected",
}
CONTROLLER = {
    "horizon": N,
    "period": DELTA_T,
    "safe_distance": D_MIN,
    "margin": ALPHA,
    "tube_initial": SIGMA_R0,
    "tube_growth": BETA,
    "tube_time": "steps",
    "horizon_from": "now",
    "covariance_noise": True,
    "position_noise": QP,
    "velocity_noise": QV / DELTA_T**2,
    "kappa": KAPPA,
}
SENSOR = {"along": SIGMA_D, "across": SIGMA_B, "kind": "relative_position", "max_range": None}
INFORM = {"range": 30.0, "penalty": GAMMA, "variance": ETA, "joint": True}
OBSTACLE = {"start": OBSTACLE_START, "speed": OBSTACLE_SPEED, "turn_rate": OBSTACLE_TURN_RATE, "heading": math.pi}


def held(thing: object, names: Iterable[str]) -> dict[str, Any]:
    """What a thing holds under these names, as plain numbers."""
    found = {name: attrgetter(name)(thing) for name in names}
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in found.items()}


def approximately(numbers: Mapping[str, Any]) -> dict[str, Any]:
    return {name: pytest.approx(value) if name == "velocity_noise" else value for name, value in numbers.items()}


@cache
def model() -> Model:
    return load_model("collision_avoidance", set={"observers": 4})


def actor(path: str) -> Actor:
    return model().graph.actors[path]


def test_table_1_is_the_study() -> None:
    study = read_study("table_1")
    found = {
        each.name: [each.level(number).values[each.name] for number in range(each.size)] for each in study.dimensions
    }
    assert found == {"measurement_range": RANGES, "disturbance": LEVELS, "observers": NUMBERS}
    assert (study.model, study.replications, study.paired) == ("collision_avoidance", RUNS, True)


def test_by_default_three_observers_and_no_disturbance() -> None:
    default = load_model("collision_avoidance")
    assert sum(path.endswith(".vehicle") for path in default.graph.actors) == 1 + 3
    assert [
        woven.aspect.probability for woven in default.aspects if woven.kind in ("PacketLoss", "MeasurementFailure")
    ] == [  # type: ignore[attr-defined]
        0.0,
        0.0,
    ]


READINGS: dict[str, tuple[Any, str, Any]] = {
    # parameter of the scenario: its value, and what holds what then
    "prior_mean": ([1.0, 2.0, 3.0, 4.0], "estimator.prior_mean", [1.0, 2.0, 3.0, 4.0]),
    "prior_variance": ([1.0, 2.0, 3.0, 4.0], "estimator.prior_variance", [1.0, 2.0, 3.0, 4.0]),
    "kappa": (1.5, "estimator.kappa", 1.5),
    "noise_direction": ("predicted", "estimator.noise_direction", "predicted"),
    "covariance_noise": (False, "controller.covariance_noise", False),
    "horizon_from": ("decision", "controller.horizon_from", "decision"),
    "tube_time": ("seconds", "controller.tube_time", "seconds"),
    "free_controls": (7, "controller.solver.free_controls", 7),
    "infeasible": ("brake", "controller.solver.infeasible", "brake"),
    "main_gap": (0.25, "controller.solver.gap", {MAIN: 0.25}),
    "observer_gap": (0.25, "controller.solver.gap", dict.fromkeys(OBSERVERS, 0.25)),
    "main_last_parameter": (0.25, "controller.solver.last_parameter", {MAIN: 0.25}),
    "observer_last_parameter": (0.25, "controller.solver.last_parameter", dict.fromkeys(OBSERVERS, 0.25)),
    "information_unit": ("bit", "controller.objective.unit", dict.fromkeys(OBSERVERS, "bit")),
    "joint_information": (False, "controller.objective.joint", dict.fromkeys(OBSERVERS, False)),
    "starts_known": (
        True,
        "controller.peers_at_start",
        [START, *OBSERVER_STARTS],  # of which each robot leaves out its own 'start'
    ),
}


def test_how_far_the_solvers_go() -> None:
    """What the study closest_readings speaks for most (docs/paper.md); nothing of it is in the paper's tables."""
    names = ["gap", "last_parameter", "free_controls", "infeasible"]
    found = {robot: held(actor(f"{robot}.controller").solver, names) for robot in (MAIN, *OBSERVERS)}  # type: ignore[attr-defined]
    common = {"last_parameter": 0.0, "free_controls": 4, "infeasible": "progress"}
    assert found == {MAIN: {"gap": 0.03, **common}} | {each: {"gap": 0.01, **common} for each in OBSERVERS}


@pytest.mark.parametrize("name", READINGS)
def test_a_reading_reaches_whom_it_is_about_and_nobody_else(name: str) -> None:
    value, place, expected = READINGS[name]
    changed = load_model("collision_avoidance", set={"observers": 4, name: value})
    part, _, attribute = place.partition(".")
    found, before = (
        {
            robot: held(each.graph.actors[f"{robot}.{part}"], [attribute])[attribute]
            for robot in (MAIN, *OBSERVERS)
            if robot != MAIN or not attribute.startswith("objective.")  # the main robot seeks no information
        }
        for each in (changed, model())
    )
    assert found == {**before, **(expected if isinstance(expected, dict) else dict.fromkeys(before, expected))}
    assert found != before


@pytest.mark.parametrize("level", LEVELS)
def test_table_1_reaches_the_actors(level: float) -> None:
    for reach in RANGES:
        model = load_model(
            "collision_avoidance", set={"observers": 1, "measurement_range": reach, "disturbance": level}
        )
        aspects = {woven.name: woven for woven in model.aspects}
        assert model.graph.actors["observer[0].controller"].objective.range == reach  # type: ignore[attr-defined]
        assert aspects["packet_loss"].aspect.probability == level  # type: ignore[attr-defined]
        assert aspects["measurement_failure"].aspect.probability == level  # type: ignore[attr-defined]
        assert {port for port in aspects["packet_loss"].ports if port.startswith(MAIN)} == {
            "main.peer_plan",
            "main.peer_measurement",
        }
        assert aspects["measurement_failure"].ports == ["main.sensor.measurement", "observer[0].sensor.measurement"]


@pytest.mark.parametrize("robot", [MAIN, *OBSERVERS])
def test_tables_2_and_3_in_every_robot(robot: str) -> None:
    start = START if robot == MAIN else OBSERVER_STARTS[OBSERVERS.index(robot)]
    limits = {"max_speed": V_MAX[robot], "max_acceleration": A_MAX[robot]}
    for part, numbers in (
        ("vehicle", {"start": start, "start_velocity": None, **limits}),
        ("sensor", SENSOR),
        ("estimator", ESTIMATOR),
        ("controller", {**CONTROLLER, **limits}),
    ):
        assert held(actor(f"{robot}.{part}"), numbers) == approximately(numbers), part
    objective = actor(f"{robot}.controller").objective  # type: ignore[attr-defined]
    if robot == MAIN:
        assert isinstance(objective, ReachGoal)
        assert objective.goal.tolist() == GOAL
    else:
        assert isinstance(objective, Inform)
        assert held(objective, INFORM) == INFORM


def test_table_3_of_the_scenario() -> None:
    assert held(actor("obstacle"), OBSTACLE) == OBSTACLE
    assert held(actor("clock"), {"period": DELTA_T}) == {"period": DELTA_T}
    assert [held(actor(name), {"goal": 0, "tolerance": 0}) for name in ("arrival", "arrival_near", "arrival_far")] == [
        {"goal": GOAL, "tolerance": tolerance} for tolerance in (0.5, 0.2, 1.0)
    ]
    delays = {hop.destination: hop.delay for hop in model().graph.edges if hop.delay is not None}
    # What is planned at t is known to the others, and acts, at t + 1.
    assert delays == dict.fromkeys(
        [f"{robot}.{port}" for robot in (MAIN, *OBSERVERS) for port in ("peer_plan", "vehicle.acceleration")],
        round(DELTA_T * 1e9),
    )
    assert model().stop == 30.0


def test_a_robot_in_another_model_has_the_same_numbers(tmp_path: Path) -> None:
    shutil.copy(packaged_models()["collision_avoidance"].parent / "robots" / "mobile_robot.yaml", tmp_path)
    (tmp_path / "m.yaml").write_text("""
model: m
include: mobile_robot.yaml
actors:
  clock: {type: Clock, period: 100 ms}
  obstacle: {type: CircularMotion}
  robot: {type: MobileRobot, start: [1, 2], max_speed: 3, max_acceleration: 4, objective: {type: Inform}}
connections:
  - clock.output -> obstacle.trigger, robot.trigger
  - obstacle.state -> robot.target
run: {stop: 1 s}
""")
    made = load_model(tmp_path / "m.yaml").graph.actors
    for part, numbers in (("sensor", SENSOR), ("estimator", ESTIMATOR), ("controller", CONTROLLER)):
        assert held(made[f"robot.{part}"], numbers) == approximately(numbers), part
    assert held(made["robot.controller"].objective, INFORM) == INFORM  # type: ignore[attr-defined]
    assert held(made["obstacle"], OBSTACLE) == OBSTACLE


@pytest.mark.parametrize(
    ("made", "numbers"),
    [
        (CircularMotion("a"), OBSTACLE),
        (Sensor("a"), SENSOR),
        (UnscentedEstimator("a"), ESTIMATOR),
        (FilterPyEstimator("a"), ESTIMATOR),
        (RobustController("a"), {**CONTROLLER, "max_speed": V_MAX[MAIN], "max_acceleration": A_MAX[MAIN]}),
        (RobustController("a").objective, {"goal": GOAL}),
        (Vehicle("a", start=START), {"max_speed": V_MAX[MAIN], "max_acceleration": A_MAX[MAIN]}),
        (Inform(), INFORM),
        (GoalMonitor("a"), {"goal": GOAL, "tolerance": 0.5}),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_types_have_the_same_defaults(made: object, numbers: dict[str, Any]) -> None:
    assert held(made, numbers) == approximately(numbers)


# -- what the numbers do ----------------------------------------------------------------------------------------------

CHANGES = {
    "alpha": {"margin": ALPHA / 2},
    "beta": {"tube_growth": BETA / 2},
    "gamma": {"range_penalty": GAMMA * 100},
    "sigma_b": {"deviation_across": SIGMA_B / 2},
}
ALL = {name: value for change in CHANGES.values() for name, value in change.items()}
# By how much at least; less than half of the smallest difference when this was written.
LEAST = {"driven": 1.0, "gap": 0.4, "unsure": 0.0005, "beyond": 0.2}  # m, m, m^2, m
CROWD = {"observers": 4}
SHORT = {"observers": 1, "measurement_range": 3}


@cache
def behaviour(settings: tuple[tuple[str, float], ...], seed: int) -> dict[str, float]:
    """What the robots do in the first three seconds; the same seed gives the same noise."""
    results = Simulation(load_model("collision_avoidance", set=dict(settings)), seed=seed, keep_log=True).run(until=3)
    sent: dict[str, list[Any]] = {}
    for record in results.log.records:
        sent.setdefault(f"{record.actor}.{record.port}", []).append(record.value)
    place = {name: np.array([each.position for each in found]) for name, found in sent.items() if ".state" in name}
    main, obstacle = place["main.vehicle.state"], place["obstacle.state"]
    observers = [place[name] for name in place if name.startswith("observer") and name.endswith("vehicle.state")]
    reach = dict(settings).get("measurement_range", 30.0)
    return {
        "driven": float(main[0, 0] - main[15, 0]),
        "gap": min(float(np.hypot(*(each - main).T).min()) for each in observers),
        "unsure": float(np.mean([np.trace(each.covariance[:2, :2]) for each in sent["main.estimator.estimate"][10:]])),
        "beyond": float(np.mean([np.maximum(np.hypot(*(each - obstacle).T) - reach, 0.0) for each in observers])),
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("base", "change", "what", "sign"),
    [
        # The robots keep away from each other proportionally to alpha, and their reachability sets grow with beta: with
        # less of either, the main robot drives off before four observers have made way, and passes nearer to them.
        (CROWD, CHANGES["alpha"], "driven", +1),
        (CROWD, CHANGES["alpha"], "gap", -1),
        (CROWD, CHANGES["beta"], "driven", +1),
        (CROWD, CHANGES["beta"], "gap", -1),
        (CROWD, ALL, "driven", +1),
        (CROWD, ALL, "gap", -1),
        # The penalty for what lies beyond Dmax keeps the observers within.
        (SHORT, CHANGES["gamma"], "beyond", -1),
        (SHORT, ALL, "beyond", -1),
        # Whoever measures better across the line of sight is surer of where the obstacle is.
        (CROWD, CHANGES["sigma_b"], "unsure", -1),
        (CROWD, ALL, "unsure", -1),
    ],
)
def test_another_number_is_another_behaviour(
    base: dict[str, float], change: dict[str, float], what: str, sign: int
) -> None:
    for seed in (1, 2, 3):
        before, after = (behaviour(tuple(settings.items()), seed)[what] for settings in (base, {**base, **change}))
        assert sign * (after - before) > LEAST[what], (seed, before, after)
