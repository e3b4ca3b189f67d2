"""A model that is built in Python is the one that YAML describes."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.actors import (
    Clock,
    ReachGoal,
    Recorder,
    Scale,
)
from epicycle.aspects import MeasurementFailure
from epicycle.runner import Model, ModelError, Simulation, load_composite, load_model
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.graph.ranks import firing_order
from tests.api.build_parts import TYPES, YAML, Adder, Noisy, in_python, run, structure, write
from tests.demo_models import DURATIONS


def test_python_and_yaml_make_one_graph_and_one_digest(tmp_path: Path) -> None:
    loaded, built = load_model(write(tmp_path, YAML), types=TYPES), in_python()
    ours, theirs = structure(built), structure(loaded)
    # In YAML, parts of one kind stand together; in Python they come as the program makes them.
    assert sorted(ours.pop("connections")) == sorted(theirs.pop("connections"))
    assert sorted(ours["aspects"]) == sorted(theirs["aspects"])
    assert ours == theirs
    results = run(built), run(loaded)
    assert results[0].events > 30
    assert results[0].digest == results[1].digest
    assert results[0].metrics == results[1].metrics
    assert list(results[0]["sum.output"].values) == list(results[1]["sum.output"].values)


def test_composite_with_a_clock_of_its_own_as_in_yaml(tmp_path: Path) -> None:
    text = """
model: drifting
composites:
  Slow:
    outputs: [ticks]
    director: {start: 2 s, drift: 0.5}
    actors: {clock: {type: Clock, period: 1 s}}
    connections: [clock.output -> ticks]
actors: {slow: {type: Slow}, sum: {type: Adder}}
connections: [slow.ticks -> sum.input]
run: {stop: 9, record: sum.output}
"""
    model = Model("drifting", stop=9)
    slow = model.composite("slow", outputs=["ticks"], director=True, start="2 s", drift=0.5)
    clock = slow.add(Clock("clock", period=1))
    slow.connect(clock.output, slow["ticks"])
    total = model.add(Adder("sum"))
    model.connect(slow["ticks"], total.input)
    model.record(total.output)
    loaded = load_model(write(tmp_path, text), types=TYPES)
    assert run(model).digest == run(loaded).digest
    assert run(model)["sum.output"].times.tolist() == run(loaded)["sum.output"].times.tolist()
    assert len(run(model)["sum.output"]) > 3


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(packaged_models()))
def test_a_model_runs_again_as_if_it_were_new(name: str) -> None:
    model = load_model(name)
    until = min(model.stop or 20.0, DURATIONS.get(name, 20.0), 20.0)
    first, again = (Simulation(model, seed=3).run(until=until) for _ in range(2))
    anew = Simulation(load_model(name), seed=3).run(until=until)
    assert first.digest == again.digest == anew.digest
    assert first.metrics == again.metrics
    assert first.signals is not again.signals


def test_a_composite_class_of_a_file(tmp_path: Path) -> None:
    path = write(tmp_path, YAML)
    robot = load_composite(path, "Robot", types=TYPES)
    assert repr(robot) == "<composite class Robot(deviation)>"
    model = in_python()
    for index in reversed(range(3)):
        model.remove(f"robot[{index}]")
    for index in range(3):
        added = model.add(robot(f"robot[{index}]", deviation=(index + 1) / 10))
        assert added["inner.noise"].deviation == (index + 1) / 10
    model.connect("clock.output -> robot[*].trigger")
    model.connect("robot[*].position -> sum.input")
    model.record("robot[*].position")
    model.unweave("failure")
    model.weave("failure", MeasurementFailure(probability=0.2), at=["**.noise.output", "late.output"])
    loaded = load_model(path, types=TYPES)
    # Channels and ranks have another order now: what is sent is the same, whoever sends first within a tag.
    ours, theirs = ({(r.tag, r.actor, r.port, r.value) for r in run(each).log.records if r.actor != "sum"}
                    for each in (model, loaded))  # fmt: skip
    assert ours == theirs
    mobile = load_composite("robots/mobile_robot.yaml", "MobileRobot")
    scenario = load_model("collision_avoidance", set={"observers": 1, "main.start": [20, "3 m"]})
    assert scenario["main.vehicle"].start.tolist() == [20.0, 3.0]
    robot_2 = scenario.add(
        mobile("observer[1]", start=[20, 0], objective=ReachGoal(goal=[0, 0]), max_speed="8 m/s", max_acceleration=8)
    )
    scenario.connect("clock.output -> observer[1].trigger")
    scenario.connect("obstacle.state", robot_2["target"])
    assert Simulation(scenario).run(until=0.2).stopped == "stop time"


def test_what_is_removed_is_gone_everywhere() -> None:
    model = in_python()
    model.remove("robot[2]")
    model.remove("robot[1]")
    assert "robot[1]" not in str(structure(model))
    assert [woven.name for woven in model.aspects] == ["robot[0].lossy", "failure"]
    assert run(model).events > 10
    with pytest.raises(ModelError):
        model.remove("robot[1]")
    model.remove("sum")
    assert model.output.metrics[0].ports == []
    assert model.output.recorded == ["robot[0].position"]
    assert run(model, until=1).metrics == {"total": None}


def test_a_loaded_model_changes_like_any_other(tmp_path: Path) -> None:
    model = load_model(write(tmp_path, YAML), types=TYPES)
    twice = model["robot[0]"].add(Noisy("second"))
    assert twice.path == "robot[0].second"
    assert twice.output.path == "robot[0].second.output"
    model["robot[0]"].connect("inner.position -> second.input")
    model.disconnect("clock.output", "robot[1].trigger")
    with pytest.raises(ModelError) as caught:
        Simulation(model)
    assert "robot[1].inner.noise.input is not connected" in str(caught.value)
    model.connect("clock.output -> robot[1].trigger", delay=0.1)
    assert any(record.actor == "robot[0].second" for record in run(model).log.records)
    assert len(model.graph.incoming("robot[1].trigger")) == 1


def test_the_firing_order_is_found_once_and_anew_after_each_change() -> None:
    model = Model("chain", stop=2)
    for actor in (Clock("clock", period=1), Scale("second", offset=1), Scale("first", factor=2), Recorder("sink")):
        model.add(actor)
    for ends in ("clock.output -> second.input", "second.output -> sink.input", "clock.output -> first.input"):
        model.connect(ends)
    assert run(model).log.records[-1].actor == "first"
    before = model.order()
    assert model.order() is before
    model.disconnect("clock.output", "second.input")
    model.connect("first.output -> second.input")
    assert run(model).log.records[-1].actor == "second"
    assert model.order() == firing_order(model.graph) != before
    model.remove("first")
    assert "first" not in model.order()


def test_no_robots_is_fine() -> None:
    model = Model("m", stop=1)
    total = model.add(Adder("sum"))
    clock = model.add(Clock("clock", period=1))
    model.connect(clock.output, total.input)
    robots: list[Noisy] = []
    model.connect([robot.output for robot in robots], total.input)
    model.record(*[robot.output for robot in robots])
    assert run(model).events == 6


def test_what_a_prompt_and_a_notebook_show() -> None:
    model = in_python()
    assert repr(model) == "<Model sums: 6 actors, 20 connections, 4 aspects, stops at 5 s>"
    assert repr(model["robot[1]"]) == "<Composite robot[1]: inputs trigger; outputs position>"
    assert repr(model["robot[1]"]["trigger"]) == "<input port robot[1].trigger of a composite>"
    text, html = str(model), model._repr_html_()
    for part in ("robot[0].inner.noise", "deviation=0.2", "0.02 s", "PacketLoss", "robots"):
        assert part in text
        assert part in html
    results = run(model)
    assert repr(results).startswith("<Results of sums, seed 4: ")
    for part in ("total", "dropped", results.digest[:16], "sum.output", results.stopped):
        assert part in str(results)
        assert part in results._repr_html_()
    assert list(results) == list(results.signals)
    assert "sum.output" in results
    frame = results.frame("sum.output")
    assert frame["value"].tolist() == results["sum.output"].values.tolist()
    long = results.to_pandas()
    assert set(long["signal"]) == set(results)
    log = results.log.to_pandas()
    assert len(log) == results.events
    assert log["value"].tolist() == [record.value for record in results.log.records]
