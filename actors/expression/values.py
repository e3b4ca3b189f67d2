"""What expressions compute with: operators, functions and constants, each checked before it becomes costly."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable
from typing import Any, Final

from ..core import Quantity, counted, did_you_mean, elementary
from .budget import check_elements, check_text, size_of
from .tables import interpolate

MAX_INT = 2**63
_MAX_DECIMALS = 30

NUMBER: Final = (int, float)
LIST: Final = (list, tuple)
CONSTANTS: Final = {"pi": math.pi, "e": math.e, "inf": math.inf}


def check_result(value: object) -> None:
    """Raise if the value that an expression hands out is too large or has a NaN in it."""
    if isinstance(value, str):
        check_text(len(value))
    size_of(value)
    stack = [value]
    while stack:
        item = stack.pop()
        if isinstance(item, float) and math.isnan(item):
            raise ValueError("the result is not a number (NaN)")
        if isinstance(item, Quantity):
            item.si  # noqa: B018  raises any error of the conversion to SI units
        elif isinstance(item, int):
            _checked(item)
        elif isinstance(item, (list, tuple, dict)):
            stack += item.values() if isinstance(item, dict) else item


_KINDS: Final[tuple[tuple[type | tuple[type, ...], str], ...]] = (
    (bool, "a truth value"),  # before int, because a bool is an int, too
    ((int, float), "a number"),
    (str, "a text"),
    ((list, tuple), "a list"),
    (dict, "a dict"),
)


_ORDERED: Final[tuple[Any, ...]] = (NUMBER, str, LIST)  # values of one kind can be ordered


def kind_of(value: object) -> str:
    """Return what kind of thing a value is, in words."""
    if value is None:
        return "null"
    for kind, word in _KINDS:
        if isinstance(value, kind):
            return word
    return f"a value of type {type(value).__name__}"


def text_of(value: object) -> str:
    """Return a value as it appears in a text: `true`, `null`, `3`, `2.5`, `[1, 'a']`."""
    size_of(value)  # which bounds what must be written
    text = value if isinstance(value, str) else _written(value)
    check_text(len(text))
    return text


def _written(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key!r}: {_written(item)}" for key, item in value.items()) + "}"
    if isinstance(value, LIST):
        return "[" + ", ".join(map(_written, value)) + "]"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, float):  # by its own name, because subclasses show their type
        return float.__repr__(value.si if isinstance(value, Quantity) else value)
    return repr(value) if isinstance(value, str) else str(value)


# --- operators ----------------------------------------------------------------------------------------


def _checked(result: Any, *operands: Any) -> Any:
    """Return the result if it is a real number of reasonable size, and infinite only if an operand was."""
    if isinstance(result, complex):
        raise ValueError("the result is not a real number")
    if isinstance(result, int):
        if abs(result) > MAX_INT:
            raise OverflowError
    elif math.isnan(result):
        raise ValueError("the result is not a number (NaN)")
    elif math.isinf(result) and not any(isinstance(x, float) and math.isinf(x) for x in operands):
        raise OverflowError
    return result


def _arithmetic(sign: str, function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def apply(left: Any, right: Any) -> Any:
        if not (isinstance(left, NUMBER) and isinstance(right, NUMBER)):
            raise TypeError(f"{sign} needs two numbers, not {kind_of(left)} and {kind_of(right)}")
        return _checked(function(left, right), left, right)

    return apply


def _add(left: Any, right: Any) -> Any:
    if isinstance(left, NUMBER) and isinstance(right, NUMBER):
        return _checked(left + right, left, right)
    if isinstance(left, str) and isinstance(right, str):
        check_text(len(left) + len(right))
        return left + right
    if isinstance(left, LIST) and isinstance(right, LIST):
        check_elements(len(left) + len(right))
        return [*left, *right]
    raise TypeError(f"+ needs two numbers, two texts or two lists, not {kind_of(left)} and {kind_of(right)}")


def _multiply(left: Any, right: Any) -> Any:
    if isinstance(left, NUMBER) and isinstance(right, NUMBER):
        return _checked(left * right, left, right)
    whole, times = (right, left) if isinstance(left, int) else (left, right)
    if isinstance(times, int) and isinstance(whole, str):
        check_text(len(whole) * times)
        return whole * times
    if isinstance(times, int) and isinstance(whole, LIST):
        check_elements(len(whole) * times)
        return list(whole) * times
    raise TypeError(
        f"* needs two numbers, or a text or list and a whole number, not {kind_of(left)} and {kind_of(right)}"
    )


def _power(base: Any, exponent: Any) -> Any:
    # An int of b bits to the power n has at least (b - 1) * n bits: known before it is computed.
    if isinstance(base, int) and isinstance(exponent, int) and (base.bit_length() - 1) * exponent > 64:
        raise OverflowError
    if isinstance(base, Quantity) or isinstance(exponent, Quantity):
        return base**exponent
    return elementary.power(base, exponent)


def _ordering(sign: str, function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], bool]:
    def apply(left: Any, right: Any) -> bool:
        for kind in _ORDERED:
            if isinstance(left, kind) and isinstance(right, kind):
                return bool(function(left, right))
        raise TypeError(f"{sign} cannot compare {kind_of(left)} with {kind_of(right)}")

    return apply


def _contains(item: Any, whole: Any) -> bool:
    if isinstance(whole, str) and not isinstance(item, str):
        raise TypeError(f"'in' looks for a text in a text, not for {kind_of(item)}")
    if isinstance(whole, dict):
        return isinstance(item, str) and item in whole
    if not isinstance(whole, (str, list, tuple)):
        raise TypeError(f"'in' needs a list, dict or text on its right, not {kind_of(whole)}")
    return item in whole


def _signed(sign: str, function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def apply(value: Any) -> Any:
        if not isinstance(value, NUMBER):
            raise TypeError(f"{sign} needs a number, not {kind_of(value)}")
        return function(value)

    return apply


UNARY: Final[dict[type[ast.unaryop], Callable[[Any], Any]]] = {
    ast.USub: _signed("-", operator.neg),
    ast.UAdd: _signed("+", operator.pos),
}
BINARY: Final[dict[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: _add,
    ast.Sub: _arithmetic("-", operator.sub),
    ast.Mult: _multiply,
    ast.Div: _arithmetic("/", operator.truediv),
    ast.FloorDiv: _arithmetic("//", operator.floordiv),
    ast.Mod: _arithmetic("%", operator.mod),
    ast.Pow: _arithmetic("**", _power),
}
COMPARE: Final[dict[type[ast.cmpop], Callable[[Any, Any], bool]]] = {
    ast.Eq: lambda left, right: bool(left == right),
    ast.NotEq: lambda left, right: bool(left != right),
    ast.Lt: _ordering("<", operator.lt),
    ast.LtE: _ordering("<=", operator.le),
    ast.Gt: _ordering(">", operator.gt),
    ast.GtE: _ordering(">=", operator.ge),
    ast.In: _contains,
    ast.NotIn: lambda item, whole: not _contains(item, whole),
}


def subscript(whole: Any, index: object) -> Any:
    """Return `whole[index]`: an element of a list, a character of a text, or the value of a key."""
    if isinstance(whole, dict):
        if not isinstance(index, str):
            raise TypeError(f"a dict is indexed by a text, not by {kind_of(index)}")
        if index not in whole:
            keys = [str(key) for key in whole]
            guess = did_you_mean(index, keys) or ","
            raise ValueError(f"there is no key {index!r}{guess} known keys: {', '.join(sorted(keys)[:20])}")
        return whole[index]
    if not isinstance(whole, (list, tuple, str)):
        raise TypeError(f"{kind_of(whole)} has no elements")
    if type(index) is not int:
        raise TypeError(f"{kind_of(whole)} is indexed by a whole number, not by {kind_of(index)}")
    if not -len(whole) <= index < len(whole):
        number = counted(len(whole), "element")
        raise ValueError(f"there is no element {index} in {kind_of(whole)} of {number}, counted from 0")
    return whole[index]


# --- functions ----------------------------------------------------------------------------------------


def _function(
    name: str, function: Callable[..., Any], least: int = 1, most: float = 1, *, of_numbers: bool = True
) -> Callable[..., Any]:
    """A function that explains its arguments; given numbers, it returns a number of reasonable size."""

    def call(*values: Any) -> Any:
        if not least <= len(values) <= most:
            wanted = f"at least {least}" if most == math.inf else f"{least}" if least == most else f"{least} to {most}"
            raise TypeError(f"{name} takes {wanted} value{'' if wanted.endswith('1') else 's'}, not {len(values)}")
        if not of_numbers:
            return function(*values)
        for value in values:
            if not isinstance(value, NUMBER):
                raise TypeError(f"{name} needs numbers, not {kind_of(value)}")
        try:
            result = function(*values)
        except ValueError:
            raise ValueError(f"{name} is not defined for {', '.join(map(str, values))}") from None
        return _checked(result, *values)

    return call


def _keeping_unit(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which returns a quantity in the unit of the first number, if it has one."""

    def call(first: Any, *others: Any) -> Any:
        if not isinstance(first, Quantity):
            return function(first, *others)
        beside = [other.to(first.unit) if isinstance(other, Quantity) else other for other in others]
        return Quantity(function(float(first), *beside), first.unit)

    return call


def _in_unit(unit: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function of plain numbers, given quantities in this unit; in SI units if it is empty."""

    def call(*values: Any) -> Any:
        plain = [value if not isinstance(value, Quantity) else value.to(unit) if unit else value.si for value in values]
        return function(*plain)

    return call


def _angle(unit: str, function: Callable[[float], float]) -> Callable[[Any], float]:
    """``radians`` or ``degrees``: of a plain number, or of an angle, which has a unit."""
    return lambda value: value.to(unit) if isinstance(value, Quantity) else function(value)


def _log(x: float, base: float = math.e) -> float:
    exact = {math.e: elementary.log, 2: elementary.log2, 10: elementary.log10}
    return exact[base](x) if base in exact else elementary.log(x) / elementary.log(base)


def _round(value: Any, decimals: Any = None) -> Any:
    if decimals is None:
        return round(value)
    if not isinstance(decimals, int) or abs(decimals) > _MAX_DECIMALS:
        raise TypeError(f"round takes a whole number of decimals up to {_MAX_DECIMALS}, not {decimals}")
    return round(value, decimals)


def _range(*values: Any) -> list[int]:
    for value in values:
        if not isinstance(value, int):
            shown = text_of(value) if isinstance(value, float) else kind_of(value)
            raise TypeError(f"range needs whole numbers, not {shown}")
    if len(values) == 3 and values[2] == 0:
        raise ValueError("range needs a step other than 0")
    numbers = range(*values)
    check_elements(len(numbers))
    return list(numbers)


def _len(value: Any) -> int:
    if not isinstance(value, (list, tuple, str, dict)):
        raise TypeError(f"{kind_of(value)} has no length")
    return len(value)


def _needs_list(name: str, value: Any) -> list[Any]:
    if not isinstance(value, LIST):
        raise TypeError(f"{name} needs a list, not {kind_of(value)}")
    return list(value)


def _sum(value: Any) -> Any:
    items = _needs_list("sum", value)
    for item in items:
        if not isinstance(item, NUMBER):
            raise TypeError(f"sum needs a list of numbers, but this one contains {kind_of(item)}")
    return _checked(elementary.total(items), *items)


def _ordered(name: str, items: list[Any]) -> list[Any]:
    """Return the items if they can be ordered."""
    if not any(all(isinstance(item, kind) for item in items) for kind in _ORDERED):
        raise TypeError(f"{name} cannot compare {' with '.join(sorted({kind_of(item) for item in items}))}")
    return items


def _extreme(name: str, function: Callable[[list[Any]], Any]) -> Callable[..., Any]:
    def call(*values: Any) -> Any:
        items = _ordered(name, _needs_list(name, values[0]) if len(values) == 1 else list(values))
        if not items:
            raise ValueError(f"{name} needs at least one element")
        return function(items)

    return call


def _converted(kind: type[int] | type[float], words: str) -> Callable[[Any], Any]:
    def convert(value: Any) -> Any:
        if not isinstance(value, (int, float, str)):
            raise TypeError(f"{kind_of(value)} cannot become {words}")
        try:
            result = kind(value.si if isinstance(value, Quantity) else value)
        except ValueError:
            raise ValueError(f"{value!r} is not {words}") from None
        return result if isinstance(value, str) and math.isinf(result) else _checked(result, value)

    return convert


FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    name: _function(name, *rest, of_numbers=True)
    for name, *rest in (
        ("abs", abs),
        ("round", _keeping_unit(_round), 1, 2),
        ("floor", _keeping_unit(math.floor)),
        ("ceil", _keeping_unit(math.ceil)),
        ("sqrt", _in_unit("", math.sqrt)),
        ("exp", _in_unit("1", elementary.exp)),
        ("log", _in_unit("1", _log), 1, 2),
        ("sin", _in_unit("rad", elementary.sin)),
        ("cos", _in_unit("rad", elementary.cos)),
        ("tan", _in_unit("rad", elementary.tan)),
        ("atan2", _in_unit("", elementary.atan2), 2, 2),
        ("hypot", _keeping_unit(elementary.hypot), 1, math.inf),
        ("radians", _angle("rad", math.radians)),
        ("degrees", _angle("deg", math.degrees)),
    )
} | {
    name: _function(name, *rest, of_numbers=False)
    for name, *rest in (
        ("min", _extreme("min", min), 1, math.inf),
        ("max", _extreme("max", max), 1, math.inf),
        ("sum", _sum),
        ("interpolate", interpolate, 3, 5),
        ("len", _len),
        ("range", _range, 1, 3),
        ("int", _converted(int, "a whole number")),
        ("float", _converted(float, "a number")),
        ("str", text_of),
        ("bool", bool),
        ("sorted", lambda value: sorted(_ordered("sorted", _needs_list("sorted", value)))),
    )
}
