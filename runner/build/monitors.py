"""Monitors of a model: their properties, and the ports that these use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from epicycle.actors import ParameterError, Quantity, UnitError, declared_parameters, did_you_mean, parse_unit
from epicycle.aspects import Reading

from ..graph import Monitor, Part
from ..temporal import Condition, Property, PropertyError, Requirement, Sends, Spread, leaves, property_of, spread_of
from ..text import RAISE_IT, PathIndex, PatternError, Position, Problems, Text, TooManyError, within
from .draft import Draft
from .looks import Looks
from .paths import Paths

_MOST = 2_000_000  # characters of a property that is written out for every place of a pattern


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
    looks = Looks(draft, Paths(draft), name, "", problems, called="monitor")
    try:
        spread = spread_of(source)
        paths = [""] if spread is None else _selected(looks, spread, place)
        if spread is not None and len(paths) * len(spread.body) > _MOST:
            message = f"for {len(paths):,} places, the property is longer than {_MOST:,} characters"
            raise PropertyError(message, spread.offset, len(spread.pattern))
        parts, size = [], 1.0
        for path in paths:
            tree = property_of(source if spread is None else spread.of(path))
            parts.append(Part(path, tree, [_readings(looks, each, place) for each in leaves(tree)]))
            found = _size(tree, requirement.unit)
            if isinstance(found, tuple):
                problems.add(f"{what}: {found[0]}", places.get("unit", at), found[1])
            else:
                size = found
            if len(problems) > before:  # the others would say the same
                return None
    except PropertyError as error:
        wrong = source[error.offset : error.offset + error.length]
        # The part that is wrong, if the text is in the file unchanged.
        whole = within(Text(source, place), source)
        part = whole if whole.length != len(source) or "\n" in source else _part(whole, error.offset, len(wrong))
        problems.add(f"{what}: {error}", part, *([error.hint] if error.hint else []))
        return None
    return (
        Monitor(name, requirement, parts, spread is not None and spread.any, size) if len(problems) == before else None
    )


def _selected(looks: Looks, spread: Spread, place: Position) -> list[str]:
    """The actors and composites that a pattern selects; if there are none, the output ports."""
    what, pattern = f"monitor {looks.name}", spread.pattern
    outputs = [path for path in looks.ports if looks.graph.direction(path) == "output"]
    holders = looks.paths.holders
    try:
        found = holders.select(pattern) or PathIndex(outputs, looks.graph.limits).select(pattern)
    except PatternError as error:
        looks.problems.add(f"{what}: {pattern!r} is not a pattern: {error}", within(Text("", place), pattern))
        return []
    except TooManyError as error:
        looks.problems.stop(f"{what}: {error}", place, RAISE_IT)
    if not found and not looks.draft.excuses(f"{pattern}.*"):
        near = holders.did_you_mean(pattern)
        looks.problems.add(f"{what}: {pattern!r} matches no actor, composite or output port{near}", place)
    return found


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
