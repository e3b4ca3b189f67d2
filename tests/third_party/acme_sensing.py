"""Weather: a thermometer, and ice on it; a dialect and a command."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

from epicycle import actors
from epicycle.actors import Actor, InputPort, OutputPort, Parameter
from epicycle.aspects import JoinPoint, MeasurementAspect
from epicycle.runner.execution.engine import Activation, Director
from epicycle.runner.interface.commands import DONE, command, option, tell
from epicycle.runner.model.catalogue import Dialect
from epicycle.runner.show import Figure
from epicycle.runner.show.report import StudyFigure


class Thermometer(Actor):
    """Measures a temperature that rises evenly."""

    trigger = InputPort(object, doc="measure now")
    temperature = OutputPort(float, doc="in K")

    start = Parameter(float, 280.0, unit="K", min=0.0, doc="temperature at the start")
    rise = Parameter(float, 1.0, unit="K/s", doc="how fast it rises")

    def fire(self) -> None:
        self.temperature.send(self.start + self.rise * self.now)


class Icing(MeasurementAspect):
    """Keeps a thermometer from showing less than the freezing point of water."""

    events: ClassVar[tuple[str, ...]] = ("frozen",)
    freezing = Parameter(float, 273.15, unit="K", min=0.0, doc="what it shows at least")

    def pass_token(self, token: float, point: JoinPoint) -> None:
        if token < self.freezing:
            point.act("frozen", token)
        point.forward(max(token, self.freezing))


class Extremes(Figure):
    """The least and the greatest value of a signal."""

    signal = Parameter(str, doc="which signal")

    def signal_patterns(self) -> tuple[str, ...]:
        return (self.signal,)

    def draw(self, results: Any, path: Path) -> None:
        from matplotlib.figure import Figure as Canvas

        canvas, values = Canvas(), results.signals[self.signal].tokens
        canvas.subplots().barh(["least", "greatest"], [min(values), max(values)])
        canvas.savefig(path)


class Ladder(StudyFigure):
    """A metric of all runs, the least first."""

    metric = Parameter(str, doc="column of the table")

    def draw(self, data: Any, extracts: Any, paths: Any) -> str:
        from matplotlib.figure import Figure as Canvas

        canvas = Canvas()
        canvas.subplots().plot(sorted(row[self.metric] for row in data.rows), "o")
        for path in paths:
            canvas.savefig(path)
        return f"{len(data.rows)} runs."


class Const(actors.Const):
    """Sends 7, unless it is told otherwise."""

    value = Parameter(object, 7, doc="the value to send")


class LastFirst(Director):
    """Lets the actor fire first that asked last; for models in which none waits for another one at a tag."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.line: list[Activation] = []

    def enqueue(self, activation: Activation) -> None:
        activation.is_scheduled = True
        self.line.append(activation)

    def next_activation(self) -> Activation | None:
        if not self.line:
            return None
        activation = self.line.pop()
        activation.is_scheduled, self.rank = False, activation.rank
        return activation


class Acme(Dialect):
    """How things are done at Acme."""

    name = "acme"

    @classmethod
    def types(cls) -> Iterable[type]:
        return (Const,)

    @classmethod
    def director(cls) -> Any:
        return LastFirst


@command(
    "say how cold it gets in a model",
    option("model", metavar="MODEL", help="a path to a YAML file"),
    imports=("build",),
)
def coldest(options: argparse.Namespace) -> int:
    """Run a model, and tell its metric 'coldest'."""
    from epicycle import run

    tell(f"{run(options.model).metrics['coldest']:g} K")
    return DONE
