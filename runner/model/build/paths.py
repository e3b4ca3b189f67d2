"""What aspects select their places from, and how one of them sees it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

from epicycle.actors import FaultError

from ..graph.model_graph import ModelGraph
from ..language.places import PointcutText
from ..language.values import Locals, Values
from ..text.document import Node
from ..text.kinds import Kind
from ..text.patterns import PathIndex
from ..text.problems import NONE, Near, Poison, Position, Problems
from ..text.reading import Text


class Paths:
    """What the pointcuts of a model's aspects select from, determined once for all of them; of ``ports``, or of all."""

    def __init__(self, graph: ModelGraph, ports: Iterable[str] | None = None) -> None:
        self.graph = graph
        self.ports = self._index(graph.ports if ports is None else ports)

    def _index(self, paths: Iterable[str]) -> PathIndex:
        return PathIndex(paths, self.graph.limits)

    @cached_property
    def actors(self) -> PathIndex:
        return self._index(self.graph.actors)

    @cached_property
    def holders(self) -> PathIndex:
        """All actors and composites."""
        return self._index([*self.graph.actors, *self.graph.composites])

    @cached_property
    def owners(self) -> PathIndex:
        """All composites and actors, including those that could not be made."""
        unmade = sorted(set(map(self.graph.owner, self.graph.fed)))
        return self._index(dict.fromkeys((*self.graph.composites, *self.graph.actors, *unmade)))


@dataclass
class View:
    """A model as one aspect or monitor sees it: names are relative to ``scope``, the composite that declares it."""

    paths: Paths
    name: str
    scope: str
    problems: Problems
    called: str = field(default="aspect", kw_only=True)

    @property
    def graph(self) -> ModelGraph:
        return self.paths.graph

    @property
    def ports(self) -> PathIndex:
        return self.paths.ports

    def _full(self, text: str) -> str:
        return f"{self.scope}.{text}" if self.scope else text

    def tell(
        self,
        message: str,
        where: PointcutText | Text | Position | None,
        *hints: str,
        about: tuple[str, ...] = (),
        kind: Kind | None = None,
        near: Near = NONE,
    ) -> Poison:
        """Report a problem of the aspect or monitor."""
        position = where.position if isinstance(where, (PointcutText, Text)) else where
        said = f"{self.called} {self.name}: {message}"
        return self.problems.add(said, position, *hints, scope=self.scope, about=about, kind=kind, near=near)

    def blame(self, error: FaultError, where: Node | Position) -> Poison:
        """Report what is wrong with a node, or with something at a position."""
        return Values(self.problems).blame(f"{self.called} {self.name}", error, where, Locals(self.scope))
