"""Model: what elaboration makes and a simulation runs."""

from __future__ import annotations

from dataclasses import dataclass, field

from .graph import ModelGraph
from .problems import Position
from .weave import WovenAspect


@dataclass
class Metric:
    """A number taken from what some ports send: ``take`` is a reduction over all their tokens."""

    name: str
    ports: list[str]
    take: str
    unit: str
    doc: str


@dataclass
class Model:
    """A model that can be run; ports are named by their paths, those of composites included."""

    name: str
    doc: str
    graph: ModelGraph
    parameters: dict[str, object]
    aspects: list[WovenAspect] = field(default_factory=list)
    stop: int | None = None  # ns
    stop_when: list[str] = field(default_factory=list)
    seed: int = 0
    record: list[str] = field(default_factory=list)
    metrics: list[Metric] = field(default_factory=list)
    figures: dict[str, tuple[str, dict[str, object], Position]] = field(default_factory=dict)
