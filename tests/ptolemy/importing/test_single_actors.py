"""What single actors of a file become: checks, expressions, variables, values."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.ptolemy.importing import MomlError
from tests.ptolemy.importing.moml_parts import (
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
    sent,
    wires,
    written,
)


def test_a_strict_test_of_several_channels(tmp_path: Path) -> None:
    actors = entity("a", "DiscreteClock", values="{1, 2}") + entity("b", "DiscreteClock", values="{3, 4}")
    good = entity("Test", "Test", correctValues="{{1, 3}, {2, 4}}")
    run(tmp_path, model(actors, good, wires("a.output Test.input", "b.output Test.input"), stop=1))
    bad = model(actors, good.replace("{2, 4}", "{2, 5}"), wires("a.output Test.input", "b.output Test.input"), stop=1)
    with pytest.raises(
        Exception, match=r"Test failed in fire\(\) at \(1 s, 1\): token 1 is \[2, 4\], expected \[2, 5\]"
    ):
        run(tmp_path, bad)


def test_a_test_in_training_checks_nothing(tmp_path: Path) -> None:
    text = model(
        entity("a", "DiscreteClock"),
        entity("Test", "Test", correctValues="{7}", trainingMode="true"),
        wires("a.output Test.input"),
    )
    assert notes(tmp_path, text) == ["Test is in training mode and checks nothing"]
    assert "  Test: {type: Recorder}\n" in written(tmp_path, text)


def test_the_last_that_says_whether_it_trains_says_it_for_all_of_its_class(tmp_path: Path) -> None:
    text = model(
        entity("a", "DiscreteClock"),
        entity("One", "Test", correctValues="{7}", trainingMode="true"),
        entity("Two", "Test", correctValues="{1}", trainingMode="false", requireAllCorrectValues="false"),
        entity("Three", "NonStrictTest", correctValues="{1, 1}"),
        wires("a.output One.input Two.input Three.input"),
        stop=1,
    )
    assert notes(tmp_path, text) == []
    assert "  One: {type: Test, values: [7], complete: false}\n" in written(tmp_path, text)
    assert "  Three: {type: Test, values: [1, 1]}\n" in written(tmp_path, text)


def test_what_a_test_expects_where_anything_may_come(tmp_path: Path) -> None:
    """NaN is close to every number, and nil stands for any token."""
    text = model(
        entity("a", "DiscreteClock", values="{1, 2, 3}"),
        entity("Test", "NonStrictTest", correctValues="{NaN, nil, 3}"),
        wires("a.output Test.input"),
        stop=2,
    )
    assert "  Test: {type: Test, values: [.nan, null, 3]}\n" in written(tmp_path, text)
    run(tmp_path, text)


def test_a_test_of_one_channel_expects_arrays_in_arrays(tmp_path: Path) -> None:
    """And the arrays around them stand for the channel, however many there are in each."""
    actors = entity("a", "DiscreteClock", values="{{1, 2}, {3}}")
    for expected, values in (
        ("{{{1, 2}}, {{3}}}", "[[1, 2], [3]]"),
        ("{{{1, 2}}, {{3}, {4}}}", "[[1, 2], [[3], [4]]]"),
    ):
        text = model(actors, entity("Test", "Test", correctValues=expected), wires("a.output Test.input"), stop=1)
        assert f"  Test: {{type: Test, values: {values}}}\n" in written(tmp_path, text)


def test_a_test_sends_whether_it_is_done(tmp_path: Path) -> None:
    text = model(
        entity("a", "DiscreteClock", values="{1, 2, 3}"),
        entity("Test", "Test", correctValues="{1, 2}"),
        entity("Stop", "Stop"),
        wires("a.output Test.input", "Test.output Stop.input"),
        stop=9,
    )
    assert notes(tmp_path, text) == []
    assert "  - Test.output -> Stop.input\n" in written(tmp_path, text)
    assert [time for time, *_ in sent(tmp_path, text)] == [0.0, 1.0]


def test_a_test_of_types_is_left_out(tmp_path: Path) -> None:
    text = model(entity("a", "DiscreteClock"), entity("T", "TypeTest", portTypes="{a={}}"), wires("a.output T.input"))
    assert "T:" not in written(tmp_path, text)


def test_an_expression_has_the_ports_that_somebody_added(tmp_path: Path) -> None:
    actors = entity("Clock", "DiscreteClock", values="{1, 2}") + entity("Recorder", "Recorder")
    actors += entity(
        "E", "Expression", port("in", "input"), port("also", "input"), expression="in * n + time > 4 ? -in : in"
    )
    text = model(prop("n", 3), actors, wires("Clock.output E.in E.also", "E.output Recorder.input"), stop=1)
    assert "expression: '[-in_ if in_ * 3 + time > 4 else in_, also][0]'" in written(tmp_path, text)
    assert [token for _, _, token in recorded(tmp_path, text)] == [1, -2]


def test_texts(tmp_path: Path) -> None:
    const = entity("Const", f"{LIB}StringConst", prop("value", "n is $n, ${n}$$", TEXT))
    text = model(
        prop("n", 3),
        entity("Clock", "DiscreteClock"),
        const,
        entity("Recorder", "Recorder"),
        wires("Clock.output Const.trigger", "Const.output Recorder.input"),
        stop=0,
    )
    assert recorded(tmp_path, text) == [(0.0, 1, "n is 3, 3$")]


def test_a_parameter_that_a_set_variable_sets(tmp_path: Path) -> None:
    setter = entity("Set", f"{LIB}SetVariable", prop("variableName", "P", "ptolemy.kernel.util.StringAttribute"))
    actors = (
        entity("Clock", "DiscreteClock", values="{10, 20}")
        + entity("Const", "Const", value="P + 1")
        + entity("Recorder", "Recorder")
    )
    delay = entity("Delay", "TimeDelay", delay=0.5)
    nets = wires("Clock.output Set.input Delay.input", "Delay.output Const.trigger", "Const.output Recorder.input")
    text = model(prop("P", 1), setter, actors, delay, nets, stop=2)
    assert "  P_in_Const_value: {type: Replace, to: P_variable.value + 1, at: Const.value}\n" in written(tmp_path, text)
    assert recorded(tmp_path, text) == [(0.5, 1, 11), (1.5, 1, 21)]


def test_a_port_parameter_of_a_composite(tmp_path: Path) -> None:
    inner = composite(
        "C",
        port("in", "input"),
        port("out", "output"),
        prop("p", 1, "ptolemy.actor.parameters.PortParameter"),
        entity("Const", "Const", value="p"),
        wires("in Const.trigger", "Const.output out"),
        director=True,
    )
    actors = (
        entity("Values", "DiscreteClock", values="{5, 6}")
        + entity("Ask", "DiscreteClock", offsets="{0.5}")
        + entity("Recorder", "Recorder")
    )
    text = model(inner, actors, wires("Values.output C.p", "Ask.output C.in", "C.out Recorder.input"), stop=2)
    assert [token for _, _, token in recorded(tmp_path, text)] == [5, 6]


def test_functions_that_a_model_defines_are_refused(tmp_path: Path) -> None:
    text = model(
        entity("c", "DiscreteClock", values="{1, 2}"),
        entity("a", "Const", value="f(2)"),
        entity("R", "Recorder"),
        wires("c.output a.trigger", "a.output R.input"),
        f="function(x:int) x + 1",
    )
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, text)
    assert str(caught.value) == (
        "m.xml cannot be imported:\n   - a.value = 'f(2)': 'function(x:int) x + 1' cannot be read: "
        "functions that a model defines are not supported"
    )


def sending(said: str) -> str:
    actors = entity("c", "DiscreteClock") + entity("a", "Const", value=said) + entity("R", "Recorder")
    return model(actors, wires("c.output a.trigger", "a.output R.input"), stop=0)


def test_nil_is_null_in_arrays_alone(tmp_path: Path) -> None:
    assert recorded(tmp_path, sending("{1, nil}"), "R") == [(0.0, 1, [1, None])]
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, sending("nil"))
    assert str(caught.value) == "m.xml cannot be imported:\n   - a.value = 'nil': nil cannot be written"
