"""What is watched of a model: when a run ends, what it records, and its metrics."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from epicycle.actors import paths
from epicycle.actors.expression import Formula
from epicycle.aspects import Reading

from ..catalogue.metrics import MetricSpec
from ..temporal import TINY, Property, Requirement
from ..text.patterns import folded
from ..text.problems import Position


@dataclass(frozen=True)
class Metric:
    """A number computed from what some ports send, or from other metrics."""

    name: str
    ports: list[str]
    measure: MetricSpec
    monitor: str = ""  # the monitor whose verdict or robustness it is
    formula: Formula | None = None  # over other metrics, if it is computed from these

    def without(self, path: str) -> Metric:
        """The metric after the removal of a part of the model that it may have watched."""
        return replace(self, ports=[port for port in self.ports if not paths.is_within(port, path)])

    @property
    def is_measured(self) -> bool:
        """Whether it is taken from tokens."""
        return not self.monitor and self.formula is None

    @property
    def takes(self) -> str:
        """What is taken from what, for people."""
        if self.formula is not None:
            return self.formula.source
        across = f"{self.measure.across} of the " if self.measure.across else ""
        return f"{across}{self.measure.take} of {', '.join(folded(self.ports))}"

    @property
    def unit(self) -> str:
        """Its unit."""
        return self.measure.to or self.measure.own_unit


@dataclass(frozen=True)
class Part:
    """The property of one of several, whose path is ``of``; ``readings`` are the ports and fields of each condition."""

    of: str
    tree: Property
    readings: list[list[Reading]]

    @property
    def ports(self) -> list[str]:
        """The ports that it observes."""
        return list(dict.fromkeys(port for condition in self.readings for port, _ in condition))


@dataclass(frozen=True)
class Monitor:
    """A property that a run must have: that of every part, or of ``any``; most monitors have one.

    ``size`` is that of the unit of its robustness, in what its margins are in.
    """

    name: str
    requirement: Requirement
    parts: list[Part]
    any: bool = False
    size: float = 1.0

    @property
    def ports(self) -> list[str]:
        """The ports that it observes."""
        return list(dict.fromkeys(port for part in self.parts for port in part.ports))

    def without(self, path: str) -> Monitor | None:
        """The monitor after the removal of a part of the model that it may have watched; None if nothing is left."""
        parts = [each for each in self.parts if not any(paths.is_within(port, path) for port in each.ports)]
        return replace(self, parts=parts) if parts or not self.parts else None

    def in_unit(self, margin: float) -> float:
        """A margin in the unit of the robustness; one that stands for 0 stays as it is, with its sign."""
        return margin if abs(margin) == TINY else margin / self.size

    @property
    def metrics(self) -> list[Metric]:
        """Its results among the metrics of a run: whether the property holds, and its robustness."""
        said = self.requirement
        label = said.label or self.name
        verdict = MetricSpec(doc=said.doc or said.property, label=said.label, unit="1")
        margin = MetricSpec(doc=f"robustness of {self.name}", label=f"robustness of {label}", unit=said.unit)
        return [
            Metric(self.name, self.ports, verdict, self.name),
            Metric(f"{self.name}_robustness", self.ports, margin, self.name),
        ]


@dataclass
class OutputSpec:
    """What a model declares about a run: when it ends, and what is kept of it."""

    stop_time: int | None = None  # ns
    seed: int = 0
    recorded: list[str] = field(default_factory=list)
    stop_ports: list[str] = field(default_factory=list)
    metrics: list[Metric] = field(default_factory=list)
    monitors: list[Monitor] = field(default_factory=list)
    stop_position: Position | None = None  # where ``stop_ports`` were last declared

    def copy(self) -> OutputSpec:
        """A copy to which more can be added."""
        lists: Any = {key: [*each] for key, each in vars(self).items() if isinstance(each, list)}
        return replace(self, **lists)

    def without(self, path: str) -> OutputSpec:
        """What is left of it after the removal of a part of the model."""
        left = [each.without(path) for each in self.monitors]
        gone = {each.name for each, kept in zip(self.monitors, left, strict=True) if kept is None}
        return replace(
            self,
            recorded=[port for port in self.recorded if not paths.is_within(port, path)],
            stop_ports=[port for port in self.stop_ports if not paths.is_within(port, path)],
            metrics=[metric.without(path) for metric in self.metrics if metric.monitor not in gone],
            monitors=[each for each in left if each is not None],
        )
