"""Functions of Ptolemy II's expressions: those of Java's Math, its own, and methods of texts, arrays and records."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from epicycle.actors import elementary

from .operators import MAX_ELEMENTS, OPERATORS, Rows, equal, java_text, limited, minus, number, plus, times, truth
from .syntax import ExpressionError


def element(whole: Any, index: Any) -> Any:
    """An element of an array; a scalar is its own element 0."""
    if index == 0 and isinstance(whole, (int, float)):
        return whole
    if not isinstance(whole, (list, str)) or type(index) is not int or not 0 <= index < len(whole):
        raise ExpressionError(f"there is no element at index {index}")
    return whole[index]


def _numeric(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """The function, applied to each element of arrays and matrices."""

    def apply(value: Any) -> Any:
        if isinstance(value, list):
            return type(value)(apply(each) for each in value)
        return function(number(value))

    return apply


def _best(function: Callable[..., Any]) -> Callable[..., Any]:
    def apply(*values: Any) -> Any:
        items = values[0] if len(values) == 1 and isinstance(values[0], list) else values
        found = function(number(each) for each in items)
        return float(found) if any(isinstance(each, float) for each in items) else found

    return apply


def _repeated(count: Any, value: Any) -> list[Any]:
    if not 0 <= count <= MAX_ELEMENTS:
        raise ExpressionError(f"it has more than the maximum of {MAX_ELEMENTS:,} elements")
    return [value] * count


def _cast(kind: Any, value: Any) -> Any:
    if isinstance(kind, dict):
        return {name: _cast(each, value[name]) for name, each in kind.items()}
    if isinstance(kind, list):
        return [_cast(kind[0], each) for each in value] if kind else list(value)
    if isinstance(kind, bool):
        return value == "true" if isinstance(value, str) else bool(value)
    if isinstance(kind, str):
        return java_text(value)
    if isinstance(value, list):
        return type(value)(_cast(kind, each) for each in value)
    return type(kind)(value if isinstance(value, str) else number(value))


def _half_up(value: float) -> int:
    return math.floor(value + 0.5)


def _subarray(items: Any, start: int, count: int | None = None) -> Any:
    return items[start:] if count is None else items[start : start + count]


def _extracted(items: Any, chosen: Any) -> list[Any]:
    """The elements at the given indices, or those for which the given array has ``true``."""
    if all(isinstance(each, bool) for each in chosen):
        return [each for each, is_chosen in zip(items, chosen, strict=False) if is_chosen]
    return [element(items, each) for each in chosen]


def _joined(*parts: Any) -> list[Any]:
    return limited([each for part in (parts[0] if len(parts) == 1 else parts) for each in part])


def _close(one: Any, other: Any, distance: Any = 1e-9) -> bool:
    if isinstance(one, list) and isinstance(other, list):
        pairs = zip(one, other, strict=False)
        return len(one) == len(other) and all(_close(left, right, distance) for left, right in pairs)
    if isinstance(one, (bool, str)) or isinstance(other, (bool, str)):
        return equal(one, other)
    return not (number(other) > number(one) + distance or other < one - distance)


def _map(function: Any, *arrays: Any) -> list[Any]:
    return [function(*each) for each in zip(*arrays, strict=True)]


def _filter(function: Any, items: Any, most: int = -1) -> list[Any]:
    found = [each for each in items if truth(function(each))]
    return found if most < 0 else found[:most]


def _fold(function: Any, first: Any, items: Any) -> Any:
    for each in items:
        first = function(first, each)
    return first


def _iterated(function: Any, count: int, first: Any) -> list[Any]:
    found = _repeated(count, first)
    for place in range(1, count):
        found[place] = function(found[place - 1])
    return found


def _matrix(rows: int, columns: int, value: float) -> Rows:
    _repeated(rows * columns, 0)
    return Rows([value] * columns for _ in range(rows))


def _identity(count: int, one: float) -> Rows:
    found = _matrix(count, count, one * 0)
    for place, row in enumerate(found):
        row[place] = one
    return found


def _logarithm(function: Callable[[float], float]) -> Callable[[float], float]:
    return lambda x: -math.inf if x == 0 else math.nan if x < 0 else function(x)


def _plain(text: str) -> str:
    if set(text) & set("\\^$.|?*+()[]{}"):
        raise ExpressionError(f"{text!r}: regular expressions have no counterpart")
    return text


def _split(text: str, between: str) -> list[str]:
    found = text.split(_plain(between))
    while len(found) > 1 and not found[-1]:  # Java drops empty ones at the end
        found.pop()
    return found


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    # numbers
    "abs": _numeric(abs),
    "min": _best(min),
    "max": _best(max),
    "floor": _numeric(lambda x: float(math.floor(x))),
    "ceil": _numeric(lambda x: float(math.ceil(x))),
    "rint": _numeric(lambda x: float(round(x))),
    "round": _numeric(_half_up),
    "roundToInt": _numeric(_half_up),
    "sqrt": _numeric(math.sqrt),
    "exp": _numeric(elementary.exp),
    "log": _numeric(_logarithm(elementary.log)),
    "log10": _numeric(_logarithm(elementary.log10)),
    "log2": _numeric(_logarithm(elementary.log2)),
    "sin": _numeric(elementary.sin),
    "cos": _numeric(elementary.cos),
    "tan": _numeric(elementary.tan),
    "asin": _numeric(elementary.asin),
    "acos": _numeric(elementary.acos),
    "atan": _numeric(elementary.atan),
    "sinh": _numeric(lambda x: (elementary.exp(x) - elementary.exp(-x)) / 2.0),
    "cosh": _numeric(lambda x: (elementary.exp(x) + elementary.exp(-x)) / 2.0),
    "atan2": lambda y, x: elementary.atan2(float(y), float(x)),
    "hypot": lambda x, y: elementary.hypot(float(x), float(y)),
    "pow": lambda x, y: elementary.power(float(x), y),
    "toRadians": _numeric(lambda x: x / 180.0 * math.pi),
    "toDegrees": _numeric(lambda x: x * 180.0 / math.pi),
    "remainder": math.remainder,
    "IEEEremainder": math.remainder,
    "sgn": _numeric(lambda x: (x > 0) - (x < 0)),
    "signum": _numeric(lambda x: float((x > 0) - (x < 0))),
    "neighborhood": lambda x, y, d: abs(x - y) <= d,
    "within": _close,
    "isCloseTo": _close,
    "isNaN": math.isnan,
    "isInfinite": math.isinf,
    "doubleValue": lambda x: float(number(x)),
    "intValue": number,
    "longValue": number,
    "parseInt": lambda text, base=10: int(text, base),
    "parseLong": lambda text, base=10: int(text, base),
    "parseDouble": float,
    # any value
    "add": plus,
    "subtract": minus,
    "multiply": times,
    "divide": OPERATORS["/"],
    "modulo": OPERATORS["%"],
    "isEqualTo": equal,
    "equals": equal,
    "isLessThan": OPERATORS["<"],
    "isGreaterThan": OPERATORS[">"],
    "and": lambda one, other: truth(one) and truth(other),
    "or": lambda one, other: truth(one) or truth(other),
    "not": lambda value: not truth(value),
    "isNil": lambda value: False,
    "cast": _cast,
    "double": lambda x: float(number(x)),
    "int": lambda x: int(number(x)),
    "toString": java_text,
    "stringValue": java_text,
    # arrays
    "length": len,
    "size": len,
    "get": lambda whole, index: whole[index] if isinstance(whole, dict) else element(whole, index),
    "getElement": element,
    "sum": lambda items: elementary.total(items) if items else 0,
    "sort": sorted,
    "sortAscending": sorted,
    "sortDescending": lambda items: sorted(items, reverse=True),
    "reverse": lambda items: items[::-1],
    "append": _joined,
    "concatenate": _joined,
    "subarray": _subarray,
    "extract": _extracted,
    "update": lambda items, place, value: [*items[:place], value, *items[place + 1 :]],
    "find": lambda items, match=True: [place for place, each in enumerate(items) if equal(each, match)],
    "repeat": _repeated,
    "array": lambda *items: list(items),
    "contains": lambda items, each: each in items,
    "emptyArray": lambda kind: [],
    "nilArray": lambda kind: [],
    "arrayType": lambda kind, count=1: _repeated(count, kind),
    "zeroArray": lambda kind, count=0: _repeated(count, kind),
    "elementAdd": plus,
    "elementSubtract": minus,
    "elementMultiply": times,
    "map": _map,
    "filter": _filter,
    "fold": _fold,
    "iterate": _iterated,
    # matrices
    "arrayToMatrix": lambda items, rows, columns: Rows(
        items[row * columns : (row + 1) * columns] for row in range(min(rows, MAX_ELEMENTS))
    ),
    "matrixToArray": lambda rows: [each for row in rows for each in row],
    "toArray": lambda rows: [each for row in rows for each in row],
    "transpose": lambda rows: Rows(map(list, zip(*rows, strict=True))),
    "getRowCount": len,
    "getColumnCount": lambda rows: len(rows[0]),
    "identityMatrixInt": lambda count: _identity(count, 1),
    "identityMatrixDouble": lambda count: _identity(count, 1.0),
    "zeroMatrix": lambda rows, columns: _matrix(rows, columns, 0.0),
    "zeroMatrixDouble": lambda rows, columns: _matrix(rows, columns, 0.0),
    "zeroMatrixInt": lambda rows, columns: _matrix(rows, columns, 0),
    # records
    "merge": lambda one, other: {**other, **one},
    "emptyRecord": lambda: {},
    "labelSet": sorted,
    # texts
    "trim": lambda text: text.strip(),
    "substring": lambda text, start, end=None: text[start:end],
    "concat": plus,
    "replace": lambda text, old, new: text.replace(old, new),
    "replaceAll": lambda text, old, new: text.replace(_plain(old), new),
    "split": _split,
    "equalsIgnoreCase": lambda text, other: text.lower() == other.lower(),
    "toLowerCase": lambda text: text.lower(),
    "toUpperCase": lambda text: text.upper(),
    "startsWith": lambda text, start: text.startswith(start),
    "endsWith": lambda text, end: text.endswith(end),
    "indexOf": lambda text, part: text.find(part),
    "lastIndexOf": lambda text, part: text.rfind(part),
}
