"""Dimensions: what a study varies, each a row of levels of which one is taken at a time."""

from __future__ import annotations

import json
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any, TypeAlias

from epicycle.actors import Quantity, UnitError

from ..text import Node, Position, Scalar, plain
from .settings import Setting

Factor: TypeAlias = bool | int | float | str | None
KINDS: dict[str, type] = {"bool": bool, "int": int, "float": float, "text": str}

_NUMBER = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?)\s*(.*?)\s*")


@dataclass(frozen=True)
class Level:
    """What one level sets and adds to the model, and what it puts into the columns of the table."""

    settings: tuple[Setting, ...] = ()
    values: dict[str, Factor] = field(default_factory=dict)
    disturb: tuple[str, ...] = ()


class Dimension(ABC):
    """Levels by their number; ``columns`` are those of the table that it fills, with what they hold (see ``KINDS``)."""

    def __init__(self, name: str, position: Position, columns: dict[str, str]) -> None:
        self.name = name
        self.position = position
        self.columns = columns

    @property
    @abstractmethod
    def size(self) -> int:
        """The number of levels; more than ``len`` could hold, perhaps."""

    @abstractmethod
    def level(self, index: int) -> Level:
        """One level."""

    @abstractmethod
    def find(self, values: Mapping[str, Factor]) -> int | None:
        """The level that puts these values into its columns; None if there is none."""


class Listed(Dimension):
    """Levels that are written out, one by one."""

    def __init__(self, name: str, position: Position, columns: dict[str, str], levels: Sequence[Level]) -> None:
        super().__init__(name, position, columns)
        self._levels = tuple(levels)
        self._places = {tuple(level.values.values()): index for index, level in enumerate(levels)}

    @property
    def size(self) -> int:
        return len(self._levels)

    def level(self, index: int) -> Level:
        return self._levels[index]

    def find(self, values: Mapping[str, Factor]) -> int | None:
        return self._places.get(tuple(values[name] for name in self.columns))


class Ranged(Dimension):
    """Numbers at equal distances, calculated in decimal so that 0.1, 0.2, 0.3 are what they look like."""

    def __init__(
        self, path: str, position: Position, start: Decimal, step: Decimal, size: int, unit: str, at: Position
    ) -> None:
        is_whole = not unit and start == start.to_integral_value() and step == step.to_integral_value()
        super().__init__(path, position, {path: "int" if is_whole else "float"})
        self._start, self._step, self._size, self._unit, self._at = start, step, size, unit, at

    @property
    def size(self) -> int:
        return self._size

    def level(self, index: int) -> Level:
        number = self._start + index * self._step
        value: int | float = int(number) if self.columns[self.name] == "int" else float(number)
        node = number_node(value, self._unit, self._at)
        return Level((Setting(self.name, node, self.position),), {self.name: in_si(value, self._unit)})

    def is_distinct(self) -> bool:
        """Whether no two levels are the same number: those are nearest to it, at the ends, that are far from zero."""
        ends = {0, max(0, self._size - 2)} if self._size > 1 else set()
        return all(self.level(at).values != self.level(at + 1).values for at in ends)

    def find(self, values: Mapping[str, Factor]) -> int | None:
        first, second, wanted = (
            float(each or 0) for each in (*(self.level(at).values[self.name] for at in (0, 1)), values[self.name])
        )
        index = round((wanted - first) / (second - first))
        is_there = 0 <= index < self._size and self.level(index).values[self.name] == values[self.name]
        return index if is_there else None


def number_node(value: float, unit: str, position: Position) -> Scalar:
    """A number with its unit, as a file would hold it."""
    if not unit:
        return Scalar(value, repr(value), True, position)
    return Scalar(f"{value!r} {unit}", f"{value!r} {unit}", True, position)


def in_si(value: float, unit: str) -> float:
    """A number as the table holds it: in SI units, or as it is without a unit."""
    return Quantity(value, unit).si if unit else value


def split_number(node: Node) -> tuple[Decimal, str] | None:
    """A number and the text of its unit; None if it is no number."""
    if not isinstance(node, Scalar) or isinstance(node.value, bool) or node.value is None:
        return None
    found = _NUMBER.fullmatch(node.text)
    return None if found is None else (Decimal(found[1]), found[2])


def kind_of(nodes: Iterable[Node]) -> str:
    """What a column holds that is filled with these values."""
    nodes = list(nodes)
    values = [node.value if isinstance(node, Scalar) else node for node in nodes]
    if all(isinstance(value, bool) for value in values):
        return "bool"
    if all(isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63 for value in values):
        return "int"
    if all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values):
        return "float"
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
    """A number with its unit in SI units; None if it is none."""
    parts = split_number(node)
    if parts is None or not parts[1]:
        return None
    try:
        return Quantity(float(parts[0]), parts[1]).si
    except UnitError:
        return None
