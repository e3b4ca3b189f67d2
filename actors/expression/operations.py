"""What expressions that have become functions do with values that are not plain numbers.

Each function does what the evaluator does, or raises one of ``UNDECIDED``.  Values are tokens as they came: what looks
at one makes an operand of it.
"""

from __future__ import annotations

import ast
import dataclasses
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Final, NoReturn

import numpy as np

from ..core import MAX_DEPTH, UnitError
from .budget import MAX_ELEMENTS, MAX_TEXT, BudgetError, size_of
from .tokens import operand
from .values import BINARY, COMPARE, MAX_INT, UNARY, check_result, subscript

UNDECIDED: Final = (ArithmeticError, BudgetError, LookupError, TypeError, UnitError, ValueError)
NUMBERS: Final = frozenset({float, int})
LIGHT: Final = frozenset({float, int, bool, type(None)})  # which cost nothing
_PLAIN: Final = frozenset({float, int, bool, type(None), str, list, dict})
_OF_SLICES: Final = frozenset({int, type(None)})
_OTHERS: Final = (int, float, str, list, tuple, Mapping, np.generic, np.ndarray, type)
_DEEP: Final = MAX_DEPTH - 10

Left = list[int]  # the steps that are left, in a list of one


def undecided() -> NoReturn:
    """Leave the expression to the evaluator."""
    raise OverflowError


def handed(value: Any) -> Any:
    """The value of an expression, checked; a copy, because it becomes a token."""
    kind = type(value)
    if kind is float:
        return value if value == value else undecided()  # noqa: PLR0124  true of NaN
    if kind is int:
        return value if -MAX_INT <= value <= MAX_INT else undecided()
    if kind is bool or value is None:
        return value
    if kind is str:
        return value if len(value) <= MAX_TEXT else undecided()
    made = _copied(value, left := [MAX_ELEMENTS], 0)
    if left[0] < 0:
        undecided()
    if made is None:
        made = operand(value)
        if type(made) not in _PLAIN:
            undecided()
        check_result(made)
    return made


def _copied(value: Any, left: Left, depth: int) -> Any:
    """A checked copy of a list or dict of plain things; None if it is, or holds, anything else."""
    made: Any
    items: Any
    if type(value) is dict:
        if not _has_texts(value):
            return None
        made, items = value.copy(), value.items()
    elif type(value) is list:
        made, items = value.copy(), enumerate(value)
    else:
        return None
    left[0] -= len(made)
    if depth > _DEEP or left[0] < 0:
        return None
    for key, item in items:
        kind = type(item)
        if kind is float:
            if item != item:  # noqa: PLR0124  true of NaN
                undecided()
        elif kind is int:
            if not -MAX_INT <= item <= MAX_INT:
                undecided()
        elif kind is str:
            left[0] -= len(item) // 10
        elif kind is not bool and item is not None:
            made[key] = inner = _copied(item, left, depth + 1)
            if inner is None:
                return None
    return made


def plain(value: Any) -> Any:
    """A value as an operand, but for what is in it."""
    return value if type(value) in _PLAIN else _converted(value)


def _converted(value: Any) -> Any:
    found = operand(value)
    if _is_odd(found):
        undecided()
    return found


def _is_odd(value: Any) -> bool:
    """Whether an operand is, or holds, what the language does not know, or NaN: in a list, this equals itself, but not
    the one in another copy of the list."""
    kind = type(value)
    if kind is list or kind is dict:
        return any(map(_is_odd, value.values() if kind is dict else value))
    return kind not in _PLAIN or value != value  # noqa: PLR0124  true of NaN


def paid(value: Any, left: Left) -> Any:
    """A value that was made, paid for by its length."""
    kind = type(value)
    if kind in LIGHT:
        return value
    size = len(value)
    left[0] -= size // 10
    if left[0] < 0 or size > (MAX_TEXT if kind is str else MAX_ELEMENTS):
        undecided()
    return value


def weighed(value: Any, left: Left) -> Any:
    """A value that is searched as an operand, paid for by its size."""
    kind = type(value)
    if kind in LIGHT:
        return value
    size = _size(value, 0) if kind is list or kind is dict else -1
    if size < 0:
        value = _converted(value)
        if isinstance(value, str):
            size = len(value)
            if size > MAX_TEXT:
                undecided()
        else:
            size = size_of(value)
    left[0] -= size // 10
    if left[0] < 0 or size > MAX_ELEMENTS:
        undecided()
    return value


def _size(value: Any, depth: int) -> int:
    """The elements of a list or dict of plain things at all levels; negative if it holds anything else."""
    size = len(value)
    if type(value) is dict:
        if not _has_texts(value):
            return -1
        value = value.values()
    elif LIGHT.issuperset(map(type, value)):
        return size
    for item in value:
        kind = type(item)
        if kind is str:
            size += len(item) // 10
        elif kind is list or kind is dict:
            inner = _size(item, depth + 1) if depth < _DEEP else -1
            if inner < 0:
                return -1
            size += inner
        elif kind not in LIGHT:
            return -1
    return size


def _has_texts(value: dict[Any, Any]) -> bool:
    """Whether all keys are texts."""
    for key in value:  # noqa: SIM110  a generator takes longer
        if type(key) is not str:
            return False
    return True


@cache
def _fields(cls: type) -> frozenset[str]:
    """The fields of a dataclass that counts as one."""
    if not dataclasses.is_dataclass(cls) or issubclass(cls, _OTHERS):
        return frozenset()
    return frozenset(each.name for each in dataclasses.fields(cls))


def part(whole: Any, index: Any) -> Any:
    """`whole[index]`, or a field of a dataclass."""
    if type(index) is str:
        if type(whole) is dict:
            return whole[index]
        kind: type = type(whole)
        if index in _fields(kind):
            return getattr(whole, index)
    elif type(index) is int and type(whole) in (list, tuple, str):
        return whole[index]
    return subscript(plain(whole), plain(index))


def cut(whole: Any, lower: Any, upper: Any, step: Any, left: Left) -> Any:
    """A slice of a list or text."""
    bounds = plain(lower), plain(upper), plain(step)
    whole = plain(whole)
    if not isinstance(whole, (list, str)) or not _OF_SLICES.issuperset(map(type, bounds)):
        undecided()
    return paid(whole[slice(*bounds)], left)


def turns(whole: Any, left: Left, steps: int) -> Any:
    """The items of a list, each of which takes so many steps."""
    if type(whole) is not list:
        whole = plain(whole)
        if type(whole) is not list:
            undecided()
    left[0] -= len(whole) * steps
    if left[0] < 0:
        undecided()
    return whole


def _of_one(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda value: function(plain(value))


def _of_two(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any, Left], Any]:
    return lambda first, second, left: paid(function(plain(first), plain(second)), left)


def _joining(function: Callable[[Any, Any, Left], Any]) -> Callable[[Any, Any, Left], Any]:
    """An addition that takes the shortest way for lists."""

    def add(first: Any, second: Any, left: Left) -> Any:
        both = type(first) is type(second) is list
        return paid([*first, *second], left) if both else function(first, second, left)

    return add


def _comparing(function: Callable[[Any, Any], bool]) -> Callable[[Any, Any, Left], bool]:
    return lambda first, second, left: function(weighed(first, left), weighed(second, left))


def _finding(is_wanted: bool) -> Callable[[Any, Any, Left], bool]:
    """Whether something is in a list, or is not, which takes the shortest way."""
    find = _comparing(COMPARE[ast.In])

    def found(first: Any, second: Any, left: Left) -> bool:
        if type(second) is list and not second:
            return not is_wanted
        return find(first, second, left) is is_wanted

    return found


# By the names of their nodes in the tree.
OPERATORS: Final[dict[type[ast.AST], Callable[..., Any]]] = {
    **{kind: _of_one(function) for kind, function in UNARY.items()},
    **{kind: _of_two(function) for kind, function in BINARY.items()},
    **{kind: _comparing(function) for kind, function in COMPARE.items()},
    ast.Add: _joining(_of_two(BINARY[ast.Add])),
    ast.In: _finding(True),
    ast.NotIn: _finding(False),
}
