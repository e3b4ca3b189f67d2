"""What expressions of Ptolemy II come to: numbers, texts, truth values, arrays as lists, records as dicts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from epicycle.actors import elementary

from .syntax import (
    Array,
    Binary,
    Call,
    Choice,
    Const,
    ExpressionError,
    Matrix,
    Method,
    Name,
    Record,
    Steps,
    Tree,
    Unary,
)

MAX_ELEMENTS = 10_000
CONSTANTS: Mapping[str, object] = {
    "PI": math.pi,
    "pi": math.pi,
    "E": math.e,
    "e": math.e,
    "Infinity": math.inf,
    "PositiveInfinity": math.inf,
    "NegativeInfinity": -math.inf,
    "MaxDouble": 1.7976931348623157e308,
    "MinDouble": 5e-324,
    "MaxInt": 2**31 - 1,
    "MinInt": -(2**31),
    "MaxLong": 2**63 - 1,
    "MinLong": -(2**63),
    "MaxShort": 2**15 - 1,
    "MinShort": -(2**15),
    "MaxUnsignedByte": 255,
    "MinUnsignedByte": 0,
    # types, by a value of theirs
    "boolean": False,
    "int": 0,
    "long": 0,
    "double": 0.0,
    "string": "",
}
Scope = Callable[[str], object]


class Rows(list[Any]):
    """A matrix: a list of its rows, which is no array of arrays."""


def evaluate(tree: Tree, scope: Scope) -> Any:
    """The value; ``scope`` finds that of a name, or raises ``KeyError``.  Raises ``ExpressionError``."""
    try:
        return _value(tree, scope)
    except KeyError as error:
        raise ExpressionError(f"{error.args[0]!r} is not known") from None
    except RecursionError:
        raise ExpressionError("it is nested too deeply") from None
    except (TypeError, ValueError, IndexError, ZeroDivisionError, OverflowError, AttributeError, MemoryError) as error:
        raise ExpressionError(f"it cannot be computed: {error}") from None


def _value(tree: Tree, scope: Scope) -> Any:
    match tree:
        case Const(value):
            return value
        case Name(name):
            try:
                return scope(name)
            except KeyError:
                return CONSTANTS[name]
        case Unary(sign, operand):
            value = _value(operand, scope)
            return not _truth(value) if sign == "!" else ~value if sign == "~" else _times(value, -1)
        case Binary("&&", left, right):
            return _truth(_value(left, scope)) and _truth(_value(right, scope))
        case Binary("||", left, right):
            return _truth(_value(left, scope)) or _truth(_value(right, scope))
        case Binary(sign, left, right):
            return _BINARY[sign](_value(left, scope), _value(right, scope))
        case Choice(test, one, other):
            return _value(one if _truth(_value(test, scope)) else other, scope)
        case Call():
            return _called(tree, scope)
        case Method(of, name, arguments):
            whole = _value(of, scope)
            given = [_value(each, scope) for each in arguments or ()]
            if isinstance(whole, dict) and name in whole:
                whole = whole[name]
                for index in given:
                    whole = _at(whole, index)
                return whole
            if name not in _FUNCTIONS:
                raise ExpressionError(f"the function {name!r} is not known here")
            return _FUNCTIONS[name](whole, *given)
        case Array(items):
            found = [_value(each, scope) for each in items]
            # One type for all elements: as soon as there is a double, all are.
            kinds = {type(each) for each in found}
            return [float(each) for each in found] if kinds == {int, float} else found
        case Record(fields):
            return {name: _value(each, scope) for name, each in fields}
        case Matrix(rows):
            return Rows([_value(each, scope) for each in row] for row in rows)
        case Steps(first, step, last):
            one, by, end = (_value(each, scope) for each in (first, step, last))
            return Rows([_limited(_stepped(one, by, end))])
    raise ExpressionError("it is not understood")


def _called(tree: Call, scope: Scope) -> Any:
    arguments = [_value(each, scope) for each in tree.arguments]
    whole: Any
    if isinstance(tree.function, Name):
        try:
            whole = scope(tree.function.name)
        except KeyError:
            if tree.function.name not in _FUNCTIONS:
                raise ExpressionError(f"the function {tree.function.name!r} is not known here") from None
            return _FUNCTIONS[tree.function.name](*arguments)
    else:
        whole = _value(tree.function, scope)
    for index in arguments:
        whole = whole[0] if len(arguments) > 1 and index is None else _at(whole, index)
    return whole


def _at(whole: Any, index: Any) -> Any:
    if not isinstance(whole, (list, str)) or type(index) is not int or not 0 <= index < len(whole):
        raise ExpressionError(f"there is no element {index}")
    return whole[index]


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"{value!r} is no truth value")
    return value


def _limited(items: list[Any]) -> list[Any]:
    if len(items) > MAX_ELEMENTS:
        raise ExpressionError(f"it has more than {MAX_ELEMENTS:,} elements")
    return items


def _stepped(first: Any, step: Any, last: Any) -> list[Any]:
    if not step or (last - first) / step > MAX_ELEMENTS:
        raise ExpressionError(f"it has more than {MAX_ELEMENTS:,} elements")
    count = math.floor((last - first) / step + 1e-9) + 1
    return [first + number * step for number in range(max(count, 0))]


# -- operators ----------------------------------------------------------------------------------------------------


def java_text(value: Any) -> str:
    """A value as Ptolemy writes it into a text."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return _java_double(value)
    if isinstance(value, list):
        return "{" + ", ".join(_quoted(each) for each in value) + "}"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name} = {_quoted(each)}" for name, each in sorted(value.items())) + "}"
    return str(value)


def _quoted(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else java_text(value)


def _java_double(value: float) -> str:
    if math.isinf(value) or math.isnan(value):
        return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if value == 0 or 1e-3 <= abs(value) < 1e7:
        text = format(value, "f") if "e" in repr(value) else repr(value)
        return text.rstrip("0") + ("0" if text.rstrip("0").endswith(".") else "") if "." in text else text
    mantissa, _, exponent = format(value, ".17e").partition("e")
    digits, _, power = repr(value).partition("e")
    if power:
        return f"{digits}{'' if '.' in digits else '.0'}E{int(power)}"
    exponent = str(int(exponent))
    shifted = repr(float(f"{value!r}e{-int(exponent)}"))
    return f"{shifted}E{exponent}" if mantissa else shifted


def _pairwise(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """The function, which goes through arrays and records element by element."""

    def apply(left: Any, right: Any) -> Any:
        if isinstance(left, list) and isinstance(right, list):
            if len(left) != len(right):
                raise TypeError("arrays of different lengths")
            return [apply(one, other) for one, other in zip(left, right, strict=True)]
        if isinstance(left, list):
            return [apply(each, right) for each in left]
        if isinstance(right, list):
            return [apply(left, each) for each in right]
        if isinstance(left, dict) and isinstance(right, dict):
            return {name: apply(left[name], right[name]) for name in left if name in right}
        return function(left, right)

    return apply


def _number(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"{value!r} is not a number")
    return value


def _plus(left: Any, right: Any) -> Any:
    if isinstance(left, str) or isinstance(right, str):
        text = java_text(left) + java_text(right)
        _limited(list(text[: MAX_ELEMENTS + 1]))
        return text
    if isinstance(left, bool) and isinstance(right, bool):
        return left or right
    return _number(left) + _number(right)


def _times(left: Any, right: Any) -> Any:
    return _pairwise(lambda one, other: _number(one) * _number(other))(left, right)


def _divided(left: Any, right: Any) -> Any:
    left, right = _number(left), _number(right)
    if isinstance(left, int) and isinstance(right, int):
        if right == 0:
            raise ZeroDivisionError("division by zero")
        quotient = abs(left) // abs(right)  # towards zero, as in Java
        return quotient if (left < 0) == (right < 0) else -quotient
    if right == 0:
        if left == 0 or math.isnan(left):
            raise ZeroDivisionError("it is not a number")
        return math.inf if (left > 0) == (math.copysign(1.0, right) > 0) else -math.inf
    return left / right


def _rest(left: Any, right: Any) -> Any:
    found = math.fmod(_number(left), _number(right))
    return int(found) if isinstance(left, int) and isinstance(right, int) else found


def _raised(left: Any, right: Any) -> Any:
    base, exponent = _number(left), _number(right)
    if isinstance(exponent, int) and isinstance(base, int) and exponent >= 0:
        if exponent * max(abs(base), 2).bit_length() > 2000:
            raise OverflowError("the result is too large")
        return elementary.power(base, exponent)
    return elementary.power(float(base), exponent)


def _equal(left: Any, right: Any) -> bool:
    if isinstance(left, bool) is not isinstance(right, bool):
        return False
    return bool(left == right)


def _whole(value: Any) -> int:
    if type(value) not in (int, bool) or abs(value) >= 2**63:
        raise TypeError(f"{value!r} is not a whole number")
    return int(value)


def _shift(left: Any, right: Any) -> int:
    bits, by = _whole(left), _whole(right)
    if not -63 <= by <= 63:
        raise ExpressionError("it shifts too far")
    return bits << by if by >= 0 else bits >> -by


_BINARY: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": _pairwise(_plus),
    "-": _pairwise(lambda left, right: _number(left) - _number(right)),
    "*": _times,
    "/": _pairwise(_divided),
    "%": _pairwise(_rest),
    "^": _raised,
    "==": _equal,
    "!=": lambda left, right: not _equal(left, right),
    "<": lambda left, right: _number(left) < _number(right),
    "<=": lambda left, right: _number(left) <= _number(right),
    ">": lambda left, right: _number(left) > _number(right),
    ">=": lambda left, right: _number(left) >= _number(right),
    "|": lambda left, right: left or right if isinstance(left, bool) else _whole(left) | _whole(right),
    "&": lambda left, right: left and right if isinstance(left, bool) else _whole(left) & _whole(right),
    "#": lambda left, right: left != right if isinstance(left, bool) else _whole(left) ^ _whole(right),
    "<<": _shift,
    ">>": lambda left, right: _shift(left, -_whole(right)),
}

# -- functions ----------------------------------------------------------------------------------------------------


def _numeric(function: Callable[[float], float]) -> Callable[[Any], Any]:
    def apply(value: Any) -> Any:
        return [apply(each) for each in value] if isinstance(value, list) else function(_number(value))

    return apply


def _best(function: Callable[..., Any]) -> Callable[..., Any]:
    def apply(*values: Any) -> Any:
        items = values[0] if len(values) == 1 and isinstance(values[0], list) else values
        return function(_number(each) for each in items)

    return apply


def _repeated(count: Any, value: Any) -> list[Any]:
    if not 0 <= count <= MAX_ELEMENTS:
        raise ExpressionError(f"it has more than {MAX_ELEMENTS:,} elements")
    return [value] * count


def _cast(kind: Any, value: Any) -> Any:
    if isinstance(kind, list) and kind:
        return [_cast(kind[0], each) for each in value]
    if isinstance(kind, bool):
        return bool(value)
    return java_text(value) if isinstance(kind, str) else type(kind)(_number(value))


def _summed(items: Any) -> Any:
    return elementary.total(items) if items else 0


_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "abs": _numeric(abs),
    "min": _best(min),
    "max": _best(max),
    "floor": _numeric(lambda x: float(math.floor(x))),
    "ceil": _numeric(lambda x: float(math.ceil(x))),
    "round": _numeric(lambda x: math.floor(x + 0.5)),
    "roundToInt": _numeric(lambda x: math.floor(x + 0.5)),
    "sqrt": _numeric(math.sqrt),
    "exp": _numeric(elementary.exp),
    "log": _numeric(elementary.log),
    "log10": _numeric(elementary.log10),
    "log2": _numeric(elementary.log2),
    "sin": _numeric(elementary.sin),
    "cos": _numeric(elementary.cos),
    "tan": _numeric(elementary.tan),
    "asin": _numeric(elementary.asin),
    "acos": _numeric(elementary.acos),
    "atan": _numeric(elementary.atan),
    "atan2": lambda y, x: elementary.atan2(float(y), float(x)),
    "pow": lambda x, y: elementary.power(float(x), y),
    "remainder": math.remainder,
    "sgn": _numeric(lambda x: (x > 0) - (x < 0)),
    "neighborhood": lambda x, y, d: abs(x - y) <= d,
    "length": len,
    "size": len,
    "get": lambda whole, index: whole[index] if isinstance(whole, dict) else _at(whole, index),
    "getElement": _at,
    "sum": _summed,
    "sort": sorted,
    "sortAscending": sorted,
    "sortDescending": lambda items: sorted(items, reverse=True),
    "append": lambda *parts: _limited([each for part in parts for each in part]),
    "concatenate": lambda *parts: _limited(
        [each for part in (parts[0] if len(parts) == 1 else parts) for each in part]
    ),
    "subarray": lambda items, start, count: items[start : start + count],
    "repeat": _repeated,
    "array": lambda *items: list(items),
    "cast": _cast,
    "double": lambda x: float(_number(x)),
    "int": lambda x: int(_number(x)),
    "toString": java_text,
    "stringValue": java_text,
    "contains": lambda items, each: each in items,
    "emptyArray": lambda kind: [],
    "nilArray": lambda kind: [],
    "arrayToMatrix": lambda items, rows, columns: [items[row * columns : (row + 1) * columns] for row in range(rows)],
    "matrixToArray": lambda rows: [each for row in rows for each in row],
    "zeroArray": lambda kind, count=0: _repeated(count, kind),
    "trim": lambda text: text.strip(),
    "substring": lambda text, start, end=None: text[start:end],
    "toLowerCase": lambda text: text.lower(),
    "toUpperCase": lambda text: text.upper(),
    "startsWith": lambda text, start: text.startswith(start),
    "endsWith": lambda text, end: text.endswith(end),
    "indexOf": lambda text, part: text.find(part),
    "isNaN": math.isnan,
    "isInfinite": math.isinf,
}
