"""What goes wrong in a run says where: who, at which tag, and the place in the model file."""

from __future__ import annotations

import os
import pickle
from collections.abc import Generator
from fractions import Fraction
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors import Actor, Clock, InputPort, OutputPort, Parameter, Process, Scale
from epicycle.aspects import ClockAspect, ExecutionAspect, Job, JoinPoint, PortAspect
from epicycle.aspects.execution import ActorPoint, Target
from epicycle.runner import Model
from epicycle.runner.execution.engine import ActorError, Simulation
from tests.engine.engine_parts import Plan, Script, load, simulate


class Broken(Actor):
    """Fails where it is told to, or sends what it is told to."""

    input = InputPort(float, required=False)
    output: OutputPort[Any] = OutputPort(float)
    where = Parameter(str, "fire")

    def initialize(self) -> None:
        if self.where == "initialize":
            raise RuntimeError("no start")

    def fire(self) -> None:
        if self.where == "fire" and self.now >= 1:
            raise RuntimeError("no more")
        things = {"array": np.zeros(2), "nameless": object(), "number": 1.0}
        if self.where in things:
            self.output.send(things[self.where])
        if self.where == "channel":
            self.output.send(1.0, 4)

    def wrapup(self) -> None:
        if self.where == "wrapup":
            raise RuntimeError("no end")


class Worker(Process):
    """A process that sends in a firing, or when SimPy resumes it."""

    input = InputPort(float, required=False)
    output: OutputPort[Any] = OutputPort(float)
    how = Parameter(str, "wait")

    def run(self) -> Generator[Any, Any, None]:
        yield self.wait(1) if self.how == "wait" else self.environment.timeout(1)
        self.output.send(1.0)
        if self.how == "fail":
            raise RuntimeError("no more work")
        yield self.wait(1)


class Trap(PortAspect):
    """Fails at every token."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        raise RuntimeError("trapped")


def raised(code: str) -> str:
    """What is said of an exception that comes from a line of this file."""
    (place,) = [place for place, line in enumerate(SOURCE, 1) if line.strip() == code]
    source = SOURCE[place - 1]
    before = len(source) - len(code)
    file = __file__.removeprefix(os.getcwd() + os.sep)
    carets = f"{'':>{before}}{'^' * len(code)}"
    return f"\n   raised at {file}:{place}:{before + 1}\n{place:>5} | {source}\n      | {carets}\n   "


SOURCE = Path(__file__).read_text(encoding="utf-8").splitlines()
MODEL = """
composites:
  Inner:
    inputs: [in]
    director: {{start: 7}}
    actors:
      b: {part}
    connections: [in -> b.input]
actors:
  t: {{type: Ticker}}
  a: {part}
  c: {{type: Inner}}
connections: [{wires}]
{more}
"""
AT_12 = "declared at m.yaml:12:3"
NO_MORE, TRAPPED = raised('raise RuntimeError("no more")'), raised('raise RuntimeError("trapped")')
IN, OUT = "t.output -> a.input", "t.output -> c.in"


@pytest.mark.parametrize(
    ("part", "wires", "more", "message"),
    [
        (
            "{type: Broken}",
            IN,
            "",
            "a failed in fire() at (1 s, 1): RuntimeError: no more" + NO_MORE + "declared at m.yaml:12:3",
        ),
        (
            "{type: Broken}",
            OUT,
            "",
            "c.b failed in fire() at (0 s, 1): RuntimeError: no more" + NO_MORE + "declared at m.yaml:8:7",
        ),
        (
            "{type: Broken, where: initialize}",
            OUT,
            "",
            "a failed in initialize() at (0 s, 1): RuntimeError: no start"
            + raised('raise RuntimeError("no start")')
            + "declared at m.yaml:12:3",
        ),
        (
            "{type: Broken, where: wrapup}",
            OUT,
            "",
            "a failed in wrapup() at (5 s, 2): RuntimeError: no end"
            + raised('raise RuntimeError("no end")')
            + "declared at m.yaml:12:3",
        ),
        (
            "{type: Broken, where: channel}",
            IN,
            "",
            (
                "a failed in fire() at (0 s, 1): a.output has no channel 4: it has 0 channels, counted from 0"
                + raised("self.output.send(1.0, 4)")
                + "declared at m.yaml:12:3"
            ),
        ),
        (
            "{type: Broken, where: nameless}",
            IN,
            "",
            (
                "a failed in fire() at (0 s, 1): a token of type object has no value that can be logged: make it a "
                "dataclass, or give it a __repr__ that shows its contents"
                + raised("self.output.send(things[self.where])")
                + "declared at m.yaml:12:3"
            ),
        ),
        (
            "{type: Broken, where: array}",
            IN,
            "run:\n  stop_when: a.output",
            (
                "stop_when failed in asking a.output at (0 s, 1): ValueError: The truth value of an array with more "
                "than one element is ambiguous. Use a.any() or a.all()\n   declared at m.yaml:16:14"
            ),
        ),
        (
            "{type: Broken, where: number}",
            OUT,
            "aspects:\n  trap: {type: Trap, at: c.b.input}",
            (
                "aspect trap failed in pass_token() at c.b.input at (0 s, 1): RuntimeError: trapped"
                + TRAPPED
                + "declared at m.yaml:16:3"
            ),
        ),
        *(
            (
                f"{{type: Worker, how: {how}}}",
                "t.output -> a.input",
                f"aspects:\n  trap: {{type: Trap, at: {path}.output}}",
                (
                    f"aspect trap failed in pass_token() at {path}.output at (1 s, 1): RuntimeError: trapped"
                    + TRAPPED
                    + "declared at m.yaml:16:3"
                ),
            )
            for how in ("wait", "timeout")
            for path in ("a", "c.b")
        ),
        (
            "{type: Worker, how: fail}",
            OUT,
            "",
            "a failed in run() at (1 s, 1): RuntimeError: no more work"
            + raised('raise RuntimeError("no more work")')
            + "declared at m.yaml:12:3",
        ),
    ],
)
def test_who_when_and_where(part: str, wires: str, more: str, message: str) -> None:
    model = load(MODEL.format(part=part, wires=wires, more=more), types=[Broken, Worker, Trap])
    simulation = Simulation(model, keep_log=True)
    with pytest.raises(ActorError) as caught:
        simulation.run(until=5)
    text = str(caught.value)
    folder = text.partition("declared at ")[2].partition("m.yaml")[0]
    assert text.replace(folder, "") == message
    assert str(pickle.loads(pickle.dumps(caught.value))) == text
    results = simulation.results("failed")  # what was recorded is kept
    assert (results.events, results.stopped) == (len(simulation.log.records), "failed")
    assert all(record.tag <= caught.value.tag for record in simulation.log.records)


PACKAGED = """
import numpy as np
from epicycle.actors import Actor


class Packaged(Actor):
    is_source = True

    def initialize(self):
        np.linalg.inv(np.zeros((2, 2))) if self.path == "first" else json_of(self)


def json_of(value):
    import json
    json.dumps(value)
"""


class Faulty(ExecutionAspect):
    """Fails where it is told to."""

    events = ("seen",)
    where = Parameter(str)

    def _fail(self, here: str) -> None:
        if self.where == here:
            raise RuntimeError(f"no {here}")

    def begin(self, target: Target) -> None:
        self._fail("begin")

    def is_due(self, time: int) -> bool:
        self._fail("is_due")
        return super().is_due(time)

    def pass_by(self, job: Any, point: Any) -> None:
        self._fail("pass_by")
        point.forward(job)

    def schedule(self, job: Job, point: ActorPoint) -> None:
        point.later(0.25, lambda _: self._fail("later"), None)
        point.forward(job)

    def forget(self, point: JoinPoint) -> None:
        self._fail("forget")


class FaultyClock(ClockAspect):
    """Does not know how wrong it is."""

    def error(self, random: Any) -> tuple[int, Fraction]:
        raise RuntimeError("no error")


@pytest.mark.parametrize(
    ("aspect", "message"),
    [
        ("type: Faulty, where: begin", "begin() at s at (0 s, 1): RuntimeError: no begin"),
        ("type: Faulty, where: is_due, until: 9 s", "is_due() at s at (0 s, 1): RuntimeError: no is_due"),
        ("type: Faulty, where: pass_by, until: 2.5 s", "pass_by() at s at (3 s, 1): RuntimeError: no pass_by"),
        ("type: Faulty, where: later", "later() at s at (0.25 s, 1): RuntimeError: no later"),
        ("type: Faulty, where: forget", "forget() at s at (1.5 s, 1): RuntimeError: no forget"),
        ("type: FaultyClock", "error() at s at (0 s, 1): RuntimeError: no error"),
    ],
)
def test_an_aspect_that_fails_is_named_with_what_it_was_asked(aspect: str, message: str) -> None:
    model = load(
        "actors: {t: {type: Clock, period: 1 s}, s: {type: Scale, factor: 2}}\nconnections: [t.output -> s.input]\n"
        f"aspects: {{trap: {{{aspect}, at: s}}, crash: {{type: CrashRestart, at: s, times: [1.5 s]}}}}\n",
        types=[Faulty, FaultyClock],
    )
    with pytest.raises(ActorError) as caught:
        Simulation(model).run(until=5)
    assert str(caught.value).splitlines()[0] == f"aspect trap failed in {message}"


def test_an_actor_of_an_installed_package(tmp_path: Path) -> None:
    """Its own line is shown, not that of the library which it calls, nor that of a function beside it."""
    home = tmp_path / "site-packages" / "acme"
    home.mkdir(parents=True)
    (home / "actors.py").write_text(PACKAGED, encoding="utf-8")
    spec = spec_from_file_location("acme_of_mine", home / "actors.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    for name, reason in (
        ("first", "LinAlgError: Singular matrix"),
        ("second", "TypeError: Object of type Packaged is not JSON serializable"),
    ):
        model = Model("m", stop=1)
        model.add(module.Packaged(name))
        with pytest.raises(ActorError) as caught:
            Simulation(model).run()
        head, at, line, carets, declared = str(caught.value).splitlines()
        assert head == f"{name} failed in initialize() at (0 s, 1): {reason}"
        assert at == f"   raised at {home / 'actors.py'}:10:{9 if name == 'first' else 70}"
        assert line[carets.index("^") :].startswith("np.linalg.inv(" if name == "first" else "json_of(self)")
        assert declared.startswith("   declared at ")


def test_an_actor_of_epicycles_own_needs_no_line() -> None:
    model = Model("m", stop=1)
    clock = model.add(Clock("clock", period=1, values=[[1, 2]]))
    scale = model.add(Scale("scale", factor=0.5))
    model.connect(clock.output, scale.input)
    with pytest.raises(ActorError) as caught:
        Simulation(model).run()
    first, declared = str(caught.value).splitlines()
    assert first.startswith("scale failed in fire() at (0 s, 1): TypeError: ")
    assert declared.startswith("   declared at ")


class FussyError(Exception):
    """SimPy cannot make a copy of this one."""

    def __init__(self, one: int, two: int) -> None:
        super().__init__(f"{one} and {two}")


@pytest.mark.parametrize(
    ("resumed_by", "error"),
    [(by, ValueError("bad luck")) for by in ("start", "wait", "read", "timeout", "subprocess")]
    # SimPy itself fails to hand such an error from one of its processes to another.
    + [(by, FussyError(1, 2)) for by in ("start", "wait", "read", "timeout")],
)
def test_an_exception_in_a_process_names_its_actor(
    resumed_by: str, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def inner(self: Script) -> Generator[Any, Any, None]:
        yield self.environment.timeout(1)
        raise error

    def behaviour(self: Script) -> Generator[Any, Any, None]:
        if resumed_by == "wait":
            yield self.wait(1)
        elif resumed_by == "read":
            yield self.read(self.input)
        elif resumed_by == "timeout":
            yield self.environment.timeout(1)
        elif resumed_by == "subprocess":
            yield self.environment.process(inner(self))
        raise error

    monkeypatch.setattr(Script, "behaviour", staticmethod(behaviour))
    model = load(
        "actors:\n  t: {type: Ticker}\n  a: {type: Script}\n  probe: {type: Probe}\n"
        "connections: [t.output -> a.input]\n"
    )
    simulation = Simulation(model)
    with pytest.raises(ActorError) as caught:
        simulation.run(until=3)
    tag = {"start": "(0 s, 1)", "read": "(0 s, 1)", "subprocess": "(1 s, 1)"}.get(resumed_by, "(1 s, 1)")
    reason = "ValueError: bad luck" if isinstance(error, ValueError) else "FussyError: 1 and 2"
    first = str(caught.value).splitlines()[0]
    assert first == f"a failed in run() at {tag}: {reason}"
    assert caught.value.where.endswith("m.yaml:4:3")
    assert simulation["probe"].wrapped == 1  # type: ignore[attr-defined]


def test_an_exception_in_a_process_of_simpys_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def begin(actor: Plan) -> None:
        def stray() -> Generator[Any, Any, None]:
            yield actor.context.environment.timeout(5)
            raise KeyError("lost")

        actor.context.environment.process(stray())

    monkeypatch.setattr(Plan, "begin", begin)
    with pytest.raises(ActorError) as caught:
        simulate("actors: {a: {type: Plan}}")
    message, at, line, carets = str(caught.value).splitlines()
    assert message == "a SimPy process failed in its generator at (5 s, 1): KeyError: 'lost'"
    assert at.startswith("   raised at ")
    assert line[carets.index("^") :] == 'raise KeyError("lost")'


def test_an_exception_in_a_callback_of_simpys(monkeypatch: pytest.MonkeyPatch) -> None:
    """SimPy hands it on as it is, where that of a generator is a copy with a cause."""

    def begin(actor: Plan) -> None:
        actor.context.environment.timeout(5).callbacks.append(lambda event: {}["lost"])

    monkeypatch.setattr(Plan, "begin", begin)
    with pytest.raises(ActorError) as caught:
        simulate("actors: {a: {type: Plan}}")
    told = str(caught.value).splitlines()[0]
    assert told == "a SimPy process failed in its generator at (5 s, 1): KeyError: 'lost'"
