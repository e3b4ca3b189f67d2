"""What a study varies: dimensions, each a list of levels of which a run takes one, and their form in a file."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Collection
from collections.abc import Mapping as AnyMapping
from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from typing import Any, TypeAlias

from epicycle.actors import Quantity, UnitError, parse_unit

from ..text.document import Entry, Mapping, Node, Scalar, Sequence, plain
from ..text.faults import blame
from ..text.problems import POISON, Poison, Position
from ..text.reading import NodeReader, is_empty
from .fields import QUANTITY_SCHEMA, Field, Reader, Record, Schema, node_as, ref, sound
from .sampling import (
    HYPERCUBE,
    LATIN,
    MAX_SAMPLES,
    MAX_VALUES,
    MORRIS,
    MORRIS_INDICES,
    SAMPLINGS,
    SOBOL,
    SOBOL_INDICES,
    Design,
    Point,
    latin_hypercube,
    morris_blocks,
    sobol_blocks,
)
from .settings import Setting, is_pattern, settings_in

Factor: TypeAlias = bool | int | float | str | None
Bounds: TypeAlias = tuple[float, float, str, Position]  # low, high, their unit, and where they are given
_MAX_WHOLE = 2**63  # of a column of whole numbers
_LARGEST = sys.float_info.max
KINDS: dict[str, type] = {"bool": bool, "int": int, "float": float, "text": str}

_NUMBER = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?)\s*(.*?)\s*")


@dataclass(frozen=True)
class Level:
    """What one level sets in the model and adds to it, and its values in the columns of the table."""

    settings: tuple[Setting, ...] = ()
    values: dict[str, Factor] = field(default_factory=dict)
    disturb: tuple[str, ...] = ()


class Dimension:
    """Levels by their number; ``columns`` are the table's columns that it fills, and what they hold (``KINDS``).

    ``design``, if there is one, says how the levels give sensitivity indices.
    """

    def __init__(
        self,
        name: str,
        position: Position,
        columns: dict[str, str],
        levels: list[Level],
        design: Design | None = None,
    ) -> None:
        self.name = name
        self.position = position
        self.columns = columns
        self.design = design
        self._levels = tuple(levels)
        self._places = {tuple(level.values.values()): index for index, level in enumerate(levels)}

    @property
    def size(self) -> int:
        """The number of levels."""
        return len(self._levels)

    def level(self, index: int) -> Level:
        """One level."""
        return self._levels[index]

    def find(self, values: AnyMapping[str, Factor]) -> int | None:
        """The level that puts these values into its columns; None if there is none."""
        return self._places.get(tuple(values[name] for name in self.columns))


def number_node(value: float, unit: str, position: Position) -> Scalar:
    """A number with its unit, as a file would hold it."""
    if not unit:
        return Scalar(value, repr(value), True, position)
    return Scalar(f"{value!r} {unit}", f"{value!r} {unit}", True, position)


def in_si(value: float, unit: str) -> float:
    """A number as the table holds it: in SI units, or unchanged if it has no unit."""
    return Quantity(value, unit).si if unit else value


def split_number(node: Node) -> tuple[Decimal, str] | None:
    """A number and the text of its unit; None if it is not a number."""
    if not isinstance(node, Scalar) or isinstance(node.value, bool) or node.value is None:
        return None
    found = _NUMBER.fullmatch(node.text)
    return None if found is None else (Decimal(found[1]), found[2])


def kind_of(nodes: Collection[Node]) -> str:
    """What a column filled with these values holds."""
    values = [node.value if isinstance(node, Scalar) else node for node in nodes]
    if all(isinstance(value, bool) for value in values):
        return "bool"
    numbers = [value for value in values if isinstance(value, (int, float)) and not isinstance(value, bool)]
    if len(numbers) == len(values) and all(isinstance(each, float) or abs(each) <= _LARGEST for each in numbers):
        return "int" if all(isinstance(each, int) and abs(each) < _MAX_WHOLE for each in numbers) else "float"
    if all(isinstance(value, str) and _quantity(node) is not None for value, node in zip(values, nodes, strict=True)):
        return "float"
    return "text"


def as_factor(node: Node, kind: str) -> Factor:
    """A value as a column of that kind holds it: quantities in SI units, lists as JSON."""
    if kind == "text":
        if isinstance(node, Scalar):
            return None if node.value is None else node.text
        return json.dumps(plain(node))
    assert isinstance(node, Scalar)
    if isinstance(node.value, str):
        return _quantity(node)
    value: Any = node.value
    return float(value) if kind == "float" else value


def _quantity(node: Node) -> float | None:
    """A number with its unit in SI units; None for anything else."""
    parts = split_number(node)
    if parts is None or not parts[1]:
        return None
    try:
        return Quantity(float(parts[0]), parts[1]).si
    except UnitError:
        return None


class DimensionReader(NodeReader):
    """Reads the entries of ``vary``; anything malformed is added to ``problems`` and left out."""

    def vary(self, node: Node, what: str) -> tuple[Dimension, ...]:
        """An ordered mapping of dimensions."""
        if is_empty(node):
            return ()
        if not isinstance(node, Mapping):
            self.problems.add(f"{what} is not a mapping", node.position, "write lines like 'load: [0.5, 0.75, 0.9]'")
            return ()
        found = (self.dimension(name, entry) for name, entry in node.entries.items())
        return tuple(dimension for dimension in found if dimension is not POISON)

    def dimension(self, name: str, entry: Entry) -> Dimension | Poison:
        """A list, a range, or a mapping with the key zip, cases, latin_hypercube, sobol or morris."""
        node, position = entry.value, entry.key.position
        if isinstance(node, Sequence):
            return self.listed(name, position, {name: Entry(entry.key, node)})
        if isinstance(node, Mapping):
            samplings = {form: partial(self.sampled, form) for form in SAMPLINGS}
            readers: dict[str, Callable[[str, Position, Node], Dimension | Poison]] = {
                "zip": self.zipped,
                "cases": self.cases,
                **samplings,
            }
            form = next(iter(node.entries), "")
            if form in readers and len(node.entries) == 1:
                return readers[form](name, position, node.entries[form].value)
            if node.entries.keys() & RANGE.keys.keys():
                return self.ranged(name, position, node)
        forms = ", ".join(f"{{{form}: ...}}" for form in ("zip", "cases", LATIN, SOBOL))
        hint = f"give a list, {{from, to, step}}, {forms} or {{{MORRIS}: ...}}"
        return self.problems.add(f"{name!r} has no values", node.position, hint)

    def listed(self, name: str, position: Position, lists: dict[str, Entry]) -> Dimension | Poison:
        """One list for each path, all of the same length."""
        items = {path: entry.value.items for path, entry in lists.items() if isinstance(entry.value, Sequence)}
        keys = {path: entry.key.position for path, entry in lists.items()}
        are_patterns = [is_pattern(path, key, self.problems) for path, key in keys.items()]
        sizes = {len(each) for each in items.values()}
        if 0 in sizes:
            return self.problems.add(f"{name!r} has an empty list", position, "give at least one value")
        if len(sizes) > 1:
            shown = ", ".join(f"{path}: {len(each)}" for path, each in items.items())
            return self.problems.add(f"the lists of {name!r} differ in length", position, shown)
        if not all(are_patterns):
            return POISON
        kinds = {path: kind_of(each) for path, each in items.items()}
        levels: list[Level] = []
        seen: dict[str, Node] = {}
        for nodes in zip(*items.values(), strict=True):
            pairs = list(zip(items, nodes, strict=True))
            values = {path: as_factor(node, kinds[path]) for path, node in pairs}
            if (first := seen.setdefault(repr(values), nodes[0])) is not nodes[0]:
                self.problems.add(
                    f"{name!r} takes the same value twice", nodes[0].position, f"first at {first.position}"
                )
            levels.append(Level(tuple(Setting(path, node, keys[path]) for path, node in pairs), values))
        return Dimension(name, position, kinds, levels)

    def zipped(self, name: str, position: Position, node: Node) -> Dimension | Poison:
        """Parameters that vary together: the first values of all lists, then the second ones, and so on."""
        if not isinstance(node, Mapping) or not node.entries:
            return self.problems.add(f"the zip of {name!r} is not a mapping from parameters to lists", node.position)
        wrong = {path: each for path, each in node.entries.items() if not isinstance(each.value, Sequence)}
        for path, entry in wrong.items():
            self.problems.add(f"{path!r} is not a list", entry.value.position, "begin each entry with '- '")
        return POISON if wrong else self.listed(name, position, node.entries)

    def cases(self, name: str, position: Position, node: Node) -> Dimension | Poison:
        """Named sets of values; the column holds the names."""
        if not isinstance(node, Mapping) or not node.entries:
            return self.problems.add(f"the cases of {name!r} are not a mapping from names to settings", node.position)
        levels = []
        for case, entry in node.entries.items():
            settings: list[Setting] = []
            if isinstance(entry.value, Mapping):
                settings = settings_in(entry.value, self.problems)
            elif not is_empty(entry.value):
                self.problems.add(f"case {case!r} is not a mapping from parameters to values", entry.value.position)
            levels.append(Level(tuple(settings), {name: case}))
        return Dimension(name, position, {name: "text"}, levels)

    def ranged(self, name: str, position: Position, node: Mapping) -> Dimension | Poison:
        """``{from: 0, to: 0.5, step: 0.1}``; the end counts if a step falls on it."""
        what = f"the range of {name!r}"
        found: list[tuple[Decimal, str] | Poison] = [] if is_pattern(name, position, self.problems) else [POISON]
        entries = RANGE.entries(self, node, what) or {}
        for key in RANGE.keys:
            if key in entries:
                found.append(self.quantity(entries[key].value, f"{key} of {name!r}"))
            else:
                found.append(self.problems.add(f"{what} has no {key!r}", node.position))
        numbers = [each for each in found if each]
        if len(numbers) < len(found):
            return POISON
        (start, unit), (end, _), (step, _) = numbers
        at = entries["step"].value.position
        if len({each for _, each in numbers}) > 1:
            return self.problems.add(f"{what} has more than one unit", node.position, "use the same unit for all")
        if step == 0 or (end - start) / step < 0:
            return self.problems.add(f"{what} never reaches {end} from {start} in steps of {step}", at)
        size = int((end - start) / step) + 1
        if size > MAX_SAMPLES:
            return self.problems.add(f"{what} has more than {MAX_SAMPLES:,} values", at)
        exact = [start + index * step for index in range(size)]  # so that 0.1, 0.2, 0.3 are the nearest floats
        is_whole = not unit and start == int(start) and step == int(step)
        is_whole = is_whole and max(abs(start), abs(exact[-1])) < _MAX_WHOLE
        levels = []
        try:
            for each in exact:
                value: int | float = int(each) if is_whole else float(each)
                setting = Setting(name, number_node(value, unit, node.position), position)
                levels.append(Level((setting,), {name: in_si(value, unit)}))
        except UnitError as error:
            return blame(self.problems, what, error, at)
        if len({level.values[name] for level in levels}) < size:
            reach = f"from {start} to {end} in steps of {step}"
            return self.problems.add(f"{what} has values that cannot be told apart as floats: {reach}", at)
        return Dimension(name, position, {name: "int" if is_whole else "float"}, levels)

    def quantity(self, node: Node, what: str) -> tuple[Decimal, str] | Poison:
        """A number, perhaps with a unit."""
        found = split_number(node)
        if found is None:
            return self.problems.add(f"{what} is not a number", node.position, "write 5, 0.1 or '5 m'")
        if abs(found[0]) > _LARGEST:
            return self.problems.add(f"{what} is too large for a float", node.position)
        try:
            if found[1]:
                parse_unit(found[1])
        except UnitError as error:
            return blame(self.problems, what, error, node)
        return found

    def sampled(self, form: str, name: str, position: Position, node: Node) -> Dimension | Poison:
        """Points of a box: a Latin hypercube, or the design of a sensitivity analysis."""
        entries = SAMPLINGS[form].entries(self, node, f"{form} of {name!r}") or {}
        if "size" not in entries or "ranges" not in entries:
            hint = f"write {{size: {16 if form == SOBOL else 20}, seed: 1, ranges: {{load: [0.1, 0.9]}}}}"
            return self.problems.add(f"{form} of {name!r} needs 'size' and 'ranges'", position, hint)
        said = SAMPLINGS[form].values(self, entries, "", position)
        box = self.box(name, entries["ranges"].value)
        if box is POISON or POISON in said.values():
            return POISON
        size, seed, steps = said["size"], said.get("seed", 0), said.get("levels", 4)
        at = entries["size"].value.position
        if form == SOBOL and size.bit_count() != 1:
            near = 1 << size.bit_length()
            hint = f"a Sobol sequence fills the box evenly only then: take {near // 2:,} or {near:,}"
            return self.problems.add(f"the size {size} of {name!r} is not a power of 2", at, hint)
        if steps % 2:
            hint = f"steps go over half of the grid: take {steps - 1 or 2} or {steps + 1}"
            return self.problems.add(
                f"the levels {steps} of {name!r} are not even", entries["levels"].value.position, hint
            )
        points = {SOBOL: len(box) + 2, MORRIS: len(box) + 1}.get(form, 1)  # of a block
        for limit, each, what in ((MAX_SAMPLES, points, "points"), (MAX_VALUES, points * len(box), "values")):
            if size > (most := limit // each):
                told = f"{form} of {name!r} has more than {limit:,} {what}"
                hint = f"with {len(box)} parameters, take at most {most:,}" if most > 1 else "take fewer parameters"
                return self.problems.add(told, at, hint)
        taken: tuple[tuple[tuple[int, float], ...], ...] = ()
        if form == SOBOL:
            blocks = sobol_blocks(size, seed, list(box))
        elif form == MORRIS:
            blocks, found = morris_blocks(size, seed, list(box), steps)
            taken = tuple(found)
        else:
            blocks = [[point] for point in latin_hypercube(size, seed, list(box))]
        places: dict[Point, int] = {}  # a point that comes twice is run once
        numbers = tuple(tuple(places.setdefault(point, len(places)) for point in block) for block in blocks)
        levels = [_level_at(point, box) for point in places]
        design = Design(form, tuple(box), numbers, taken) if form in (SOBOL, MORRIS) else None
        return Dimension(name, position, dict.fromkeys(box, "float"), levels, design)

    def box(self, name: str, node: Node) -> dict[str, Bounds] | Poison:
        """``path: [low, high]`` for each parameter."""
        if not isinstance(node, Mapping) or not node.entries:
            message = f"the ranges of {name!r} are not a mapping from parameters to [low, high]"
            return self.problems.add(message, node.position)
        bounds: dict[str, Bounds | Poison] = {}
        for path, entry in node.entries.items():
            is_path = is_pattern(path, entry.key.position, self.problems)
            items = entry.value.items if isinstance(entry.value, Sequence) else ()
            read = [self.quantity(item, f"a bound of {path!r}") for item in items]
            ends = [end for end in read if end]
            if (len(items) == 2 and len(ends) < 2) or not is_path:
                bounds[path] = POISON
            elif len(ends) != 2 or ends[0][1] != ends[1][1] or not ends[0][0] < ends[1][0]:
                bounds[path] = self.problems.add(f"{path!r} is not [low, high] in one unit", entry.value.position)
            else:
                bounds[path] = float(ends[0][0]), float(ends[1][0]), ends[0][1], entry.key.position
        whole = sound(bounds)
        return whole if len(whole) == len(bounds) else POISON


def _level_at(point: Point, box: AnyMapping[str, Bounds]) -> Level:
    settings, values = [], {}
    for (path, (low, high, unit, at)), share in zip(box.items(), point, strict=True):
        value = low + share * (high - low)
        settings.append(Setting(path, number_node(value, unit, at), at))
        values[path] = in_si(value, unit)
    return Level(tuple(settings), dict(values))


_QUANTITY = node_as(QUANTITY_SCHEMA)
RANGE = Record(
    "Values at equal distances.",
    {
        "from": Field(_QUANTITY, "The first value."),
        "to": Field(_QUANTITY, "The last value, if a step falls on it."),
        "step": Field(_QUANTITY, "The distance between two values."),
    },
    type="object",
    required=["from", "to", "step"],
)
DIMENSIONS = Reader(
    {"type": ["object", "null"], "additionalProperties": ref("dimension")},
    lambda reader, node, what: DimensionReader(reader.problems).vary(node, what),
)


def dimension_schema() -> Schema:
    """The schema of one form in which a study gives the values of a factor."""
    lists: Schema = {"type": "object", "minProperties": 1, "additionalProperties": {"type": "array", "minItems": 1}}
    sets: Schema = {**lists, "additionalProperties": {"type": ["object", "null"]}}
    forms = {
        "zip": Field(node_as(lists), "Parameters that vary together: 'path: [value, ...]', all of the same length."),
        "cases": Field(node_as(sets), "Named sets of values: 'name: {path: value}'."),
        LATIN: Field(node_as(HYPERCUBE.schema), "Points that fill a box evenly."),
        SOBOL: Field(node_as(SOBOL_INDICES.schema), "Points for Sobol's sensitivity indices: shares of the variance."),
        MORRIS: Field(node_as(MORRIS_INDICES.schema), "Points for Morris's elementary effects, to find what matters."),
    }
    single = (Record("", {key: each}, type="object", required=[key]).schema for key, each in forms.items())
    return {
        "description": "The values of a parameter, or of several that vary together.",
        "anyOf": [{"type": "array", "minItems": 1}, RANGE.schema, *single],
    }
