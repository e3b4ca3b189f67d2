"""What is known of the composites of a file while they are imported, and what becomes of their parts."""

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
    """What a child of a composite becomes: its name and entry, and its ports by their names there."""

    name: str
    entry: Flow
    row: Counterpart | None = None  # of an actor
    ports: Mapping[str, str] = field(default_factory=dict)
    unwired: frozenset[str] = frozenset()  # ports there for which there is none of ours
    channels: Mapping[str, Sequence[str | None]] = field(default_factory=dict)  # ours, where each is a port by itself


@dataclass
class Level:
    """One composite that is being imported."""

    entity: Entity
    path: str  # as messages tell it
    at: str  # where it is in the written model: "" or a path with a dot behind it
    outer: Level | None
    scope: Scope
    names: Names  # of its actors
    ports: Names
    parameters: Names
    own_names: dict[str, str] = field(default_factory=dict)  # parameters that may stay names, and ours for them
    used: set[str] = field(default_factory=set)
    parts: dict[str, Part | None] = field(default_factory=dict)
    requests: dict[str, str] = field(default_factory=dict)  # ports of an aspect's model, which are actors there
    added_inputs: list[str] = field(default_factory=list)  # by which something in it knows a variable around it
    added_outputs: list[str] = field(default_factory=list)  # by which something in it sets a variable around it
    added_connections: list[str] = field(default_factory=list)

    @cached_property
    def linked(self) -> dict[str, list[str]]:
        """The ports of each child to which something is linked."""
        found: dict[str, list[str]] = {}
        for path, links in self.entity.links.items():
            actor, _, port = path.rpartition(".")
            if links:
                found.setdefault(actor, []).append(port)
        return found

    def told(self, name: str) -> str:
        """The path of something within, for messages."""
        return f"{self.path}.{name}" if self.path else name


@dataclass
class Changing:
    """One parameter that changes."""

    owner: Entity
    name: str
    delayed: bool = True
    is_port: bool = False  # of a composite, by which its values come
    actor: str = ""  # our name of the Variable
    setters: list[str] = field(default_factory=list)  # what leads to it, as seen from the owner
    readers: list[tuple[str, str]] = field(default_factory=list)  # where parameters go by it, and how
    inputs: list[str] = field(default_factory=list)  # to which it leads


class CountsEnds(Protocol):
    """Who knows how many actors send into a net, and how many take what it carries."""

    def senders(self, composite: Entity, ends: list[End]) -> int: ...
    def receivers(self, composite: Entity, ends: list[End]) -> int: ...


class Converting(Protocol):
    """The import of a model, as those know it who do a part of it."""

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
