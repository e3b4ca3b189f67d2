"""Mistakes in a model that is built in Python are told as well as those of a file."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import (
    Clock,
    ParameterError,
    declared_parameters,
)
from epicycle.aspects import PacketLoss
from epicycle.runner import Model, ModelError, Simulation
from tests.api.build_parts import Adder, Noisy, Shout, in_python, structure

MISTAKES: dict[str, tuple[Callable[[Model], Any], str]] = {
    "unknown actor": (
        lambda m: m.connect(m["late"].output, "smu.input"),
        """error: sums has no actor 'smu', did you mean 'sum'?
   help: valid actors: clock, robot, late, sum""",
    ),
    "unknown port": (
        lambda m: m.connect("late.output -> robot[0].triger"),
        """error: robot: robot[0] has no input port 'triger', did you mean 'trigger'?
   help: valid input ports: trigger""",
    ),
    "unknown port of an actor": (
        lambda m: m.connect("late.output", "sum.inptu"),
        """error: sum: Adder has no input port 'inptu', did you mean 'input'?
   help: valid input ports: input""",
    ),
    "wrong way round": (
        lambda m: m.connect(m["sum"].input, m["late"].output),
        """error: sum.input is an input of Adder, so nothing can come from it
   help: valid output ports: output, enough

error: late.output is an output of Noisy, so nothing can go to it
   help: valid input ports: input
2 errors""",
    ),
    "types": (
        lambda m: m.connect(m["sum"].output, m.add(Shout("shout")).input),
        "error: sum.output sends float, but shout.input takes str",
    ),
    "two writers": (
        lambda m: m.connect(m["sum"].output, m["late"].input),
        """error: late.input takes one connection, and clock.output is already connected to it, at FILE:LINE
   help: disconnect that one, or send through an actor that merges them""",
    ),
    "no destination": (
        lambda m: m.connect(m["sum"].output),
        """error: the connection has no destination
   help: write connect(a.output, b.input)""",
    ),
    "no arrow": (
        lambda m: m.connect("sum.output"),
        """error: 'sum.output' is not a connection
   help: write 'actor.port -> actor.port'""",
    ),
    "array": (
        lambda m: m.connect("robot.position -> sum.input"),
        """error: robot is an array of 3: give an index
   help: write robot[*].position for all, or robot[0].position for the first""",
    ),
    "through a wall": (
        lambda m: m.connect(m["clock"].output, m["robot[1].inner.noise"].input),
        """error: robot[1].inner.noise.input cannot be connected in sums
   help: connect it in robot[1].inner, where robot[1].inner.noise is; ports of composites lead in and out""",
    ),
    "a stranger": (
        lambda m: m.connect(Clock("other", period=1).output, m["sum"].input),
        """error: the actor of other.output is not part of this model
   help: add it to the model first""",
    ),
    "a stranger of the same name": (
        lambda m: m.connect(Clock("clock", period=1).output, m["sum"].input),
        """error: the actor of clock.output is not part of this model
   help: add it to the model first""",
    ),
    "an actor": (
        lambda m: m.connect(m["late"], m["sum"].input),
        """error: late is an actor, not a port
   help: name one of its ports: late.input, late.output""",
    ),
    "a composite": (
        lambda m: m.connect(m["robot[0]"], m["sum"].input),
        """error: robot[0] is a composite, not a port
   help: name one of its ports: robot[0].trigger, robot[0].position""",
    ),
    "no port at all": (
        lambda m: m.connect(3, m["sum"].input),
        """error: 3 is not a port
   help: give a port such as clock.output, or its path as text""",
    ),
    "a class": (
        lambda m: m.connect(Noisy.output, m["sum"].input),
        """error: <output port output: float> is declared in a class
   help: give the port of an actor that was added to the model""",
    ),
    "delay": (
        lambda m: m.connect("clock.output -> sum.input", delay="5 kg"),
        "error: clock.output -> sum.input: delay: '5 kg' is a mass, expected a time in s",
    ),
    "not connected": (
        lambda m: m.disconnect("late.output -> late.input"),
        """error: late.output is not connected to late.input
   help: late.output is connected to: sum.input""",
    ),
    "taken": (
        lambda m: m.add(Adder("sum")),
        """error: there is already a sum
   help: the first was added at FILE:LINE
   help: give it another name""",
    ),
    "twice": (
        lambda m: m.add(m["sum"]),
        """error: sum is already part of a model, and an actor belongs to only one
   help: create another one: Adder(...)""",
    ),
    "dotted name": (
        lambda m: m.add(Adder("robot.sum")),
        """error: 'robot.sum' is not a name
   help: use letters, digits and _, and no digit first; an element of an array is called 'name[0]'
   help: add parts of a composite to the composite""",
    ),
    "single and array": (
        lambda m: m.add(Adder("robot")),
        """error: robot is already an array
   help: give it another name""",
    ),
    "gap": (
        lambda m: m.composite("robot[7]"),
        """error: robot[7] is not the next of its array
   help: the next is robot[3]""",
    ),
    "no first": (
        lambda m: m.add(Adder("adder[1]")),
        """error: adder[1] cannot be the first of its array
   help: begin with adder[0]""",
    ),
    "name of a port": (
        lambda m: m["robot[0]"].add(Adder("trigger")),
        """error: robot[0].trigger is already a port
   help: give the actor another name""",
    ),
    "port of an actor's name": (
        lambda m: m["robot[0]"].input("inner"),
        """error: 'robot[0].inner' is the name of both an actor and a port
   help: rename one""",
    ),
    "port twice": (lambda m: m.composite("x", inputs=["a", "a"]), "error: port 'x.a' is declared twice"),
    "clock of a composite": (
        lambda m: m.composite("x", director=True, start="3 m", drift=0),
        """error: x: director.start: '3 m' is a length, expected a time in s

error: x: director.drift: 0 is out of bounds, expected a number from 1e-06 to 1000000
2 errors""",
    ),
    "clock of a director that is not there": (
        lambda m: m.composite("x", start="2 s", drift=2, like="ptolemy"),
        """error: x: 'start' belongs to a director, and x has none of its own
   help: write director=True

error: x: 'drift' belongs to a director, and x has none of its own
   help: write director=True

error: x: 'like' belongs to a director, and x has none of its own
   help: write director=True, or set it for the model
3 errors""",
    ),
    "own port": (
        lambda m: m["robot[0]"].connect("positon -> inner.trigger"),
        """error: robot[0] has no input port 'positon' of its own
   help: its own input ports: trigger
   help: a port of an actor is written 'actor.port'""",
    ),
    "path": (lambda m: m["robot[0]"]["iner"], "error: there is no 'robot[0].iner', did you mean 'robot[0].inner'?"),
    "aspect's name": (
        lambda m: m.weave("failure", PacketLoss(probability=0.1), at="sum.input"),
        """error: there is already an aspect 'failure'
   help: unweave it, or give this another name""",
    ),
    "aspect's class": (
        lambda m: m.weave("loss", PacketLoss, at="sum.input"),
        """error: PacketLoss is not an aspect
   help: give an object, such as PacketLoss(probability=0.1)""",
    ),
    "name of an aspect for one": (
        lambda m: m.weave("loss", "PacketLoss", at="sum.input"),
        """error: 'PacketLoss' is not an aspect
   help: give an object, such as PacketLoss(probability=0.1)""",
    ),
    "aspect's port": (
        lambda m: m.weave("loss", PacketLoss(probability=0.1), at="sum.inputs"),
        """error: aspect loss: 'sum.inputs' matches no port, did you mean 'sum.input'?
   help: valid ports of sum: input""",
    ),
    "aspect's side": (
        lambda m: m.weave("loss", PacketLoss(probability=0.1), at=m["sum"].output),
        "error: aspect loss: PacketLoss attaches to input ports, but sum.output is an output port",
    ),
    "no aspect": (
        lambda m: m.unweave("failures"),
        """error: the model has no aspect 'failures', did you mean 'failure'?
   help: its aspects: robot[0].lossy, robot[1].lossy, robot[2].lossy, failure""",
    ),
    "record": (
        lambda m: m.record("late.output", "sum.outptu"),
        """error: record: 'sum.outptu' matches no output port, did you mean 'sum.output'?
   help: valid ports of sum: output, enough""",
    ),
    "record an input": (
        lambda m: m.record(m["sum"].input),
        "error: record: sum.input is an input port, but an output port is needed, did you mean 'sum.output'?",
    ),
    "record what is no port": (
        lambda m: m.record(5, Clock("clock", period=1).output),
        """error: 5 is not a port
   help: give a port such as clock.output, or its path as text

error: the actor of clock.output is not part of this model
   help: add it to the model first
2 errors""",
    ),
    "stop when there is no port": (
        lambda m: m.stop_when(m["sum"]),
        """error: sum is an actor, not a port
   help: name one of its ports: sum.input, sum.output, sum.enough""",
    ),
    "metric of what is no port": (
        lambda m: m.metric("other", of=[5, "sum.output"]),
        """error: 5 is not a port
   help: give a port such as clock.output, or its path as text""",
    ),
    "disturb what is no port": (
        lambda m: m.disturb("wifi_burst", at=["sum.inptu"]),
        "error: there is no port 'sum.inptu', did you mean 'sum.input'?",
    ),
    "metric": (
        lambda m: m.metric("total", of="sum.output", take="men"),
        """error: there is already a metric 'total'
   help: give this another name

error: metric 'total' cannot take 'men', did you mean 'mean'?
   help: valid: last, first, count, min, max, sum, mean, std, quantile, rate, time_mean, time_std, time_quantile, \
share, integral, duration
2 errors""",
    ),
}


def plainly(error: ModelError) -> str:
    """The message without the lines of this file that it shows, and without their numbers."""
    text = "\n".join(line for line in str(error).splitlines() if " | " not in line[:10])
    text = re.sub(r"\S*(?:build_parts|test_build_mistakes)\.py:\d+:\d+: ", "", text)
    text = re.sub(r"\S*(?:build_parts|test_build_mistakes)\.py:\d+", "FILE:LINE", text)
    return re.sub(r" in \S*(?:build_parts|test_build_mistakes)\.py$", "", text)


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_and_changes_nothing(name: str) -> None:
    mistake, message = MISTAKES[name]
    model = in_python()
    before = structure(model)
    with pytest.raises(ModelError) as caught:
        mistake(model)
    assert plainly(caught.value) == message
    if name == "types":
        model.remove("shout")
    assert structure(model) == before
    assert pickle.loads(pickle.dumps(caught.value)).problems == caught.value.problems


def test_a_mistake_points_at_the_line_of_the_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    program = """from epicycle.actors import Clock
from epicycle.runner import Model
model = Model("m")
clock = model.add(Clock("clock", period=1))
if True:
    model.connect("clock.output",
                  "nobody.input")
"""
    Path("program.py").write_text(program, encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        exec(compile(program, str(tmp_path / "program.py"), "exec"), {"__name__": "program"})
    assert str(caught.value) == (
        "program.py:6:5: error: m has no actor 'nobody'\n"
        '    6 |     model.connect("clock.output",\n'
        "      |     ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^\n"
        "   help: valid actors: clock"
    )


def test_the_whole_is_checked_before_a_run() -> None:
    model = Model("m")
    adder, noisy = model.add(Adder("adder")), model.add(Noisy("noisy"))
    model.connect(adder.output, noisy.input)
    model.connect(noisy.output, adder.input)
    model.add(Shout("shout"))
    with pytest.raises(ModelError) as caught:
        Simulation(model)
    text = plainly(caught.value)
    assert "error: shout.input is not connected, but Shout needs it" in text
    assert "error: a loop without delay: adder -> noisy -> adder" in text
    assert text.endswith("2 errors")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: Clock("c", perod=1),
            "c: Clock has no parameter 'perod', did you mean 'period'? valid parameters: "
            + ", ".join(declared_parameters(Clock)),
        ),
        (lambda: Clock("c"), "c: Clock needs a value for 'period'"),
        (lambda: Clock("c", period="3 m"), "c: Clock.period: '3 m' is a length, expected a time in s"),
        (lambda: Model("m", stop="3 m"), "'3 m' is a length, expected a time in s"),
        (lambda: Model("m", seed=-1), "-1 is out of bounds, expected an integer from 0 to 9223372036854775807"),
    ],
)
def test_values_are_checked_when_they_are_given(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        make()
    assert str(caught.value) == message
