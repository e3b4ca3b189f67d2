"""What a search is given, and what it varies: ranges and lists, as ``--vary`` says them, or the faults of one run."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator
from collections.abc import Sequence as Many
from dataclasses import dataclass, field
from decimal import Decimal
from heapq import heappop, heappush
from importlib.util import find_spec
from itertools import islice
from typing import Any, ClassVar

from epicycle.actors import UnitError, counted, declared_parameters, parse_unit, random_stream

from ..model.build.model import Model
from ..model.graph.acts import ActName
from ..model.language.dimensions import (
    RANGE,
    Dimension,
    DimensionReader,
    Factor,
    Level,
    as_factor,
    in_si,
    kind_of,
    number_node,
    split_number,
)
from ..model.language.disturbance import EXACTLY
from ..model.language.settings import Setting, parse_setting
from ..model.language.study import RESERVED
from ..model.text.document import Entry, Mapping, Node, Scalar, Sequence, plain
from ..model.text.files import COMMAND_LINE
from ..model.text.patterns import matches, select
from ..model.text.problems import POISON, Position, Problems
from ..model.text.program import node_of
from ..study.run_spec import RunSpec, seconds
from .proposals import BATCH, Point, Proposals, proposals, ranks

HINT = "write load=0.5..0.9, policy=[fifo, lifo] or 'period={from: 1 s, to: 5 s, step: 1 s}'"
_BARE = re.compile(r"[A-Za-z0-9_.+ -]+")  # a text that needs no quotes in YAML, where it is not a number
_RANGE = re.compile(r"(.*?\S)\s*\.\.\s*(\S.*)")
MAX_WHOLE, MAX_NUMBER = 10**15, 10**300  # of the ends of a range
_DIGITS = 6  # of the width of a range, to which its numbers are drawn
_OF_FAULTS = Position(COMMAND_LINE, 1, 1, 1, "--max-faults")
_VALUES = 8  # numbers in the text of a study that a fault takes, about


@dataclass(frozen=True)
class Interval:
    """All numbers of a range, or all whole ones; of a signal, all lists of so many numbers, one after the other."""

    path: str
    low: Decimal
    high: Decimal
    unit: str
    position: Position
    is_whole: bool
    length: int | None = None  # of the lists

    @property
    def width(self) -> int:
        """How many shares lead to a value."""
        return self.length or 1

    @property
    def kind(self) -> str:
        """What its column in the table holds."""
        return "text" if self.length else "int" if self.is_whole else "float"

    @property
    def ends(self) -> list[Node]:
        """Nothing but the first number, and nothing but the last."""
        return [self._value([self._node(end)] * self.width) for end in (self.low, self.high)]

    def node(self, *shares: float) -> Node:
        """The number at a share of the range, or the numbers at several."""
        return self._value([self._number(share) for share in shares])

    def factor(self, node: Node) -> Factor:
        """A value as the table has it."""
        number = split_number(node)
        if number is None:
            return as_factor(node, self.kind)
        return int(number[0]) if self.is_whole else in_si(float(number[0]), self.unit)

    def _value(self, numbers: Many[Node]) -> Node:
        return Sequence(tuple(numbers), self.position) if self.length else numbers[0]

    def _number(self, share: float) -> Node:
        """The number at a share of the range, to six digits of its width."""
        width = self.high - self.low
        if self.is_whole:
            return self._node(min(self.low + int(Decimal(share) * (width + 1)), self.high))
        low, high = float(self.low), float(self.high)
        number = round(low + share * (high - low), _DIGITS - 1 - width.adjusted())
        return number_node(min(max(number, low), high), self.unit, self.position)

    def _node(self, number: Decimal) -> Scalar:
        return number_node(int(number) if self.is_whole else float(number), self.unit, self.position)


@dataclass(frozen=True)
class Choice:
    """Some values, which have no order."""

    path: str
    nodes: tuple[Node, ...]
    kind: str
    position: Position

    width: ClassVar[int] = 1

    @property
    def ends(self) -> list[Node]:
        """All values."""
        return list(self.nodes)

    def node(self, share: float) -> Node:
        """One of the values."""
        return self.nodes[min(int(share * len(self.nodes)), len(self.nodes) - 1)]

    def factor(self, node: Node) -> Factor:
        """A value as the table has it."""
        return as_factor(node, self.kind)


Axis = Interval | Choice


@dataclass(frozen=True)
class SearchSpec(RunSpec):
    """All that a search is given: a model or study, with all that changes it, and what is varied."""

    vary: tuple[str, ...] = ()
    continued_by: tuple[str, ...] = field(default=(), repr=False)  # the command, if there is one

    def keys_of_study(self, name: str) -> dict[str, Any]:
        """A study of the model, as its file would say it."""
        given = {"disturb": {"given": list(self.disturb)}} if self.disturb else {}
        return {"study": name, "model": self.model, **given}

    @property
    def stop(self) -> float | None:
        """The stop time (s), if it is not the model's."""
        return seconds("until", self.until)

    def load(self, more: Iterable[Setting] = ()) -> Model:
        """The model, with further settings."""
        model = super().load(more)
        if self.stop is not None:
            model.stop = self.stop
        return model


class Space:
    """All combinations of some axes."""

    def __init__(self, axes: Many[Axis]) -> None:
        self.axes = tuple(axes)
        self.widths = [axis.width for axis in self.axes]
        self.width = sum(self.widths)  # shares that lead to a point, and numbers in the text of a study that it takes
        self.content = counted(len(self.axes), "parameter")
        self.has_ranges = any(isinstance(axis, Interval) for axis in self.axes)

    @property
    def is_guided(self) -> bool:
        """Whether what is found guides a search; for one of no signals, a library must be there."""
        return self.has_ranges and (max(self.widths) > 1 or find_spec("cma") is not None)

    @property
    def columns(self) -> dict[str, str]:
        """The columns of the table, and what they hold."""
        return {axis.path: axis.kind for axis in self.axes}

    def level(self, point: Point) -> Level:
        """What a point sets, which has shares of the axes."""
        left = iter(point)
        nodes = [axis.node(*islice(left, axis.width)) for axis in self.axes]
        pairs = list(zip(self.axes, nodes, strict=True))
        settings = tuple(Setting(axis.path, node, axis.position) for axis, node in pairs)
        return Level(settings, {axis.path: axis.factor(node) for axis, node in pairs})

    def dimensions(self, levels: Many[Level]) -> tuple[Dimension, ...]:
        """These points, as what a study varies."""
        at = self.axes[0].position if self.axes else _OF_FAULTS
        return (Dimension("point", at, self.columns, list(levels)),) if self.columns else ()

    def ends(self) -> tuple[Dimension, ...]:
        """The ends of each range and each value of each list: a study of which all conditions must load."""
        found = []
        for axis in self.axes:
            settings = [Setting(axis.path, each, axis.position) for each in axis.ends]
            levels = [Level((each,), {axis.path: axis.factor(each.node)}) for each in settings]
            found.append(Dimension(axis.path, axis.position, {axis.path: axis.kind}, levels))
        return tuple(found)

    def proposals(self, seed: int, together: int = BATCH) -> Proposals:
        """Batches of points, guided by what is found at those before."""
        return proposals(self.widths, seed, self.is_guided, together)


class FaultSpace(Space):
    """All sets of at most ``most`` of some acts; a point has their places among ``acts``."""

    def __init__(self, acts: Many[ActName], most: int) -> None:
        super().__init__(())
        self.acts = tuple(acts)
        self.most = min(most, len(acts))
        self.width = _VALUES * self.most
        self.content = "faults"

    @property
    def columns(self) -> dict[str, str]:
        return {EXACTLY: "text"}

    def level(self, point: Point) -> Level:
        """The acts of a point, and no others."""
        acts = [self.acts[int(place)] for place in point]
        node = node_of([{"aspect": each.aspect, "at": each.place, "token": each.token} for each in acts], _OF_FAULTS)
        return Level((Setting(EXACTLY, node, _OF_FAULTS),), {EXACTLY: as_factor(node, "text")})

    def ends(self) -> tuple[Dimension, ...]:
        """All acts at once, and none: with both, a model must load."""
        return self.dimensions([self.level(tuple(range(len(self.acts)))), self.level(())])

    def sizes(self) -> list[int]:
        """How many sets there are of 0 acts, 1 act, and so on."""
        return [math.comb(len(self.acts), size) for size in range(self.most + 1)]

    def proposals(self, seed: int, together: int = BATCH) -> Proposals:
        """Batches of sets until all have been: smaller sets first, and of one size those of the worst acts first.

        The worst are those with the least robustness alone; single acts come in a random order.
        """
        order = random_stream(seed, "acts").permutation(len(self.acts)).tolist()
        alone: list[float | None] = []
        sets: Iterator[Point] = iter([(), *((place,) for place in order)])
        while batch := list(islice(sets, BATCH)):
            alone += yield batch
        places = ranks(alone[1:])
        worst = [place for _, place in sorted(zip(places, order, strict=True), key=lambda each: each[0])]
        for size in range(2, self.most + 1):
            sets = (tuple(worst[rank] for rank in each) for each in _by_sum(size, len(worst)))
            while batch := list(islice(sets, BATCH)):
                yield batch


def _by_sum(size: int, count: int) -> Iterator[tuple[int, ...]]:
    """All sets of so many numbers below ``count``, those with the least sum first."""
    least = tuple(range(size))
    waiting, seen = [(math.comb(size, 2), least)], {least}  # by their sums
    while waiting:
        total, each = heappop(waiting)
        yield each
        for place, following in enumerate([*each[1:], count]):
            more = (*each[:place], each[place] + 1, *each[place + 1 :])
            if more[place] < following and more not in seen:
                seen.add(more)
                heappush(waiting, (total + 1, more))


def said(levels: Many[Level]) -> dict[str, object]:
    """What the key ``vary`` of a study says of points."""
    paths = [setting.path for setting in levels[0].settings] if levels else []
    if not paths:
        return {}
    columns = zip(*([plain(setting.node) for setting in level.settings] for level in levels), strict=True)
    return {"point": {"zip": {path: list(column) for path, column in zip(paths, columns, strict=True)}}}


def as_set(level: Level) -> Iterator[tuple[str, str]]:
    """What a point sets, as ``--set`` takes it."""
    return ((setting.path, text_of(setting.node)) for setting in level.settings)


def text_of(node: Node) -> str:
    """A value as YAML, without quotes where it can be."""
    if isinstance(node, Scalar):
        number = split_number(node)
        is_bare = _BARE.fullmatch(node.text) is not None and (number is None or bool(number[1]))
        if is_bare or not isinstance(node.value, str):
            return node.text
    return json.dumps(plain(node))


# -- reading it -------------------------------------------------------------------------------------------------------


def read_space(spec: SearchSpec, model: Model, taken: Iterable[str] = ()) -> Space:
    """The space of what is varied, which has no names ``taken`` by other columns; raises ``ModelError``."""
    axes: dict[str, Axis] = {}
    problems = Problems()
    for text in spec.vary:
        setting = parse_setting(text, problems, "--vary")
        if setting is None:
            continue
        if setting.path in axes or setting.path in (*RESERVED, *taken):
            why = "it is varied twice" if setting.path in axes else "the table already has a column with that name"
            problems.add(f"{setting.path!r} cannot be varied: {why}", setting.position)
        elif (axis := _axis(setting, model, problems)) is not None:
            axes[setting.path] = axis
    for each in [parse_setting(text, problems) for text in spec.set]:
        if each is not None and each.path in axes:
            problems.add(f"{each.path!r} is set and varied", each.position, "leave out --set or --vary")
    problems.raise_if_any()
    return Space(list(axes.values()))


def _axis(setting: Setting, model: Model, problems: Problems) -> Axis | None:
    node = setting.node
    if isinstance(node, Scalar) and (found := _RANGE.fullmatch(node.text)) is not None:
        length = _length(setting.path, model)
        is_count = length is None and counts(setting.path, model)
        return _interval(setting, found[1], found[2], is_count, length, problems)
    if not (isinstance(node, Sequence) or (isinstance(node, Mapping) and node.entries.keys() & RANGE.keys.keys())):
        problems.add(f"{setting.path!r} has neither a range nor a list of values", setting.position, HINT)
        return None
    key = Scalar(setting.path, setting.path, True, setting.position)
    dimension = DimensionReader(problems).dimension(setting.path, Entry(key, node))
    if dimension is POISON:
        return None
    nodes = [each.node for at in range(dimension.size) for each in dimension.level(at).settings]
    kinds = {kind_of([each]) for each in nodes}
    if kinds == {"int", "float"}:
        nodes, kinds = [_float(each) for each in nodes], {"float"}
    if len(kinds) > 1:
        message = f"the values of {setting.path!r} are of more than one kind: {', '.join(sorted(kinds))}"
        problems.add(message, setting.position)
        return None
    return Choice(setting.path, tuple(nodes), kinds.pop(), setting.position)


def _length(path: str, model: Model) -> int | None:
    """How many numbers a parameter of the model has that is a list of numbers; None if it is not."""
    for name, declared in model.declared.items():
        if matches(path, name) and isinstance(declared.value, Sequence):
            numbers = [split_number(each) for each in declared.value.items]
            return len(numbers) if numbers and None not in numbers else None
    return None


def counts(path: str, model: Model) -> bool:
    """Whether a parameter has whole numbers; one of a model or composite, if its own value is one without a unit."""
    for name, declared in model.declared.items():
        if matches(path, name):
            value = declared.value
            return not declared.unit and isinstance(value, Scalar) and type(value.value) is int
    owner, _, name = path.rpartition(".")
    owners: list[type] = [type(each.aspect) for each in model.aspects if each.name == owner]
    owners += [type(model.graph.actors[each]) for each in (select(owner, model.graph.actors) if owner else ())]
    found = [declared_parameters(each).get(name) for each in owners]
    return any(each is not None and each.type is int for each in found)


def _float(node: Node) -> Node:
    number = split_number(node)
    return node if number is None else number_node(float(number[0]), number[1], node.position)


def _interval(
    setting: Setting, first: str, last: str, is_count: bool, length: int | None, problems: Problems
) -> Interval | None:
    path, at = setting.path, setting.position
    least, most = (split_number(Scalar(each, each, True, at)) for each in (first, last))
    if least is None or most is None:
        wrong = first if least is None else last
        problems.add(f"the range of {path!r}: {wrong!r} is not a number", at, HINT)
        return None
    (low, unit_of_low), (high, unit) = least, most
    try:
        for each in filter(None, (unit_of_low, unit)):
            parse_unit(each)
    except UnitError as error:
        problems.add(f"the range of {path!r}: {error}", at)
        return None
    if unit_of_low not in ("", unit):
        problems.add(f"the range of {path!r} has more than one unit", at, "use the same unit for both ends")
        return None
    if max(abs(low), abs(high)) > (MAX_WHOLE if is_count else MAX_NUMBER):
        problems.add(f"the range of {path!r} exceeds ±{MAX_WHOLE if is_count else MAX_NUMBER:.0e}", at)
    elif is_count and any(each != each.to_integral_value() for each in (low, high)):
        problems.add(f"{path!r} takes whole numbers, and the ends of its range are not", at)
    elif not float(low) < float(high):
        problems.add(f"the range of {path!r} is empty: {first} is not less than {last}", at)
    else:
        return Interval(path, low, high, unit, at, is_count, length)
    return None
