"""start something of your own: a model, or a package of actors"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import tell
from .options import DONE, command, option

MODEL = """\
# Run it: epicycle run $name.yaml
model: $name
doc: Customers arrive at random, wait in a queue and are served one after another.

parameters:
  load: {value: 0.8, unit: "1", min: 0.01, max: 0.99, doc: share of the time that the server is busy}
  service_time: {value: 30, unit: s, min: 0.001, doc: how long serving a customer takes}

actors:
  customers: {type: PoissonClock, mean_interval: "$${service_time / load}"}
  server: {type: Server, inherit: service_time}

connections:
  - customers.output -> server.input

# A disturbance of the model, from outside: some customers turn away at the door.
aspects:
  impatience: {type: PacketLoss, probability: 0.05, at: server.input}

run: {stop: 100 h, seed: 1, record: [server.size]}

metrics:
  served: {of: server.output, take: count, doc: customers served}
  longest_queue: {of: server.size, take: max, doc: greatest number of customers waiting or in service}
  mean_number: {of: server.size, take: time_mean, initial: 0, interval: 0.95, doc: mean number of such customers}

figures:
  queue: {type: TimeSeries, signals: server.size, label: customers}
"""

PROJECT = """\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "$name"
version = "0.1.0"
description = "Actors and aspects for Epicycle"
requires-python = ">=3.11"
dependencies = ["epicycle"]

[project.optional-dependencies]
dev = ["pytest>=8"]

# Makes the types known to models once the package is installed: Name = "package:Name".
[project.entry-points."epicycle.actors"]
Smoother = "$name:Smoother"

[project.entry-points."epicycle.aspects"]
Spikes = "$name:Spikes"

[tool.setuptools.packages.find]
where = ["src"]

[tool.pytest.ini_options]
pythonpath = ["src"]
"""

SOURCE = '''\
"""Actors and aspects of $name."""

from __future__ import annotations

from typing import ClassVar

from epicycle.actors import Actor, InputPort, OutputPort, Parameter
from epicycle.aspects import JoinPoint, MeasurementAspect

__all__ = ["Smoother", "Spikes"]


class Smoother(Actor):
    """Smooths numbers: each output is a weighted mean of the new number and the previous output."""

    input = InputPort(float)
    output = OutputPort(float)
    share = Parameter(float, 0.2, unit="1", above=0, max=1, doc="weight of the new number")

    def initialize(self) -> None:
        self.smooth: float | None = None

    def fire(self) -> None:
        for token in self.input.tokens:
            before = token if self.smooth is None else self.smooth
            self.smooth = before + self.share * (token - before)
            self.output.send(self.smooth)


class Spikes(MeasurementAspect):
    """Adds a spike to a number now and then."""

    events: ClassVar[tuple[str, ...]] = ("spiked",)
    probability = Parameter(float, 0.1, unit="1", min=0, max=1, doc="probability that a number gets a spike")
    height = Parameter(float, 5.0, doc="height of a spike")

    def pass_token(self, token: float, point: JoinPoint) -> None:
        if self.probability and point.random.uniform() < self.probability:
            point.act("spiked", token)
            token += self.height
        point.forward(token)
'''

USE = """\
# Run it: epicycle run $name.yaml
model: $name
doc: A noisy sensor whose spikes are smoothed.

actors:
  clock: {type: Clock, period: 0.1 s}
  sensor: {type: Random, distribution: {type: Normal, mean: 20, standard_deviation: 0.5}}
  smoother: {type: Smoother, share: 0.2}

connections:
  - clock.output -> sensor.trigger
  - sensor.output -> smoother.input

aspects:
  spikes: {type: Spikes, at: sensor.output}

run: {stop: 60 s, seed: 1, record: [smoother.output]}

metrics:
  highest: {of: smoother.output, take: max, doc: the highest smoothed number}

figures:
  smoothed: {type: TimeSeries, signals: smoother.output}
"""

TESTS = '''\
"""Tests of the actors and aspects of $name."""

from pathlib import Path

from epicycle.actors.testing import Harness
from epicycle.aspects.testing import assert_silent_at_zero
from epicycle.runner import Simulation, Trial, load_model

from $name import Smoother, Spikes

MODEL = Path(__file__).parents[1] / "$name.yaml"


def test_a_step_is_smoothed() -> None:
    harness = Harness(Smoother("smoother", share=0.5))
    harness.run(until=3.0, input=[(0.0, 0.0), (1.0, 8.0), (2.0, 8.0)])
    assert harness.sent["output"] == [(0.0, 0.0), (1.0, 4.0), (2.0, 6.0)]


def test_without_spikes_nothing_changes() -> None:
    trial = Trial(MODEL, until=5.0, types=[Smoother, Spikes])
    assert_silent_at_zero(Spikes(probability=0), trial)


def test_the_model_runs() -> None:
    results = Simulation(load_model(MODEL, types=[Smoother, Spikes])).run()
    assert results.aspects["spikes"]["spiked"] > 0
    assert 20 < results.metrics["highest"] < 25
'''

README = """\
# $name

Actors and aspects for Epicycle.

    pip install --editable '.[dev]'
    epicycle describe Smoother
    epicycle run $name.yaml
    python -m pytest
"""

FILES = {  # of a package
    "pyproject.toml": PROJECT,
    "README.md": README,
    "$name.yaml": USE,
    "src/$name/__init__.py": SOURCE,
    "tests/test_$name.py": TESTS,
}


@command(
    "start a model or a package of actors",
    option("name", metavar="NAME", help="its name, such as my_model"),
    option(
        "--package",
        action="store_true",
        help="a Python package with an actor, an aspect, a model that uses them and tests, in a folder NAME",
    ),
    imports=("text",),
)
def new(options: argparse.Namespace) -> int:
    """Write NAME.yaml, a model to start from, which is ready to run.

    With --package, write a package whose entry points make its actors and aspects known to models.
    """
    from keyword import iskeyword
    from string import Template

    from epicycle.actors import EpicycleError

    from ..text import NAME, NAMES_HAVE

    name: str = options.name
    if not NAME.match(name) or iskeyword(name) or not name.isascii():
        raise EpicycleError(f"{name!r} is not a name\n   help: {NAMES_HAVE}")
    files = FILES if options.package else {"$name.yaml": MODEL}
    home = Path(name) if options.package else Path()
    texts = {
        home / Template(path).substitute(name=name): Template(text).substitute(name=name)
        for path, text in files.items()
    }
    there = [path for path in ([home] if options.package else texts) if path.exists()]
    if there:
        raise EpicycleError(f"{there[0]} already exists\n   help: choose another name or another folder")
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        tell(f"wrote {path}")
    if options.package:
        tell(f"install it: pip install --editable {name}; then: epicycle run {name}/{name}.yaml")
    else:
        tell(f"run it: epicycle run {name}.yaml")
    return DONE
