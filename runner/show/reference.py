"""The reference of actors and aspects, as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import attrgetter

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from epicycle.actors import Configurable, bounds_text

from ..model.build.model import Model
from ..model.catalogue.reference import (
    ParameterReference,
    PortReference,
    TypeReference,
    as_written,
    describe,
    parts_of,
    shown,
    topic_order,
)
from ..support.printing import columns


def described(types: Mapping[str, type[Configurable]]) -> list[TypeReference]:
    """The declarations of types, topic by topic."""
    found = [describe(name, cls) for name, cls in types.items()]
    return sorted(found, key=topic_order)


def parts_described(types: Iterable[type[Configurable]]) -> dict[str, list[TypeReference]]:
    """The declarations of parts that parameters of these types take, by the base class of the parts."""
    return {
        base.__name__: [describe(name, cls) for name, cls in known.items()] for base, known in parts_of(types).items()
    }


def by_group(references: Iterable[TypeReference]) -> Iterator[tuple[tuple[str, str], Iterator[TypeReference]]]:
    """The topics with their descriptions, and the types in each."""
    return groupby(references, key=attrgetter("group", "about_group"))


# -- for a terminal -------------------------------------------------------------------------------------------------


def overview(groups: Mapping[tuple[str, str], Mapping[str, str]]) -> Group:
    """One line for each name with what it is, under the heading of its group and what this is."""
    width = max((len(name) for members in groups.values() for name in members), default=0)
    blocks: list[RenderableType] = []
    for (group, about), members in groups.items():
        blocks += [Text(""), Text.assemble((group, "bold"), f"  {about}" if about else "")]
        table = Table(box=None, show_header=False, pad_edge=False)
        table.add_column(width=width + 2, no_wrap=True)
        table.add_column()
        for name, what in members.items():
            table.add_row(Text(f"  {name}"), Text(what))
        blocks.append(table)
    return Group(*blocks[1:])


_FEW = 4  # parts of a kind that are described with a type that takes them


def detail(reference: TypeReference, parts: Mapping[str, Sequence[TypeReference]]) -> Group:
    """Everything declared by one type, and by the parts that its parameters take."""
    head = Text.assemble((reference.name, "bold"), f"  {reference.kind}, {reference.group}")
    blocks: list[RenderableType] = [head, *_about(reference)]
    for base, known in parts.items():
        if len(known) > _FEW:
            names = ", ".join(each.name for each in known)
            told = f": one of {names}; 'epicycle describe NAME' describes one"
            blocks += [Text(""), Text.assemble((base, "bold"), told)]
            continue
        for each in known:
            blocks += [Text(""), Text.assemble((each.name, "bold"), f"  {base.lower()}")]
            blocks.append(Padding(Group(*_about(each)), (0, 0, 0, 2)))
    return Group(*blocks)


def _about(reference: TypeReference) -> list[RenderableType]:
    blocks: list[RenderableType] = [Text(""), Text(reference.doc)]
    for heading, rows in sections(reference):
        blocks += [Text(""), columns(heading, rows, whole=("input port", "output port", "parameter", "unit"))]
    return [*blocks, *(Text(f"\n{line}") for line in facts(reference))]


def weaving(model: Model) -> RenderableType:
    """The aspects attached to each port and actor of a model, in the order in which a token or a firing meets them."""
    if not model.aspects:
        return Text(f"{model.name} has no aspects")
    rows = [
        ("" if place else path, str(place + 1) if len(woven) > 1 else "", *about)
        for path, woven in aspects_at(model).items()
        for place, about in enumerate(woven)
    ]
    idle = [each for each in model.aspects if not each.places]
    table = columns(("at", "", "aspect", "type", "parameters"), rows, whole=("at",))
    return Group(table, *(Text(f"{each.name} ({each.kind}) is not attached to anything") for each in idle))


def aspects_at(model: Model) -> dict[str, list[tuple[str, str, str]]]:
    """For each place with aspects, their names, types and set parameters, the outermost first."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    for woven in model.aspects:
        written = as_written(woven.aspect)
        given = {name: value for name, value in written.items() if name != "type"} if isinstance(written, dict) else {}
        for path in woven.places:
            here = {**given, **({} if woven.model is None else woven.model.at(path))}
            parameters = ", ".join(f"{name}: {shown(value)}" for name, value in here.items())
            found.setdefault(path, []).append((woven.name, woven.kind, parameters))
    places = dict.fromkeys((*model.graph.ports, *model.graph.actors, *found))  # any others come last
    return {path: found[path] for path in places if path in found}


# -- what is told of a type -------------------------------------------------------------------------------------------


def sections(reference: TypeReference) -> Iterator[tuple[Sequence[str], list[list[str]]]]:
    """The tables of a type that have rows: ports and parameters, with their headings."""
    for direction in ("input", "output"):
        if rows := [_port_row(port) for port in reference.ports if port.direction == direction]:
            yield (f"{direction} port", "type", "", "what it is"), rows
    if reference.parameters:
        yield ("parameter", "type", "unit", "default", "what it is"), [*map(parameter_row, reference.parameters)]


def facts(reference: TypeReference) -> list[str]:
    """Other facts about a type."""
    found = ["Its parameters determine further ports."] if reference.has_own_ports else []
    if reference.stands_at:
        where = "actors" if "actor" in reference.stands_at else f"{' and '.join(reference.stands_at)} ports"
        found.append(f"Attaches to {where}{', and to parameters' if reference.alters_parameters else ''}.")
    if reference.events:
        found.append(f"Events: {', '.join(reference.events)}.")
    if reference.reports:
        figures = (name if unit == "1" else f"{name} ({unit})" for name, unit in reference.reports.items())
        found.append(f"Reports: {', '.join(figures)}.")
    return found


def _port_row(port: PortReference) -> list[str]:
    is_input, inputs = port.direction == "input", port.depends_on
    notes = {  # what is not the default
        "optional": is_input and not port.required,
        "does not trigger": is_input and not port.triggers,
        # Such a port may be part of a loop.
        f"depends at once on {' and '.join(inputs or ()) or 'no input'}": not is_input and inputs is not None,
        "any number of connections": port.multi,
    }
    return [port.name, port.type, ", ".join(note for note, holds in notes.items() if holds), port.doc]


def parameter_row(parameter: ParameterReference) -> list[str]:
    """What a table says of a parameter."""
    kind = parameter.part or parameter.type
    if parameter.choices:
        kind = " or ".join(parameter.choices)
    elif parameter.min is not None and parameter.max is not None:
        kind += f", {parameter.min:g} to {parameter.max:g}"
    else:
        kind += bounds_text(parameter.min, parameter.above, parameter.max, "{:g}".format)
    default = "required" if parameter.required else shown(parameter.default)
    return [parameter.name, kind, parameter.unit, default, parameter.doc]
