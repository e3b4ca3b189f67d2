"""Formula: an expression that an actor evaluates again and again, and the parameter that holds one."""

from __future__ import annotations

import ast
import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core import REQUIRED, EpicycleError, Parameter, ParameterError, counted_in_si
from .evaluation import evaluate
from .syntax import ExpressionError, free_names, parse
from .values import CONSTANTS, FUNCTIONS


class Formula:
    """A checked expression; ``names`` are what it asks for, in the order in which they first appear.

    ``is_condition`` says whether its value is always true or false.

    Raises ``ExpressionError`` if the text is no expression.
    """

    __slots__ = ("is_condition", "names", "source")

    def __init__(self, source: str) -> None:
        tree = parse(source)
        places: dict[str, int] = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.Name):
                places[node.id] = min(places.get(node.id, node.col_offset), node.col_offset)
        free = free_names(tree, frozenset()) - CONSTANTS.keys()
        for name in sorted(free & FUNCTIONS.keys()):
            raise ExpressionError(f"'{name}' is a function: write {name}(...)", places[name], len(name))
        self.source = source
        self.is_condition = _is_condition(tree)
        self.names = tuple(sorted(free, key=places.__getitem__))

    def __call__(self, values: Mapping[str, object]) -> Any:
        """The value of the expression; raises ``EpicycleError`` telling the values of its names."""
        try:
            return evaluate(self.source, values)
        except ExpressionError as error:
            given = ", ".join(f"{name} = {values[name]!r}" for name in self.names if name in values)
            raise EpicycleError(f"{self.source!r}: {error}{f', with {given}' if given else ''}") from None

    def __repr__(self) -> str:
        return repr(self.source)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and other.source == self.source

    def __hash__(self) -> int:
        return hash(self.source)


def _is_condition(node: ast.expr) -> bool:
    """Whether the value of an expression is true or false whatever its names stand for."""
    match node:
        case ast.Compare() | ast.UnaryOp(op=ast.Not()) | ast.Constant(value=bool()):
            return True
        case ast.BoolOp():
            return all(map(_is_condition, node.values))
        case ast.IfExp():
            return _is_condition(node.body) and _is_condition(node.orelse)
        case ast.Call(func=ast.Name(id="bool")):
            return True
        case _:
            return False


class FormulaParameter(Parameter[Formula]):
    """A parameter whose value is an expression: a text, or a number or truth value that stands for itself."""

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(str, default, doc=doc)  # type: ignore[arg-type]

    def describe_type(self) -> str:
        return "expression"

    def convert(self, value: object) -> Formula | None:
        if value is None and self.optional:
            return None
        if isinstance(value, Formula):
            return value
        if isinstance(value, (bool, int, float)):
            value = repr(counted_in_si(value))
        if not isinstance(value, str):
            raise ParameterError(f"{value!r} is not an expression")
        try:
            return Formula(value)
        except ExpressionError as error:
            raise ParameterError(f"{value!r} is not an expression: {error}") from None


def operand(token: Any) -> Any:
    """A token as the expression language knows it: arrays become lists, dataclasses dicts of their fields."""
    if isinstance(token, (bool, int, float, str)) or token is None:
        return token
    if isinstance(token, (np.generic, np.ndarray)):
        return token.tolist()
    if isinstance(token, (list, tuple)):
        return [operand(item) for item in token]
    if isinstance(token, Mapping):
        return {str(key): operand(item) for key, item in token.items()}
    if dataclasses.is_dataclass(token) and not isinstance(token, type):
        return {each.name: operand(getattr(token, each.name)) for each in dataclasses.fields(token)}
    return token
