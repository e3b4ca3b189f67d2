"""What is watched of a model: when a run ends, what it records, and its metrics."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from ..catalogue import Measure
from ..text import Position
from .model_graph import is_within


@dataclass(frozen=True)
class Metric:
    """A number computed from what some ports send together."""

    name: str
    ports: list[str]
    measure: Measure

    def without(self, path: str) -> Metric:
        """The metric after the removal of a part of the model that it may have watched."""
        return replace(self, ports=[port for port in self.ports if not is_within(port, path)])

    @property
    def unit(self) -> str:
        """Its unit."""
        return self.measure.to or self.measure.own_unit


@dataclass
class Watched:
    """What a model declares about a run: when it ends, and what is kept of it."""

    stop_time: int | None = None  # ns
    seed: int = 0
    recorded: list[str] = field(default_factory=list)
    stop_ports: list[str] = field(default_factory=list)
    metrics: list[Metric] = field(default_factory=list)
    stop_position: Position | None = None  # where ``stop_ports`` were last declared
