"""What is in a file in few words and comes out in more: instances, channels, composites of other kinds, switches."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from epicycle.ptolemy.importing import MomlError
from tests.ptolemy.importing.moml_parts import (
    COMPOSITE,
    HEAD,
    LIB,
    TEXT,
    composite,
    entity,
    imported,
    model,
    notes,
    port,
    prop,
    recorded,
    run,
    wires,
)

IN, OUT = port("in", "input"), port("out", "output")
CLOCK, RECORDER = entity("Clock", "DiscreteClock", values="{1, 2, 3}"), entity("Recorder", "Recorder")


def values(tmp_path: Path, text: str) -> list[tuple[float, Any]]:
    """What the Recorder has heard, and when."""
    return [(time, token) for time, _, token in recorded(tmp_path, text)]


# -- wires ------------------------------------------------------------------------------------------------------------


def test_a_port_that_is_linked_twice_gets_twice(tmp_path: Path) -> None:
    text = model(
        CLOCK,
        entity("A", "AddSubtract"),
        RECORDER,
        wires("Clock.output A.plus A.plus", "A.output Recorder.input"),
        stop=0,
    )
    assert values(tmp_path, text) == [(0.0, 2)]


def test_a_port_that_nobody_knows_is_told(tmp_path: Path) -> None:
    text = model(
        CLOCK, entity("A", "Scale"), RECORDER, wires("Clock.output A.input A.strange", "A.output Recorder.input")
    )
    assert notes(tmp_path, text) == ["A.strange has no counterpart; its wires are left out"]


def test_widths_that_ports_of_an_actor_have_in_common(tmp_path: Path) -> None:
    """The output of a Sampler is as wide as its input, also through borders that do not say how wide they are."""
    many = port("in", "input", "multiport") + port("out", "output", "multiport")
    inner = composite(
        "I", many, entity("S", "Sampler"), CLOCK, wires("in S.input", "S.output out", "Clock.output S.trigger")
    )
    outer = composite("O", many, inner, wires("in I.in", "I.out out"))
    text = model(
        CLOCK,
        entity("Other", "DiscreteClock", values="{7}"),
        outer,
        entity("Test", "Test", correctValues="{{1, 7}, {2, 7}}"),
        wires("Clock.output O.in", "Other.output O.in", "O.out Test.input"),
        stop=1,
    )
    run(tmp_path, text)


# -- iterations -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["SDF", "SR"])
def test_a_model_of_iterations_is_refused(tmp_path: Path, name: str) -> None:
    java = f"ptolemy.domains.{name.lower()}.kernel.{name}Director"
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, HEAD + entity("m", COMPOSITE, prop("D", java=java), entity("Ramp", "Ramp")))
    assert str(caught.value) == f"m.xml cannot be imported:\n   - D is a {java}, which has no counterpart"


def test_a_delay_of_several_tokens(tmp_path: Path) -> None:
    delay = entity("D", "ptolemy.domains.sdf.lib.SampleDelay", initialOutputs="{5, 6}")
    text = model(CLOCK, delay, RECORDER, wires("Clock.output D.input", "D.output Recorder.input"), stop=3)
    assert values(tmp_path, text) == [(0.0, 5), (1.0, 6), (2.0, 1), (3.0, 2)]


# -- parameters that change, and ports with a default -----------------------------------------------------------------


def over_a_variable(*, inside: bool) -> str:
    """An Expression over a parameter that changes, through another parameter."""
    made = entity("E", "Expression", port("x", "input"), expression="x + q")
    inner = composite("C", IN, OUT, made, wires("in E.x", "E.output out"))
    setter = entity("Set", "SetVariable", prop("variableName", "p", TEXT)) + entity("Late", "TimeDelay", delay=0.5)
    ends = ("C.in", "C.out") if inside else ("E.x", "E.output")
    nets = wires("Clock.output Set.input Late.input", f"Late.output {ends[0]}", f"{ends[1]} Recorder.input")
    return model(prop("p", 0), prop("q", "p * 10"), CLOCK, setter, inner if inside else made, RECORDER, nets, stop=2)


def test_an_expression_over_a_parameter_that_changes(tmp_path: Path) -> None:
    assert values(tmp_path, over_a_variable(inside=False)) == [(0.5, 11), (1.5, 22)]
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, over_a_variable(inside=True))
    assert str(caught.value) == (
        "m.xml cannot be imported:\n   - C.E: expression: p, a variable outside, has no counterpart in an expression"
    )


def test_a_parameter_of_a_composite_around_is_not_set(tmp_path: Path) -> None:
    setter = entity("Set", "SetVariable", prop("variableName", "p", TEXT)) + wires("in Set.input")
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, model(prop("p", 0), CLOCK, composite("C", IN, setter), wires("Clock.output C.in")))
    assert str(caught.value) == (
        "m.xml cannot be imported:\n   - C.Set sets p of a composite around it, which has no counterpart"
    )


def test_a_parameter_that_is_set_by_what_it_is(tmp_path: Path) -> None:
    setter = entity("Set", "SetVariable", prop("variableName", "p", TEXT))
    counts = entity("E", "Expression", port("x", "input"), expression="p + 1")
    nets = wires("Clock.output E.x", "E.output Set.input Recorder.input")
    text = model(prop("p", 0), CLOCK, setter, counts, RECORDER, nets, stop=2)
    assert values(tmp_path, text) == [(0.0, 1), (1.0, 2), (2.0, 3)]


def test_a_parameter_of_an_actor_that_is_set(tmp_path: Path) -> None:
    setter = entity("Set", "SetVariable", prop("variableName", "Const.value", TEXT))
    late = entity("Late", "TimeDelay", delay=0.5) + entity("Const", "Const")
    nets = wires("Clock.output Set.input Late.input", "Late.output Const.trigger", "Const.output Recorder.input")
    assert values(tmp_path, model(CLOCK, setter, late, RECORDER, nets, stop=2)) == [(0.5, 1), (1.5, 2)]


def test_an_expression_with_inputs_that_hold_a_value(tmp_path: Path) -> None:
    """A port with a default, and a PortParameter, of which one is not connected."""
    parameters = "".join(prop(name, 5, "ptolemy.actor.parameters.PortParameter") for name in ("k", "l"))
    default = port("d", "input", inner=prop("defaultValue", 100))
    made = entity("E", "Expression", port("x", "input"), default, parameters, expression="x * k + d + l")
    once = entity("Once", "SingleEvent", time=0.5, value=7)
    nets = wires("Clock.output E.x", "Once.output E.k", "E.output Recorder.input")
    text = model(CLOCK, made, once, RECORDER, nets, stop=1)
    assert notes(tmp_path, text) == []
    assert values(tmp_path, text) == [(0.0, 110), (1.0, 119)]


def test_a_distribution_that_changes(tmp_path: Path) -> None:
    mean = entity("Mean", "DiscreteClock", values="{10.0, 1000.0}")
    nets = wires("Clock.output G.trigger", "Mean.output G.mean", "G.output Recorder.input")
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, model(CLOCK, mean, entity("G", "Gaussian"), RECORDER, nets))
    expected = "m.xml cannot be imported:\n   - G.mean: a distribution that changes during the run has no counterpart"
    assert str(caught.value) == expected


# -- what chooses and joins -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("selector", "expected"), [("true", [1, 2]), ("false", [7, 7])])
def test_a_selection_that_does_not_change(tmp_path: Path, selector: str, expected: list[int]) -> None:
    other = entity("Other", "DiscreteClock", values="{7}")
    chosen = entity("S", "ConfigurationSelect", selector=selector)
    nets = wires("Clock.output S.trueInput", "Other.output S.falseInput", "S.output Recorder.input")
    assert [token for _, token in values(tmp_path, model(CLOCK, other, chosen, RECORDER, nets, stop=1))] == expected


def test_one_token_of_each_channel_in_turn(tmp_path: Path) -> None:
    """Unlike a Commutator it does not wait for a channel that has nothing."""
    other = entity("Other", "DiscreteClock", values="{7, 8}", period=10, offsets="{1.0, 1.5}")
    nets = wires("Clock.output S.input", "Other.output S.input", "S.output Recorder.input")
    text = model(CLOCK, other, entity("S", "SingleTokenCommutator"), RECORDER, nets, stop=2)
    assert values(tmp_path, text) == [(0.0, 1), (1.0, 7), (1.0, 2), (1.5, 8), (2.0, 3)]


def test_unions(tmp_path: Path) -> None:
    actors = entity("U", "UnionMerge", port("b", "input"), port("a", "input"))
    actors += entity("D", "UnionDisassembler", port("a", "output")) + entity("Other", "DiscreteClock", values="{7}")
    test = entity("Test", "NonStrictTest", correctValues="{{|b = 1|}, {|a = 7|}}")
    nets = wires("Clock.output U.b", "Other.output U.a", "U.output D.input Test.input", "D.a Recorder.input")
    assert values(tmp_path, model(CLOCK, actors, test, RECORDER, nets, stop=0)) == [(0.0, 7)]


# -- what is left out on purpose --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "java",
    [
        f"{LIB}hoc.Case", f"{LIB}hoc.MultiInstanceComposite", f"{LIB}hoc.ThreadedComposite",
        f"{LIB}SubscriptionAggregator", "ptolemy.domains.sdf.lib.Chop", "ptolemy.domains.de.lib.EventButton",
        "ptolemy.domains.de.test.CancelFireAtTest",
    ],
)  # fmt: skip
def test_a_class_that_is_not_supported(tmp_path: Path, java: str) -> None:
    inner = entity("Scale", "Scale") + wires("in Scale.input", "Scale.output out") if ".hoc." in java else ""
    nets = wires("Clock.output A.in", "A.out Recorder.input")
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, model(CLOCK, entity("A", java, IN, OUT, inner), RECORDER, nets))
    assert str(caught.value) == f"m.xml cannot be imported:\n   - A is a {java}, which has no counterpart"


def test_an_array_without_duplicates(tmp_path: Path) -> None:
    arrays = entity("Arrays", "DiscreteClock", values="{{3, 9, 9, 1}}")
    nets = wires("Arrays.output A.input", "A.output Recorder.input")
    text = model(arrays, entity("A", "ArraySort", allowDuplicates="false"), RECORDER, nets, stop=0)
    assert values(tmp_path, text) == [(0.0, [1, 3, 9])]
