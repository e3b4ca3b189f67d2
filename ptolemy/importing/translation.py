"""What an expression of Ptolemy II means here: a value, or an expression of the model language.

Each operator and function is translated by a pattern in the model language.  What is known before the run is the value
of the same pattern, so that a constant and an expression of the run have one meaning.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

from epicycle.actors.expression import BudgetError, evaluate
from epicycle.actors.expression import ExpressionError as OwnError

from .limits import budget, spend
from .syntax import ExpressionError, Tree
from .table import CONSTANTS, FUNCTIONS, OPERATORS

MAX_PARTS = 500  # of one expression of the model language
LETTERS = "abcdfghijlmnopqrstuvwxyz"  # the names of operands in patterns

Kind: TypeAlias = type | None  # None: any


@dataclass(frozen=True)
class Value:
    """What is known before the run."""

    value: Any

    @property
    def kind(self) -> Kind:
        """The kind of the value."""
        return type(self.value)


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


def named(name: str, kind: Kind = None) -> Code:
    """A name, or a dotted path, that changes in a run."""
    return Code(ast.parse(name, mode="eval").body, kind)


def literal(value: Any) -> Code:
    """A value as an expression; raises ``ExpressionError``."""
    node = ast.parse(repr(value), mode="eval").body
    parts = [*ast.walk(node)]
    spend(len(parts))
    if any(isinstance(each, ast.Constant) and each.value is None for each in parts):
        raise ExpressionError("nothing cannot be a value here")
    return _checked(node, type(value), len(parts) // 2)


def code_of(said: Meaning) -> Code:
    """A meaning as an expression; raises ``ExpressionError``."""
    return literal(said.value) if isinstance(said, Value) else said


def _checked(node: ast.expr, kind: Kind, size: int) -> Code:
    spend(min(1 + size, MAX_PARTS))
    if 1 + size > MAX_PARTS:
        raise ExpressionError(f"it has more than the maximum of {MAX_PARTS} parts")
    return Code(node, kind, 1 + size)


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
    return _checked(replaced(tree, codes), kind, sum(codes[name].size for name in places if name in codes))


def _computed(pattern: str, values: Mapping[str, Any]) -> Any:
    if None in values.values():
        raise ExpressionError("nothing cannot be a value here")
    try:
        return evaluate(pattern, values, budget())
    except OwnError as error:
        spend(0)  # raises if this is why
        known = ", ".join(f"{name} = {value!r:.40}" for name, value in values.items())
        raise ExpressionError(f"it cannot be evaluated: {error}, with {known}") from None


_SAMPLES: Mapping[Kind, Any] = {int: 1, float: 1.0, str: "1", bool: True}


@cache
def _kind(pattern: str, kinds: tuple[Kind, ...]) -> Kind:
    """The kind of what a pattern gives: that of its value for samples of the operands, if it is always the same."""
    found = set()
    for each in _SAMPLES.values():
        samples = {**_SAMPLES, None: each, list: [each] * 2, dict: {}}
        with suppress(OwnError):
            found.add(type(evaluate(pattern, dict(zip(LETTERS, (samples[kind] for kind in kinds), strict=False)))))
    return found.pop() if len(found) == 1 else None


# -- trees ------------------------------------------------------------------------------------------------------------


def meaning_of(tree: Tree, lookup: Lookup) -> Meaning:
    """What an expression means; raises ``ExpressionError``.

    ``lookup`` tells what a name means, or raises ``KeyError``.
    """
    try:
        return _Translation(lookup).of(tree)
    except RecursionError:
        raise ExpressionError("the expression is nested too deeply") from None


class _Translation:
    """Goes through a tree."""

    def __init__(self, lookup: Lookup) -> None:
        self._lookup = lookup

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
        operands = [self.of(each) for each in tree.parts]
        match tree.form:
            case "array" | "matrix":
                return whole(operands)
            case "record":
                return whole(operands, tree.said)
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
            if pattern in OPERATORS:
                return self._operator(pattern, given)
            if len({*_pattern(pattern)[1]}) == len(given):
                return filled(pattern, *given)
        raise ExpressionError(f"wrong number of arguments: {name} does not take {len(given)}")

    # -- operators ------------------------------------------------------------------------------------------------

    def _operator(self, sign: str, operands: list[Meaning]) -> Meaning:
        kinds = [each.kind for each in operands]
        is_logical = sign in ("||", "&&", "|", "&", "#", "!", "==", "!=")
        if list in kinds and not is_logical:
            return self._by_items(sign, operands)
        if sign == "/" and kinds == [int, int]:
            return filled("int(a / b)", *operands)
        if sign == "+" and str in kinds:
            operands = [_text(each) for each in operands]
        is_of_truth = bool in kinds and not is_logical and str not in kinds
        if sign not in OPERATORS or is_of_truth or (sign in "|&#" and int in kinds):
            what = " of truth values" if bool in kinds else ""
            raise ExpressionError(f"the operator {sign!r}{what} is not supported")
        return filled("-a" if len(operands) == 1 and sign == "-" else OPERATORS[sign], *operands)

    def _by_items(self, sign: str, operands: list[Meaning]) -> Meaning:
        """Arrays are combined item by item; what is not an array is combined with each item."""
        values = [each.value for each in operands if isinstance(each, Value)]
        arrays = [each for each in values if isinstance(each, list)]
        if len(values) < len(operands) or any(isinstance(item, list) for each in arrays for item in each):
            raise ExpressionError("operators of matrices, and of arrays that are not constant, are not supported")
        if len(lengths := {*map(len, arrays)}) > 1:
            raise ExpressionError("the arrays have different lengths")
        rows = [[Value(each[k] if isinstance(each, list) else each) for each in values] for k in range(lengths.pop())]
        return whole([self._operator(sign, [*row]) for row in rows])


def _element(whole: Meaning, indices: Iterable[Meaning]) -> Meaning:
    for index in indices:
        whole = filled("a[b]", whole, index)
    return whole


def _text(said: Meaning) -> Meaning:
    return said if said.kind is str else filled("str(a)", said)


def _unified(items: Sequence[Meaning]) -> list[Meaning]:
    """Items of one kind: texts if one is a text, otherwise doubles if one is a double."""
    kinds = {each.kind for each in items}
    if str in kinds and len(kinds) > 1 and kinds <= {str, int, float, bool}:
        return [_text(each) for each in items]
    if kinds == {int, float}:
        return [filled("float(a)", each) if each.kind is int else each for each in items]
    return [*items]


def whole(items: Sequence[Meaning], names: Sequence[str] | None = None) -> Meaning:
    """An array, whose items become of one kind, or a record with these names."""
    items = _unified(items) if names is None else items
    values = [each.value for each in items if isinstance(each, Value)]
    if len(values) == len(items):
        return _weighed(values if names is None else dict(zip(names, values, strict=True)))
    codes = [*map(code_of, items)]
    nodes, size = [each.node for each in codes], sum(each.size for each in codes)
    if names is None:
        return _checked(ast.List(nodes), list, size)
    return _checked(ast.Dict([ast.Constant(each) for each in names], nodes), dict, size)


def _weighed(value: Any) -> Value:
    """A value that is paid by its size; raises ``ExpressionError`` if it is too large by itself."""
    try:
        budget().weigh(value)
    except BudgetError as error:
        spend(0)  # raises if this is why
        raise ExpressionError(str(error)) from None
    return Value(value)
