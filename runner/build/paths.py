"""Paths: what the patterns of a model's aspects choose from."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

from ..text import PathIndex
from .draft import Draft


class Paths:
    """What the pointcuts of a model's aspects choose from, found out once for all of them; of ``ports``, or of all."""

    def __init__(self, draft: Draft, ports: Iterable[str] | None = None) -> None:
        self._draft, self._graph = draft, draft.graph
        graph = draft.graph
        self.ports = PathIndex(graph.ports.nodes if ports is None else ports, graph.limits)

    @cached_property
    def actors(self) -> PathIndex:
        """All actors."""
        return PathIndex(self._graph.actors, self._graph.limits)

    @cached_property
    def holders(self) -> PathIndex:
        """All actors and composites."""
        return PathIndex([*self._graph.actors, *self._graph.composites], self._graph.limits)

    @cached_property
    def owners(self) -> PathIndex:
        """All composites and actors, those that could not be made included."""
        graph = self._graph
        unmade = sorted(set(map(graph.owner, self._draft.open)))
        return PathIndex(dict.fromkeys((*graph.composites, *graph.actors, *unmade)), graph.limits)

    @cached_property
    def kinds(self) -> dict[str, str]:
        """The types of all actors and composites."""
        return {path: type(actor).__name__ for path, actor in self._graph.actors.items()} | self._graph.composites
