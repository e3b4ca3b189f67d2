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

SDF = "ptolemy.domains.sdf.kernel.SDFDirector"
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


def sdf(**parameters: object) -> str:
    return prop("SDF", java=SDF, inner="".join(prop(name, value) for name, value in parameters.items()))


def test_iterations_with_a_period(tmp_path: Path) -> None:
    inner = composite("C", OUT, sdf(period="1.0 / 2"), entity("Ramp", "Ramp"), wires("Ramp.output out"))
    text = model(inner, RECORDER, wires("C.out Recorder.input"), stop=1)
    assert values(tmp_path, text) == [(0.0, 0), (0.5, 1), (1.0, 2)]


def whole(*inner: str, **parameters: object) -> str:
    """A model with an SDF director."""
    return HEAD + entity("m", COMPOSITE, sdf(**parameters), *inner)


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"iterations": 3}, [(0.0, 1, 0), (0.0, 2, 3), (0.0, 3, 6)]),
        ({"iterations": 3, "period": 0.5}, [(0.0, 1, 0), (0.5, 1, 3), (1.0, 1, 6)]),
        ({"iterations": "AUTO"}, [(0.0, 1, 0)]),
    ],
)
def test_a_model_of_iterations(tmp_path: Path, parameters: dict[str, object], expected: list[Any]) -> None:
    inner = composite("D", IN, OUT, entity("S", "Scale", factor=3), wires("in S.input", "S.output out"), director=True)
    nets = wires("Ramp.output D.in", "D.out Recorder.input")
    text = whole(entity("Ramp", "Ramp"), inner, RECORDER, nets, **parameters)
    assert recorded(tmp_path, text, as_de=True) == expected


def test_a_model_of_iterations_needs_a_word(tmp_path: Path) -> None:
    text = whole(entity("Ramp", "Ramp"), RECORDER, wires("Ramp.output Recorder.input"), iterations=3)
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, text)
    assert str(caught.value) == (
        "m.xml cannot be imported:\n   - SDF is a ptolemy.domains.sdf.kernel.SDFDirector: "
        "to let its actors fire by the rules of DE, say --as-de"
    )
    found = imported(tmp_path, text, as_de=True)
    assert found.notes[0] == "SDF, a SDFDirector: the actors inside fire by the rules of DE"


def test_a_model_of_endless_iterations(tmp_path: Path) -> None:
    text = whole(entity("Ramp", "Ramp"), RECORDER, wires("Ramp.output Recorder.input"), iterations=0)
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, text, as_de=True)
    assert str(caught.value).endswith("   - m: endlessly many iterations at one time have no counterpart")


def test_a_delay_of_one_iteration_in_a_loop(tmp_path: Path) -> None:
    delay = entity("D", "ptolemy.domains.sdf.lib.SampleDelay", initialOutputs="{5}")
    inner = entity("Add", "AddSubtract") + wires("in Add.plus", "D.output Add.plus", "Add.output D.input out")
    nets = wires("Clock.output C.in", "C.out Recorder.input")
    text = model(CLOCK, composite("C", IN, OUT, sdf(), delay, inner), RECORDER, nets)
    assert values(tmp_path, text)[:3] == [(0.0, 6), (1.0, 8), (2.0, 11)]


def test_a_delay_of_several_tokens(tmp_path: Path) -> None:
    delay = entity("D", "ptolemy.domains.sdf.lib.SampleDelay", initialOutputs="{5, 6}")
    text = model(CLOCK, delay, RECORDER, wires("Clock.output D.input", "D.output Recorder.input"), stop=3)
    assert values(tmp_path, text) == [(0.0, 5), (1.0, 6), (2.0, 1), (3.0, 2)]


# -- parameters that change, and ports with a default -----------------------------------------------------------------


def test_an_expression_over_a_parameter_that_changes(tmp_path: Path) -> None:
    """Also through another parameter, and in a composite."""
    inner = composite(
        "C", IN, OUT, entity("E", "Expression", port("x", "input"), expression="x + q"), wires("in E.x", "E.output out")
    )
    setter = entity("Set", "SetVariable", prop("variableName", "p", TEXT))
    late = entity("Late", "TimeDelay", delay=0.5)
    nets = wires("Clock.output Set.input Late.input", "Late.output C.in", "C.out Recorder.input")
    text = model(prop("p", 0), prop("q", "p * 10"), CLOCK, setter, late, inner, RECORDER, nets, stop=2)
    assert values(tmp_path, text) == [(0.5, 11), (1.5, 22)]


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
    law = entity("G", "Gaussian", standardDeviation="0.0")
    nets = wires("Clock.output G.trigger", "Mean.output G.mean", "G.output Recorder.input")
    text = model(CLOCK, mean, law, RECORDER, nets, stop=1)
    assert values(tmp_path, text) == [(0.0, 10.0), (1.0, 1000.0)]


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
