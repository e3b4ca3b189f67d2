"""Draft: a graph under construction, with the gaps whose reason has been reported.

Each problem of a model is reported once, where it is found.  From then on it is a gap, about which nothing more is
reported: a part that could not be made, a port that may be connected to anything, a connection that could not be
understood.  The empty array of a valid model is a gap, too: it may be named although it has no instances.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from epicycle.actors import Actor, declared_ports, has_own_ports

from ..graph import ModelGraph, PortNode
from ..text import could_be_within


@dataclass
class Draft:
    """A graph with its gaps; a model is valid only if all of them are empty arrays."""

    graph: ModelGraph = field(default_factory=ModelGraph)
    empty: set[str] = field(default_factory=set)  # arrays with count 0
    unknown: set[str] = field(default_factory=set)  # parts that could not be made: anything may be behind them
    open: set[str] = field(default_factory=set)  # ports that may have unknown connections
    kinds: set[str] = field(default_factory=set)  # the types and tags of what is missing
    is_wired: bool = True  # whether every connection has been made

    def inside(self, director: str = "") -> Draft:
        """A part of it that is to be merged later, under a director of this graph."""
        return Draft(ModelGraph(inside=self.graph, director=director))

    def merge(self, part: Draft, director: str) -> None:
        """Take in a part that was made for this draft."""
        self.graph.merge(part.graph, director)
        self.empty |= part.empty
        self.unknown |= part.unknown
        self.open |= part.open
        self.kinds |= part.kinds
        self.is_wired = self.is_wired and part.is_wired

    def copy(self) -> Draft:
        """A copy that can be changed while this one stays the same."""
        return Draft(self.graph.copy(), {*self.empty}, {*self.unknown}, {*self.open}, {*self.kinds}, self.is_wired)

    def leave_out(self, path: str, actor_type: type[Actor]) -> None:
        """Add the ports of an actor that could not be made, so that references to them are not wrong, too."""
        for name, port in declared_ports(actor_type).items():
            self.graph.ports[f"{path}.{name}"] = PortNode(None, port.direction)
            self.open.add(f"{path}.{name}")
        self.kinds.add(actor_type.__name__)
        if has_own_ports(actor_type):
            self.unknown.add(path)

    def leave_open(self, composite: str) -> None:
        """Report nothing more about what comes into a composite."""
        self.open.update(self.graph.borders(composite)[0])

    def excuses(self, pattern: str) -> bool:
        """Whether a pattern may match nothing: it names an empty array, or something unknown."""
        return any(could_be_within(pattern, path, array=True) for path in self.empty) or any(
            could_be_within(pattern, path, array=False) for path in self.unknown
        )
