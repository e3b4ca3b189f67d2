"""Evaluates expressions of Ptolemy II: to numbers, texts, truth values, lists for arrays, dicts for records."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from .budget import spend, weigh
from .functions import FUNCTIONS, element
from .operators import MAX_ELEMENTS, OPERATORS, Rows, limited, times, truth, unified
from .syntax import (
    Array,
    Binary,
    Call,
    Choice,
    Const,
    ExpressionError,
    Lambda,
    Matrix,
    Method,
    Name,
    Record,
    Steps,
    Tree,
    Unary,
    parse,
)

CONSTANTS: Mapping[str, object] = {
    "PI": math.pi,
    "pi": math.pi,
    "E": math.e,
    "e": math.e,
    "Infinity": math.inf,
    "PositiveInfinity": math.inf,
    "NegativeInfinity": -math.inf,
    "NaN": math.nan,
    "nil": None,
    "MaxDouble": 1.7976931348623157e308,
    "MinDouble": 5e-324,
    "MaxInt": 2**31 - 1,
    "MinInt": -(2**31),
    "MaxLong": 2**63 - 1,
    "MinLong": -(2**63),
    "MaxShort": 2**15 - 1,
    "MinShort": -(2**15),
    "MaxFloat": 3.4028234663852886e38,
    "MinFloat": 1.401298464324817e-45,
    "MaxUnsignedByte": 255,
    "MinUnsignedByte": 0,
    # types, each represented by a value
    "boolean": False,
    "int": 0,
    "long": 0,
    "short": 0,
    "unsignedByte": 0,
    "double": 0.0,
    "float": 0.0,
    "string": "",
}
Scope = Callable[[str], object]


class Function:
    """The value of ``function(x) ...``."""

    def __init__(self, names: tuple[str, ...], body: Tree, scope: Scope) -> None:
        self.names = names
        self.body = body
        self.scope = scope

    def __call__(self, *arguments: Any) -> Any:
        if len(arguments) != len(self.names):
            raise TypeError(f"wrong number of arguments: the function takes {len(self.names)}, not {len(arguments)}")
        given = dict(zip(self.names, arguments, strict=True))
        return _value(self.body, lambda name: given[name] if name in given else self.scope(name))


def evaluate(tree: Tree, scope: Scope) -> Any:
    """The value; ``scope`` returns that of a name, or raises ``KeyError``.  Raises ``ExpressionError``."""
    try:
        return _value(tree, scope)
    except KeyError as error:
        raise ExpressionError(f"unknown name {error.args[0]!r}") from None
    except RecursionError:
        raise ExpressionError("the expression is nested too deeply") from None
    except (TypeError, ValueError, IndexError, ZeroDivisionError, OverflowError, AttributeError, MemoryError) as error:
        raise ExpressionError(f"it cannot be evaluated: {error}") from None


def _value(tree: Tree, scope: Scope) -> Any:
    spend()
    found = _computed(tree, scope)
    weigh(found)
    return found


def _computed(tree: Tree, scope: Scope) -> Any:
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
            return not truth(value) if sign == "!" else ~value if sign == "~" else times(value, -1)
        case Binary("&&", left, right):
            return truth(_value(left, scope)) and truth(_value(right, scope))
        case Binary("||", left, right):
            return truth(_value(left, scope)) or truth(_value(right, scope))
        case Binary(sign, left, right):
            return OPERATORS[sign](_value(left, scope), _value(right, scope))
        case Choice(test, one, other):
            return _value(one if truth(_value(test, scope)) else other, scope)
        case Call():
            return _called(tree, scope)
        case Method(of, name, arguments):
            whole = _value(of, scope)
            given = [_value(each, scope) for each in arguments or ()]
            if isinstance(whole, dict) and name in whole:
                return _applied(whole[name], given)
            if name not in FUNCTIONS:
                raise ExpressionError(f"the function {name!r} is not supported")
            return FUNCTIONS[name](whole, *given)
        case Array(items):
            return unified([_value(each, scope) for each in items])
        case Record(fields):
            return {name: _value(each, scope) for name, each in fields}
        case Matrix(rows):
            found = unified([[_value(each, scope) for each in row] for row in rows])
            return Rows([unified(found[0])] if len(found) == 1 else found)
        case Steps(first, step, last):
            one, by, end = (_value(each, scope) for each in (first, step, last))
            return Rows([limited(_stepped(one, by, end))])
        case Lambda(names, body):
            return Function(names, body, scope)
    raise ExpressionError("the expression is not supported")


def _called(tree: Call, scope: Scope) -> Any:
    arguments = [_value(each, scope) for each in tree.arguments]
    if not isinstance(tree.function, Name):
        return _applied(_value(tree.function, scope), arguments)
    name = tree.function.name
    try:
        whole = scope(name)
    except KeyError:
        if name == "eval" and len(arguments) == 1 and isinstance(arguments[0], str):
            return _value(parse(arguments[0]), scope)
        if name not in FUNCTIONS:
            raise ExpressionError(f"the function {name!r} is not supported") from None
        return FUNCTIONS[name](*arguments)
    return _applied(whole, arguments)


def _applied(whole: Any, arguments: list[Any]) -> Any:
    """Call a function with its arguments, or index an array or matrix."""
    if isinstance(whole, Function):
        return whole(*arguments)
    for index in arguments:
        whole = element(whole, index)
    return whole


def _stepped(first: Any, step: Any, last: Any) -> list[Any]:
    if not step or (last - first) / step > MAX_ELEMENTS:
        raise ExpressionError(f"it has more than the maximum of {MAX_ELEMENTS:,} elements")
    count = math.floor((last - first) / step + 1e-9) + 1
    return [first + number * step for number in range(max(count, 0))]
