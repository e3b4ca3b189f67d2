"""Converts composites to composite classes of the model language: parts, wires, directors and parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from epicycle.actors import Actor as OwnActor
from epicycle.runner.catalogue import installed

from .actors import Actor
from .aspects import aspects_of
from .connections import connections_of
from .directors import said_of
from .entities import Entity, Property, director_of, is_aside, is_text, is_variable, version_of
from .leftovers import about_links, about_ports, about_properties, about_unknown, is_watched
from .machines import Machine
from .names import Names
from .nets import wire
from .notes import Notes
from .parts import Part, parts_of
from .reach import Reach, kinds_at, leave_out_idle, trigger
from .special import SPECIAL
from .syntax import ExpressionError
from .variables import Variables
from .writing import Flow, plain


class Conversion:
    """Goes through a model and writes its sections; holds what these share."""

    def __init__(self, model: Entity, notes: Notes, own: Mapping[str, type[OwnActor]]) -> None:
        self.notes = notes
        self.root = parts_of(model, own)
        self.classes: dict[str, dict[str, Any]] = {}
        self._version = version_of(model)
        self._known: dict[str, str] = {}  # body: its class
        known = installed()
        self._class_names = Names([*known.actors, *known.aspects, *own])
        self._variables = Variables(self.root, notes)
        wire(self.root, notes)
        trigger(self.root)
        leave_out_idle(self.root, notes)
        self._reach = Reach()

    # -- composites -----------------------------------------------------------------------------------------------

    def body(self, part: Part) -> dict[str, Any]:
        """The sections of a composite, or of the model."""
        entity, parameters = part.entity, Names(in_expressions=True)
        changing = self._variables.names_of(part)
        for name, said in entity.properties.items():
            if is_variable(said) and not is_aside(said) and name not in changing and _stays(part, name, said):
                part.own_names[name] = parameters.of(name)
        for name in [*entity.ports, *(name for name, child in part.parts.items() if child.is_border)]:
            part.names.take(part.ports.of(name))
        for port, ours in part.ports.renamed().items():
            self.notes.note(f"{part.told(port)} is renamed {ours}")
        actors: dict[str, Flow] = {}
        for child in part.parts.values():
            if child.is_border:
                continue
            about_ports(child, self.notes)
            about_links(child, self.notes)
            child.name = "" if child.role == "aspect" else part.names.of(child.entity.name)
            child.entry = self._entry(child)
            if child.entry is not None:
                actors[child.name] = child.entry
                if child.name != child.entity.name:
                    self.notes.note(f"{child.path} is renamed {child.name}")
        connections = connections_of(part, self._reach, self.notes)
        following = self._variables.write(part, actors, connections)
        inputs, outputs = _borders(part)
        found = {
            "doc": " ".join(entity.doc.split()), "inputs": inputs, "outputs": outputs, "actors": actors,
            "connections": connections + part.added[2],
            "aspects": {**aspects_of(part, self.model_entry, self.notes), **following},
        }  # fmt: skip
        about_properties(part, self.notes)
        return {key: value for key, value in found.items() if value}

    def parameters(self, part: Part) -> dict[str, Any]:
        """The parameters that are used inside."""
        return {ours: plain(part.scope(name)) for name, ours in part.own_names.items() if name in part.used}

    def _entry(self, part: Part) -> Flow | None:
        """What a part becomes; None if it is left out."""
        if part.role == "aspect" or part.is_idle:
            return None
        if part.role == "machine":
            return self._machine(part)
        if part.role == "composite":
            return self.model_entry(part)
        if part.row is None:
            about_unknown(part, self.notes)
            return None
        if part.row.is_view and not is_watched(part):
            self.notes.views += 1
            return None
        return self._actor(part)

    def model_entry(self, part: Part) -> Flow:
        """A composite as an instance of a composite class."""
        part.at = f"{part.around.at}{part.name}."
        body = self.body(part)
        values = self.parameters(part)
        if (director := director_of(part.entity)) is not None:
            found = said_of(director, part.told(director.name), part.scope, self.notes)
            if body.get("actors"):
                found.pop("stop", None)
                front = {key: body.pop(key) for key in ("doc", "inputs", "outputs") if key in body}
                body = front | {"director": Flow(found)} | body
        entry = self.instance(part, body, values)
        part.give_priority(entry, self.notes)
        return entry

    def instance(self, part: Part, body: dict[str, Any], values: dict[str, Any]) -> Flow:
        """The entry of an instance; reuses an existing class with the same content."""
        # The type of a parameter's default decides which values it takes.
        key = json.dumps([body, sorted((name, type(value).__name__) for name, value in values.items())], default=str)
        if key not in self._known:
            name = self._known[key] = self._class_names.fresh(
                part.entity.of_class.rpartition(".")[2] or part.entity.name
            )
            ordered = {"doc": body.pop("doc")} if "doc" in body else {}
            self.classes[name] = {**ordered, **({"parameters": Flow(values)} if values else {}), **body}
        name = self._known[key]
        default = self.classes[name].get("parameters", {})
        changed = {each: value for each, value in values.items() if not _same(default[each], value)}
        return Flow({"type": name, **changed})

    def inside(self, name: str, body: dict[str, Any]) -> dict[str, Any]:
        """The body of a model with one composite, which contains everything."""
        kind = self._class_names.fresh(name)
        self.classes[kind] = body
        return {"actors": {kind: Flow({"type": kind})}}

    # -- actors and state machines -----------------------------------------------------------------------------------

    def _actor(self, part: Part) -> Flow:
        around, row = part.around, part.row
        assert row is not None
        actor = Actor(part, row, self.notes, self._variables)
        for name in (*row.ports, *part.entity.ports, *part.entity.properties):
            face = part.face(name)
            is_unfed = face is not None and face.direction == "input" and not self._reach.feeds(part, name)
            actor.widths[name] = 0 if is_unfed else around.widths.get(f"{part.entity.name}.{name}", 0)
        actor.kinds = kinds_at(part, row)
        actor.convert(SPECIAL)
        part.own_ports = actor.ports
        for port, changing in actor.reads.items():
            self._variables.lead_to(changing, around, f"{part.name}.{port}")
        if row.type == "SetVariable":
            self._variables.lead_from(part, has_value="value" in actor.values)
        return Flow({"type": row.type, **actor.values})

    def _machine(self, part: Part) -> Flow:
        """A state machine as an actor, a modal model as a composite with modes."""
        part.at = f"{part.around.at}{part.name}."
        machine = Machine(part, self.notes, self._version)
        for child, name in machine.handed():
            self._variables.add_port(child, name)
        machine.tell_rest()
        found = machine.written(self._refinement)
        is_refinement = part.around.role == "machine"
        if part.entity is part.controller and not is_refinement:
            entry = Flow({"type": "StateMachine", **found})
            part.unnamed = machine.words.unnamed()
        else:
            entry = self.instance(part, machine.head() | found, {})
        if not is_refinement:
            part.give_priority(entry, self.notes)
        return entry

    def _refinement(self, part: Part, mode: str) -> Flow:
        """The refinement of a mode: a composite, possibly with its own modes."""
        part.name, part.ports = mode, part.around.ports
        if part.role == "machine":
            return self._machine(part)
        part.at = f"{part.around.at}{mode}."
        body = self.body(part)
        if (director := director_of(part.entity)) is not None:
            for key in said_of(director, part.told(director.name), part.scope, self.notes):
                self.notes.note(f"{part.path}: {key} of the director of a refinement has no counterpart")
        return self.instance(part, body, self.parameters(part))


def _stays(part: Part, name: str, said: Property) -> bool:
    """Whether a parameter can remain one."""
    try:
        value = part.scope(name)
        plain(value)
    except (ExpressionError, KeyError, ValueError):
        return False
    return value is not None and (not isinstance(value, str) or is_text(said))


def _borders(part: Part) -> tuple[list[str], list[str]]:
    """The inputs and outputs of a composite."""
    found: tuple[list[str], list[str]] = ([], [])
    for port in part.entity.ports:
        face = part.face(port)
        for channel in range(part.count(port) if face is not None else 0):
            found[face is not None and face.direction == "output"].append(part.port_name(port, channel))
    for name, child in part.parts.items():
        if child.is_border:
            found[child.role == "response"].append(part.ports.of(name))
    found[0].extend(part.ports.of(name) for name in part.variable_ports if name not in part.entity.ports)
    found[0].extend(part.added[0])
    found[1].extend(part.added[1])
    return found


def _same(one: object, other: object) -> bool:
    return type(one) is type(other) and one == other
