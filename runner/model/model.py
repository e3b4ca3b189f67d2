"""Model: what elaboration makes and a simulation runs."""

from __future__ import annotations

from dataclasses import dataclass

from epicycle.actors import Parameter, Tag, to_nanoseconds, to_seconds

from .graph import ModelGraph
from .problems import Position, Problem
from .weave import WovenAspect


@dataclass
class Metric:
    """A number taken from what some ports send: ``take`` is a reduction over all their tokens."""

    name: str
    ports: list[str]
    take: str
    unit: str
    doc: str


class Model:
    """A model that can be run; ports are named by their paths, those of composites included."""

    def __init__(self, name: str, *, doc: str = "", stop: float | str | None = None, seed: int = 0) -> None:
        self.name = name
        self.doc = doc
        self.graph = ModelGraph()
        self.parameters: dict[str, object] = {}
        self.aspects: list[WovenAspect] = []
        self.stop_time: int | None = None  # ns
        self.stop_ports: list[str] = []
        self.seed = seed
        self.recorded: list[str] = []
        self.metrics: list[Metric] = []
        self.figures: dict[str, tuple[str, dict[str, object], Position]] = {}
        self.warnings: tuple[Problem, ...] = ()  # what is odd about it, but not wrong
        self.stop = stop

    @property
    def stop(self) -> float | None:
        """When the run ends, in seconds; None if only an empty agenda or a port ends it.  ``"500 ms"`` may be set."""
        return None if self.stop_time is None else to_seconds(self.stop_time)

    @stop.setter
    def stop(self, stop: float | str | None) -> None:
        self.stop_time = None if stop is None else nanoseconds(stop)

    def local_tag(self, actor: str, tag: Tag) -> Tag:
        """A tag of the event log, as the actor or composite of that path sees it: in its director's time."""
        return self.graph.clocks[self.graph.director_of(actor)].tag(tag)


def nanoseconds(duration: float | str) -> int:
    """A time in seconds, or a text such as ``"500 ms"``, in ns; raises ``ParameterError`` or ``ValueError``."""
    seconds = Parameter(float, unit="s", min=0.0).convert(duration)
    assert seconds is not None
    return to_nanoseconds(seconds)
