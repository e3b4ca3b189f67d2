"""Small actors and a quick way to run a model that a test writes."""

from __future__ import annotations

import tempfile
from collections.abc import Generator
from pathlib import Path
from typing import Any, ClassVar

from simpy.events import Event

from epicycle.actors import Actor, InputPort, OutputPort, Parameter, Process
from epicycle.runner.execution.engine import Results, Simulation
from epicycle.runner.execution.engine.measurement import Measurement, Outcome
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.metrics import MetricSpec
from epicycle.runner.model.graph.outputs import Metric

SECOND = 10**9  # ns


class Repeat(Actor):
    """Sends every token twice."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        for token in self.input.tokens:
            self.output.send(token)
            self.output.send(token)


class Ticker(Actor):
    """Counts at a period, the first time at once."""

    is_source: ClassVar[bool] = True
    output = OutputPort(int)
    period = Parameter(float, 1.0, unit="s")
    limit = Parameter(int, 1_000_000)

    def initialize(self) -> None:
        self.count = 0
        self.wake_in(0)

    def fire(self) -> None:
        self.output.send(self.count)
        self.count += 1
        if self.count < self.limit:
            self.wake_in(self.period)


class Scale(Actor):
    """Multiplies every token."""

    input = InputPort(float)
    output = OutputPort(float)
    factor = Parameter(float, 1.0)

    def fire(self) -> None:
        for token in self.input.tokens:
            self.output.send(self.factor * token)


class Join(Actor):
    """Sends the list of all that came, by channel."""

    input: InputPort[Any] = InputPort(Any, multi=True)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        self.output.send(self.input.by_channel())


class Spread(Actor):
    """Sends a token to one channel after the other."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any, multi=True)
    to = Parameter(int, -1)

    def fire(self) -> None:
        for token in self.input.tokens:
            for channel in range(self.output.width) if self.to < 0 else (self.to,):
                self.output.send(f"{token}/{channel}", channel)


class Register(Actor):
    """Sends what came before: its output does not depend on its input at once."""

    input: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any, depends_on=())

    def initialize(self) -> None:
        self.held: Any = 0.0
        self.wake_in(0)

    def fire(self) -> None:
        if self.input.present:
            self.held = self.input.value
        else:
            self.output.send(self.held)
            self.wake_in(1)


class Later(Actor):
    """Sends each token one microstep later."""

    input: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any, depends_on=())

    def initialize(self) -> None:
        self.waiting: list[Any] = []
        self.wake_in(0)

    def fire(self) -> None:
        for token in self.waiting:
            self.output.send(token)
        self.waiting = list(self.input.tokens)
        if self.tag.microstep == 1 and self.tag.time == 0:
            self.waiting.append("start")
        if self.waiting:
            self.wake_in(0)


class Probe(Actor):
    """Writes down when it fired and with what."""

    input: InputPort[Any] = InputPort(Any, multi=True, required=False)

    def initialize(self) -> None:
        self.seen: list[tuple[float, int, tuple[Any, ...]]] = []
        self.wrapped = 0

    def fire(self) -> None:
        self.seen.append((self.now, self.tag.microstep, self.input.tokens))

    def wrapup(self) -> None:
        self.wrapped += 1


class Script(Process):
    """A process whose behaviour a test gives."""

    input: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any)
    behaviour: ClassVar[Any] = None

    def run(self) -> Generator[Event, Any, None]:
        yield from type(self).behaviour(self)


class Plan(Actor):
    """A reactive actor whose initialize and fire a test gives."""

    is_source: ClassVar[bool] = True
    input: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any)
    begin: ClassVar[Any] = None
    act: ClassVar[Any] = None

    def initialize(self) -> None:
        if type(self).begin is not None:
            type(self).begin(self)

    def fire(self) -> None:
        if type(self).act is not None:
            type(self).act(self)


TYPES = (Ticker, Scale, Join, Spread, Register, Later, Probe, Script, Plan)


def load(text: str, **options: Any) -> Model:
    """The model that a text describes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "m.yaml"
        path.write_text(f"model: m\n{text}", encoding="utf-8")
        return load_model(path, types=[*TYPES, *options.pop("types", ())], **options)


def simulate(text: str, until: float | None = None, seed: int = 0, **options: Any) -> tuple[Simulation, Results]:
    """Load and run."""
    simulation = Simulation(load(text, **options), seed=seed, keep_log=True)
    return simulation, simulation.run(until=until)


def sends(results: Results, actor: str = "") -> list[tuple[float, int, str, Any]]:
    """(time, microstep, port, token) of all sends, or of one actor's."""
    return [
        (record.tag.seconds, record.tag.microstep, f"{record.actor}.{record.port}", record.value)
        for record in results.log.records
        if record.event == "send" and actor in ("", record.actor)
    ]


def seen(simulation: Simulation, path: str = "probe") -> list[tuple[float, int, tuple[Any, ...]]]:
    """What a probe wrote down."""
    probe = simulation[path]
    assert isinstance(probe, Probe)
    return probe.seen


def measured(tokens: list[tuple[str, int, Any]], end: int, ports: tuple[str, ...] = ("a.out",), **said: Any) -> Outcome:
    """The value of a metric over tokens of ports at times in ns."""
    measurement = Measurement(Metric("m", list(ports), MetricSpec(**said)))
    for port, time, token in tokens:
        measurement.add(port, time, token)
    return measurement.outcome(end)
