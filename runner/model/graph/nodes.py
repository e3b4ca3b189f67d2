"""What a model graph consists of: components, the domains of directors, ports, and connections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from epicycle.actors import InputPort, OutputPort

from ..catalogue.dialect import Dialect
from ..text.problems import Position
from .acts import connection_place
from .clock import Clock


@dataclass(frozen=True, eq=False)
class Edge:
    """One edge of the graph: a connection between two ports, as declared."""

    source: str
    destination: str
    delay: int | None  # ns; None: within the tag
    position: Position | None
    order: int
    shared: int | None = field(default=None, kw_only=True)  # the same for all hops of a connection that is one channel

    def __str__(self) -> str:
        return connection_place(self.source, self.destination)


@dataclass(frozen=True)
class Wire:
    """A path from an output port to an input port."""

    source: OutputPort[Any]
    destination: InputPort[Any]
    edges: tuple[Edge, ...]


@dataclass(frozen=True, eq=False)
class Detour(Edge):
    """A part of the path of tokens through an aspect that is a model, within the tag: it orders firings.

    Tokens go from their sender to the composite's request port, and from its response port to their destination.  If it
    ``waits`` for the composite's turn, it orders nothing.
    """

    aspect: str
    waits: bool = False


@dataclass(slots=True)
class PortNode:
    """A port in the graph: an actor's, or one of a composite (``port`` is None) that tokens only pass through."""

    port: InputPort[Any] | OutputPort[Any] | None
    direction: str  # input or output
    type: Any = None  # the type of what a composite's port hands on, if it declares one
    declared: Position | None = None
    incoming: list[Edge] = field(default_factory=list)  # in their order
    outgoing: list[Edge] = field(default_factory=list)


@dataclass(slots=True)
class Domain:
    """What one director orders: its clock, its dialect, and what it fires, in the order of declaration."""

    clock: Clock
    dialect: type[Dialect]
    members: list[str] = field(default_factory=list)
    machine: str = ""  # of a composite with modes
    refinements: Mapping[str, str] = field(default_factory=dict)  # their paths, by the mode


@dataclass(slots=True)
class Component:
    """An actor, or a composite with its ports and parts; of an array of parts all instances."""

    kind: str  # the name of its type
    position: Position | None = None
    priority: int = 0
    tags: tuple[str, ...] = ()  # that the model's author gave it
    borders: tuple[list[str], list[str]] = field(default_factory=lambda: ([], []))
    parts: dict[str, list[str]] = field(default_factory=dict)

    def copy(self) -> Component:
        inputs, outputs = self.borders
        parts = {name: [*paths] for name, paths in self.parts.items()}
        return replace(self, borders=([*inputs], [*outputs]), parts=parts)


@dataclass(frozen=True)
class Gap:
    """A part that is missing: its types and tags, as far as they are known, and those of the parts in it.

    It ``is_open`` if anything may be behind its path, and ``is_empty`` if it is an array without instances.
    """

    kinds: frozenset[str] = frozenset()
    is_open: bool = True
    is_empty: bool = False
