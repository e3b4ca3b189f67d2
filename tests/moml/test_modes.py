"""Modal models and state machines."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.runner.moml import MomlError
from tests.moml.moml_parts import (
    DIRECTOR,
    MODAL,
    composite,
    entity,
    imported,
    model,
    notes,
    port,
    prop,
    recorded,
    wires,
    written,
)

TEXT = "ptolemy.kernel.util.StringAttribute"


def state(name: str, refinement: str = "", **flags: object) -> str:
    inner = prop("refinementName", refinement, TEXT) if refinement else ""
    return entity(name, f"{MODAL}kernel.State", inner, **flags)


def transition(
    name: str, source: str, target: str, guard: str = "true", output: str = "", set_: str = "", **flags: object
) -> str:
    said = prop("guardExpression", guard, TEXT) + prop("outputActions", output, f"{MODAL}kernel.OutputActionsAttribute")
    said += prop("setActions", set_, f"{MODAL}kernel.CommitActionsAttribute") + "".join(
        prop(key, value) for key, value in flags.items()
    )
    links = (
        f'<link port="{source}.outgoingPort" relation="{name}"/><link port="{target}.incomingPort" relation="{name}"/>'
    )
    return f'<relation name="{name}" class="{MODAL}kernel.Transition">{said}</relation>\n{links}\n'


PORTS = port("in", "input") + port("out", "output")


def machine(*inner: str, java: str = f"{MODAL}kernel.FSMActor") -> str:
    return entity("M", java, PORTS, *inner)


def modal(controller: str, *refinements: str) -> str:
    """A modal model as Vergil writes it: with wires between its ports, its controller and the refinements."""
    own = entity("_Controller", f"{MODAL}modal.ModalController", PORTS, controller)
    return entity(
        "M", f"{MODAL}modal.ModalModel", PORTS, own, *refinements, wires("in _Controller.in", "out _Controller.out")
    )


def around(made: str, values: str = "{1, 2, 3, 4}", stop: float = 3, **parameters: object) -> str:
    actors = entity("Clock", "DiscreteClock", values=values) + entity("Recorder", "Recorder")
    return model(actors, made, wires("Clock.output M.in", "M.out Recorder.input"), stop=stop, **parameters)


def test_a_state_machine(tmp_path: Path) -> None:
    parts = [
        prop("count", 0), state("idle", isInitialState="true"), state("busy"), state("end", isFinalState="true"),
        transition("t1", "idle", "busy", "in_isPresent && in > 1", "out = in * 10", "count = count + 1"),
        transition("t2", "busy", "idle", "timeout(0.5)", "out = -count; ", preemptive="true"),
        transition("t3", "idle", "end", "count > limit", nondeterministic="true", immediate="true"),
    ]  # fmt: skip
    text = around(machine(*parts), limit=1)
    assert (
        written(tmp_path, text)
        == """\
model: m
director: {like: ptolemy}
actors:
  Clock: {type: Clock, period: 1 s, values: [1, 2, 3, 4]}
  Recorder: {type: Recorder}
  M:
    type: StateMachine
    variables: {count: 0}
    modes: {idle: null, busy: null, end: {final: true}}
    transitions:
      - idle -> busy on in_ when in_ > 1 do out = in_ * 10; count = count + 1
      - busy -> idle preemptive after 0.5 s do out = -count
      - idle -> end immediate nondeterministic when count > 1
connections:
  - Clock.output -> M.in_
  - M.out -> Recorder.input
run: {stop: 3 s}
"""
    )
    assert recorded(tmp_path, text) == [(1.0, 1, 20), (1.5, 1, -1), (2.0, 1, 30), (2.5, 1, -2)]


@pytest.mark.parametrize(
    ("version", "flags", "history"),
    [
        ("10.0.devel", {}, False),
        ("10.0", {"history": "true"}, True),
        ("8.0.1", {}, True),
        ("8.0.1", {"reset": "true"}, False),
    ],
)
def test_refinements_and_their_history(tmp_path: Path, version: str, flags: dict[str, str], history: bool) -> None:
    """Up to version 9.0 a transition was one with history unless it said 'reset'."""
    inner = composite("one", PORTS, entity("Ramp", "Ramp"), wires("in Ramp.trigger", "Ramp.output out"), director=True)
    controller = state("one", "one", isInitialState="true") + state("two")
    controller += transition("t1", "one", "two", "in == 2") + transition("t2", "two", "one", "in == 3", **flags)
    created = prop("_createdBy", version, "ptolemy.kernel.attributes.VersionAttribute")
    text = around(modal(controller, inner) + created)
    word = "history " if history else ""
    assert f"      - two -> one {word}when in_ == 3\n" in written(tmp_path, text)
    assert "      one: {refinement: one}\n" in written(tmp_path, text)
    assert [token for _, _, token in recorded(tmp_path, text)] == ([0, 1, 2] if history else [0, 1, 0])


def test_machines_in_machines(tmp_path: Path) -> None:
    """A refinement that is a modal model, and one that is a state machine."""
    innermost = transition("t", "a", "b", "in == 1", "out = 100") + transition("u", "b", "a", "in > 1", "out = 200")
    inner = entity(
        "one", f"{MODAL}modal.ModalController", PORTS, state("a", isInitialState="true"), state("b"), innermost
    )
    controller = (
        state("one", "one", isInitialState="true")
        + state("two")
        + transition("t1", "one", "two", "in == 3", "out = 300")
    )
    text = around(modal(controller, inner))
    assert "  one:\n    inputs: [in_]\n    outputs: [out]\n    modes: [a, b]\n    transitions:\n" in written(
        tmp_path, text
    )
    assert [token for _, _, token in recorded(tmp_path, text)] == [100, 200, 200, 300][:2] + recorded_rest(
        tmp_path, text
    )


def recorded_rest(tmp_path: Path, text: str) -> list[object]:
    return [token for _, _, token in recorded(tmp_path, text)][2:]


def test_the_machine_of_former_versions(tmp_path: Path) -> None:
    """With names of states at the machine, and flags of former times."""
    old = "ptolemy.domains.fsm.kernel.FSMActor"
    parts = [entity("a", "ptolemy.domains.fsm.kernel.State"), entity("b", "ptolemy.domains.fsm.kernel.State"),
             prop("initialStateName", "b", TEXT), prop("finalStateNames", "", TEXT),
             transition("t", "b", "a", "true", "out(0) = 7", defaultTransition="true")]  # fmt: skip
    text = around(machine(*parts, java=old))
    assert "  M: {type: StateMachine, modes: [a, b], initial: b, transitions: [b -> a else do out = 7]}\n" in written(
        tmp_path, text
    )
    assert notes(tmp_path, text) == ["M: in is called in_", "M: in is left out: nothing reads it"]


def test_words_that_could_be_mistaken(tmp_path: Path) -> None:
    parts = (
        state("a", isInitialState="true")
        + state("b")
        + transition("t", "a", "b", "after > 2", "out = 'on; when'", after=1)
    )
    text = around(machine(prop("after", 1), parts, transition("u", "b", "a", set_="after = after + 1")))
    found = written(tmp_path, text)
    assert "      - {from: a, to: b, when: after > 2, do: \"out = 'on; when'\"}\n" in found
    assert "      - {from: b, to: a, do: after = after + 1}\n" in found


def test_what_of_machines_has_no_counterpart(tmp_path: Path) -> None:
    parts = (
        state("a", isInitialState="true")
        + state("b")
        + transition("t", "a", "b", "in > 1", "other = 1; out = 1", "b.gain = 2; nonsense")
    )
    text = around(machine(parts))
    assert notes(tmp_path, text) == [
        "M: t: the action 'nonsense' is not understood, and left out",
        "M: t: other = 1 is left out: other is no output and no variable here",
        "M: t: b.gain = 2 is left out: b.gain is no output and no variable here",
        "M: in is called in_",
    ]
    wrong = around(machine(state("a", isInitialState="true"), transition("t", "a", "a", "random() > 0.5")))
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, wrong)
    assert str(caught.value) == "m.xml cannot be imported:\n   - M.t: the function 'random' is not known here"


__all__ = ["DIRECTOR"]


def test_a_machine_that_the_director_names(tmp_path: Path) -> None:
    """A composite whose director is that of a modal model; what goes by a variable changes with it.

    What the action sends takes the place of the 20 that the refinement has sent in the same firing.
    """
    controller = state("one", "one", isInitialState="true") + transition(
        "t", "one", "one", "in == 2", "out = k", "k = k + 1"
    )
    inner = composite(
        "one", PORTS, entity("Scale", "Scale", factor="k * 10"), wires("in Scale.input", "Scale.output out")
    )
    director = prop("D", java="ptolemy.domains.fsm.kernel.FSMDirector", inner=prop("controllerName", "Ctrl", TEXT))
    made = entity(
        "M",
        "ptolemy.actor.TypedCompositeActor",
        director,
        PORTS,
        prop("k", 1),
        inner,
        entity("Ctrl", "ptolemy.domains.fsm.kernel.FSMActor", PORTS, controller),
    )
    text = around(made)
    assert sorted(token for _, _, token in recorded(tmp_path, text)) == [1, 10, 60, 80]


def test_an_action_sets_a_parameter_of_a_refinement(tmp_path: Path) -> None:
    """What the refinement that is entered goes by is the new value."""
    inner = composite("two", prop("gain", 10), PORTS, entity("Scale", "Scale", factor="gain + 1"),
                      entity("Const", "Const", value="gain"), entity("Recorder", "Recorder"),
                      wires("in Scale.input Const.trigger", "Scale.output out", "Const.output Recorder.input"),
                      director=True)  # fmt: skip
    controller = state("one", isInitialState="true") + state("two", "two")
    controller += transition("t1", "one", "two", "in == 2", set_="two.gain = in * 50")
    controller += transition("t2", "two", "one", "in == 3")
    text = around(modal(controller, inner), "{2, 7, 3, 2, 8}", stop=4)
    assert [token for _, _, token in recorded(tmp_path, text)] == [707, 303, 808]


def test_a_default_that_an_expression_names(tmp_path: Path) -> None:
    text = model(
        entity("Clock", "DiscreteClock", offsets="{0.0, period / 4}", values="{1, 2}"),
        entity("Recorder", "Recorder"),
        wires("Clock.output Recorder.input"),
        stop=1,
    )
    assert [time for time, _, _ in recorded(tmp_path, text)] == [0.0, 0.25, 1.0]


def test_states_that_are_never_entered_and_ways_out_of_final_ones(tmp_path: Path) -> None:
    """Ptolemy allows both, for neither does anything."""
    parts = [state("a", isInitialState="true"), state("b", isFinalState="true"), state("lost"), state("also")]
    parts += [transition("t", "a", "b", "in == 2", "out = in"), transition("u", "b", "also", "true", "out = 0"),
              transition("v", "lost", "a", "true", "out = 0")]  # fmt: skip
    text = around(machine(*parts))
    assert notes(tmp_path, text) == [
        "M: lost is left out: no transition leads there",
        "M: also is left out: no transition leads there",
        "M: the transition u is left out: nothing leaves a final state",
        "M: in is called in_",
    ]
    assert recorded(tmp_path, text) == [(1.0, 1, 2)]


def test_a_default_transition_has_a_guard_too(tmp_path: Path) -> None:
    """It goes if no other is enabled and its guard holds."""
    parts = [state("a", isInitialState="true"), transition("t", "a", "a", "in == 1", "out = 10"),
             transition("u", "a", "a", "in > 2", "out = 20", defaultTransition="true")]  # fmt: skip
    assert [token for _, _, token in recorded(tmp_path, around(machine(*parts)))] == [10, 20, 20]
