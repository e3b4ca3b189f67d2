"""``inherit``, parameters that stand for those of parts, and types that a parameter chooses.

What is wrong with them is in ``tests/bad_models/small/inherit.txt``.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import Actor, Dynamics, InputPort, Parameter, SensorModel, declared_parameters
from epicycle.runner import ModelError, Simulation, load_composite, load_model
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.packaged import model_folders
from epicycle.runner.model.language import surroundings
from tests.model.model_parts import TYPES

SHORT = """
model: m
parameters: {factor: 2, start: 3, mode: }
composites:
  Pair:
    parameters: {factor, times, mode, level: {value: "${1 * factor}", doc: a level}}
    inputs: [in]
    outputs: [out]
    actors:
      first: {type: Gain, inherit: all}
      second: {type: Gain, inherit: [factor], times: 3}
    connections: [in -> first.input, first.output -> second.input, second.output -> out]
    aspects: {loss: {type: PacketLoss, inherit: all, probability: "${level / 100}", at: first.input}}
actors:
  ramp: {type: Ramp, inherit: all}
  pair: {type: Pair, inherit: all, times: 4}
  gain: {type: Gain, inherit: [factor, mode]}
connections: [ramp.output -> pair.in, pair.out -> gain.input]
"""
LONG = """
model: m
parameters: {factor: 2, start: {value: 3, unit: m}, mode: {value: plain, choices: [plain, squared]}}
composites:
  Pair:
    parameters:
      {factor: {doc: what it is multiplied by}, times: 1, mode: plain, level: {value: "${1 * factor}", doc: a level}}
    inputs: [in]
    outputs: [out]
    actors:
      first: {type: Gain, factor: "${factor}", times: "${times}", mode: "${mode}"}
      second: {type: Gain, factor: "${factor}", times: 3}
    connections: [in -> first.input, first.output -> second.input, second.output -> out]
    aspects: {loss: {type: PacketLoss, probability: "${level / 100}", at: first.input}}
actors:
  ramp: {type: Ramp, start: "${start}"}
  pair: {type: Pair, factor: "${factor}", times: 4, mode: "${mode}"}
  gain: {type: Gain, factor: "${factor}", mode: "${mode}"}
connections: [ramp.output -> pair.in, pair.out -> gain.input]
"""


def loaded(folder: Path, text: str, **options: object) -> Model:
    (folder / "m.yaml").write_text(text)
    return load_model(folder / "m.yaml", types=TYPES, **options)  # type: ignore[arg-type]


def held(model: Model) -> dict[str, dict[str, object]]:
    """What the actors and aspects of a model hold."""
    parts = {**model.graph.actors, **{each.name: each.aspect for each in model.aspects}}
    return {
        path: {name: repr(getattr(part, name)) for name in declared_parameters(type(part))}
        for path, part in parts.items()
    }


def test_what_parts_inherit_is_as_if_it_were_written_out(tmp_path: Path) -> None:
    short, long = loaded(tmp_path, SHORT), loaded(tmp_path, LONG)
    assert held(short) == held(long)
    assert short.parameters == long.parameters == {"factor": 2.0, "start": 3.0, "mode": "plain"}


def test_a_parameter_stands_for_that_of_the_first_part_that_takes_it(tmp_path: Path) -> None:
    found = loaded(tmp_path, SHORT).declared
    told = {name: (each.source, each.unit, each.bounds(), [*each.choices], each.doc) for name, each in found.items()}
    assert told == {
        "factor": ("Gain.factor", "", (None, None, None), [], "what it is multiplied by"),
        "start": ("Ramp.start", "m", (0.0, None, 10.0), [], "where it begins"),
        "mode": ("Gain.mode", "", (None, None, None), ["plain", "squared"], ""),
    }


def test_a_parameter_of_its_own_unit_is_not_the_parts(tmp_path: Path) -> None:
    text = "model: m\nparameters: {far: {value: 0.004, unit: km}}\nactors: {r: {type: Ramp, start: '${far}'}}\n"
    far = loaded(tmp_path, text).declared["far"]
    assert (far.source, far.unit, far.bounds(), far.doc) == ("", "km", (None, None, None), "where it begins")


def test_a_parameter_of_a_distribution_has_the_unit_of_what_is_drawn(tmp_path: Path) -> None:
    text = (
        "model: m\nparameters: {mean: {value: 2 min, above: 0}, shape: 3, spread: 1}\n"
        "actors:\n"
        "  s: {type: Server, distribution: {type: Gamma, mean: '${mean}', shape: '${shape}'}}\n"
        "  r: {type: Random, distribution: {type: Normal, standard_deviation: '${spread}'}}\n"
        "  c: {type: Clock, period: 1 s}\n"
        "connections: [c.output -> s.input, c.output -> r.trigger]\n"
    )
    model = loaded(tmp_path, text)
    told = {name: (each.source, each.unit, each.bounds()) for name, each in model.declared.items()}
    assert told == {
        "mean": ("Gamma.mean", "s", (None, 0.0, None)),
        "shape": ("Gamma.shape", "1", (None, 0.0, None)),
        "spread": ("Normal.standard_deviation", "", (0.0, None, None)),
    }
    assert model.graph.actors["s"].distribution.mean == 120.0


def test_what_comes_from_outside_wins(tmp_path: Path) -> None:
    model = loaded(tmp_path, SHORT, set={"factor": 5, "pair.times": 6, "gain.factor": 7})
    found = {path: (each.factor, each.times) for path, each in model.graph.actors.items() if hasattr(each, "factor")}
    assert found == {"pair.first": (5.0, 6), "pair.second": (5.0, 3), "gain": (7.0, 1)}


ROBOT = """
model: m
composites:
  Robot:
    parameters: {solver, objectives}
    inputs: [trigger]
    actors: {v: {type: Vehicle, start: [0, 0]}, c: {type: RobustController, inherit: all}}
    connections:
      - trigger -> v.trigger, c.trigger
      - v.state -> c.state
      - {from: c.control, to: v.acceleration, delay: 1 ms}
parameters: {gap: , free_controls: 3, goal: [1, 2], penalty: }
actors:
  clock: {type: Clock, period: 1 s}
  main:
    type: Robot
    solver: {type: Barrier, inherit: [gap, free_controls]}
    objectives: {there: {type: ReachGoal, inherit: all}, look: {type: Inform, inherit: penalty}}
connections: [clock.output -> main.trigger]
run: {stop: 1 s}
"""


def test_values_with_a_type_inherit_too(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(ROBOT)
    model = load_model(tmp_path / "m.yaml")
    assert model.parameters == {"gap": 1e-5, "free_controls": 3, "goal": [1, 2], "penalty": 0.001}
    assert {name: each.source for name, each in model.declared.items()} == {
        "gap": "Barrier.gap",
        "free_controls": "Barrier.free_controls",
        "goal": "ReachGoal.goal",
        "penalty": "Inform.penalty",
    }
    controller: Any = model.graph.actors["main.c"]
    assert controller.solver.free_controls == 3
    assert controller.objectives["there"].goal.tolist() == [1.0, 2.0]


class Loud(Actor):
    """Multiplies aloud."""

    input = InputPort(float)
    factor = Parameter(float, 1.0, doc="how loud")
    silent = Parameter(float, 0.0, doc="of no use")
    unused = ("silent",)


class Stream(Dynamics):
    """Carries a robot away."""

    water = Parameter(float, 0.0, doc="how fast it flows")


class Rate(SensorModel):
    """A part with a part."""

    dynamics = Parameter(Dynamics, None, doc="how the robot moves")


WITHIN = """
model: m
parameters: {water: 3}
actors:
  clock: {type: Clock, period: 1 s}
  robot: {type: CircularMotion}
  target: {type: CircularMotion}
  sensor: {type: Sensor, model: {type: Rate, dynamics: {type: Stream, inherit: [water]}}}
connections:
  - clock.output -> robot.trigger, target.trigger
  - robot.state -> sensor.robot
  - target.state -> sensor.target
run: {stop: 1 s}
"""


def test_values_within_values_inherit_too(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(WITHIN, encoding="utf-8")
    model = load_model(tmp_path / "m.yaml", types=[Rate, Stream])
    assert model.graph.actors["sensor"].model.dynamics.water == 3.0


def test_inherit_all_leaves_out_what_a_class_does_not_use(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(
        "model: m\nparameters: {factor: 2, silent: 3}\nactors:\n  c: {type: Clock, period: 1}\n"
        "  a: {type: Loud, inherit: all}\n  b: {type: Loud, inherit: [silent]}\n"
        "connections: [c.output -> a.input, c.output -> b.input]\nrun: {stop: 1 s}\n"
    )
    actors = load_model(tmp_path / "m.yaml", types=[Loud]).graph.actors
    found = {name: (actors[name].factor, actors[name].silent) for name in "ab"}  # type: ignore[attr-defined]
    assert found == {"a": (2.0, 0.0), "b": (1.0, 3.0)}


CHOSEN = """
model: m
parameters: {kind: {value: ramp, choices: {ramp: Ramp, any: Source}}, start: 2 m}
composites: {Source: {parameters: {start: 1 m}, outputs: [output], actors: {r: {type: Ramp, inherit: all}},
  connections: [r.output -> output]}}
actors: {a: {type: "${kind}", count: 2, inherit: all}, s: {type: Sum}}
connections: ["a[*].output -> s.input"]
"""


@pytest.mark.parametrize(("kind", "paths"), [("ramp", ["a[0]", "a[1]", "s"]), ("any", ["a[0].r", "a[1].r", "s"])])
def test_a_parameter_chooses_a_type(tmp_path: Path, kind: str, paths: list[str]) -> None:
    model = loaded(tmp_path, CHOSEN, set={"kind": kind})
    assert sorted(model.graph.actors) == paths
    assert {actor.start for path, actor in model.graph.actors.items() if path != "s"} == {2.0}  # type: ignore[attr-defined]


def test_another_controller_is_another_choice() -> None:
    """The paper's main robot is the same, whether its type is chosen or not."""
    runs = [
        Simulation(load_model(name, set=given)).run(until=1.0)
        for name, given in (("collision_avoidance", {}), ("safe_avoidance", {"controller": "paper"}))
    ]
    assert runs[0].digest == runs[1].digest


def test_composites_of_python_programs_take_the_defaults_of_their_parts() -> None:
    robot = load_composite("robots/mobile_robot.yaml", "MobileRobot").composites["MobileRobot"]
    assert {name: each.source for name, each in robot.parameters.items() if not each.source} == {"latency": ""}
    assert robot.parameters["velocity_noise"].source == "UnscentedEstimator.velocity_noise"


PACKAGED = sorted(path for folder in model_folders() for path in folder.rglob("*.yaml"))


@pytest.mark.parametrize("path", PACKAGED, ids=lambda path: path.stem)
def test_no_packaged_model_hands_a_value_on_under_its_own_name(path: Path) -> None:
    lines = re.findall(r"^\s*(\w+): [\"']?\$\{\1\}[\"']?$", path.read_text(), re.MULTILINE)
    assert lines == []


def test_the_flagship_fits_on_a_slide() -> None:
    lines = {path.stem: len(path.read_text().splitlines()) for path in PACKAGED}
    assert lines["collision_avoidance"] <= 130
    assert lines["mobile_robot"] <= 60
    assert sum(len(path.read_text().splitlines()) for path in PACKAGED) <= 2500


def test_parts_with_too_many_types_to_choose_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A short file may name very many: as many as it has parts, times the choices."""
    monkeypatch.setattr(surroundings, "MAX_CHOICES", 5)
    actors = "actors:\n" + "".join(f"  {name}: {{type: '${{kind}}', period: 1}}\n" for name in ("a", "b"))
    (tmp_path / "m.yaml").write_text(
        f"model: m\nparameters: {{kind: {{value: x, choices: {{x: Clock, y: Clock, z: Clock}}}}}}\n{actors}"
    )
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ModelError) as caught:
        load_model("./m.yaml")
    assert str(caught.value) == (
        "m.yaml:5:13: error: m: the types that parts may have are more than 5 together\n"
        "    5 |   b: {type: '${kind}', period: 1}\n"
        "      |             ^^^^^^^^^"
    )
