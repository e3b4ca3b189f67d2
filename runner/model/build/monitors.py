"""Monitors of a model: their properties, and the ports that these use."""

from __future__ import annotations

from epicycle.actors import FaultError, Quantity, UnitError, parse_unit
from epicycle.aspects import Reading

from ..graph.model_graph import ModelGraph
from ..graph.outputs import Monitor, Part
from ..language.metrics import WatchText
from ..temporal import Condition, Property, PropertyError, Requirement, Sends, Spread, leaves, property_of, spread_of
from ..text.document import Scalar
from ..text.limits import RAISE_IT
from ..text.patterns import PathIndex, PatternError, TooManyError
from ..text.problems import POISON, Poison, Position, Problems
from ..text.reading import within
from .looks import Looks
from .paths import Paths

_MOST = 2_000_000  # characters of a property that is written out for every place of a pattern


def monitor_of(graph: ModelGraph, text: WatchText, requirement: Requirement, problems: Problems) -> Monitor | Poison:
    """The monitor of a requirement."""
    source, place = requirement.property, text.place("property")
    looks = Looks(Paths(graph), text.name, "", problems, called="monitor")
    before = len(problems)
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
            try:
                size = _size(tree, requirement.unit)
            except FaultError as error:
                looks.blame(error, text.place("unit"))
            if len(problems) > before:  # the others would say the same
                return POISON
    except PropertyError as error:
        # The part that is wrong, if the text is in the file unchanged.
        whole = within(place, source)
        is_written = whole.length == len(source) and "\n" not in source
        return looks.blame(error, Scalar(source, source, True, whole) if is_written else whole)
    if len(problems) > before:
        return POISON
    return Monitor(text.name, requirement, parts, spread is not None and spread.any, size)


def _selected(looks: Looks, spread: Spread, place: Position) -> list[str]:
    """The actors and composites that a pattern selects; if there are none, the output ports."""
    what, pattern = f"monitor {looks.name}", spread.pattern
    outputs = [path for path in looks.ports if looks.graph.direction(path) == "output"]
    holders = looks.paths.holders
    try:
        found = holders.select(pattern) or PathIndex(outputs, looks.graph.limits).select(pattern)
    except PatternError as error:
        looks.problems.add(f"{what}: {pattern!r} is not a pattern: {error}", within(place, pattern))
        return []
    except TooManyError as error:
        looks.problems.stop(f"{what}: {error}", place, RAISE_IT)
    if not found and not looks.graph.excuses(f"{pattern}.*"):
        near = holders.near(pattern)
        looks.problems.add(f"{what}: {pattern!r} matches no actor, composite or output port", place, near=near)
    return found


def _size(tree: Property, unit: str) -> float:
    """The size of the unit of a robustness, in what the margins are in; raises ``FaultError`` if it does not fit.

    Where numbers have units, all counts in SI; elsewhere, the unit is that of what the ports send.
    """
    conditions = [each for each in leaves(tree) if isinstance(each, Condition)]
    if not unit or not any(each.units for each in conditions):
        return 1.0
    try:
        size = parse_unit(unit).factor
    except UnitError as error:
        advice = "write the unit in which its robustness is to be given, such as m"
        raise FaultError(f"unit: {error}", help=[advice]) from None
    for condition in conditions:
        for other in condition.compared:
            try:
                Quantity(1.0, other).to(unit)
            except UnitError:
                problem = f"its robustness cannot be given in {unit!r}: {condition.source!r} compares in {other!r}"
                advice = f"write 'unit: {other}', or, where units differ, a monitor for each, or no unit"
                raise FaultError(problem, help=[advice]) from None
    return size


def _readings(looks: Looks, condition: Condition | Sends, place: Position) -> list[Reading]:
    """What a condition reads."""
    if isinstance(condition, Sends):
        port, fields = looks.reading("property", condition.port, within(place, condition.port))
        if fields:
            message = f"monitor {looks.name}: 'sends {condition.port}' names a part of what {port} sends"
            looks.problems.add(message, place, f"write 'sends {port}'")
        return [(port, ())]
    found = []
    for reference in condition.references:
        found.append(looks.reading("property", reference, within(place, reference)))
    return found
