"""Bounds on the value of an expression whose names lie between bounds: interval arithmetic."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from typing import Final

from .formula import Formula
from .syntax import parse
from .values import BINARY, CONSTANTS, FUNCTIONS

Bounds = tuple[float, float]

EVERYTHING: Final[Bounds] = (-math.inf, math.inf)
_TRUE: Final[Bounds] = (1.0, 1.0)
_FALSE: Final[Bounds] = (0.0, 0.0)
_EITHER: Final[Bounds] = (0.0, 1.0)
_RISING: Final = frozenset(
    ("asin", "atan", "ceil", "degrees", "exp", "expm1", "float", "floor", "int", "log", "log1p", "radians", "round",
     "sinh", "sqrt", "tanh")
)  # fmt: skip
_FAR: Final = 1e8  # larger angles cannot be distinguished well enough from the next peak


class _UnknownError(Exception):
    """There are no bounds for a part."""


def bounds_of(formula: Formula, names: Mapping[str, Bounds]) -> Bounds:
    """The bounds of the value of a formula, up to rounding; ``EVERYTHING`` if they are unknown.

    A name without bounds, such as a list, must not be in ``names``.
    """
    try:
        low, high = _bounds(parse(formula.source), names)
    except (_UnknownError, ArithmeticError, TypeError, ValueError):
        return EVERYTHING
    return (low, high) if low <= high else EVERYTHING


def _bounds(node: ast.expr, names: Mapping[str, Bounds]) -> Bounds:
    match node:
        case ast.Constant(value=int() | float() as value):
            return float(value), float(value)
        case ast.Name(id=name):
            if name in names:
                return names[name]
            if name in CONSTANTS:
                return CONSTANTS[name], CONSTANTS[name]
        case ast.BinOp():
            low, high = _OPERATORS[type(node.op)](_bounds(node.left, names), _bounds(node.right, names))
            if low <= high:  # as it is not for inf - inf
                return low, high
        case ast.UnaryOp():
            low, high = _bounds(node.operand, names)
            if isinstance(node.op, ast.Not):
                truth = _truth((low, high))
                return _EITHER if truth is None else _FALSE if truth else _TRUE
            return (-high, -low) if isinstance(node.op, ast.USub) else (low, high)
        case ast.Compare():
            return _compared(node, names)
        case ast.BoolOp():
            return _either_of(node, names)
        case ast.IfExp():
            truth = _truth(_bounds(node.test, names))
            chosen = [node.body, node.orelse] if truth is None else [node.body if truth else node.orelse]
            return _hull(*(_bounds(each, names) for each in chosen))
        case ast.Call(func=ast.Name(id=name)):
            return _called(name, [_bounds(each, names) for each in node.args])
        case _:
            pass
    raise _UnknownError


def _hull(*parts: Bounds) -> Bounds:
    return min(low for low, _ in parts), max(high for _, high in parts)


def _of_corners(function: Callable[[float, float], float], left: Bounds, right: Bounds) -> Bounds:
    """A function of two numbers that rises or falls in each: its extremes are at the corners."""
    values = [function(one, other) for one in left for other in right]
    if any(map(math.isnan, values)):
        raise _UnknownError
    return min(values), max(values)


def _truth(bounds: Bounds) -> bool | None:
    """Whether a value counts as true; None if that is undecided."""
    if bounds == _FALSE:
        return False
    return None if bounds[0] <= 0.0 <= bounds[1] else True


# -- operators ----------------------------------------------------------------------------------------------------


def _divided(left: Bounds, right: Bounds) -> Bounds:
    if right[0] <= 0.0 <= right[1]:
        raise _UnknownError
    return _of_corners(lambda one, other: one / other, left, right)


def _floored(left: Bounds, right: Bounds) -> Bounds:
    low, high = _divided(left, right)
    return float(math.floor(low)), float(math.floor(high))


def _rest(left: Bounds, right: Bounds) -> Bounds:
    low, high = _floored(left, right)
    divisor = right[0]
    if divisor == right[1] and low == high:
        return left[0] % divisor, left[1] % divisor
    return min(right[0], 0.0), max(right[1], 0.0)


def _raised(base: Bounds, exponent: Bounds) -> Bounds:
    power = BINARY[ast.Pow]
    if base[0] > 0.0 or (base[0] == 0.0 and exponent[0] >= 0.0):
        return _of_corners(power, base, exponent)
    number = exponent[0]
    if exponent[1] != number or not number.is_integer():
        raise _UnknownError
    if number >= 0.0 or base[1] < 0.0:
        ends = _of_corners(power, base, (number, number))
        return (0.0, ends[1]) if number > 0.0 and number % 2.0 == 0.0 and base[1] >= 0.0 else ends
    raise _UnknownError


_OPERATORS: Final[dict[type[ast.operator], Callable[[Bounds, Bounds], Bounds]]] = {
    ast.Add: lambda left, right: (left[0] + right[0], left[1] + right[1]),
    ast.Sub: lambda left, right: (left[0] - right[1], left[1] - right[0]),
    ast.Mult: lambda left, right: _of_corners(lambda one, other: one * other, left, right),
    ast.Div: _divided,
    ast.FloorDiv: _floored,
    ast.Mod: _rest,
    ast.Pow: _raised,
}


# -- conditions ---------------------------------------------------------------------------------------------------


def _compared(node: ast.Compare, names: Mapping[str, Bounds]) -> Bounds:
    values = [_bounds(each, names) for each in (node.left, *node.comparators)]
    found = [_relation(sign, *pair) for sign, *pair in zip(node.ops, values[:-1], values[1:], strict=True)]
    if False in found:
        return _FALSE
    return _EITHER if None in found else _TRUE


def _relation(sign: ast.cmpop, left: Bounds, right: Bounds) -> bool | None:
    if isinstance(sign, (ast.Gt, ast.GtE)):
        left, right = right, left
    match sign:
        case ast.Lt() | ast.Gt():
            return True if left[1] < right[0] else False if left[0] >= right[1] else None
        case ast.LtE() | ast.GtE():
            return True if left[1] <= right[0] else False if left[0] > right[1] else None
        case ast.Eq() | ast.NotEq():
            if left[1] < right[0] or right[1] < left[0]:
                return isinstance(sign, ast.NotEq)
            return isinstance(sign, ast.Eq) if left[0] == left[1] == right[0] == right[1] else None
        case _:
            raise _UnknownError


def _either_of(node: ast.BoolOp, names: Mapping[str, Bounds]) -> Bounds:
    """`and` and `or` give the operand that decides; every operand that may decide counts."""
    parts = []
    for each in node.values:
        parts.append(_bounds(each, names))
        if _truth(parts[-1]) is isinstance(node.op, ast.Or):
            break
    undecided = [part for part in parts[:-1] if _truth(part) is None]
    return _hull(*undecided, parts[-1])


# -- functions ----------------------------------------------------------------------------------------------------


def _called(name: str, values: list[Bounds]) -> Bounds:
    function = FUNCTIONS[name]
    if name == "min" and len(values) > 1:
        return min(low for low, _ in values), min(high for _, high in values)
    if name == "max" and len(values) > 1:
        return max(low for low, _ in values), max(high for _, high in values)
    if name in ("sin", "cos") and len(values) == 1:
        return _wave(function, values[0], math.pi / 2 if name == "sin" else 0.0)
    if name == "abs" and len(values) == 1:
        return _size(values[0])
    if name == "hypot":
        sizes = [_size(value) for value in values]
        return function(*(low for low, _ in sizes)), function(*(high for _, high in sizes))
    if name == "bool" and len(values) == 1:
        truth = _truth(values[0])
        return _EITHER if truth is None else _TRUE if truth else _FALSE
    if name in _RISING and len(values) == 1:
        low, high = values[0]
        return float(function(low)), float(function(high))
    raise _UnknownError


def _size(value: Bounds) -> Bounds:
    low, high = value
    return (max(low, -high, 0.0), max(-low, high))


def _wave(function: Callable[[float], float], angle: Bounds, peak: float) -> Bounds:
    """A sine or cosine: 1 at ``peak`` and after each full turn, -1 half a turn away."""
    low, high = angle
    if not -_FAR < low <= high < _FAR:
        return -1.0, 1.0
    ends = function(low), function(high)

    def passes(place: float) -> bool:
        return math.floor((high - place) / math.tau) > math.floor((low - place) / math.tau)

    return -1.0 if passes(peak + math.pi) else min(ends), 1.0 if passes(peak) else max(ends)
