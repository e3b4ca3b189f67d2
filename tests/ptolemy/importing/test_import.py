"""Whole models: what is written, what is said of the rest, what is refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.ptolemy.importing import MomlError, import_moml
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.load import load_model
from tests.ptolemy.importing.moml_parts import (
    COMPOSITE,
    DE,
    DIRECTOR,
    LIB,
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

QUEUE = model(
    prop("_windowProperties", "{bounds={0, 22, 834, 762}}", "ptolemy.actor.gui.WindowPropertiesAttribute"),
    prop("interval", "2"),
    entity(
        "Customers",
        f"{LIB}DiscreteClock",
        prop("_location", "[1, 2]", "ptolemy.kernel.util.Location"),
        period="interval / 2",
    ),
    entity("The queue!", f"{DE}Queue", capacity="0"),
    entity("Server", f"{DE}Server", serviceTime="interval * 0.75"),
    entity("Display", f"{LIB}gui.Display"),
    entity("Test", "Test", correctValues="{1, 1}", trainingMode="false", tolerance="1E-6"),
    '<entity name="Annotation" class="ptolemy.vergil.kernel.attributes.TextAttribute"/>',
    wires("Customers.output Server.input", "Server.output Display.input Test.input"),
    stop="4 * 1",
).replace("The queue!", "unused")


def test_a_model_as_a_person_would_have_written_it(tmp_path: Path) -> None:
    assert (
        imported(tmp_path, QUEUE).text
        == """\
# Imported from m.xml, a model of Ptolemy II; left out: layout, 1 view.
# - unused is left out: it never fires because nothing sends to its input
model: m
parameters: {interval: 2}
director: {like: ptolemy}
actors:
  Customers: {type: Clock, period: '${interval / 2}', values: [1]}
  Server: {type: Server, service_time: '${interval * 0.75}'}
  Test: {type: Test, values: [1, 1], tolerance: 1.0e-06}
connections:
  - Customers.output -> Server.input
  - Server.output -> Test.input
run: {stop: 4 s}
"""
    )


def test_classes_and_what_instances_change(tmp_path: Path) -> None:
    """A class of a class, and instances that override parameters inside and add actors."""
    base = f"""<class name="Base" extends="{COMPOSITE}">
      {prop("gain", 2)}{port("in", "input")}{port("out", "output")}
      {entity("Scale", "Scale", factor="gain")}{wires("in Scale.input", "Scale.output out")}</class>
    <class name="Heir" extends="Base">{prop("gain", 3)}</class>"""
    actors = entity("Clock", "DiscreteClock") + entity("one", "Base").replace(f"{LIB}Base", "Base")
    actors += f'<entity name="two" class="Heir"/><entity name="three" class="Heir">{prop("gain", "2 * 2 + 1")}</entity>'
    actors += f'<entity name="four" class="Base">{entity("Scale", "Scale", factor=10)}</entity>'
    sinks = "".join(entity(f"r_{each}", "Recorder") for each in ("one", "two", "three", "four"))
    joined = wires(
        "Clock.output one.in two.in three.in four.in",
        *(f"{each}.out r_{each}.input" for each in ("one", "two", "three", "four")),
    )
    text = written(tmp_path, model(base, actors, sinks, joined, stop=0))
    assert (
        text
        == """\
model: m
director: {like: ptolemy}
composites:
  Base:
    parameters: {gain: 2}
    inputs: [in]
    outputs: [out]
    actors:
      Scale: {type: Scale, factor: '${gain}'}
    connections:
      - in -> Scale.input
      - Scale.output -> out
  Base_2:
    inputs: [in]
    outputs: [out]
    actors:
      Scale: {type: Scale, factor: 10}
    connections:
      - in -> Scale.input
      - Scale.output -> out
actors:
  Clock: {type: Clock, period: 1 s, values: [1]}
  one: {type: Base}
  two: {type: Base, gain: 3}
  three: {type: Base, gain: 5}
  four: {type: Base_2}
  r_one: {type: Recorder}
  r_two: {type: Recorder}
  r_three: {type: Recorder}
  r_four: {type: Recorder}
connections:
  - Clock.output -> one.in, two.in, three.in, four.in
  - one.out -> r_one.input
  - two.out -> r_two.input
  - three.out -> r_three.input
  - four.out -> r_four.input
run: {stop: 0 s}
"""
    )


def test_parameters_of_outer_composites_are_known_inside(tmp_path: Path) -> None:
    inner = composite(
        "inner",
        port("out", "output"),
        prop("own", "outer + 1"),
        entity("Clock", "DiscreteClock", values="{own, deep}"),
        wires("Clock.output out"),
        director=True,
    )
    outer = composite("outside", port("out", "output"), prop("deep", "outer * 10"), inner, wires("inner.out out"))
    text = model(prop("outer", 4), outer, entity("Recorder", "Recorder"), wires("outside.out Recorder.input"), stop=1)
    assert "values: '${[own, 40]}'" in written(tmp_path, text)
    assert recorded(tmp_path, text) == [(0.0, 1, 5), (1.0, 1, 40)]


def test_names_that_are_none_here(tmp_path: Path) -> None:
    actors = entity("my clock", "DiscreteClock") + entity("3rd", "Recorder") + entity("3rd!", "Recorder")
    links = "".join(f'<link port="{each}" relation="r0"/>' for each in ("my clock.output", "3rd.input", "3rd!.input"))
    text = model(actors, wires(""), links, stop=0)
    assert notes(tmp_path, text) == ["my clock is renamed my_clock", "3rd is renamed _3rd", "3rd! is renamed _3rd_2"]


def test_what_has_no_counterpart_is_told(tmp_path: Path) -> None:
    ramp = entity(
        "Ramp",
        f"{LIB}Ramp",
        port("trigger", "input", "multiport", inner=prop("defaultValue", 3)),
        firingCountLimit=5,
        odd='"x"',
    )
    extra = prop("own", "1") + prop("strange", java="ptolemy.actor.StrangeAttribute")
    text = model(
        entity("Clock", "DiscreteClock"),
        ramp,
        entity("Recorder", "Recorder"),
        extra,
        wires("Clock.output Ramp.trigger", "Ramp.output Recorder.input"),
    )
    assert notes(tmp_path, text) == [
        "Ramp.trigger.defaultValue = '3' has no counterpart",
        "Ramp.odd = '\"x\"' has no counterpart",
        "strange, a StrangeAttribute, has no counterpart",
    ]


def refusal(tmp_path: Path, text: str) -> str:
    with pytest.raises(MomlError) as caught:
        imported(tmp_path, text)
    return str(caught.value)


def test_all_that_cannot_be_said_is_told_at_once(tmp_path: Path) -> None:
    inner = composite("inner", port("out", "output"), entity("Magic", f"{LIB}MagicSource"), wires("Magic.output out"))
    actors = entity("Python", "ptolemy.actor.lib.python.PythonScript", port("in", "input"), port("out", "output"))
    actors += entity("Expression", "Expression", port("x", "input"), expression="x + random()") + entity(
        "Clock", "DiscreteClock", period="unheard"
    )
    nets = wires(
        "inner.out Python.in",
        "Python.out Recorder.input",
        "Clock.output Expression.x",
        "Expression.output Recorder.input",
    )
    assert (
        refusal(tmp_path, model(inner, actors, entity("Recorder", "Recorder"), nets))
        == """\
m.xml cannot be imported:
   - inner.Magic is a ptolemy.actor.lib.MagicSource, which has no counterpart
   - Python is a ptolemy.actor.lib.python.PythonScript, which has no counterpart: a script is a program, and \
no program in an imported file is run
   - Expression: expression: the function 'random' is not supported
   - Clock.period = 'unheard': unknown name 'unheard'"""
    )


def test_another_director_is_refused(tmp_path: Path) -> None:
    text = model(entity("Clock", "DiscreteClock")).replace(
        DIRECTOR, "ptolemy.domains.continuous.kernel.ContinuousDirector"
    )
    expected = "DE Director is a ptolemy.domains.continuous.kernel.ContinuousDirector, which has no counterpart"
    expected += ": continuous models are not imported"
    assert refusal(tmp_path, text) == f"m.xml cannot be imported:\n   - {expected}"


def test_a_result_that_does_not_load_is_refused_with_the_reason(tmp_path: Path) -> None:
    text = model(entity("Scale", "Scale"), wires("Scale.output Scale.input"))
    assert (
        refusal(tmp_path, text)
        == """\
m.xml cannot be imported: the result is not a valid model
m.yaml:7:5: error: a loop without delay: Scale -> Scale
    7 |   - Scale.output -> Scale.input
      |     ^^^^^^^^^^^^
   help: Scale.output -> Scale.input (m.yaml:7)
   help: give one of these connections a delay, preferably the one that leads back: \
{from: Scale.output, to: Scale.input, delay: ...}"""
    )


class Strange(Actor):
    """Stands for a Java class of its name."""

    some_input: InputPort[float] = InputPort(float)
    output: OutputPort[float] = OutputPort(float)

    def fire(self) -> None:
        self.output.send(-self.some_input.value)


def test_an_actor_of_ones_own_stands_for_a_java_class(tmp_path: Path) -> None:
    actors = entity("Clock", "DiscreteClock") + entity("S", "org.example.Strange") + entity("Recorder", "Recorder")
    file = tmp_path / "m.xml"
    file.write_text(model(actors, wires("Clock.output S.someInput", "S.output Recorder.input"), stop=1))
    found = import_moml(file, lambda path: load_model(path, types=[Strange]), [Strange])
    assert "  S: {type: Strange}\n" in found.text
    assert "  - Clock.output -> S.some_input\n" in found.text


# -- the command ------------------------------------------------------------------------------------------------------


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.xml").write_text(QUEUE)
    assert main(["import", "m.xml", "-o", "m.yaml"]) == 0
    out, err = capsys.readouterr()
    assert out == "wrote m.yaml\n"
    assert err.splitlines()[0] == "note: unused is left out: it never fires because nothing sends to its input"
    assert err.splitlines()[-1] == "note: left out: layout, 1 view"
    assert main(["run", "m.yaml", "--until", "4"]) == 0


def test_the_command_prints_what_it_does_not_write(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "m.xml").write_text(model(entity("Clock", "DiscreteClock")))
    assert main(["import", str(tmp_path / "m.xml")]) == 0
    assert capsys.readouterr().out.splitlines()[1] == "model: m"


def test_a_refused_model_is_not_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "m.xml").write_text(
        model(entity("A", f"{LIB}Magic"), entity("B", "Recorder"), wires("A.output B.input"))
    )
    out = tmp_path / "m.yaml"
    assert main(["import", str(tmp_path / "m.xml"), "-o", str(out)]) == 2
    assert capsys.readouterr().err == (
        "error: m.xml cannot be imported:\n   - A is a ptolemy.actor.lib.Magic, which has no counterpart\n"
    )
    assert not out.exists()
    assert main(["import", str(tmp_path / "m.xml"), "-o", str(tmp_path / "m.txt")]) == 2
    assert capsys.readouterr().err == f"error: {tmp_path}/m.txt is not a name for a model file: it must end in .yaml\n"


def test_help_does_not_load_much() -> None:
    code = "import sys; from epicycle.runner.interface.cli import main\n"
    code += "try:\n main(['import', '--help'])\nexcept SystemExit: pass\n"
    code += "assert 'numpy' not in sys.modules and 'epicycle.ptolemy.importing' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)


def test_a_model_whose_time_does_not_begin_at_0(tmp_path: Path) -> None:
    start = '<property name="startTime" class="x.Parameter" value="2.5"/><property name="stopTime"'
    text = model(entity("Clock", "DiscreteClock"), stop=4).replace('<property name="stopTime"', start)
    expected = "m.xml cannot be imported:\n   - the start of the model, 2.5 s, has no counterpart"
    assert refusal(tmp_path, text) == expected


def test_a_composite_that_is_called_as_an_actor_is(tmp_path: Path) -> None:
    inner = composite("Queue", port("out", "output"), entity("Clock", "DiscreteClock"), wires("Clock.output out"))
    text = model(inner, entity("Recorder", "Recorder"), wires("Queue.out Recorder.input"), stop=0)
    assert "  Queue: {type: Queue_2}\n" in written(tmp_path, text)


def test_names_of_former_versions(tmp_path: Path) -> None:
    actors = (
        entity("Clock", "DiscreteClock")
        + entity("Server", f"{DE}Server", newServiceTime=2)
        + entity("Recorder", "Recorder")
    )
    text = model(actors, wires("Clock.output Server.input Server.newServiceTime", "Server.output Recorder.input"))
    assert "  Server: {type: Server, service_time: 2 s}\n" in written(tmp_path, text)
    assert "  - Clock.output -> Server.input, Server.service_time\n" in written(tmp_path, text)


def test_an_sdf_composite(tmp_path: Path) -> None:
    """It is one of DE: what nothing triggers does not fire."""
    inner = composite(
        "C",
        prop("SDF", java="ptolemy.domains.sdf.kernel.SDFDirector", inner=prop("iterations", 1)),
        port("in", "input"),
        port("out", "output"),
        entity("Const", "Const", value=5),
        entity("Add", "AddSubtract"),
        wires("in Add.plus", "Const.output Add.plus", "Add.output out"),
    )
    text = model(
        entity("Clock", "DiscreteClock"),
        inner,
        entity("Recorder", "Recorder"),
        wires("Clock.output C.in", "C.out Recorder.input"),
        stop=1,
    )
    assert notes(tmp_path, text) == [
        "C.Const is left out: it never fires because nothing sends to its trigger",
        "C.SDF, a SDFDirector: the actors inside fire by the rules of DE",
    ]
    assert recorded(tmp_path, text) == [(0.0, 1, 1), (1.0, 1, 1)]


def test_a_quotient_of_whole_numbers_is_whole(tmp_path: Path) -> None:
    actors = (
        entity("Clock", "DiscreteClock", values="{7, -7}")
        + entity("Half", "DiscreteClock", values="{0.5}")
        + entity("Recorder", "Recorder")
    )
    actors += entity("E", "Expression", port("x", "input"), port("y", "input"), expression="x / n + y / n")
    text = model(prop("n", 2), actors, wires("Clock.output E.x", "Half.output E.y", "E.output Recorder.input"), stop=1)
    assert "  E: {type: Expression, expression: int(x / 2) + y / 2}\n" in written(tmp_path, text)
    assert [token for _, _, token in recorded(tmp_path, text)] == [3.25, -2.75]
