"""The state of the import: what is known about composites, and the results for their parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

from .counterpart import Counterpart
from .entities import Entity, kind
from .names import Names
from .notes import Notes
from .relations import End, Net, PortFace, Wiring
from .scope import Scope
from .syntax import ExpressionError
from .writing import Flow


@dataclass
class Part:
    """The result for a child of a composite: its name and entry, and its ports by their names in the file."""

    name: str
    entry: Flow
    row: Counterpart | None = None  # only for an actor
    ports: Mapping[str, str] = field(default_factory=dict)
    unwired: frozenset[str] = frozenset()  # ports in the file without a counterpart
    channels: Mapping[str, Sequence[str | None]] = field(default_factory=dict)  # our names, if channels are ports


@dataclass
class Level:
    """One composite that is being imported."""

    entity: Entity
    path: str  # as messages show it
    at: str  # where it is in the written model: "" or a path with a final dot
    outer: Level | None
    scope: Scope
    names: Names  # of its actors
    ports: Names
    parameters: Names
    own_names: dict[str, str] = field(default_factory=dict)  # our names for parameters that may remain
    used: set[str] = field(default_factory=set)
    parts: dict[str, Part | None] = field(default_factory=dict)
    requests: dict[str, str] = field(default_factory=dict)  # ports of an aspect's model, which are entities in the file
    added_inputs: list[str] = field(default_factory=list)  # through which something inside reads an outer variable
    added_outputs: list[str] = field(default_factory=list)  # through which something inside sets an outer variable
    added_connections: list[str] = field(default_factory=list)

    @cached_property
    def linked(self) -> dict[str, list[str]]:
        """The linked ports of each child."""
        found: dict[str, list[str]] = {}
        for path, links in self.entity.links.items():
            actor, _, port = path.rpartition(".")
            if links:
                found.setdefault(actor, []).append(port)
        return found

    def told(self, name: str) -> str:
        """The path of something inside, for messages."""
        return f"{self.path}.{name}" if self.path else name


@dataclass
class Changing:
    """One parameter that changes."""

    owner: Entity
    name: str
    delayed: bool = True
    is_port: bool = False  # whether its values come from a port of a composite
    actor: str = ""  # our name of the Variable
    setters: list[str] = field(default_factory=list)  # its sources, as seen from the owner
    readers: list[tuple[str, str]] = field(default_factory=list)  # places where parameters follow it, and how
    inputs: list[str] = field(default_factory=list)  # that it is connected to


class CountsEnds(Protocol):
    """Counts the actors that send into a net, and those that receive from it."""

    def senders(self, composite: Entity, ends: list[End]) -> int: ...
    def receivers(self, composite: Entity, ends: list[End]) -> int: ...


class Converting(Protocol):
    """The import of a model, as seen by the modules that do a part of it."""

    model: Entity
    notes: Notes
    version: tuple[int, int]  # of Ptolemy
    rows: dict[int, Counterpart | None]
    levels: dict[int, Level]
    idle: set[int]
    triggers: dict[tuple[int, str], str]
    wiring: Wiring

    def face(self, entity: Entity, port: str) -> PortFace | None: ...
    def scope_of(self, entity: Entity) -> Scope: ...
    def container_of(self, entity: Entity) -> Entity | None: ...
    def path_of(self, composite: Entity, child: Entity) -> str: ...
    def is_linked(self, entity: Entity, port: str) -> bool: ...
    def hand(self, refinement: Entity, name: str) -> None: ...
    def nets_of(self, composite: Entity) -> list[Net]: ...
    @property
    def counting(self) -> CountsEnds: ...
    def nets_at(self, composite: Entity, actor: str, port: str, channel: int | None = None) -> list[Net]: ...
    def end(self, level: Level, end: End) -> tuple[str, bool] | None: ...
    def port_name(self, names: Names, port: str, channel: int) -> str: ...
    def channels(self, entity: Entity, port: str) -> int: ...
    def port_of(self, entity: Entity, part: Part, port: str, channel: int) -> str: ...
    def level(self, entity: Entity, path: str, at: str = "", outer: Level | None = None) -> Level: ...
    def body(self, level: Level) -> dict[str, Any]: ...
    def parameters(self, level: Level) -> dict[str, Any]: ...
    def instance(self, child: Entity, body: dict[str, Any], values: dict[str, Any]) -> Flow: ...
    def composite_part(self, child: Entity, level: Level, name: str) -> Part: ...


def give_priority(entry: Flow, entity: Entity, scope: Scope, notes: Notes) -> None:
    """Put the priority of a composite or machine into its entry, if it has one."""
    for said in entity.properties.values():
        if (said.name == "_priority" or kind(said) == "Priority") and (said.value or "").strip():
            try:
                entry["priority"] = scope.value_of(said)
            except ExpressionError as error:
                notes.note(f"{entity.name}.{said.name} = {said.value!r}: {error}")
