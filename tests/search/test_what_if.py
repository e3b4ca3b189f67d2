"""What if: both futures are one run before the tag, and differ from there on as they should."""

from __future__ import annotations

import json
import random  # noqa: TID251 (of the tags that are tried)
from pathlib import Path
from typing import Any

import pytest

import epicycle
from epicycle.actors import EpicycleError, Tag, declared_parameters
from epicycle.runner.execution.engine import Interventions, Simulation
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.search.what_if import Changes, forked, tag_of

QUICK = {"mm1": 200.0, "bouncing_modes": 3.0, "switched_network": 0.2}
SHORT = {"collision_avoidance": 1.0, "changing_roles": 1.0, "flying_observers": 1.0, "many_obstacles": 1.0}
SHORT |= {"safe_avoidance": 1.0, "searching_robot": 1.0, "waypoints": 1.0, "lift_group": 200.0, "machine_shop": 3e4}
SHORT |= {
    "manufacturing_cell": 600.0,
    "inspection_paradox": 600.0,
    "mg1": 200.0,
    "car_wash": 2000.0,
    "warehouse": 300.0,
}

LINE = """
model: line
parameters: {size: 2}
actors:
  clock: {type: Clock, period: 1 s}
  count: {type: Ramp}
  gain: {type: Scale, factor: "${size}"}
  heard: {type: Recorder}
connections: [clock.output -> count.trigger, count.output -> gain.input, gain.output -> heard.input]
aspects:
  lossy: {type: PacketLoss, probability: 0.5, at: gain.input}
  late: {type: Latency, delay: 100 ms, at: heard.input}
run: {stop: 20 s, seed: 1, record: [gain.output]}
metrics:
  heard: {of: gain.output, take: count}
monitors:
  small: {property: "always gain.output <= 30"}
"""


@pytest.fixture
def line(tmp_path: Path) -> Path:
    path = tmp_path / "line.yaml"
    path.write_text(LINE, encoding="utf-8")
    return path


def _forks_without_change(name: str, until: float | None, number: int) -> None:
    """At random tags: a fork of the run, and a run in which a change was prepared that changes nothing."""
    model, drawn = epicycle.load(name), random.Random(f"what if {name}")
    tags: list[Tag] = []
    simulation = Simulation(model, acts=Interventions(model.exactly))
    stop = model.stop if until is None else until
    while simulation.step() and (stop is None or simulation.tag.seconds <= stop) and len(tags) < 20_000:
        tags.append(simulation.tag)
    plain = Simulation(model).run(until=stop)
    own = {f"{path}.{each}": actor for path, actor in model.graph.actors.items() for each in _own(actor)}
    ports = [*model.graph.ports]
    chosen = sorted(drawn.sample(tags, min(number, len(tags))))
    simulation, model.origin = Simulation(model, acts=Interventions(model.exactly)), None
    for tag in chosen:
        while simulation.tag < tag:
            simulation.step()
        assert simulation.fork().run(until=stop).digest == plain.digest, tag
        path = drawn.choice(sorted(own)) if own else ""
        given = {path: getattr(own[path], path.rpartition(".")[2])} if path else {}
        other, acts, _ = forked(model, tag, Changes(change=given, lose=[drawn.choice(ports)]))
        for woven in other.aspects:
            if woven.name == other.aspects[-1].name:
                vars(woven.aspect)["at_tag"] = Tag(2**62, 0)  # nothing is lost after all
        assert Simulation(other, acts=acts).run(until=stop).digest == plain.digest, (tag, given)


def _own(actor: Any) -> list[str]:
    """The numbers among the parameters of an actor that no connection gives."""
    return [
        name
        for name, parameter in declared_parameters(type(actor)).items()
        if type(getattr(actor, name)) in (int, float) and parameter.type in (int, float) and name not in actor.inputs
    ]


@pytest.mark.parametrize("name", QUICK)
def test_a_fork_without_a_change_is_the_same_run(name: str) -> None:
    _forks_without_change(name, QUICK[name], 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(packaged_models()))
def test_fifty_forks_without_a_change_are_the_same_run(name: str) -> None:
    _forks_without_change(name, SHORT.get(name, QUICK.get(name)), 50)


def test_without_a_change_both_futures_are_the_same(line: Path) -> None:
    found = epicycle.what_if(line, "3 s")
    assert found.is_same
    assert found.sentence == "From 3 s on, nothing is changed. Both futures have the same log."
    assert found.first is None
    assert found.affected == {}


def test_a_parameter_of_the_model_changes_from_a_tag_on(line: Path) -> None:
    found = epicycle.what_if(line, 10, change={"size": 5}, without_aspects=["lossy"])
    signals = [each.signals["gain.output"] for each in (found.before, found.after)]
    assert [*signals[0].values] == [2.0 * n for n in range(21)]
    assert [*signals[1].values] == [(2.0 if n < 10 else 5.0) * n for n in range(21)]
    assert found.first is not None
    assert (found.first.actor, found.first.tag) == ("gain", "(10 s, 1)")
    assert found.first.does == ("takes input 10; sends output 20", "takes input 10; sends output 50")
    assert found.affected == {"gain": 10.0, "heard": 10.1}
    assert (
        found.sentence
        == (
            "From 10 s on, gain.factor is 5. The first firing that changes is gain at (10 s, 1). 2 of 4 actors do "
            "something else: gain, heard. Monitor small: broken at 16 s as it was, broken at 10 s instead."
        )
        or "Monitor small" not in found.sentence
    )


def test_a_native_form_obeys_a_changed_parameter() -> None:
    before = epicycle.run("mm1", until=500, progress=False)
    found = before.what_if(250, change=["service.distribution={type: Exponential, mean: 100 ms}"])
    assert found.before.digest == before.digest
    assert found.first is not None
    assert found.first.time >= 250
    assert found.after.metrics["mean_number"] < before.metrics["mean_number"]


def test_a_changed_parameter_from_the_start_on_is_that_of_another_model(line: Path) -> None:
    found = epicycle.what_if(line, 0, change=["size=5"])
    assert found.after.digest == epicycle.run(line, set={"size": 5}, progress=False).digest


@pytest.mark.parametrize("aspect", ["lossy", "late"])
def test_an_aspect_that_is_removed_from_the_start_on_was_never_there(line: Path, aspect: str) -> None:
    found = epicycle.what_if(line, 0, remove=aspect)
    assert found.after.digest == epicycle.run(line, without_aspects=[aspect], progress=False).digest


def test_an_aspect_is_removed_from_a_tag_on(line: Path) -> None:
    found = epicycle.what_if(line, Tag(10_000_000_000, 0), remove=["lossy"])
    times = found.after.signals["gain.output"].times
    assert [time for time in times if time >= 10] == [float(n) for n in range(10, 21)]
    assert [time for time in times if time < 10] == [
        time for time in found.before.signals["gain.output"].times if time < 10
    ]
    assert found.changes == ["lossy is removed"]


def test_one_token_is_let_through_and_another_one_lost(line: Path) -> None:
    before = epicycle.run(line, progress=False)
    times = [*before.signals["gain.output"].times]
    lost = next(n for n in range(5, 21) if n not in times)
    found = before.what_if(5, let_through="lossy")
    assert found.changes == [f"lossy lets token {lost + 1} at gain.input through"]
    assert [*found.after.signals["gain.output"].times] == sorted([*times, float(lost)])
    assert found.first is not None
    assert (found.first.actor, found.first.time) == ("gain", lost)
    assert found.first.does == ("does not fire", f"takes input {lost}; sends output {2 * lost}")
    two = before.what_if(5, let_through=["lossy", "lossy@gain.input"])
    assert two.after.metrics["heard"] == before.metrics["heard"] + 2
    heard = next(time for time in times if time >= 5)
    gone = before.what_if(5, lose="gain.input")
    assert [*gone.after.signals["gain.output"].times] == [time for time in times if time != heard]
    assert gone.after.log.count == before.log.count - 1  # without a send and a delay, with a loss


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"at": "abc"},
            "'abc' is not a number with a unit, expected a time in s",
        ),
        ({"at": "("}, "at '(': expected a time, such as '3.2 s', or a tag: '(3.2 s, 1)'"),
        ({"at": -1}, "at -1: expected a time from 0 s to 1e9 s"),
        (
            {"remove": "losy"},
            "line has no aspect 'losy', did you mean 'lossy'?\n   help: its aspects: lossy, late",
        ),
        ({"lose": "gain.inpt"}, "line has no port 'gain.inpt', did you mean 'gain.input'?"),
        (
            {"let_through": "lossy@heard.input"},
            "lossy acts 0 times at heard.input at 3 s or later",
        ),
        (
            {"at": 25, "let_through": "late"},
            "late acts 0 times at 25 s or later: the last time is 20 s",
        ),
        (
            {"remove": "crash", "aspects": ["crash=CrashRestart,times=[3 s],at=gain"]},
            (
                "crash cannot be removed during a run: a CrashRestart decides at its start what it does\n"
                "   help: compare with a run without it from the start: epicycle view MODEL --without crash"
            ),
        ),
    ],
)
def test_what_cannot_change(line: Path, given: dict[str, Any], message: str) -> None:
    with pytest.raises(EpicycleError) as raised:
        epicycle.what_if(line, **{"at": 3, **given})
    assert str(raised.value) == message


def test_what_is_more_than_parameters_of_actors_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "delay.yaml"
    path.write_text(LINE.replace("delay: 100 ms", 'delay: "${size * 0.05}"'), encoding="utf-8")
    with pytest.raises(EpicycleError) as raised:
        epicycle.what_if(path, 3, change={"size": 4})
    assert str(raised.value) == (
        "size cannot change during a run: it changes more than parameters of actors: aspects late.delay: 0.1 -> 0.2\n"
        "   help: compare it from the start, with epicycle compare"
    )


def test_a_run_that_the_program_has_changed_cannot_be_made_again(line: Path) -> None:
    model = epicycle.load(line)
    simulation = Simulation(model)
    simulation.advance(5)
    fork = simulation.fork(reseed=7)
    with pytest.raises(EpicycleError) as raised:
        fork.run().what_if(10)
    assert "cannot be made again by its model and seed: the model was changed after it" in str(raised.value)


def test_models_of_programs_take_parameters_of_actors(line: Path) -> None:
    model = epicycle.load(line)
    model.origin = None
    found = epicycle.what_if(model, 10, change={"gain.factor": 5})
    assert found.changes == ["gain.factor is 5"]
    with pytest.raises(EpicycleError) as raised:
        epicycle.what_if(model, 10, change={"size": 5})
    assert str(raised.value) == "line has no parameter of an actor 'size'"
    with pytest.raises(EpicycleError) as raised:
        epicycle.what_if(model, 10, change={"gain.factor": "big"})
    assert str(raised.value).startswith("gain.factor: 'big' is not a number")


def test_a_future_that_fails_is_shown_up_to_the_error(tmp_path: Path) -> None:
    path = tmp_path / "strict.yaml"
    path.write_text(
        LINE.replace(
            "{type: Recorder}",
            "{type: Test, values: [0, 8, 10, 12, 14, 18, 20, 22, 26, 28, 30, 36, 38, 40], complete: false}",
        ),
        encoding="utf-8",
    )
    found = epicycle.what_if(path, 10, change={"gain.factor": 7})
    assert found.after.stopped == "failed"
    assert "The other future ends in an error: heard" in found.sentence


@pytest.mark.parametrize(
    ("text", "tag"),
    [
        ("3.2", Tag(3_200_000_000, 0)),
        ("3.2 s", Tag(3_200_000_000, 0)),
        ("(3.2 s, 1)", Tag(3_200_000_000, 1)),
        ("3200 ms, microstep 2", Tag(3_200_000_000, 2)),
    ],
)
def test_tags_are_read_as_they_are_shown(text: str, tag: Tag) -> None:
    assert tag_of(text) == tag


def test_the_command_says_what_came_of_it(line: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "found"
    code = main(["what-if", str(line), "--at", "5", "--let-through", "lossy", "--out", str(out), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert code == 0
    assert found == json.loads((out / "what_if.json").read_text("utf-8"))
    assert found["first_firing"]["actor"] == "gain"
    assert found["metrics"]["what if"]["heard"] == found["metrics"]["as it was"]["heard"] + 1
    assert "First firing that changes" in (out / "what_if.html").read_text("utf-8")
