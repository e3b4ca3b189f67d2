"""Expressions that are evaluated repeatedly, and the parameters that hold them.

A ``Formula`` is over names, a ``PortFormula`` over the latest tokens of ports: ``main.state.position[0] < 20``.
"""

from __future__ import annotations

import ast
import dataclasses
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, TypeVar

import numpy as np

from ..core import REQUIRED, EpicycleError, Parameter, ParameterError, counted_in_si
from .evaluation import evaluate
from .floats import UNDECIDED, of_floats
from .syntax import ExpressionError, free_names, parse
from .values import CONSTANTS, FUNCTIONS

T = TypeVar("T")

# Dotted names with an index only if another name follows: a final index is a subscript of the token.
DOTTED = re.compile(
    r"""(?P<text>"[^"]*"|'[^']*')"""
    r"""|(?<![\w.])(?P<path>[A-Za-z_]\w*(?:\[\d+\](?=\.))?(?:\.[A-Za-z_]\w*(?:\[\d+\](?=\.[A-Za-z_]))?)+)""",
    re.ASCII,
)
_STAND_IN = re.compile(r"\bport_(\d+)\b", re.ASCII)


class Formula:
    """A checked expression; ``names`` are what it uses, in the order in which they first appear.

    ``is_condition`` states whether its value is always true or false.  Raises ``ExpressionError`` if the text is not an
    expression.
    """

    __slots__ = ("function", "is_condition", "names", "source")

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
        self.function = of_floats(source, self.names)

    def of_floats(self, *values: Any) -> Any:
        """A faster function of the values of the names, in their order; None if that takes more than floats."""
        try:
            return None if self.function is None else self.function(*values)
        except UNDECIDED:
            return None

    def __call__(self, values: Mapping[str, object]) -> Any:
        """The value of the expression; raises an ``EpicycleError`` with the values of its names."""
        if self.function is not None and CONSTANTS.keys().isdisjoint(values):
            found = self.of_floats(*map(values.get, self.names))
            if found is not None:
                return found
        try:
            return evaluate(self.source, values)
        except ExpressionError as error:
            given = ", ".join(f"{name} = {values[name]!r}" for name in self.names if name in values)
            raise EpicycleError(f"{self.source!r}: {error}{f', with {given}' if given else ''}") from None

    def __reduce__(self) -> tuple[type[Formula], tuple[str]]:
        return Formula, (self.source,)

    def __repr__(self) -> str:
        return repr(self.source)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and other.source == self.source

    def __hash__(self) -> int:
        return hash(self.source)


def _is_condition(node: ast.expr) -> bool:
    """Whether the value of an expression is true or false for all values of its names."""
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


class PortFormula:
    """A checked expression in which dotted names are tokens: ``references``, in the order of their appearance.

    A reference is the path of an output port, with the fields that lead to a part of its token: ``main.state`` or
    ``main.state.position``.  A name in ``given`` means itself: its value comes with each call, and its fields can be
    named as well; ``given_fields`` are those, as ``("token.speed", ("speed",))``.  Raises ``ExpressionError`` if the
    text is not such an expression.
    """

    __slots__ = ("_formula", "_given", "_paths", "_ports", "given_fields", "references", "source")

    def __init__(self, source: str, given: Sequence[str] = ()) -> None:
        names: dict[str, str] = {}

        def stand_in(match: re.Match[str]) -> str:
            path = match["path"]
            return match[0] if path is None else names.setdefault(path, f"port_{len(names)}")

        self._formula = Formula(DOTTED.sub(stand_in, source))
        self._paths = tuple(names)
        for name in self._formula.names:
            if name in given:
                names[name] = name
            elif name not in names.values():
                also = "".join(f", and {each!r} is known" for each in given)
                raise ExpressionError(f"unknown name {name!r}: a port is written 'actor.port'{also}")
        if not names:
            what = " or ".join([*map(repr, given), "a port as 'actor.port'"])
            raise ExpressionError(f"it names {'nothing' if given else 'no port'}: write {what}")
        self.source = source
        self._ports = {path: name for path, name in names.items() if path.split(".")[0] not in given}
        self._given = {name: path.split(".") for path, name in names.items() if path not in self._ports}
        self.references = tuple(self._ports)
        self.given_fields = tuple((".".join(path), tuple(path[1:])) for path in self._given.values() if path[1:])

    def __call__(self, values: Sequence[object], **given: object) -> Any:
        """The value, for those of the references in their order and of the given names; raises ``EpicycleError``."""
        known = dict(zip(self._ports.values(), values, strict=True))
        for name, (root, *fields) in self._given.items():
            known[name] = operand(value_at(given[root], fields))
        try:
            return self._formula(known)
        except EpicycleError as error:
            told = _STAND_IN.sub(lambda match: self._paths[int(match[1])], str(error))
            raise EpicycleError(told) from None

    def __repr__(self) -> str:
        return repr(self.source)


class _ExpressionParameter(Parameter[T]):
    """A parameter whose value is made of a text; ``words`` describe it."""

    words = "expression"

    def __init__(self, made: Callable[[str], T], default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(str, default, doc=doc)  # type: ignore[arg-type]
        self._made = made

    def describe_type(self) -> str:
        return self.words

    def convert(self, value: object) -> T | None:
        if value is None and self.optional:
            return None
        if not isinstance(value, str):
            raise ParameterError(f"{value!r} is not an {self.words}")
        try:
            return self._made(value)
        except ExpressionError as error:
            raise ParameterError(f"{value!r} is not an {self.words}: {error}") from None


class FormulaParameter(_ExpressionParameter[Formula]):
    """A parameter whose value is an expression: a text, or a number or truth value that means itself."""

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(Formula, default, doc=doc)

    def convert(self, value: object) -> Formula | None:
        if isinstance(value, Formula):
            return value
        return super().convert(repr(counted_in_si(value)) if isinstance(value, (bool, int, float)) else value)


class PortFormulaParameter(_ExpressionParameter[PortFormula | None]):
    """A parameter whose value is an expression over ports, and over the ``given`` names."""

    words = "expression over ports"

    def __init__(self, default: Any = REQUIRED, *, given: Sequence[str] = (), doc: str = "") -> None:
        super().__init__(lambda text: PortFormula(text, self.given), default, doc=doc)
        self.given = tuple(given)

    def convert(self, value: object) -> PortFormula | None:
        return value if isinstance(value, PortFormula) else super().convert(value)


_PLAIN: Final = frozenset({bool, int, float, str, type(None)})


def operand(token: Any) -> Any:
    """A token as the expression language knows it: arrays become lists, dataclasses dicts of their fields."""
    if type(token) in _PLAIN:
        return token
    if isinstance(token, (np.generic, np.ndarray)):  # one that is also a float divides by zero without an error
        return token.tolist()
    if isinstance(token, (bool, int, float, str)):
        return token
    if isinstance(token, (list, tuple)):
        return [operand(item) for item in token]
    if isinstance(token, Mapping):
        return {str(key): operand(item) for key, item in token.items()}
    if dataclasses.is_dataclass(token) and not isinstance(token, type):
        return {each.name: operand(getattr(token, each.name)) for each in dataclasses.fields(token)}
    return token


def value_at(token: Any, fields: Iterable[str]) -> Any:
    """A part of a token; None if there is no such part."""
    for name in fields:
        token = token.get(name) if isinstance(token, Mapping) else getattr(token, name, None)
    return token
