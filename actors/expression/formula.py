"""Expressions that are evaluated repeatedly, and the parameters that hold them.

A ``Formula`` is over names, a ``PortFormula`` over the latest tokens of ports: ``main.state.position[0] < 20``.
"""

from __future__ import annotations

import ast
import copy
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, TypeVar

from ..core import REQUIRED, EpicycleError, Parameter, ParameterError, counted_in_si
from .evaluation import evaluate
from .syntax import ExpressionError, free_names, parse, targets
from .tokens import operand, value_at
from .translation import UNDECIDED, translated, undecided_by
from .values import CONSTANTS, FUNCTIONS

T = TypeVar("T")

# Dotted names with an index only if another name follows: a final index is a subscript of the token.
DOTTED = re.compile(
    r"""(?P<text>"[^"]*"|'[^']*')"""
    r"""|(?<![\w.])(?P<path>[A-Za-z_]\w*(?:\[\d+\](?=\.))?(?:\.[A-Za-z_]\w*(?:\[\d+\](?=\.[A-Za-z_]))?)+)""",
    re.ASCII,
)
_STAND_IN = re.compile(r"\b_(\d+)_*\b", re.ASCII)


class Formula:
    """A checked expression; ``names`` are what it uses, in the order in which they first appear.

    ``is_condition`` states whether its value is always true or false.  Raises ``ExpressionError`` if the text is not an
    expression.
    """

    __slots__ = ("_function", "is_condition", "names", "of", "source")

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
        self._function: Callable[..., Any] | None = None
        # The value for tokens by name, of which more than the expression's may be there; raises as ``function``.
        self.of: Callable[[dict[str, Any]], Any] = self._first_of

    @property
    def function(self) -> Callable[..., Any]:
        """The expression as a function of tokens, the values of its names in their order.

        It raises one of ``UNDECIDED`` for what only a call of the formula can tell.
        """
        if self._function is None:  # most copies of a model are never run
            self._function = translated(self.source, self.names) or undecided_by
        return self._function

    def _first_of(self, tokens: dict[str, Any]) -> Any:
        self.of = translated(self.source, ("",), self.names) or undecided_by
        return self.of(tokens)

    def __call__(self, values: Mapping[str, object]) -> Any:
        """The value of the expression, for tokens; raises an ``EpicycleError`` with the values of its names."""
        try:
            if CONSTANTS.keys().isdisjoint(values):
                return (self._function or self.function)(*[values[name] for name in self.names])
        except UNDECIDED:
            pass
        return self.decided({name: operand(value) for name, value in values.items()})

    def decided(self, values: Mapping[str, object]) -> Any:
        """The value by the evaluator, for operands."""
        try:
            return evaluate(self.source, values)
        except ExpressionError as error:
            given = ", ".join(f"{name} = {values[name]!r}" for name in self.names if name in values)
            raise EpicycleError(f"{self.source!r}: {error}{f', with {given}' if given else ''}") from None

    def replacing(self, defined: Mapping[str, Formula]) -> Formula:
        """The formula with others in the place of their names; raises ``ExpressionError`` if that is too long."""
        if defined.keys().isdisjoint(self.names):
            return self
        return _replaced(self, tuple(defined.items()))

    def __reduce__(self) -> tuple[type[Formula], tuple[str]]:
        return Formula, (self.source,)

    def __repr__(self) -> str:
        return repr(self.source)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and other.source == self.source

    def __hash__(self) -> int:
        return hash(self.source)


@lru_cache(maxsize=256)  # a search loads a model again and again
def _replaced(formula: Formula, defined: tuple[tuple[str, Formula], ...]) -> Formula:
    return Formula(ast.unparse(_Replacing(dict(defined)).visit(copy.deepcopy(parse(formula.source)))))


class _Replacing(ast.NodeTransformer):
    """Puts formulas in the place of their names."""

    def __init__(self, defined: Mapping[str, Formula]) -> None:
        self._defined = defined

    def visit_Call(self, node: ast.Call) -> ast.expr:
        node.args = [self.visit(each) for each in node.args]
        return node

    def visit_ListComp(self, node: ast.ListComp) -> ast.expr:
        bound = set().union(*(targets(each) or () for each in node.generators))
        for name in sorted(bound & {*self._defined, *(used for each in self._defined.values() for used in each.names)}):
            raise ExpressionError(f"{name!r} has another meaning outside of this list; rename it")
        self.generic_visit(node)
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        formula = self._defined.get(node.id)
        return node if formula is None else copy.deepcopy(parse(formula.source))


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


def check_no_constant(key: str, name: str) -> None:
    """Refuse the name of a constant for a value of which expressions are; raises ``ParameterError``."""
    if name in CONSTANTS:
        raise ParameterError(
            f"{key}: {name!r} is a constant in expressions; choose another name", (key, name), of_key=True
        )


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
            # As long as the path, so that the places of errors stay right.
            return match[0] if path is None else names.setdefault(path, f"_{len(names)}".ljust(len(path), "_"))

        code = DOTTED.sub(stand_in, source)
        self._formula = Formula(code)
        self._paths = tuple(names)
        for name in self._formula.names:
            if name in given:
                names[name] = name
            elif name not in names.values():
                also = "".join(f", and {each!r} is known" for each in given)
                places = [
                    each.col_offset for each in ast.walk(parse(code)) if isinstance(each, ast.Name) and each.id == name
                ]
                raise ExpressionError(
                    f"unknown name {name!r}: a port is written 'actor.port'{also}", min(places), len(name)
                )
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
            known[name] = value_at(given[root], fields)
        try:
            return self._formula(known)
        except EpicycleError as error:
            told = _STAND_IN.sub(lambda match: self._paths[int(match[1])], str(error))
            raise EpicycleError(told) from None

    def __repr__(self) -> str:
        return repr(self.source)


class ExpressionParameter(Parameter[T]):
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
            message = f"{value!r} is not an {self.words}: {error.reason}"
            raise ParameterError.several(replace(each, message=message) for each in error.faults) from None


class FormulaParameter(ExpressionParameter[Formula]):
    """A parameter whose value is an expression: a text, or a number or truth value that means itself."""

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(Formula, default, doc=doc)

    def convert(self, value: object) -> Formula | None:
        return value if isinstance(value, Formula) else super().convert(as_text(value))


def as_text(value: object) -> object:
    """A number or truth value as the expression that means it."""
    return repr(counted_in_si(value)) if isinstance(value, (bool, int, float)) else value


class PortFormulaParameter(ExpressionParameter[PortFormula | None]):
    """A parameter whose value is an expression over ports, and over the ``given`` names."""

    words = "expression over ports"

    def __init__(self, default: Any = REQUIRED, *, given: Sequence[str] = (), doc: str = "") -> None:
        super().__init__(lambda text: PortFormula(text, self.given), default, doc=doc)
        self.given = tuple(given)

    def convert(self, value: object) -> PortFormula | None:
        return value if isinstance(value, PortFormula) else super().convert(value)
