"""Analyses expressions of a state machine: comparisons in guards over time or flowing variables become events."""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any, Final

from ..expression import Formula
from ..expression.syntax import free_names, parse

TIMES: Final = ("time", "mode_time")
_ON_SIDES: Final[dict[type[ast.cmpop], tuple[int, ...]]] = {
    ast.Lt: (-1,), ast.LtE: (-1, 0), ast.Gt: (1,), ast.GtE: (0, 1), ast.Eq: (0,), ast.NotEq: (-1, 1),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Comparison:
    """A comparison in a guard: the difference that is zero where it changes, and the sides on which it holds."""

    source: str
    name: str  # its placeholder in the guard
    difference: Formula
    sides: tuple[int, ...]
    is_equality: bool
    names: frozenset[str]  # that it uses, except times
    until: tuple[str, Formula, int] | None = None  # a time, the value at which it changes, and the side from then on

    def __str__(self) -> str:
        return repr(self.source)

    def holds(self, side: int) -> float:
        """1 on a side on which it holds, otherwise 0."""
        return 1.0 if side in self.sides else 0.0


def condition_of(
    guard: Formula, moving: Collection[str], numbers: Collection[str], taken: int
) -> tuple[Formula, list[Comparison]]:
    """A guard in which names replace the comparisons whose changes are events: those over ``moving`` values, and
    otherwise only ``numbers``.

    ``taken`` is the number of comparisons in other guards of the mode; it keeps names unique.
    """
    source, found, pieces = guard.source, list[Comparison](), list[tuple[int, int, str]]()
    for node in _compared(parse(source)):
        names = free_names(node, frozenset())
        if names.isdisjoint(moving) or not names <= {*moving, *numbers}:
            continue
        parts = [node.left, *node.comparators]
        written = [source[part.col_offset : part.end_col_offset] for part in parts]
        stand_ins = []
        for place, sign in enumerate(node.ops):
            if type(sign) not in _ON_SIDES:
                break
            name = f"_comparison_{taken + len(found) + place}"
            difference = Formula(f"({written[place]}) - ({written[place + 1]})")
            text = source[parts[place].col_offset : parts[place + 1].end_col_offset]
            until = _until(parts[place], parts[place + 1], written[place : place + 2], moving)
            asked = frozenset(difference.names) - {*TIMES}
            is_equality = isinstance(sign, (ast.Eq, ast.NotEq))
            stand_ins.append(Comparison(text, name, difference, _ON_SIDES[type(sign)], is_equality, asked, until))
        else:
            found += stand_ins
            text = " and ".join(each.name for each in stand_ins)
            pieces.append((node.col_offset, node.end_col_offset or 0, f"({text})"))
    for start, end, text in sorted(pieces, reverse=True):
        source = source[:start] + text + source[end:]
    return Formula(source), found


def _until(
    left: ast.expr, right: ast.expr, written: list[str], moving: Collection[str]
) -> tuple[str, Formula, int] | None:
    """For a comparison between a time and a constant value: when it changes, and to which side."""
    for here, there, text, side in ((left, right, written[1], 1), (right, left, written[0], -1)):
        if isinstance(here, ast.Name) and here.id in TIMES and free_names(there, frozenset()).isdisjoint(moving):
            return here.id, Formula(text), side
    return None


def _compared(node: ast.expr) -> list[ast.Compare]:
    """The comparisons that a condition combines with and, or and not."""
    if isinstance(node, ast.Compare):
        return [node]
    if isinstance(node, ast.BoolOp):
        return [each for value in node.values for each in _compared(value)]
    return _compared(node.operand) if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not) else []


_GIVES: Final[dict[str, Any]] = {"str": str, "bool": bool, "range": Any, "sorted": Any, "min": Any, "max": Any}


def type_of(formula: Formula, type_of_name: Callable[[str], Any]) -> Any:
    """The type of an expression's value, as far as its form shows."""
    tree = parse(formula.source)
    if formula.is_condition:
        return bool
    match tree:
        case ast.Name(id=name):
            return type_of_name(name)
        case ast.Constant(value=str()):
            return str
        case ast.Constant(value=int() | float()) | ast.UnaryOp():
            return float
        case (
            ast.BinOp(left=ast.Constant(value=str()) | ast.List())
            | ast.BinOp(right=ast.Constant(value=str()) | ast.List())
        ):
            return Any
        case ast.BinOp():
            names = {type_of_name(name) for name in formula.names}
            return float if names <= {float, Any, int} else Any
        case ast.Call(func=ast.Name(id=name)):
            return _GIVES.get(name, float)
    return Any
