"""Finds actors that never fire because nothing sends to an input that they need."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from epicycle.actors import InputPort, declared_ports

from ..dialect import known_types
from .budget import spend
from .counterpart import Counterpart
from .directors import director_of, fires_whole
from .entities import Entity
from .parts import Converting
from .wires import Counting

MAX_ROUNDS = 200


def leave_out_idle(conversion: Converting) -> None:
    """Leave out the actors that can never fire, and those that then never receive anything."""
    inputs: dict[int, list[str]] = {}
    for _ in range(MAX_ROUNDS):
        counting = Counting(conversion)
        composites = list(conversion.model.everything())
        idle = [(each, found) for each in composites for found in _idle(conversion, each, counting, inputs)]
        if not idle:
            return
        for composite, (child, port) in idle:
            conversion.idle.add(id(child))
            path = conversion.path_of(composite, child)
            conversion.notes.note(f"{path} is left out: it never fires because nothing sends to its {port}")


def _idle(
    conversion: Converting, composite: Entity, counting: Counting, inputs: dict[int, list[str]]
) -> list[tuple[Entity, str]]:
    found = []
    spend(len(composite.entities))
    for child in composite.entities.values():
        row = conversion.rows.get(id(child))
        if row is None or row.is_view or id(child) in conversion.idle:
            continue
        kind = known_types().actors.get(row.type)
        if kind is None:
            continue
        if row.needs and not any(is_fed(conversion, composite, child, name, counting) for name in row.needs):
            found.append((child, " and ".join(sorted(row.needs))))
            continue
        if id(child) not in inputs:
            inputs[id(child)] = _inputs(conversion, child, row)
        here = inputs[id(child)]
        if not kind.is_source and not any(is_fed(conversion, composite, child, name, counting) for name in here):
            found.append((child, here[0] if here else "inputs"))
            continue
        waits_for = next(
            (
                name
                for name in _waits_for(composite, child, row)
                if not is_fed(conversion, composite, child, name, counting)
            ),
            None,
        )
        if waits_for is not None:
            found.append((child, waits_for))
            continue
        declared = declared_ports(kind)
        several = Counter(said.ours for said in row.ports.values())
        for name, said in row.ports.items():
            port = declared.get(said.ours) if several[said.ours] == 1 else None
            if (
                isinstance(port, InputPort)
                and port.required
                and not is_fed(conversion, composite, child, name, counting)
            ):
                found.append((child, name))
                break
    return found


def _waits_for(composite: Entity, child: Entity, row: Counterpart) -> Iterator[str]:
    """The linked inputs added in the model to an actor that waits for a token at each of them."""
    if row.type not in ("Expression", "RecordAssembler") or row.fixed.get("apart"):
        return
    for name, port in child.ports.items():
        has_value = "defaultValue" in port.properties or name in child.properties
        if (
            name not in row.ports
            and port.flag("input")
            and not has_value
            and composite.links.get(f"{child.name}.{name}")
        ):
            yield name


def _inputs(conversion: Converting, child: Entity, row: Counterpart) -> list[str]:
    """All inputs of an actor, including those of parameters."""
    names = dict.fromkeys([*row.ports, *child.ports, *row.parameters, *child.properties])
    faces = {name: conversion.face(child, name) for name in names}
    return [name for name, face in faces.items() if face is not None and face.direction == "input"]


def is_fed(conversion: Converting, composite: Entity, child: Entity, port: str, counting: Counting) -> bool:
    """Whether anything sends to a port."""
    path = f"{child.name}.{port}"
    if any(counting.senders(composite, net.ends) for net in conversion.nets_at(composite, child.name, port)):
        return True
    return conversion.triggers.get((id(composite), path), "") != ""


def iterations(conversion: Converting) -> dict[tuple[int, str], str]:
    """The inputs of composites that start iterations of their directors, by the trigger ports that fire in each."""
    found = {}
    for composite in conversion.model.everything():
        director = director_of(composite) if composite is not conversion.model else None
        if director is None or not fires_whole(director):
            continue
        inputs = [name for name, port in composite.ports.items() if port.flag("input") and composite.links.get(name)]
        for child in composite.entities.values() if inputs else ():
            row = conversion.rows.get(id(child))
            if row is not None and "trigger" in row.ports and not composite.links.get(f"{child.name}.trigger"):
                found[id(composite), f"{child.name}.trigger"] = inputs[0]
    return found
