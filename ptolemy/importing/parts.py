"""The parts of a model that is being imported: one for each entity, with what is known of it and what becomes of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import Actor as OwnActor

from .document import Entity, Property, director_of, is_aside, is_decoration, is_layout, is_priority, is_variable
from .limits import Notes, spend
from .scope import Scope
from .syntax import ExpressionError
from .table import UNSAID, WORDS, Face, Row, row_of, row_of_type, table, why_not
from .writing import Flow, Names, snake

_FACE = 5  # steps to look up a port, which is most of the work of wiring
ASPECT_MODELS: frozenset[str] = WORDS["aspect models"]


@dataclass(frozen=True)
class End:
    """One channel of a port at a net: of a part of the composite, or of the composite itself."""

    part: Part
    port: str
    channel: int
    is_own: bool  # of the composite itself
    is_source: bool  # whether tokens come from here


@dataclass(eq=False)
class Net:
    """The ports joined by one channel of a relation, in the order in which they were linked."""

    ends: list[End] = field(default_factory=list)
    order: int = 0


@dataclass(eq=False)
class Part:
    """One entity of a model, and what becomes of it."""

    entity: Entity
    outer: Part | None
    scope: Scope
    role: str  # actor, composite, machine, aspect; request and response are ports of an aspect's model
    row: Row | None = None  # only of an actor
    controller: Entity | None = None  # only of a machine: with refinements, it is inside
    parts: dict[str, Part] = field(default_factory=dict)
    linked: list[str] = field(default_factory=list)  # its ports that are linked outside
    is_idle: bool = False  # it never fires, and is left out
    variable_ports: list[str] = field(default_factory=list)  # parameters of a composite that get values from a port
    widths: dict[str, int] = field(default_factory=dict)  # of the ports linked inside: "actor.port" or "port"
    nets: list[Net] = field(default_factory=list)  # inside
    inside: dict[str, list[tuple[int, Net]]] = field(default_factory=dict)  # the nets at its ports, by channel
    outside: dict[str, list[tuple[int, Net]]] = field(default_factory=dict)
    # As it is written:
    name: str = ""
    at: str = ""  # where what is inside stands in the written model: "" or a path with a final dot
    entry: Flow | None = None  # None if it is left out
    names: Names = field(default_factory=Names)  # of what is inside
    ports: Names = field(default_factory=Names)
    own_names: dict[str, str] = field(default_factory=dict)  # our names for parameters that may remain
    used: set[str] = field(default_factory=set)  # of these parameters
    own_ports: Mapping[str, str] = field(default_factory=dict)  # of an actor: ours that are not in its row
    unwired: set[str] = field(default_factory=set)  # ports in the file without a counterpart
    unnamed: set[str] = field(default_factory=set)  # our ports of a machine that no guard or action names
    _with: dict[str, list[Part]] = field(default_factory=dict)

    @property
    def around(self) -> Part:
        """What contains it, if it is not the model itself."""
        assert self.outer is not None
        return self.outer

    @property
    def root(self) -> Part:
        """The model."""
        return self if self.outer is None else self.outer.root

    @property
    def path(self) -> str:
        """Where it is, for messages; "" for the model."""
        return "" if self.outer is None else self.outer.told(self.entity.name)

    def told(self, name: str) -> str:
        """The path of something inside, for messages."""
        return f"{self.path}.{name}" if self.path else name

    @property
    def is_border(self) -> bool:
        """Whether it stands for a port of an aspect's model."""
        return self.role in ("request", "response")

    def everything(self) -> Iterator[Part]:
        """The part and everything inside it."""
        yield self
        for each in self.parts.values():
            yield from each.everything()

    def with_property(self, name: str) -> list[Part]:
        """Everything inside at which a property of that name has a value."""
        if name not in self._with:
            self._with[name] = [each for each in self.everything() if (each.entity.text(name) or "").strip()]
        return self._with[name]

    def value(self, said: Property, notes: Notes, default: Any = None) -> Any:
        """The value of one of its attributes before the run; the default, and a note, if it has none."""
        try:
            found = self.scope.value_of(said)
        except ExpressionError as error:
            notes.note(f"{self.told(said.name)} = {said.value!r}: {error}")
            return default
        return default if found is None else found

    def with_priority(self, entry: Flow, notes: Notes) -> Flow:
        """Its entry with its priority, if it has one."""
        for said in self.entity.properties.values():
            if is_priority(said) and (said.value or "").strip() and (value := self.value(said, notes)) is not None:
                entry["priority"] = value
        return entry

    # -- ports ----------------------------------------------------------------------------------------------------

    def face(self, port: str) -> Face | None:
        """The direction of a port, and whether it is a multiport; None if nothing is wired to it."""
        spend(_FACE)
        row = self.row
        if self.is_idle or (row is not None and port in row.ports and not row.has_port(port)):
            return None
        if self.is_border or port in self.variable_ports:
            return Face("output" if self.role == "request" else "input")
        if row is not None and port in row.ports:
            return row.ports[port]
        said = self.entity.ports.get(port)
        if said is not None and (said.flag("input") or said.flag("output")):
            return Face("input" if said.flag("input") else "output", said.flag("multiport"))
        if row is not None:
            said_parameter, parameter = self.entity.properties.get(port), row.parameters.get(port)
            is_port = said_parameter is not None and said_parameter.kind.endswith("PortParameter")
            return Face("input") if (is_port if parameter is None else parameter.kind != "nothing") else None
        return None if self.role != "actor" else Face("output" if port.startswith("output") else "input", multi=True)

    def count(self, port: str) -> int:
        """How many ports one of its own becomes: one for each channel."""
        face = self.face(port)
        if face is None or not face.multi:
            return 1
        outside = 0 if self.outer is None else self.outer.widths.get(f"{self.entity.name}.{port}", 0)
        return max(self.widths.get(port, 0), outside, 1)

    def port_name(self, port: str, channel: int = 0) -> str:
        """Our name for a channel of one of its ports."""
        if self.row is None:
            return self.ports.of(port) if channel == 0 else self.ports.of(f"{port}_{channel}")
        if port in self.own_ports:
            return self.own_ports[port]
        said = self.row.ports.get(port) or self.row.parameters.get(port)
        return snake(port) if said is None else said.ours


def role_of(entity: Entity) -> str:
    """What an entity is, unless it is a machine."""
    for role in ("request", "response"):
        if entity.kind in WORDS[role]:
            return role
    is_in_package = any(each in entity.java for each in (".aspect.", ".resourceScheduler", ".aspects."))
    if is_in_package or entity.kind in ASPECT_MODELS | table("words")["schedulers"].keys():
        return "aspect"
    is_known = entity.java.startswith("ptolemy.actor.lib.hoc") or row_of(entity.java) is not None
    return "composite" if entity.kind in WORDS["composites"] or (entity.entities and not is_known) else "actor"


def controller_of(entity: Entity) -> Entity | None:
    """The state machine of an entity: the entity itself, or the one inside a modal model; None without one."""
    if entity.kind in WORDS["machines"]:
        return entity
    director = director_of(entity)
    name = "" if director is None else director.word("controllerName")
    found = entity.entities.get(name or "_Controller")
    return found if found is not None and found.kind in WORDS["machines"] else None


def parts_of(model: Entity, own: Mapping[str, type[OwnActor]]) -> Part:
    """The part of a model, with everything inside it."""

    def made(entity: Entity, outer: Part | None) -> Part:
        controller = controller_of(entity)
        role = "machine" if controller is not None else role_of(entity)
        row = None
        if role == "actor":
            row = row_of_type(own[entity.kind]) if entity.kind in own else row_of(entity.java)
        said = {} if row is None else row.parameters
        defaults = {name: one.default for name, one in said.items() if one.default is not UNSAID}
        scope = Scope(entity, None if outer is None else outer.scope, defaults)
        part = Part(entity, outer, scope, role, row, controller)
        part.parts = {name: made(each, part) for name, each in entity.entities.items()}
        for path, links in entity.links.items():
            actor, _, port = path.rpartition(".")
            if links and actor in part.parts:
                part.parts[actor].linked.append(port)
        return part

    return made(model, None)


# -- what has no counterpart ------------------------------------------------------------------------------------------


def about_ports(part: Part, notes: Notes) -> None:
    """Report settings of ports that have no counterpart, and linked ports that our actors do not have."""
    for port in part.entity.ports.values():
        for said in port.properties.values():
            known = said.name in ("input", "output", "multiport") or is_aside(said)
            known = known or (said.name == "defaultValue" and part.entity.kind == "Expression")
            if not known and said.value:
                notes.note(f"{part.told(port.name)}.{said.name} = {said.value!r} has no counterpart")
    if part.row is not None and not part.row.is_view and not part.is_idle:
        for name in part.linked:
            if part.face(name) is None:
                notes.note(f"{part.told(name)} has no counterpart; its wires are left out")


def about_properties(owner: Property, path: str, notes: Notes, known: Collection[str] = ()) -> None:
    """Report attributes that have no counterpart."""
    for name, said in owner.properties.items():
        is_known = name in known or is_aside(said) or is_variable(said) or said.kind.endswith("Director")
        if not is_known and (said.value is not None or said.java):
            notes.note(f"{path}.{name}, a {said.kind or 'property'}, has no counterpart".removeprefix("."))


def about_unknown(part: Part, notes: Notes) -> None:
    """Report an actor whose class has no row: an error, or a note if the model can do without it."""
    what = f"{part.path} is a {part.entity.java}, which has no counterpart"
    linked = part.linked
    if not linked and is_layout(part.entity):
        return
    if not linked:
        notes.note(f"{what} and is left out: nothing is connected to it")
    elif all(_only_takes(part, port) for port in linked):
        notes.note(f"{what} and is left out: it only receives tokens")
    else:
        notes.error(f"{what}{why_not(part.entity.java)}")


def _only_takes(part: Part, port: str) -> bool:
    face = part.face(port)
    return face is not None and face.direction == "input" and (port.startswith("input") or port in part.entity.ports)


def is_watched(part: Part) -> bool:
    """Whether a view must be kept: an aspect is enabled there, or it occupies a channel of a multiport."""
    owners: list[Property] = [part.entity, *part.entity.ports.values()]
    if any(is_enabled(said) for owner in owners for said in owner.properties.values()):
        return True
    ends = [end for nets in part.outside.values() for _, net in nets for end in net.ends]
    others = [(end.part.face(end.port), f"{end.part.entity.name}.{end.port}") for end in ends if not end.is_own]
    links = part.around.entity.links
    return any(face and face.multi and face.direction == "output" and len(links[path]) > 1 for face, path in others)


def is_enabled(said: Property) -> bool:
    """Whether an attribute enables an aspect."""
    return is_decoration(said) and said.word("enable") not in ("", "false")
