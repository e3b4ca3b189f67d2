"""Reports the parts of a composite that have no counterpart."""

from __future__ import annotations

from .actors import is_decoration, is_layout
from .aspects import is_decorated
from .entities import Entity, kind
from .parts import Converting, Level
from .reasons import why_not
from .scope import is_variable


def about_ports(conversion: Converting, entity: Entity, level: Level) -> None:
    """Report settings of ports that have no counterpart."""
    for port in entity.ports.values():
        for said in port.properties.values():
            known = said.name in ("input", "output", "multiport") or is_layout(said) or is_decoration(said)
            known = known or (said.name == "defaultValue" and kind(entity) == "Expression")
            if not known and said.value:
                path = f"{level.told(entity.name)}.{port.name}" if entity is not level.entity else level.told(port.name)
                conversion.notes.note(f"{path}.{said.name} = {said.value!r} has no counterpart")


def about_links(conversion: Converting, child: Entity, level: Level) -> None:
    """Report linked ports that our actors do not have."""
    row = conversion.rows.get(id(child))
    if row is None or row.is_view or id(child) in conversion.idle:
        return
    for name in level.linked.get(child.name, ()):
        if conversion.face(child, name) is None:
            conversion.notes.note(f"{level.told(child.name)}.{name} has no counterpart; its wires are left out")


def about_properties(conversion: Converting, level: Level) -> None:
    for name, said in level.entity.properties.items():
        if is_layout(said) or is_decoration(said) or is_variable(said) or kind(said).endswith("Director"):
            continue
        if said.value is not None or said.java:
            conversion.notes.note(f"{level.told(name)}, a {kind(said) or 'property'}, has no counterpart")


def about_unknown(conversion: Converting, child: Entity, level: Level) -> None:
    """Report an actor whose class has no row: an error, or a note if the model can do without it."""
    told = level.told(child.name)
    linked = level.linked.get(child.name, [])
    if not linked and is_layout(child):
        return
    if not linked:
        what = f"{told} is a {child.java}, which has no counterpart and is left out"
        conversion.notes.note(f"{what}: nothing is connected to it")
    elif all(_only_takes(conversion, child, port) for port in linked):
        conversion.notes.note(
            f"{told} is a {child.java}, which has no counterpart and is left out: it only receives tokens"
        )
    else:
        conversion.notes.error(f"{told} is a {child.java}, which has no counterpart{why_not(child.java)}")


def _only_takes(conversion: Converting, child: Entity, port: str) -> bool:
    face = conversion.face(child, port)
    return face is not None and face.direction == "input" and (port.startswith("input") or port in child.ports)


def is_watched(conversion: Converting, child: Entity, level: Level) -> bool:
    """Whether a view must be kept: an aspect is enabled there, or it occupies a channel of a multiport."""
    if is_decorated(child):
        return True
    relations = {
        link.relation
        for port, links in level.entity.links.items()
        if port.startswith(f"{child.name}.")
        for link in links
    }
    for port, links in level.entity.links.items():
        face = conversion.wiring._face(level.entity, port)
        is_one = face is not None and face.multi and face.direction == "output" and "." in port and len(links) > 1
        if is_one and relations & {link.relation for link in links}:
            return True
    return False
