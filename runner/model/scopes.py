"""The scopes of a model: what Python finds of composites that were loaded, unfolded or built."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from ..text import Position, call_site
from .scope import OF_NO_CLASS, Composite
from .wiring import Child

if TYPE_CHECKING:
    from .model import Model


class Scopes:
    """The composites of a model as scopes, kept up to date with its graph."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self._known: dict[str, Composite] = {}
        self._seen = (0, 0, 0)

    def update(self) -> None:
        """Take in what the graph has got since the last time."""
        graph = self._model.graph
        sizes = (len(graph.composites), len(graph.ports), len(graph.actors))
        if sizes == self._seen:
            return
        composites, ports, actors = self._seen
        here = call_site()  # for what has no position
        for path in islice(graph.composites, composites, None):
            position = graph.positions.get(path, here)
            kind = graph.composites[path]
            label = path if kind == OF_NO_CLASS else kind
            if (scope := self._known.get(path)) is None:
                scope = self._known[path] = Composite(self._model, path, label, position)
            self._enrol(path, Child([path], path.endswith("]"), scope.declaration, None, 1), position)
        for port, node in islice(graph.ports.nodes(data=True), ports, None):
            owner, _, name = port.rpartition(".")
            if owner in self._known:
                self._known[owner].enrol_port(name, node["direction"], graph.positions.get(port, here))
        for path in islice(graph.actors, actors, None):
            actor = graph.actors[path]
            child = Child([path], path.endswith("]"), None, type(actor), 1, [actor])
            self._enrol(path, child, graph.positions.get(path, here))
        self._seen = sizes

    def _enrol(self, path: str, child: Child, position: Position) -> None:
        above, _, name = path.rpartition(".")
        (self._known[above] if above else self._model).enrol(name, child, position)

    def at(self, path: str) -> Composite:
        """The scope of a composite."""
        return self._known[path]

    def renew(self) -> None:
        """Look at the whole graph next time: something has been taken out of it."""
        self._known = {path: scope for path, scope in self._known.items() if path in self._model.graph.composites}
        for scope in (self._model, *self._known.values()):
            scope.forget_parts()
        self._seen = (0, 0, 0)


def is_within(path: str, outer: str) -> bool:
    """Whether a path is that of a part, or of something in it."""
    return path == outer or path.startswith(f"{outer}.")
