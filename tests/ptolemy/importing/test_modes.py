"""Modal models and state machines."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.ptolemy.importing import MomlError
from tests.ptolemy.importing.moml_parts import (
    LIB,
    MODAL,
    composite,
    entity,
    imported,
    model,
    notes,
    port,
    prop,
    recorded,
    sent,
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
    assert "    modes: {one: {refinement: one}, two: null}\n" in written(tmp_path, text)
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
             transition("t", "b", "a", "true", "out = 7", defaultTransition="true")]  # fmt: skip
    text = around(machine(*parts, java=old))
    assert "  M: {type: StateMachine, modes: [a, b], initial: b, transitions: [b -> a else do out = 7]}\n" in written(
        tmp_path, text
    )
    assert notes(tmp_path, text) == ["M: in is renamed in_", "M: in is left out: nothing reads it"]


def test_words_that_could_be_mistaken(tmp_path: Path) -> None:
    parts = (
        state("a", isInitialState="true")
        + state("b")
        + transition("t", "a", "b", "after > 2", "out = 'on; when'", after=1)
    )
    text = around(machine(prop("after", 1), parts, transition("u", "b", "a", set_="after = after + 1")))
    found = written(tmp_path, text)
    assert "      - {from: a, to: b, when: after > 2, do: out = 'on; when'}\n" in found
    assert "      - {from: b, to: a, do: after = after + 1}\n" in found


def test_what_of_machines_has_no_counterpart(tmp_path: Path) -> None:
    parts = (
        state("a", isInitialState="true")
        + state("b")
        + transition("t", "a", "b", "in > 1", "other = 1; out = 1", "b.gain = 2; nonsense")
    )
    text = around(machine(parts))
    assert notes(tmp_path, text) == [
        "M: t: other = 1 is left out: other is neither an output nor a variable",
        "M: t: b.gain = 2 is left out: b.gain is neither an output nor a variable",
        "M: t: nonsense =  is left out: nonsense is neither an output nor a variable",
        "M: in is renamed in_",
    ]
    wrong = around(machine(state("a", isInitialState="true"), transition("t", "a", "a", "random() > 0.5")))
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, wrong)
    assert str(caught.value) == "m.xml cannot be imported:\n   - M.t: the function 'random' is not supported"


def test_a_machine_that_the_director_names(tmp_path: Path) -> None:
    """A composite whose director is that of a modal model; a refinement cannot go by what a transition sets.

    What the action sends takes the place of the 20 that the refinement has sent in the same firing.
    """
    controller = state("one", "one", isInitialState="true") + transition(
        "t", "one", "one", "in == 2", "out = k", "k = k + 1"
    )
    inner = composite(
        "one", PORTS, entity("Scale", "Scale", factor="n * 10"), wires("in Scale.input", "Scale.output out")
    )
    director = prop("D", java="ptolemy.domains.fsm.kernel.FSMDirector", inner=prop("controllerName", "Ctrl", TEXT))
    made = entity(
        "M",
        "ptolemy.actor.TypedCompositeActor",
        director,
        PORTS,
        prop("k", 1),
        prop("n", 1),
        inner,
        entity("Ctrl", "ptolemy.domains.fsm.kernel.FSMActor", PORTS, controller),
    )
    assert sorted(token for _, _, token in recorded(tmp_path, around(made))) == [1, 10, 30, 40]
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, around(made.replace("n * 10", "k * 10")))
    assert str(caught.value) == (
        "m.xml cannot be imported:\n   - M: Scale.factor in a refinement uses k, which a transition sets"
    )


def test_a_default_that_an_expression_names(tmp_path: Path) -> None:
    text = model(
        entity("Clock", "DiscreteClock", offsets="{0.0, period / 4}", values="{1, 2}"),
        entity("Recorder", "Recorder"),
        wires("Clock.output Recorder.input"),
        stop=1,
    )
    assert [time for time, _, _ in recorded(tmp_path, text)] == [0.0, 0.25, 1.0]


def test_a_default_transition_has_a_guard_too(tmp_path: Path) -> None:
    """It goes if no other is enabled and its guard holds."""
    parts = [state("a", isInitialState="true"), transition("t", "a", "a", "in == 1", "out = 10"),
             transition("u", "a", "a", "in > 2", "out = 20", defaultTransition="true")]  # fmt: skip
    assert [token for _, _, token in recorded(tmp_path, around(machine(*parts)))] == [10, 20, 20]


SEVERAL = port("in", "input", "multiport") + port("out", "output", "multiport")


def with_channels(made: str, *more: str) -> str:
    """A machine with two clocks at its input, and two recorders at its output."""
    clocks = entity("C1", "DiscreteClock", values="{1, 2, 3}") + entity("C2", "DiscreteClock", values="{5, 6, 7}")
    sinks = entity("R1", "Recorder") + entity("R2", "Recorder")
    return model(clocks, sinks, made, *more, stop=2)


def test_channels_of_a_machine(tmp_path: Path) -> None:
    """Each is a port; a name without a number is of the last one, and an action without a channel sends by all."""
    parts = [
        state("a", isInitialState="true"),
        state("b"),
        transition("t", "a", "b", "in_0 == 1 && in_1 == 5", "out = in; out = in_0 + 10"),
        transition("u", "b", "a", "in_0_isPresent && in_isPresent", "out = in_1 + in"),
    ]
    made = entity("M", f"{MODAL}kernel.FSMActor", SEVERAL, *parts)
    text = with_channels(made, wires("C1.output M.in", "C2.output M.in", "M.out R1.input", "M.out R2.input"))
    assert (
        written(tmp_path, text).split("connections:")[0].split("  M:")[1]
        == """
    type: StateMachine
    modes: [a, b]
    transitions:
      - a -> b when in_ == 1 and in_1 == 5 do out = in_1; out_1 = in_1; out = in_ + 10; out_1 = in_ + 10
      - b -> a on in_ when in_1_is_present do out = in_1 + in_1; out_1 = in_1 + in_1
"""
    )
    assert notes(tmp_path, text) == ["M: in is renamed in_"]
    assert recorded(tmp_path, text, "R1") == [(0.0, 1, 5), (0.0, 1, 11), (1.0, 1, 12)]
    assert recorded(tmp_path, text, "R2") == [(0.0, 1, 5), (0.0, 1, 11), (1.0, 1, 12)]


def test_channels_of_a_modal_model(tmp_path: Path) -> None:
    """Its refinements know them by the same names; of what leaves together by one channel the last alone counts."""
    inner = composite("a", SEVERAL, entity("Scale", "Scale", factor=10), entity("Other", "Scale", factor=100),
                      wires("in Scale.input", "in Other.input", "Scale.output out", "Other.output out"),
                      director=True)  # fmt: skip
    controller = [state("a", "a", isInitialState="true"), transition("t", "a", "a", "in_1 == 6", "out = in_0")]
    own = entity("_Controller", f"{MODAL}modal.ModalController", SEVERAL, *controller)
    names = "in _Controller.in a.in", "out _Controller.out a.out"
    relations = "".join(
        f'<relation name="w{number}" class="ptolemy.actor.TypedIORelation">{prop("width", 2)}</relation>'
        + "".join(f'<link port="{each}" relation="w{number}"/>' for each in name.split())
        for number, name in enumerate(names)
    )
    made = entity("M", f"{MODAL}modal.ModalModel", SEVERAL, own, inner, relations)
    text = with_channels(made, wires("C1.output M.in", "C2.output M.in", "M.out R1.input", "M.out R2.input"))
    assert (
        written(tmp_path, text).split("  M:")[1].split("actors:")[0]
        == """
    inputs: [in_, in_1]
    outputs: [out, out_1]
    modes: {a: {refinement: a}}
    transitions:
      - a -> a when in_1 == 6 do out = in_; out_1 = in_
"""
    )
    assert recorded(tmp_path, text, "R1") == [(0.0, 1, 10), (1.0, 1, 2), (2.0, 1, 30)]
    assert recorded(tmp_path, text, "R2") == [(0.0, 1, 500), (1.0, 1, 2), (2.0, 1, 700)]


def test_an_action_for_one_channel(tmp_path: Path) -> None:
    parts = state("a", isInitialState="true") + transition("t", "a", "a", "in_isPresent", "out(1) = 1")
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, around(machine(parts)))
    assert str(caught.value) == (
        "m.xml cannot be imported:\n   - M.t: out(1) = ...: an action for one channel has no counterpart"
    )


def together(made: str, values: str, number: int) -> str:
    """A machine that gets so many tokens at once."""
    actors = entity("Clock", "DiscreteClock", values=f"{{{values}}}") + entity("Recorder", "Recorder")
    actors += entity("Each", f"{LIB[:-1]}.ArrayToSequence".replace("actor.lib", "domains.sdf.lib"), arrayLength=number)
    return model(actors, made, wires("Clock.output Each.input", "Each.output M.in", "M.out Recorder.input"), stop=0)


def test_tokens_that_come_together_are_for_a_firing_each(tmp_path: Path) -> None:
    """At the same tag; and set actions come behind all output actions of a reaction, by which its guards go, too."""
    parts = [prop("n", 0), state("a", isInitialState="true"), state("b"), state("c"),
             transition("t", "a", "b", "in > 0", "out = n", "n = n + in"),
             transition("i", "b", "c", "in > 4", "out = -n", "n = n + 100", immediate="true"),
             transition("u", "b", "a", "in > 1", "out = in * 10"),
             transition("w", "c", "a", "n > 100 && !in_isPresent", "out = n")]  # fmt: skip
    text = together(machine(*parts), "{1, 2, 3, 4, 5}", 5)
    # 1 takes t, 2 u, 3 t (n is 1), 4 u (n is 4), 5 t and i (n is 4, and then 9 and 109); and no token w.
    wanted = [(0.0, 1, each) for each in (0, 20, 1, 40, 4, -4)]
    assert recorded(tmp_path, text) == [*wanted, (0.0, 2, 109)]


def test_a_modal_model_fires_again_for_tokens_that_come_together(tmp_path: Path) -> None:
    """Also what a transition enters does so at the same tag, and begins if it is entered anew."""
    inner = composite("two", PORTS, entity("Scale", "Scale", factor=10), entity("Begin", "DiscreteClock", values="{7}"),
                      wires("in Scale.input", "Scale.output out", "Begin.output Recorder.input"),
                      entity("Recorder", "Recorder"), director=True)  # fmt: skip
    controller = state("one", isInitialState="true") + state("two", "two")
    controller += transition("t", "one", "two", "in == 2", "out = 2", history="false")
    controller += transition("u", "two", "one", "in == 4", history="false")
    text = together(modal(controller, inner), "{1, 2, 3, 4, 5, 2}", 6)
    # 2 leads to the other mode, where 3 and 4 are scaled; 5 comes to nothing, and 2 leads there once more.
    assert recorded(tmp_path, text) == [(0.0, 1, 2), (0.0, 1, 30), (0.0, 1, 40), (0.0, 1, 2)]
    begins = [each[:2] for each in sent(tmp_path, text) if each[2] == "M.two.Begin.output"]
    assert begins == [(0.0, 1), (0.0, 2)]
