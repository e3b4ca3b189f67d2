"""Operators of Ptolemy II's expressions, and the text form of its values."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from decimal import ROUND_HALF_EVEN, Decimal
from itertools import pairwise as neighbours
from typing import Any

from epicycle.actors import elementary

from .budget import spend
from .syntax import ExpressionError

MAX_ELEMENTS = 10_000


class Rows(list[Any]):
    """A matrix: a list of its rows, distinct from an array of arrays."""


def limited(items: list[Any]) -> list[Any]:
    """The items; raises ``ExpressionError`` if there are too many."""
    if len(items) > MAX_ELEMENTS:
        raise ExpressionError(f"it has more than the maximum of {MAX_ELEMENTS:,} elements")
    return items


def truth(value: Any) -> bool:
    """A truth value; raises ``TypeError``."""
    if not isinstance(value, bool):
        raise TypeError(f"{value!r} is not a truth value")
    return value


def number(value: Any) -> Any:
    """A number; raises ``TypeError``."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"{value!r} is not a number")
    return value


# -- as texts -----------------------------------------------------------------------------------------------------


def java_text(value: Any) -> str:
    """A value as Ptolemy writes it as text."""
    spend(1 + len(value) // 10 if isinstance(value, str) else 1)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return _java_double(value)
    if isinstance(value, Rows):
        return "[" + "; ".join(", ".join(map(java_text, row)) for row in value) + "]"
    if isinstance(value, list):
        return "{" + ", ".join(_quoted(each) for each in value) + "}"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name} = {_quoted(each)}" for name, each in sorted(value.items())) + "}"
    if value is None:
        return "nil"
    if not isinstance(value, (str, int)):
        raise TypeError("it has no text form")
    return str(value)


def _quoted(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else java_text(value)


def _java_double(value: float) -> str:
    """With up to 13 decimals, and an exponent if it is 0.001 or less, or a million or more."""
    if math.isinf(value) or math.isnan(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    exact = Decimal(repr(value))
    if value == 0 or 1e-3 < abs(value) < 1e6:
        text = format(exact.quantize(Decimal("1e-13"), ROUND_HALF_EVEN), "f").rstrip("0")
        return f"{text}0" if text.endswith(".") else text
    power = exact.adjusted()
    mantissa = format(exact.scaleb(-power).quantize(Decimal("1e-15"), ROUND_HALF_EVEN), "f").rstrip("0")
    return f"{mantissa}{'0' if mantissa.endswith('.') else ''}E{power}"


# -- arrays, records and matrices ---------------------------------------------------------------------------------


def unified(items: list[Any]) -> list[Any]:
    """The elements of an array converted to one type: text if one is a text, otherwise double if one is a double."""
    kinds = {type(each) for each in items}
    if kinds == {int, float}:
        return [float(each) for each in items]
    if str in kinds and len(kinds) > 1 and kinds <= {str, int, float, bool, Rows}:
        return [java_text(each) for each in items]
    if kinds == {dict} and len(items) > 1:
        names = [name for name in items[0] if all(name in each for each in items)]
        fields = [unified([each[name] for each in items]) for name in names]
        return [dict(zip(names, values, strict=True)) for values in zip(*fields, strict=True)] if names else items
    if kinds in ({list}, {Rows}) and len(items) > 1:
        flat = unified([part for each in items for part in each])
        ends = [0]
        for each in items:
            ends.append(ends[-1] + len(each))
        kind = kinds.pop()
        return [kind(flat[start:end]) for start, end in neighbours(ends)]
    return items


def pairwise(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """The function, applied to arrays, matrices and records element by element."""

    def apply(left: Any, right: Any) -> Any:
        if isinstance(left, list) and isinstance(right, list):
            if len(left) != len(right):
                raise TypeError("the arrays have different lengths")
            return type(left)(apply(one, other) for one, other in zip(left, right, strict=True))
        if isinstance(left, list):
            return type(left)(apply(each, right) for each in left)
        if isinstance(right, list):
            return type(right)(apply(left, each) for each in right)
        if isinstance(left, dict) and isinstance(right, dict):
            return {name: apply(left[name], right[name]) for name in left if name in right}
        return function(left, right)

    return apply


def _product(left: Rows, right: Rows) -> Rows:
    """The product of two matrices."""
    columns = list(zip(*right, strict=True))
    if any(len(row) != len(right) for row in left):
        raise TypeError("the sizes of the matrices do not match")
    spend(len(left) * len(columns) * len(right) // 4)
    return Rows([_sum_of_products(row, column) for column in columns] for row in left)


def _sum_of_products(row: Any, column: Any) -> Any:
    found: Any = 0
    for one, other in zip(row, column, strict=True):
        found += number(one) * number(other)
    return found


# -- operators ----------------------------------------------------------------------------------------------------


def _plus(left: Any, right: Any) -> Any:
    if isinstance(left, str) or isinstance(right, str):
        text = java_text(left) + java_text(right)
        limited(list(text[: MAX_ELEMENTS + 1]))
        return text
    if isinstance(left, bool) and isinstance(right, bool):
        return left or right
    return number(left) + number(right)


def _multiplied(left: Any, right: Any) -> Any:
    if isinstance(left, bool) and isinstance(right, bool):
        return left and right
    return number(left) * number(right)


_each_times = pairwise(_multiplied)
_each_plus = pairwise(_plus)
minus = pairwise(lambda left, right: number(left) - number(right))


def plus(left: Any, right: Any) -> Any:
    """The sum, element by element; a matrix added to a text becomes text."""
    if {type(left), type(right)} == {str, Rows}:
        return _plus(left, right)
    return _each_plus(left, right)


def times(left: Any, right: Any) -> Any:
    """The product: the matrix product for matrices, element by element otherwise."""
    if isinstance(left, Rows) and isinstance(right, Rows):
        return _product(left, right)
    return _each_times(left, right)


def _divided(left: Any, right: Any) -> Any:
    left, right = number(left), number(right)
    if isinstance(left, int) and isinstance(right, int):
        if right == 0:
            raise ZeroDivisionError("division by zero")
        quotient = abs(left) // abs(right)  # towards zero, as in Java
        return quotient if (left < 0) == (right < 0) else -quotient
    if right == 0:
        if left == 0 or math.isnan(left):
            return math.nan
        return math.inf if (left > 0) == (math.copysign(1.0, right) > 0) else -math.inf
    return left / right


def _rest(left: Any, right: Any) -> Any:
    left, right = number(left), number(right)
    if isinstance(left, int) and isinstance(right, int):
        if right == 0:
            raise ZeroDivisionError("division by zero")
        return abs(left) % abs(right) * (-1 if left < 0 else 1)  # with the sign of the first operand, as in Java
    return math.fmod(left, right)


def _raised(left: Any, right: Any) -> Any:
    base, exponent = number(left), number(right)
    if isinstance(exponent, int) and isinstance(base, int) and exponent >= 0:
        if exponent * max(abs(base), 2).bit_length() > 2000:
            raise OverflowError("the result is too large")
        return elementary.power(base, exponent)
    return elementary.power(float(base), exponent)


def equal(left: Any, right: Any) -> bool:
    """Whether two values are equal; a text is compared with the text form of the other."""
    if isinstance(left, str) is not isinstance(right, str):
        return java_text(left) == java_text(right)
    return isinstance(left, bool) is isinstance(right, bool) and bool(left == right)


def _whole(value: Any) -> int:
    if type(value) not in (int, bool) or abs(value) >= 2**63:
        raise TypeError(f"{value!r} is not a whole number")
    return int(value)


def _shift(left: Any, right: Any) -> int:
    bits, by = _whole(left), _whole(right)
    if not -63 <= by <= 63:
        raise ExpressionError("the shift is too large")
    return bits << by if by >= 0 else bits >> -by


def _shift_without_sign(left: Any, right: Any) -> int:
    bits = _whole(left)
    return _shift(bits % 2**32 if -(2**31) <= bits < 2**31 else bits, -_whole(right))


OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": plus,
    "-": minus,
    "*": times,
    "/": pairwise(_divided),
    "%": pairwise(_rest),
    "^": _raised,
    "==": equal,
    "!=": lambda left, right: not equal(left, right),
    "<": lambda left, right: number(left) < number(right),
    "<=": lambda left, right: number(left) <= number(right),
    ">": lambda left, right: number(left) > number(right),
    ">=": lambda left, right: number(left) >= number(right),
    "|": lambda left, right: left or right if isinstance(left, bool) else _whole(left) | _whole(right),
    "&": lambda left, right: left and right if isinstance(left, bool) else _whole(left) & _whole(right),
    "#": lambda left, right: left != right if isinstance(left, bool) else _whole(left) ^ _whole(right),
    "<<": _shift,
    ">>": lambda left, right: _shift(left, -_whole(right)),
    ">>>": _shift_without_sign,
}
