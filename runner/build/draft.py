"""Draft: a graph in the making, and what it lacks for a reason that is no news.

What is wrong with a model is reported once, where it is found.  From there on it is a gap, of which nothing more is
said: a part that could not be made, a port behind which anything may be, a connection that could not be understood.  So
is the empty array of a model that is right: it may be spoken of, though nothing is there.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from epicycle.actors import Actor, declared_ports, has_own_ports

from ..graph import ModelGraph, PortNode
from ..text import could_be_within


@dataclass
class Draft:
    """A graph with its gaps; a model is right only if these are empty arrays and no others."""

    graph: ModelGraph = field(default_factory=ModelGraph)
    empty: set[str] = field(default_factory=set)  # arrays with count 0
    unknown: set[str] = field(default_factory=set)  # parts that could not be made: anything may be behind them
    open: set[str] = field(default_factory=set)  # ports that may be connected in a way that is not known
    kinds: set[str] = field(default_factory=set)  # the types and tags of what is missing
    is_wired: bool = True  # whether every connection has been made

    def inside(self, director: str = "") -> Draft:
        """A part of it that is yet to be merged, and will stand under a director of this graph."""
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
        """One that can be changed while this one stays as it is."""
        return Draft(self.graph.copy(), {*self.empty}, {*self.unknown}, {*self.open}, {*self.kinds}, self.is_wired)

    def leave_out(self, path: str, actor_type: type[Actor]) -> None:
        """Put the ports of an actor in its place that could not be made, so that what names them is not wrong, too."""
        for name, port in declared_ports(actor_type).items():
            self.graph.ports[f"{path}.{name}"] = PortNode(None, port.direction)
            self.open.add(f"{path}.{name}")
        self.kinds.add(actor_type.__name__)
        if has_own_ports(actor_type):
            self.unknown.add(path)

    def leave_open(self, composite: str) -> None:
        """Nothing more is said of what comes into a composite."""
        self.open.update(self.graph.borders(composite)[0])

    def excuses(self, pattern: str) -> bool:
        """Whether a pattern that matches nothing is right: it speaks of an empty array, or of what is not known."""
        return any(could_be_within(pattern, path, array=True) for path in self.empty) or any(
            could_be_within(pattern, path, array=False) for path in self.unknown
        )
