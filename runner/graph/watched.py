"""What is watched of a model: when a run ends, what it records, and its metrics."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from epicycle.aspects import Reading

from ..catalogue import Measure
from ..temporal import TINY, Property, Requirement
from ..text import Position
from .model_graph import is_within


@dataclass(frozen=True)
class Metric:
    """A number computed from what some ports send together."""

    name: str
    ports: list[str]
    measure: Measure
    monitor: str = ""  # the monitor whose verdict or robustness it is

    def without(self, path: str) -> Metric:
        """The metric after the removal of a part of the model that it may have watched."""
        return replace(self, ports=[port for port in self.ports if not is_within(port, path)])

    @property
    def unit(self) -> str:
        """Its unit."""
        return self.measure.to or self.measure.own_unit


@dataclass(frozen=True)
class Monitor:
    """A property that a run must have; ``readings`` are what each of its conditions reads: ports, and fields.

    ``size`` is that of the unit of its robustness, in what its margins are in.
    """

    name: str
    requirement: Requirement
    tree: Property
    readings: list[list[Reading]]
    size: float = 1.0

    @property
    def ports(self) -> list[str]:
        """The ports that it observes."""
        return list(dict.fromkeys(port for condition in self.readings for port, _ in condition))

    def in_unit(self, margin: float) -> float:
        """A margin in the unit of the robustness; one that stands for 0 stays as it is, with its sign."""
        return margin if abs(margin) == TINY else margin / self.size

    @property
    def metrics(self) -> list[Metric]:
        """Its results among the metrics of a run: whether the property holds, and its robustness."""
        said = self.requirement
        label = said.label or self.name
        verdict = Measure(doc=said.doc or said.property, label=said.label, unit="1")
        margin = Measure(doc=f"robustness of {self.name}", label=f"robustness of {label}", unit=said.unit)
        return [
            Metric(self.name, self.ports, verdict, self.name),
            Metric(f"{self.name}_robustness", self.ports, margin, self.name),
        ]


@dataclass
class Watched:
    """What a model declares about a run: when it ends, and what is kept of it."""

    stop_time: int | None = None  # ns
    seed: int = 0
    recorded: list[str] = field(default_factory=list)
    stop_ports: list[str] = field(default_factory=list)
    metrics: list[Metric] = field(default_factory=list)
    monitors: list[Monitor] = field(default_factory=list)
    stop_position: Position | None = None  # where ``stop_ports`` were last declared
