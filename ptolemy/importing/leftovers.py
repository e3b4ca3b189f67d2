"""Reports the parts of a composite that have no counterpart."""

from __future__ import annotations

from collections.abc import Collection

from .entities import Property, is_aside, is_decoration, is_layout, is_variable
from .notes import Notes
from .parts import Part
from .tables import why_not


def about_ports(part: Part, notes: Notes) -> None:
    """Report settings of ports that have no counterpart."""
    for port in part.entity.ports.values():
        for said in port.properties.values():
            known = said.name in ("input", "output", "multiport") or is_aside(said)
            known = known or (said.name == "defaultValue" and part.entity.kind == "Expression")
            if not known and said.value:
                notes.note(f"{part.told(port.name)}.{said.name} = {said.value!r} has no counterpart")


def about_links(part: Part, notes: Notes) -> None:
    """Report linked ports that our actors do not have."""
    if part.row is not None and not part.row.is_view and not part.is_idle:
        for name in part.linked:
            if part.face(name) is None:
                notes.note(f"{part.told(name)} has no counterpart; its wires are left out")


def about_properties(part: Part, notes: Notes, known: Collection[str] = ()) -> None:
    """Report attributes that have no counterpart."""
    for name, said in part.entity.properties.items():
        about_property(said, part.told(name), notes, known)


def about_property(said: Property, path: str, notes: Notes, known: Collection[str] = ()) -> None:
    """Report an attribute that has no counterpart."""
    is_known = said.name in known or is_aside(said) or is_variable(said) or said.kind.endswith("Director")
    if not is_known and (said.value is not None or said.java):
        notes.note(f"{path}, a {said.kind or 'property'}, has no counterpart")


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
