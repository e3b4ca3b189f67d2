"""Actors that never fire: with an input that they need and nothing that sends to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from epicycle.actors import InputPort, declared_ports

from ..catalogue import built_in
from .entities import Entity
from .wires import Counting

if TYPE_CHECKING:
    from .composites import Conversion

MAX_ROUNDS = 200


def leave_out_idle(conversion: Conversion) -> None:
    """Leave out what can never fire, and then what nothing is left for."""
    for _ in range(MAX_ROUNDS):
        idle = [(composite, each) for composite in conversion.model.everything() for each in _idle(conversion, composite)]
        if not idle:
            return
        for composite, (child, port) in idle:
            conversion.idle.add(id(child))
            path = conversion.path_of(composite, child)
            conversion.notes.note(f"{path} is left out: it never fires, for nothing sends to its {port}")


def _idle(conversion: Conversion, composite: Entity) -> list[tuple[Entity, str]]:
    found = []
    for child in composite.entities.values():
        row = conversion.rows.get(id(child))
        if row is None or row.is_view or id(child) in conversion.idle:
            continue
        kind = built_in().actors.get(row.type)
        if kind is None:
            continue
        if row.needs and not any(conversion.is_fed(composite, child, name) for name in row.needs):
            found.append((child, " and ".join(sorted(row.needs))))
            continue
        declared = declared_ports(kind)
        for name, said in row.ports.items():
            port = declared.get(said.ours)
            if isinstance(port, InputPort) and port.required and not conversion.is_fed(composite, child, name):
                found.append((child, name))
                break
    return found


def is_fed(conversion: Conversion, composite: Entity, child: Entity, port: str) -> bool:
    """Whether anything sends to a port."""
    path = f"{child.name}.{port}"
    for net in conversion.nets_of(composite):
        if any(each.actor == child.name and each.port == port for each in net.ends):
            if Counting(conversion).senders(composite, net.ends):
                return True
    return conversion.triggers.get((id(composite), path), "") != ""
