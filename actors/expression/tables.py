"""Tables in expressions: ``interpolate``, which is linear between the points of a table and beyond its ends."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

from ..core import Quantity, counted

_LEAST: Final = 2  # points on an axis
Axis = tuple[float, ...]
Tables = tuple[Axis, Axis] | tuple[Axis, Axis, tuple[Axis, ...]]


def interpolate(*arguments: Any) -> float:
    """``interpolate(x, at, values)`` or ``interpolate(x, y, at_x, at_y, rows)``, with a row of values for each x.

    Raises ``TypeError`` and ``ValueError`` for what is no table.
    """
    if len(arguments) not in (3, 5):
        raise TypeError(f"interpolate takes 3 values, or 5 for a table of two arguments, not {len(arguments)}")
    many = len(arguments) // 2
    return looked_up(tables_of(arguments[many:]), *arguments[:many])


def tables_of(given: Sequence[Any]) -> Tables:
    """The axes and values of a table, checked; raises ``TypeError`` and ``ValueError``."""
    *axes, values = given
    names = ["at"] if len(axes) == 1 else ["at_x", "at_y"]
    checked = [_axis(name, each) for name, each in zip(names, axes, strict=True)]
    if len(axes) == 1:
        return checked[0], _row("values", values, checked[0], "at")
    if not isinstance(values, (list, tuple)) or len(values) != len(checked[0]):
        raise ValueError(f"interpolate needs a row for each of the {counted(len(checked[0]), 'number')} in at_x")
    return checked[0], checked[1], tuple(_row("each row", each, checked[1], "at_y") for each in values)


def looked_up(tables: Tables, *arguments: Any) -> float:
    """The value of a checked table; raises ``TypeError`` for what is not a number."""
    numbers = [_number(each) for each in arguments]
    return along(*numbers, *tables) if len(numbers) == 1 else across(*numbers, *tables)  # type: ignore[arg-type]


def along(x: float, at: Axis, values: Axis) -> float:
    """The value at ``x`` of a table of one argument."""
    right = bisect_left(at, x, 1, len(at) - 1)
    start, value = at[right - 1], values[right - 1]
    return value + (values[right] - value) * ((x - start) / (at[right] - start))


def across(x: float, y: float, at_x: Axis, at_y: Axis, rows: tuple[Axis, ...]) -> float:
    """The value at ``x`` and ``y`` of a table of two arguments."""
    right = bisect_left(at_x, x, 1, len(at_x) - 1)
    start = at_x[right - 1]
    value = along(y, at_y, rows[right - 1])
    return value + (along(y, at_y, rows[right]) - value) * ((x - start) / (at_x[right] - start))


def _axis(name: str, given: Any) -> Axis:
    numbers = _numbers(name, given)
    if len(numbers) < _LEAST or any(not one < other for one, other in pairwise(numbers)):
        raise ValueError(f"interpolate needs at least two rising numbers in {name}")
    return numbers


def _row(name: str, given: Any, axis: Axis, beside: str) -> Axis:
    numbers = _numbers(name, given)
    if len(numbers) != len(axis):
        raise ValueError(f"interpolate needs as many numbers in {name} as in {beside}: {len(axis)}, not {len(numbers)}")
    return numbers


def _numbers(name: str, given: Any) -> Axis:
    if not isinstance(given, (list, tuple)):
        raise TypeError(f"interpolate needs a list of numbers in {name}")
    return tuple(map(_number, given))


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"interpolate needs numbers, not {'a text' if isinstance(value, str) else repr(value)}")
    return value.si if isinstance(value, Quantity) else float(value)
