"""Converts composites to composite classes of the model language: parts, wires, directors and parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cached_property
from typing import Any

from epicycle.actors import Actor as OwnActor
from epicycle.runner.catalogue import installed

from .actors import Actor, face_of, is_decoration, is_layout, plain
from .aspects import MODELS, aspects_of, is_aspect, is_request, is_response
from .budget import spend
from .counterpart import UNSAID, Counterpart, counterpart_of_type
from .directors import director_of, said_of
from .entities import Entity, Property, kind, version_of
from .leftovers import about_links, about_ports, about_properties, about_unknown, is_watched
from .modes import is_machine, machine_part
from .names import Names, snake
from .notes import Notes
from .parts import Level, Part, give_priority
from .reach import is_fed, iterations, leave_out_idle
from .relations import End, Net, PortFace, Wiring
from .scope import Scope, is_text, is_variable
from .syntax import ExpressionError
from .table import counterpart_of
from .variables import Variables
from .whole import array_ports, whole_ports
from .wires import Counting, connections_of
from .writing import Flow

_FACE = 5  # steps to look up a port, which is most of the work of wiring
COMPOSITES = frozenset({
    "TypedCompositeActor", "CompositeActor", "CompositeEntity", "ModalModel", "Refinement", "ModalRefinement",
    "TypedAtomicActorComposite", "DECompositeActor", "ThreadedComposite", "CaseRefinement", "TypedOpaqueComposite",
    *MODELS,
})  # fmt: skip


class Conversion:
    """Goes through a model and makes its sections; holds what these share."""

    def __init__(self, model: Entity, notes: Notes, own: Mapping[str, type[OwnActor]]) -> None:
        self.model = model
        self.notes = notes
        self.classes: dict[str, dict[str, Any]] = {}
        self._known: dict[str, str] = {}  # body: its class
        known = installed()
        self._class_names = Names([*known.actors, *known.aspects, *own])
        self.rows: dict[int, Counterpart | None] = {}
        for each in model.everything():
            is_row = not is_composite(each) and not is_machine(each)
            self.rows[id(each)] = self._row(each, own) if is_row else None
        self._scopes: dict[int, Scope] = {}
        self._nets: dict[int, list[Net]] = {}
        self._at: dict[int, dict[tuple[str, str, int | None], list[Net]]] = {}
        self.version = version_of(model)
        self.levels: dict[int, Level] = {}
        self._containers = {id(child): each for each in model.everything() for child in each.entities.values()}
        self.variables = Variables(self)
        self.idle: set[int] = set()  # actors that never fire
        self.wiring = Wiring(model, self.face, self._width)
        self.triggers = iterations(self)
        leave_out_idle(self)

    def _row(self, entity: Entity, own: Mapping[str, type[OwnActor]]) -> Counterpart | None:
        found = own.get(kind(entity))
        return counterpart_of(entity.java) if found is None else counterpart_of_type(found)

    # -- for wiring -----------------------------------------------------------------------------------------------

    def face(self, entity: Entity, port: str) -> PortFace | None:
        """The direction of a port, and whether it is a multiport; None if nothing is wired to it."""
        spend(_FACE)
        if id(entity) in self.idle:
            return None
        if self.variables.has_port(entity, port):
            return PortFace("input", False)
        if is_request(entity) or is_response(entity):
            return PortFace("output" if is_request(entity) else "input", False)
        row = self.rows.get(id(entity))
        if row is not None and port in row.ports and not row.has_port(port):
            return None
        found = face_of(row, entity, port)
        if found is None and row is None and not is_composite(entity) and not is_machine(entity):
            return PortFace("output" if port.startswith("output") else "input", True)
        return found

    def _width(self, composite: Entity, relation: str) -> int | None:
        said = composite.relations[relation].text("width")
        if said is None or not said.strip():
            return None
        try:
            found = self.scope_of(composite).value(said)
        except ExpressionError as error:
            self.notes.note(f"the width {said!r} of {relation}: {error}")
            return None
        return found if isinstance(found, int) and found >= 0 else None

    def scope_of(self, entity: Entity) -> Scope:
        """The scope of a composite anywhere in the model."""
        if not self._scopes:
            self._enter(self.model, None)
        return self._scopes[id(entity)]

    def _enter(self, entity: Entity, around: Scope | None) -> None:
        waiting = [(entity, around)]
        while waiting:
            each, outer = waiting.pop()
            row = self.rows.get(id(each))
            said = {} if row is None else row.parameters
            defaults = {name: one.default for name, one in said.items() if one.default is not UNSAID}
            scope = self._scopes[id(each)] = Scope(each, outer, defaults)
            waiting += [(child, scope) for child in each.entities.values()]

    def path_of(self, composite: Entity, child: Entity) -> str:
        """Where something is, for messages."""
        names, around = [child.name], composite
        while (outer := self.container_of(around)) is not None:
            names.append(around.name)
            around = outer
        return ".".join(reversed(names))

    # -- composites -----------------------------------------------------------------------------------------------

    def level(self, entity: Entity, path: str, at: str = "", outer: Level | None = None) -> Level:
        """What is known about a composite before its parts are converted."""
        names = Names(), Names(), Names(in_expressions=True)
        level = Level(entity, path, at, outer, self.scope_of(entity), *names)
        self.levels[id(entity)] = level
        for name, said in entity.properties.items():
            is_parameter = is_variable(said) and not is_layout(said) and not is_decoration(said)
            if is_parameter and self._stays(name, said, level) and self.variables.find(level.scope, name) is None:
                level.own_names[name] = level.parameters.of(name)
        return level

    def _stays(self, name: str, said: Property, level: Level) -> bool:
        """Whether a parameter can remain one."""
        try:
            value = level.scope(name)
            plain(value)
        except (ExpressionError, KeyError, ValueError):
            return False
        return value is not None and (not isinstance(value, str) or is_text(said))

    def body(self, level: Level) -> dict[str, Any]:
        """The sections of a composite, or of the model."""
        entity = level.entity
        for name in entity.ports:
            level.names.take(level.ports.of(name))
        for child in entity.entities.values():
            if is_request(child) or is_response(child):
                level.requests[child.name] = level.ports.of(child.name)
                level.names.take(level.requests[child.name])
        for port, ours in level.ports.renamed().items():
            self.notes.note(f"{level.told(port)} is renamed {ours}")
        actors: dict[str, Flow] = {}
        for child in entity.entities.values():
            if child.name in level.requests:
                continue
            about_ports(self, child, level)
            about_links(self, child, level)
            part = level.parts[child.name] = self._part(child, level)
            if part is not None:
                actors[part.name] = part.entry
                if part.name != child.name:
                    self.notes.note(f"{level.told(child.name)} is renamed {part.name}")
        connections = self._connections(level)
        following = self.variables.add(level, actors, connections)
        connections += level.added_connections
        found: dict[str, Any] = {}
        if entity.doc:
            found["doc"] = " ".join(entity.doc.split())
        inputs, outputs = self._borders(level)
        if inputs:
            found["inputs"] = inputs
        if outputs:
            found["outputs"] = outputs
        if actors:
            found["actors"] = actors
        if connections:
            found["connections"] = connections
        aspects = {**aspects_of(self, level), **following}
        if aspects:
            found["aspects"] = aspects
        about_properties(self, level)
        return found

    def parameters(self, level: Level) -> dict[str, Any]:
        """The parameters that are used inside."""
        found = {}
        for name, ours in level.own_names.items():
            if name in level.used:
                found[ours] = plain(level.scope(name))
        return found

    def _borders(self, level: Level) -> tuple[list[str], list[str]]:
        found: tuple[list[str], list[str]] = ([], [])
        for port in level.entity.ports:
            face = self.face(level.entity, port)
            if face is not None:
                for channel in range(self.channels(level.entity, port)):
                    found[face.direction == "output"].append(self.port_name(level.ports, port, channel))
        for name, ours in level.requests.items():
            found[is_response(level.entity.entities[name])].append(ours)
        for each in self.variables.of(level.entity):
            if each.is_port and each.name not in level.entity.ports:
                found[0].append(level.ports.of(each.name))
        found[0].extend(level.added_inputs)
        found[1].extend(level.added_outputs)
        return found

    def channels(self, entity: Entity, port: str) -> int:
        """How many ports a port of a composite becomes."""
        face = self.face(entity, port)
        if face is None or not face.multi:
            return 1
        return max(self.wiring.width(entity, port), self._outer_width(entity, port), 1)

    def _outer_width(self, entity: Entity, port: str) -> int:
        around = self.container_of(entity)
        return 0 if around is None else self.wiring.width(around, f"{entity.name}.{port}")

    def container_of(self, entity: Entity) -> Entity | None:
        """The composite that contains an entity; None for the model."""
        return self._containers.get(id(entity))

    def is_linked(self, entity: Entity, port: str) -> bool:
        """Whether something is linked to a port from outside."""
        around = self.container_of(entity)
        return around is not None and bool(around.links.get(f"{entity.name}.{port}"))

    def hand(self, refinement: Entity, name: str) -> None:
        """Make a refinement follow a variable of its machine."""
        self.variables.hand(refinement, name)

    def nets_of(self, composite: Entity) -> list[Net]:
        """The nets of a composite."""
        if id(composite) not in self._nets:
            self._nets[id(composite)] = self.wiring.nets(composite) if id(composite) in self.wiring.groups else []
        return self._nets[id(composite)]

    def nets_at(self, composite: Entity, actor: str, port: str, channel: int | None = None) -> list[Net]:
        """The nets at a port of a child, or at one channel; without an actor, at a port of the composite itself."""
        if id(composite) not in self._at:
            found = self._at[id(composite)] = {}
            for net in self.nets_of(composite):
                places = [(end.actor, end.port, each) for end in net.ends for each in (None, end.channel)]
                for place in dict.fromkeys(places):
                    found.setdefault(place, []).append(net)
        return self._at[id(composite)].get((actor, port, channel), [])

    def port_name(self, names: Names, port: str, channel: int) -> str:
        """Our name for a channel of a composite's port: each channel is a separate port."""
        return names.of(port) if channel == 0 else names.of(f"{port}_{channel}")

    def _part(self, child: Entity, level: Level) -> Part | None:
        if is_aspect(child):
            return None
        name = level.names.of(child.name)
        if is_machine(child):
            return machine_part(self, child, level, name)
        if is_composite(child):
            return self.composite_part(child, level, name)
        row = self.rows[id(child)]
        if id(child) in self.idle:
            return None
        if row is None:
            about_unknown(self, child, level)
            return None
        if row.is_view and not is_watched(self, child, level):
            self.notes.count("view")
            return None
        known = {*row.ports, *child.ports, *child.properties}
        actor = Actor(
            child, level.told(child.name), self.scope_of(child), self.notes, row, level.own_names,
            f".{self.model.name}.{level.told(child.name)}", self._seed, whole_ports(self, level.entity, child),
            {port: self._fed_width(level.entity, child, port) for port in known},
        )  # fmt: skip
        actor.follow = lambda ours, text, name: self.variables.follow(actor, level, ours, text, name)
        actor.arrays = array_ports(self, level.entity, child)
        actor.changing = lambda tree: self.variables.names_in(tree, actor.scope)
        actor.convert()
        level.used |= actor.used
        part = Part(
            name, Flow({"type": actor.row.type, **actor.values}), actor.row, actor.ports, frozenset(actor.unwired)
        )
        for port, changing in actor.reads.items():
            self.variables.lead_to(changing, level, f"{name}.{port}")
        if actor.row.type == "SetVariable":
            self.variables.note_setter(child, level, part)
        return part

    @cached_property
    def counting(self) -> Counting:
        """Counts the actors at the ends of nets; only valid once the actors that never fire are known."""
        return Counting(self)

    def _fed_width(self, composite: Entity, child: Entity, port: str) -> int:
        """How many channels a port of an actor has; 0 if it is an input to which nothing sends."""
        face = self.face(child, port)
        if face is not None and face.direction == "input" and not is_fed(self, composite, child, port, self.counting):
            return 0
        return self.wiring.width(composite, f"{child.name}.{port}")

    @cached_property
    def _seed(self) -> object:
        """The seed that all random actors share: the value set at one of them holds for all."""
        for each in self.model.everything():
            said, row = each.properties.get("seed"), self.rows.get(id(each))
            if said is not None and row is not None and row.type in ("Random", "VaryingRandom", "PoissonClock"):
                try:
                    if (seed := self.scope_of(each).value_of(said)) not in (0, None):
                        return seed
                except ExpressionError:
                    continue
        return 0

    def composite_part(self, child: Entity, level: Level, name: str) -> Part:
        """A composite as an instance of a composite class."""
        inner = self.level(child, level.told(child.name), f"{level.at}{name}.", level)
        body = self.body(inner)
        values = self.parameters(inner)
        if (director := director_of(child)) is not None:
            found = said_of(director, inner.told(director.name), inner.scope, self.notes, of_model=False)
            if body.get("actors"):
                body = _with_director(body, found)
        entry = self.instance(child, body, values)
        give_priority(entry, child, inner.scope, self.notes)
        return Part(name, entry)

    def class_name(self, name: str) -> str:
        """A similar, unused name for another class."""
        return self._class_names.fresh(name)

    def instance(self, child: Entity, body: dict[str, Any], values: dict[str, Any]) -> Flow:
        """The entry of an instance; reuses an existing class with the same content."""
        # The type of a parameter's default decides which values it takes.
        key = json.dumps([body, sorted((name, type(value).__name__) for name, value in values.items())], default=str)
        if key not in self._known:
            name = self._class_names.fresh(child.of_class.rpartition(".")[2] or child.name)
            self._known[key] = name
            ordered = {"doc": body.pop("doc")} if "doc" in body else {}
            self.classes[name] = {**ordered, **({"parameters": Flow(values)} if values else {}), **body}
        name = self._known[key]
        default = self.classes[name].get("parameters", {})
        changed = {each: value for each, value in values.items() if not _same(default[each], value)}
        return Flow({"type": name, **changed})

    # -- wires ----------------------------------------------------------------------------------------------------

    def _connections(self, level: Level) -> list[Any]:
        return connections_of(self, level)

    def end(self, level: Level, end: End) -> tuple[str, bool] | None:
        """Our name for one end of a net, and whether it is a source of tokens; None if it is left out."""
        entity = level.entity if not end.actor else level.entity.entities.get(end.actor)
        face = None if entity is None else self.face(entity, end.port)
        if entity is None or face is None:
            return None
        if not end.actor:
            return self.port_name(level.ports, end.port, end.channel), face.direction == "input"
        if end.actor in level.requests:
            return level.requests[end.actor], is_request(entity)
        part = level.parts.get(end.actor)
        if part is None or end.port in part.unwired:
            return None
        if end.port in part.channels:
            ours = part.channels[end.port][end.channel]
            return None if ours is None else (f"{part.name}.{ours}", face.direction == "output")
        return f"{part.name}.{self.port_of(entity, part, end.port, end.channel)}", face.direction == "output"

    def port_of(self, entity: Entity, part: Part, port: str, channel: int) -> str:
        """Our name for the port of a child."""
        if port in part.ports:
            return part.ports[port]
        if part.row is None:
            return self.port_name(self.levels[id(entity)].ports, port, channel)
        if port in part.row.ports:
            return part.row.ports[port].ours
        return part.row.parameters[port].ours if port in part.row.parameters else snake(port)


def is_composite(entity: Entity) -> bool:
    """Whether it contains a graph."""
    return kind(entity) in COMPOSITES or (
        bool(entity.entities)
        and counterpart_of(entity.java) is None
        and not entity.java.startswith("ptolemy.actor.lib.hoc")
    )


def _with_director(body: dict[str, Any], found: dict[str, Any]) -> dict[str, Any]:
    """The body with its director in the usual position."""
    said = {key: value for key, value in found.items() if key != "stop"}
    front: dict[str, Any] = {key: body[key] for key in ("doc", "inputs", "outputs") if key in body}
    return {**front, "director": Flow(said), **{key: value for key, value in body.items() if key not in front}}


def _same(one: object, other: object) -> bool:
    return type(one) is type(other) and one == other
