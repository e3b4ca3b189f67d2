"""What an expression of Ptolemy II means here: a value, or an expression of the model language.

Each operator and function is translated by a pattern in the model language.  What is known before the run is the value
of the same pattern, so that a constant and an expression of the run have one meaning.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

from epicycle.actors.expression import BudgetError, evaluate
from epicycle.actors.expression import ExpressionError as OwnError

from .budget import budget, spend
from .syntax import ExpressionError, Tree
from .tables import CONSTANTS, FUNCTIONS

MAX_PARTS = 500  # of one expression of the model language
MAX_ELEMENTS = 10_000
LETTERS = "abcdfghijlmnopqrstuvwxyz"  # the names of operands in patterns


@dataclass(frozen=True)
class Array:
    """The kind of a list: the kind of its items, or None."""

    items: Kind


Kind: TypeAlias = "type | Array | None"  # None: any


@dataclass(frozen=True)
class Value:
    """What is known before the run."""

    value: Any

    @property
    def kind(self) -> Kind:
        """The kind of the value."""
        return kind_of(self.value)


@dataclass(frozen=True)
class Code:
    """An expression of the model language, over names that change in a run."""

    node: ast.expr
    kind: Kind = None
    size: int = 1

    @property
    def text(self) -> str:
        """The expression as text."""
        return ast.unparse(self.node)


Meaning: TypeAlias = Value | Code
Lookup = Callable[[str], Meaning]  # raises KeyError


def kind_of(value: object) -> Kind:
    """The kind of a value; of an array whose items are of different kinds, that of an array of anything."""
    return Array(_common(map(kind_of, value))) if isinstance(value, list) else type(value)


def _common(kinds: Iterable[Kind]) -> Kind:
    found = [*dict.fromkeys(kinds)]
    if len(found) < 2:
        return found[0] if found else None
    if all(isinstance(each, Array) for each in found):
        return Array(_common(each.items for each in found if isinstance(each, Array)))
    return float if {*found} == {int, float} else None


def named(name: str, kind: Kind = None) -> Code:
    """A name, or a dotted path, that changes in a run."""
    return Code(ast.parse(name, mode="eval").body, kind)


def literal(value: Any) -> Code:
    """A value as an expression; raises ``ExpressionError``."""
    if value is None:
        raise ExpressionError("nothing cannot be a value here")
    if isinstance(value, (list, dict)):
        items = value.values() if isinstance(value, dict) else value
        return _whole([literal(each) for each in items], kind_of(value), value if isinstance(value, dict) else None)
    if isinstance(value, (int, float)) and not isinstance(value, bool) and math.copysign(1.0, value) < 0:
        return Code(ast.UnaryOp(ast.USub(), literal(-value).node), type(value))
    return Code(ast.Name("inf") if value == math.inf else ast.Constant(value), type(value))


def code_of(said: Meaning) -> Code:
    """A meaning as an expression; raises ``ExpressionError``."""
    return literal(said.value) if isinstance(said, Value) else said


def _whole(parts: Sequence[Code], kind: Kind, keys: Collection[str] | None = None) -> Code:
    """A list, or a dict with these keys."""
    nodes, names = [each.node for each in parts], [ast.Constant(each) for each in keys or ()]
    return _checked(ast.List(nodes) if keys is None else ast.Dict([*names], nodes), kind, parts)


def _checked(node: ast.expr, kind: Kind, parts: Iterable[Code]) -> Code:
    size = 1 + sum(each.size for each in parts)
    spend(min(size, MAX_PARTS))
    if size > MAX_PARTS:
        raise ExpressionError(f"it has more than the maximum of {MAX_PARTS} parts")
    return Code(node, kind, size)


# -- patterns ---------------------------------------------------------------------------------------------------------


@cache
def _pattern(text: str) -> tuple[ast.expr, list[str]]:
    """The tree of a pattern, and the names of its operands, one for each place where they stand."""
    tree = ast.parse(text, mode="eval").body
    return tree, [node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and len(node.id) == 1]


class _Filled(ast.NodeTransformer):
    """Puts operands in place of their names."""

    def __init__(self, operands: Mapping[str, Code]) -> None:
        self._operands = operands

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self._operands[node.id].node if node.id in self._operands else node


def replaced(tree: ast.expr, names: Mapping[str, Code]) -> ast.expr:
    """An expression with other expressions in place of some names."""
    found: ast.expr = _Filled(names).visit(deepcopy(tree))
    if (
        isinstance(found, ast.BoolOp)
        and isinstance(first := found.values[0], ast.BoolOp)
        and type(first.op) is type(found.op)
    ):
        found.values[:1] = first.values  # (a and b) and c
    return found


def filled(pattern: str, *operands: Meaning) -> Meaning:
    """A pattern over ``a``, ``b``, ``c``, with operands in their places: its value if that of each is known."""
    spend()
    names = dict(zip(LETTERS, operands, strict=False))
    values = {name: each.value for name, each in names.items() if isinstance(each, Value)}
    if len(values) == len(names):
        return Value(_computed(pattern, values))
    tree, places = _pattern(pattern)
    codes = {name: code_of(each) for name, each in names.items()}
    kind = _kind(pattern, tuple(each.kind for each in codes.values()))
    return _checked(replaced(tree, codes), kind, [codes[name] for name in places if name in codes])


def _computed(pattern: str, values: Mapping[str, Any]) -> Any:
    if None in values.values():
        raise ExpressionError("nothing cannot be a value here")
    try:
        return evaluate(pattern, values, budget())
    except OwnError as error:
        spend(0)  # raises if this is why
        said = str(error)
    with suppress(ExpressionError):  # what it says of the operands themselves
        text = ast.unparse(replaced(_pattern(pattern)[0], {name: literal(each) for name, each in values.items()}))
        try:
            evaluate(text, {}) if len(text) < MAX_PARTS else None
        except OwnError as error:
            said = str(error)
    raise ExpressionError(f"it cannot be evaluated: {said}")


_ANY: tuple[Kind, ...] = (int, float, str, bool, Array(int))
_SAMPLES: dict[Kind, Any] = {int: 1, float: 1.0, str: "1", bool: True, dict: {}}


def _sample(kind: Kind) -> Any:
    return [_sample(kind.items or int)] * 2 if isinstance(kind, Array) else _SAMPLES.get(kind)


@cache
def _kind(pattern: str, kinds: tuple[Kind, ...]) -> Kind:
    """The kind of what a pattern gives: that of its value for samples of the operands, if it is always the same."""
    found = set()
    for each in _ANY if None in kinds else (None,):
        values = dict(zip(LETTERS, (_sample(kind or each) for kind in kinds), strict=False))
        with suppress(OwnError):
            found.add(kind_of(evaluate(pattern, values)))
    return found.pop() if len(found) == 1 else None


# -- trees ------------------------------------------------------------------------------------------------------------


def meaning_of(tree: Tree, lookup: Lookup, taken: Collection[str] = ()) -> Meaning:
    """What an expression means; raises ``ExpressionError``.

    ``lookup`` tells what a name means, or raises ``KeyError``; ``taken`` are names of the model language in use.
    """
    try:
        return _Translation(lookup, taken).of(tree)
    except RecursionError:
        raise ExpressionError("the expression is nested too deeply") from None


_SIGNS: Mapping[str, str] = {
    "||": "a or b", "|": "a or b", "&&": "a and b", "&": "a and b", "#": "a != b", "==": "a == b", "!=": "a != b",
    "<": "a < b", "<=": "a <= b", ">": "a > b", ">=": "a >= b", "+": "a + b", "-": "a - b", "*": "a * b", "/": "a / b",
    "^": "a ** b", "!": "not a",
}  # fmt: skip


class _Translation:
    """Goes through a tree."""

    def __init__(self, lookup: Lookup, taken: Collection[str]) -> None:
        self._lookup = lookup
        self._taken = taken

    def of(self, tree: Tree) -> Meaning:
        spend()
        match tree.form:
            case "value":
                return Value(tree.said)
            case "name":
                return self._name(tree.said)
            case "call":
                return self._call(*tree.parts)
            case "?" | "&&" | "||" if isinstance(test := self.of(tree.parts[0]), Value):
                return self._decided(tree, test.value)
            case "==" | "!=" if tree.parts[0].form == "%" and tree.parts[1] == Tree("value", (), 0):
                # Whether there is a remainder does not depend on signs.
                return filled(f"a % b {tree.form} 0", *map(self.of, tree.parts[0].parts))
        operands = [self.of(each) for each in tree.parts]
        match tree.form:
            case "array" | "matrix":
                return array(operands)
            case "steps":
                return _steps(*operands)
            case "record":
                return _record(tree.said, operands)
            case "method" | "field":
                return self._member(tree, *operands)
            case "?":
                return filled("b if a else c", *operands)
        return self._operator(tree.form, operands)

    def _name(self, name: str) -> Meaning:
        try:
            return self._lookup(name)
        except KeyError:
            if name in CONSTANTS:
                return Value(CONSTANTS[name])
            raise ExpressionError(f"unknown name {name!r}") from None

    def _decided(self, tree: Tree, test: object) -> Meaning:
        if not isinstance(test, bool):
            raise ExpressionError(f"{test!r} is not a truth value")
        if tree.form == "?":
            return self.of(tree.parts[1 if test else 2])
        return Value(test) if test is (tree.form == "||") else self.of(tree.parts[1])

    def _call(self, called: Tree, *arguments: Tree) -> Meaning:
        given = [self.of(each) for each in arguments]
        try:
            return _element(self._lookup(called.said) if called.form == "name" else self.of(called), given)
        except KeyError:
            return self._function(called.said, given)

    def _member(self, tree: Tree, whole: Meaning, *arguments: Meaning) -> Meaning:
        is_field = isinstance(whole, Value) and isinstance(whole.value, dict) and tree.said in whole.value
        if tree.form == "method" and not is_field and (tree.said in FUNCTIONS or not isinstance(whole, Code)):
            return self._function(tree.said, [whole, *arguments])
        return _element(whole, [Value(tree.said), *arguments])

    def _function(self, name: str, given: list[Meaning]) -> Meaning:
        if name in ("min", "max") and given:
            return filled(f"{name}({', '.join(LETTERS[: len(given)])})", *_unified(given))
        if name not in FUNCTIONS:
            raise ExpressionError(f"the function {name!r} is not supported")
        for pattern in FUNCTIONS[name]:
            if pattern in _SIGNS or pattern == "%":
                return self._operator(pattern, given)
            if len({*_pattern(pattern)[1]}) == len(given):
                return filled(pattern, *given)
        raise ExpressionError(f"wrong number of arguments: {name} does not take {len(given)}")

    # -- operators ------------------------------------------------------------------------------------------------

    def _operator(self, sign: str, operands: list[Meaning]) -> Meaning:
        kinds = [each.kind for each in operands]
        if sign in ("+", "-", "*", "/", "%") and any(isinstance(each, Array) for each in kinds):
            return self._by_items(sign, operands)
        if sign == "%":
            return _rest(*operands)
        if sign == "/" and kinds == [int, int]:
            return filled("int(a / b)", *operands)
        if sign == "+" and str in kinds:
            operands = [_text(each) for each in operands]
        is_logical = sign in ("||", "&&", "|", "&", "#", "!", "==", "!=")
        if (
            sign not in _SIGNS
            or (sign in "|&#" and int in kinds)
            or (bool in kinds and not is_logical and str not in kinds)
        ):
            what = " of truth values" if bool in kinds else ""
            raise ExpressionError(f"the operator {sign!r}{what} is not supported")
        return filled("-a" if len(operands) == 1 and sign == "-" else _SIGNS[sign], *operands)

    def _by_items(self, sign: str, operands: list[Meaning]) -> Meaning:
        """Arrays are combined item by item; what is not an array is combined with each item."""
        arrays = [each for each in operands if isinstance(each.kind, Array)]
        if any(isinstance(each.kind, Array) and isinstance(each.kind.items, Array) for each in arrays):
            raise ExpressionError("operators of matrices, and of arrays in arrays, are not supported")
        if all(isinstance(each, Value) for each in operands):
            lengths = {len(each.value) for each in arrays if isinstance(each, Value)}
            if len(lengths) > 1:
                raise ExpressionError("the arrays have different lengths")
            rows = [[_item(each, Value(place)) for each in operands] for place in range(lengths.pop())]
            return array([self._operator(sign, row) for row in rows])
        index = "k"
        while index in self._taken:
            index += "_"
        body = self._operator(sign, [_item(each, named(index, int)) for each in operands])
        return filled("[a for c in range(len(b))]", body, arrays[0], named(index, int))


def _item(whole: Meaning, index: Meaning) -> Meaning:
    return filled("a[b]", whole, index) if isinstance(whole.kind, Array) else whole


def _element(whole: Meaning, indices: Iterable[Meaning]) -> Meaning:
    for index in indices:
        whole = filled("a[b]", whole, index)
    return whole


def _text(said: Meaning) -> Meaning:
    return said if said.kind is str else filled("str(a)", said)


def _rest(left: Meaning, right: Meaning) -> Meaning:
    """The remainder has the sign of the first operand in Ptolemy, and that of the second here."""
    if not (isinstance(right, Value) and right.kind in (int, float) and right.value > 0):
        right = filled("abs(a)", right)
    is_positive = isinstance(left, Value) and left.kind in (int, float) and left.value >= 0
    return filled("a % b" if is_positive else "a % b if a >= 0 else -(-a % b)", left, right)


def _unified(items: Sequence[Meaning]) -> list[Meaning]:
    """Items of one kind: texts if one is a text, otherwise doubles if one is a double."""
    kinds = {each.kind for each in items}
    if str in kinds and len(kinds) > 1 and kinds <= {str, int, float, bool}:
        return [_text(each) for each in items]
    common = _common(kinds)
    while isinstance(common, Array):
        common = common.items
    return [_double(each) for each in items] if common is float else [*items]


def _double(said: Meaning) -> Meaning:
    if isinstance(said, Value) and isinstance(said.value, list):
        return array([_double(Value(each)) for each in said.value])
    return filled("float(a)", said) if said.kind is int else said


def array(items: Sequence[Meaning]) -> Meaning:
    """An array of items, which become of one kind."""
    items = _unified(items)
    values = [each.value for each in items if isinstance(each, Value)]
    if len(values) == len(items):
        return _weighed(values)
    codes = [*map(code_of, items)]
    return _whole(codes, Array(_common(each.kind for each in codes)))


def _record(names: Sequence[str], items: Sequence[Meaning]) -> Meaning:
    values = {name: each.value for name, each in zip(names, items, strict=True) if isinstance(each, Value)}
    return _weighed(values) if len(values) == len(items) else _whole([*map(code_of, items)], dict, names)


def _steps(*parts: Meaning) -> Meaning:
    first, step, last = (each.value if isinstance(each, Value) and each.kind in (int, float) else 0 for each in parts)
    if not step:
        raise ExpressionError("the steps of a matrix are not numbers that are known before the run")
    count = math.floor((last - first) / step + 1e-9) + 1
    if count > MAX_ELEMENTS:
        raise ExpressionError(f"it has more than the maximum of {MAX_ELEMENTS:,} elements")
    return Value([[first + number * step for number in range(count)]])


def _weighed(value: Any) -> Value:
    """A value that is paid by its size; raises ``ExpressionError`` if it is too large by itself."""
    try:
        budget().weigh(value)
    except BudgetError as error:
        spend(0)  # raises if this is why
        raise ExpressionError(str(error)) from None
    return Value(value)
