"""Monitors of a model: their properties, and the ports that these use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from epicycle.actors import ParameterError, Quantity, UnitError, declared_parameters, did_you_mean, parse_unit
from epicycle.aspects import Reading

from ..graph import Monitor
from ..temporal import Condition, Property, PropertyError, Requirement, Sends, leaves, property_of
from ..text import Position, Problems, Text, within
from .draft import Draft
from .looks import Looks
from .paths import Paths


def monitor_of(
    draft: Draft,
    name: str,
    values: Mapping[str, object],
    places: Mapping[str, Position],
    at: Position,
    problems: Problems,
) -> Monitor | None:
    """A monitor with these values of a ``Requirement``; None if something is wrong with it.

    ``places`` are the positions of the values, ``at`` that of the monitor.
    """
    what = f"monitor {name}"
    before = len(problems)
    said: dict[str, Any] = {}
    declared = declared_parameters(Requirement)
    for key, value in values.items():
        if key not in declared:
            problems.add(f"{what}: there is no option {key!r}{did_you_mean(key, declared)}", at)
            continue
        try:
            said[key] = declared[key].convert(value)
        except ParameterError as error:
            problems.add(f"{what}, {key}: {error}", places.get(key, at))
    if len(problems) > before:
        return None
    requirement = Requirement(**said)
    source = requirement.property
    place = places.get("property", at)
    try:
        found = property_of(source)
    except PropertyError as error:
        wrong = source[error.offset : error.offset + error.length]
        # The part that is wrong, if the text is in the file unchanged.
        whole = within(Text(source, place), source)
        part = whole if whole.length != len(source) or "\n" in source else _part(whole, error.offset, len(wrong))
        problems.add(f"{what}: {error}", part, *([error.hint] if error.hint else []))
        return None
    looks = Looks(draft, Paths(draft), name, "", problems, called="monitor")
    readings = [_readings(looks, each, place) for each in leaves(found)]
    size = _size(found, requirement.unit)
    if isinstance(size, tuple):
        problems.add(f"{what}: {size[0]}", places.get("unit", at), size[1])
    return (
        Monitor(name, requirement, found, readings, size)
        if isinstance(size, float) and len(problems) == before
        else None
    )


def _size(tree: Property, unit: str) -> float | tuple[str, str]:
    """The size of the unit of a robustness, in what the margins are in; or why it does not fit, and what to do.

    Where numbers have units, all counts in SI; elsewhere, the unit is that of what the ports send.
    """
    conditions = [each for each in leaves(tree) if isinstance(each, Condition)]
    if not unit or not any(each.units for each in conditions):
        return 1.0
    try:
        size = parse_unit(unit).factor
    except UnitError as error:
        return f"unit: {error}", "write the unit in which its robustness is to be given, such as m"
    for condition in conditions:
        for other in condition.compared:
            try:
                Quantity(1.0, other).to(unit)
            except UnitError:
                problem = f"its robustness cannot be given in {unit!r}: {condition.source!r} compares in {other!r}"
                return problem, f"write 'unit: {other}', or, where units differ, a monitor for each, or no unit"
    return size


def _part(whole: Position, offset: int, length: int) -> Position:
    return replace(whole, column=whole.column + offset, length=length)


def _readings(looks: Looks, condition: Condition | Sends, place: Position) -> list[Reading]:
    """What a condition reads."""
    if isinstance(condition, Sends):
        port, fields = looks.reading("property", condition.port, within(Text("", place), condition.port))
        if fields:
            message = f"monitor {looks.name}: 'sends {condition.port}' names a part of what {port} sends"
            looks.problems.add(message, place, f"write 'sends {port}'")
        return [(port, ())]
    found = []
    for reference in condition.references:
        found.append(looks.reading("property", reference, within(Text("", place), reference)))
    return found
