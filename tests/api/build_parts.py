"""A model that is built in Python and the same in YAML, for the tests of building."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from epicycle.actors import (
    Actor,
    Clock,
    InputPort,
    OutputPort,
    Parameter,
)
from epicycle.aspects import MeasurementFailure, PacketLoss
from epicycle.runner import Model, Results, Simulation


class Noisy(Actor):
    """Adds noise from its own stream."""

    input = InputPort(float)
    output = OutputPort(float)
    deviation = Parameter(float, 1.0, unit="m")

    def fire(self) -> None:
        for token in self.input.tokens:
            self.output.send(token + self.deviation * self.random.normal())


class Adder(Actor):
    """Adds up all that came so far."""

    input = InputPort(float, multi=True)
    output = OutputPort(float)
    enough = OutputPort(bool)

    def initialize(self) -> None:
        self.total = 0.0

    def fire(self) -> None:
        self.total += sum(self.input.tokens)
        self.output.send(self.total)
        self.enough.send(self.total > 50)


class Shout(Actor):
    """Takes texts."""

    input = InputPort(str, doc="what is shouted")


TYPES = (Noisy, Adder, Shout)

YAML = """
model: sums
parameters: {robots: 3}
composites:
  Robot:
    parameters: {deviation: {unit: m}}
    inputs: [trigger]
    outputs: [position]
    actors:
      inner: {type: Core, deviation: "${deviation}"}
    connections:
      - trigger -> inner.trigger
      - {from: inner.position, to: position, delay: 20 ms}
    aspects:
      lossy: {type: PacketLoss, probability: 0.3, at: inner.trigger}
  Core:
    parameters: {deviation: {unit: m}}
    inputs: [trigger]
    outputs: [position]
    actors:
      noise: {type: Noisy, deviation: "${deviation}"}
    connections:
      - trigger -> noise.input
      - noise.output -> position
actors:
  clock: {type: Clock, period: 0.5 s}
  robot: {type: Robot, count: "${robots}", deviation: "${10 * (index + 1)} cm"}
  late: {type: Noisy}
  sum: {type: Adder, priority: 1}
connections:
  - clock.output -> robot[*].trigger
  - clock.output -> late.input
  - robot[*].position, late.output -> sum.input
aspects:
  failure: {type: MeasurementFailure, probability: 0.2, at: ["**.noise.output", late.output]}
run: {stop: 5 s, seed: 4, stop_when: sum.enough, record: [sum.output, "robot[*].position"]}
metrics:
  total: {of: sum.output, take: last, unit: m, doc: the sum of all}
"""


def in_python() -> Model:
    """The same model."""
    model = Model("sums", stop="5 s", seed=4, parameters={"robots": 3})
    clock = model.add(Clock("clock", period=0.5))
    for index in range(3):
        robot = model.composite(f"robot[{index}]", inputs=["trigger"], outputs=["position"])
        inner = robot.composite("inner")
        noise = inner.add(Noisy("noise", deviation=f"{10 * (index + 1)} cm"))
        inner.connect(inner.input("trigger"), noise.input)
        inner.connect(noise.output, inner.output("position"))
        robot.connect("trigger -> inner.trigger")
        robot.connect(inner["position"], "position", delay=0.02)
        robot.weave("lossy", PacketLoss(probability=0.3), at="inner.trigger")
    late = model.add(Noisy("late"))
    total = model.add(Adder("sum"), priority=1)
    model.connect(clock.output, "robot[*].trigger")
    model.connect(clock.output, late.input)
    model.connect(["robot[*].position", late.output], total.input)
    model.weave("failure", MeasurementFailure(probability=0.2), at=["**.noise.output", late.output])
    model.stop_when(total.enough)
    model.record(total.output, "robot[*].position")
    model.metric("total", of=total.output, unit="m", doc="the sum of all")
    return model


def write(folder: Path, text: str) -> Path:
    path = folder / "model.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def run(model: Model, **options: Any) -> Results:
    return Simulation(model, keep_log=True).run(**options)


def structure(model: Model) -> dict[str, Any]:
    """All of a model that decides what a run does."""
    graph = model.graph
    return {
        "actors": {path: (type(actor), repr(actor)) for path, actor in graph.actors.items()},
        "ports": {path: (graph.direction(path), repr(node.port)) for path, node in graph.ports.items()},
        "connections": [(edge.source, edge.destination, edge.delay) for edge in graph.edges],
        "composites": list(graph.composites),
        "members": {path: each.members for path, each in graph.domains.items()},
        "priorities": {path: each.priority for path, each in graph.components.items() if each.priority},
        "aspects": {woven.name: (repr(woven.aspect), woven.ports) for woven in model.aspects},
        "watched": (
            model.output.recorded,
            model.output.stop_ports,
            [(each.name, each.ports, vars(each.measure)) for each in model.output.metrics],
        ),
        "run": (model.name, model.stop, model.output.seed, model.parameters),
    }
