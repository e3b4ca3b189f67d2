"""Converts composites to composite classes of the model language: parts, wires, directors and parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from epicycle.actors import Actor as OwnActor
from epicycle.runner.model.catalogue import installed

from .actors import Actor
from .aspects import aspects_of
from .document import Entity, Property, director_of, is_aside, is_layout, is_text, is_variable, version_of
from .limits import Notes
from .machines import Machine
from .nets import Reach, connections_of, kinds_at, leave_out_idle, wire
from .parts import Part, about_ports, about_properties, about_unknown, is_watched, parts_of
from .scope import Scope
from .syntax import ExpressionError
from .table import WORDS, why_not
from .translation import Code
from .variables import Variables
from .writing import Flow, Lines, Names, plain, seconds


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
        leave_out_idle(self.root, notes)
        self._reach = Reach()

    # -- composites -----------------------------------------------------------------------------------------------

    def body(self, part: Part, director: Flow | None = None) -> dict[str, Any]:
        """The sections of a composite, or of the model."""
        entity, parameters = part.entity, Names(in_expressions=True)
        changing = self._variables.names_of(part)
        for name, said in entity.properties.items():
            if is_variable(said) and not is_aside(said) and name not in changing and _stays(part, name, said):
                part.own_names[name] = parameters.of(name)
        for name in [*entity.ports, *(name for name, child in part.parts.items() if child.is_border)]:
            part.names.fresh(part.ports.of(name))  # which no actor may have
        for port, ours in part.ports.renamed().items():
            self.notes.note(f"{part.told(port)} is renamed {ours}")
        actors: dict[str, Flow] = {}
        for child in part.parts.values():
            if child.is_border:
                continue
            about_ports(child, self.notes)
            child.name = "" if child.role == "aspect" else part.names.of(child.entity.name)
            child.entry = self._entry(child)
            if child.entry is not None:
                actors[child.name] = child.with_priority(child.entry, self.notes)
                if child.name != child.entity.name:
                    self.notes.note(f"{child.path} is renamed {child.name}")
        connections = connections_of(part, self.notes)
        following = self._variables.write(part, actors, connections)
        inputs, outputs = _borders(part)
        about_properties(entity, part.path, self.notes)
        found = {
            "inputs": inputs, "outputs": outputs, "director": director if actors else None, "actors": actors,
            "connections": Lines(connections),
            "aspects": {**aspects_of(part, self.model_entry, self.notes), **following},
        }  # fmt: skip
        return {key: value for key, value in found.items() if value or (key == "director" and value is not None)}

    def parameters(self, part: Part) -> dict[str, Any]:
        """The parameters that are used inside."""
        return Flow({ours: plain(part.scope(name)) for name, ours in part.own_names.items() if name in part.used})

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
        director = director_of(part.entity)
        found = None if director is None else said_of(director, part, self.notes)
        if found is not None:
            found.pop("stop", None)
        return self._instance_of(part, found)

    def _instance_of(self, part: Part, director: Flow | None = None) -> Flow:
        part.at = f"{part.around.at}{part.name}."
        return self._instance(part, self.body(part, director), self.parameters(part))

    def _instance(self, part: Part, body: dict[str, Any], values: dict[str, Any]) -> Flow:
        """The entry of an instance; reuses an existing class with the same content."""
        # The type of a parameter's default decides which values it takes.
        key = json.dumps([body, sorted((name, type(value).__name__) for name, value in values.items())], default=str)
        if key not in self._known:
            name = self._known[key] = self._class_names.fresh(
                part.entity.of_class.rpartition(".")[2] or part.entity.name
            )
            self.classes[name] = ({"parameters": values} if values else {}) | body
        name = self._known[key]
        default = self.classes[name].get("parameters", {})
        return Flow({"type": name, **{each: value for each, value in values.items() if default[each] != value}})

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
        actor.convert()
        part.own_ports = actor.ports
        return Flow({"type": row.type, **actor.values})

    def _machine(self, part: Part) -> Flow:
        """A state machine as an actor, a modal model as a composite with modes."""
        part.at = f"{part.around.at}{part.name}."
        machine = Machine(part, self.notes, self._version)
        found = machine.written(self._refinement)
        if part.entity is part.controller and part.around.role != "machine":
            part.unnamed = machine.unnamed()
            return Flow({"type": "StateMachine", **found})
        return self._instance(part, machine.head() | found, {})

    def _refinement(self, part: Part, mode: str) -> Flow:
        """The refinement of a mode: a composite, possibly with its own modes."""
        part.name, part.ports = mode, part.around.ports
        if part.role == "machine":
            return self._machine(part)
        if (director := director_of(part.entity)) is not None:
            for key in said_of(director, part, self.notes):
                self.notes.note(f"{part.path}: {key} of the director of a refinement has no counterpart")
        return self._instance_of(part)


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
    return found


def said_of(director: Property, part: Part, notes: Notes) -> Flow:
    """The settings of a director, including its stop time in s."""
    found, path = Flow(), part.told(director.name)
    if director.kind in WORDS["directors inside"] and part.outer is not None:
        notes.note(f"{path}, a {director.kind}: the actors inside fire by the rules of DE")
    elif director.kind not in WORDS["directors like DE"]:
        notes.error(f"{path} is a {director.java}, which has no counterpart{why_not(director.java)}")
    scope, clock = Scope(director, part.scope), director.properties.get("localClock", Property(""))
    said = [(each, f"{path}.{name}", scope) for name, each in director.properties.items() if each is not clock]
    inner = Scope(clock, scope)
    said += [(each, f"{path}.localClock.{name}", inner) for name, each in clock.properties.items()]
    for each, where, here in said:
        if is_layout(each) or each.name in WORDS["settings without effect"] or not (each.value or "").strip():
            continue
        try:
            if not _note(each.name, here.value_of(each), found):
                notes.note(f"{where} = {each.value!r} has no counterpart")
            elif isinstance(here.meaning_of(each), Code):
                notes.note(f"{where} = {each.value!r} keeps its initial value")
        except (ExpressionError, ValueError, TypeError) as error:
            notes.note(f"{where} = {each.value!r}: {error}")
    return found


def _note(name: str, value: Any, found: Flow) -> bool:
    """Store a parameter of a director; return whether it has a counterpart, or needs none."""
    match name:
        case "startTime":
            found |= {"start": seconds(value)} if value else {}
        case "stopTime":
            found |= {} if value is None or value > 1e300 else {"stop": seconds(value)}
        case "clockDrift" | "clockRate":
            found |= {} if value == 1.0 else {"drift": plain(value)}
        case _:
            return not value
    return True
