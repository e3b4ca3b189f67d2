"""Draft: a graph under construction, with its gaps.

Each problem of a model is reported once, where it is found.  From then on it is a gap, about which nothing more is
reported: a part that could not be made, a port that may be connected to anything, a connection that could not be
understood.  The empty array of a valid model is a gap, too: it may be named although it has no instances.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from epicycle.actors import Actor, declared_ports, has_own_ports

from ..graph.model_graph import ModelGraph
from ..graph.nodes import PortNode
from ..text.patterns import could_be_within


@dataclass(frozen=True)
class Gap:
    """A part that is missing: its types and tags, as far as they are known, and those of the parts in it.

    It ``is_open`` if anything may be behind its path, and ``is_empty`` if it is an array without instances.
    """

    kinds: frozenset[str] = frozenset()
    is_open: bool = True
    is_empty: bool = False


@dataclass
class Draft:
    """A graph with its gaps; a model is valid only if all of them are empty arrays."""

    graph: ModelGraph = field(default_factory=ModelGraph)
    gaps: dict[str, Gap] = field(default_factory=dict)  # by path
    fed: set[str] = field(default_factory=set)  # inputs to which anything may be connected
    is_wired: bool = True  # whether every connection has been made

    def inside(self, director: str = "") -> Draft:
        """A part of it that is to be merged later, under a director of this graph."""
        return Draft(ModelGraph(inside=self.graph, director=director))

    def merge(self, part: Draft, director: str) -> None:
        """Take in a part that was made for this draft."""
        self.graph.merge(part.graph, director)
        self.gaps |= part.gaps
        self.fed |= part.fed
        self.is_wired = self.is_wired and part.is_wired

    def copy(self) -> Draft:
        """A copy that can be changed while this one stays the same."""
        return Draft(self.graph.copy(), {**self.gaps}, {*self.fed}, self.is_wired)

    def leave_out(self, path: str, actor_type: type[Actor]) -> None:
        """Add the ports of an actor that could not be made, so that references to them are not wrong, too."""
        for name, port in declared_ports(actor_type).items():
            self.graph.ports[f"{path}.{name}"] = PortNode(None, port.direction)
            self.fed.add(f"{path}.{name}")
        self.gaps[path] = Gap(frozenset({actor_type.__name__}), has_own_ports(actor_type))

    def leave_open(self, composite: str) -> None:
        """Report nothing more about what comes into a composite."""
        self.fed.update(self.graph.borders(composite)[0])

    @property
    def kinds(self) -> set[str]:
        """The types and tags of what is missing."""
        return set[str]().union(*(gap.kinds for gap in self.gaps.values()))

    def may_hold(self, kind: str, scope: str) -> bool:
        """Whether there may be a part of that type, or with that tag, in a composite."""
        inside = (path for path, gap in self.gaps.items() if gap.is_open and not gap.is_empty)
        return kind in self.kinds or any(not scope or path.startswith(f"{scope}.") for path in inside)

    def excuses(self, pattern: str) -> bool:
        """Whether a pattern may match nothing: it names an empty array, or something unknown."""
        return any(could_be_within(pattern, path, array=gap.is_empty) for path, gap in self.gaps.items() if gap.is_open)

    def may_be_fed(self, ports: Iterable[str]) -> bool:
        """Whether a connection to one of these inputs may be missing because of another problem."""
        return not self.is_wired or not self.fed.isdisjoint(ports)
