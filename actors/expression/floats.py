"""Expressions as Python functions of floats, which give what the evaluator would, or nothing where it must decide.

Only a checked tree is translated, node by node, into names and signs of our own.  What the evaluator refuses on the
way, an overflow or NaN, is not lost in between: + - * and the sign keep it until the end, and it is checked wherever
anything else takes it in.
"""

import ast
import functools
import math
from collections.abc import Callable
from typing import Any, Final

from ..core import Quantity
from .evaluation import evaluate
from .syntax import ExpressionError, free_names, parse
from .values import BINARY, CONSTANTS, FUNCTIONS

_SIGNS: Final[dict[type[ast.AST], str]] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.Pow: "**",
    ast.USub: "-", ast.UAdd: "+", ast.And: " and ", ast.Or: " or ",
    ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
}  # fmt: skip
_OF_FLOATS: Final = (
    "abs",
    "atan2",
    "cos",
    "exp",
    "hypot",
    "log",
    "max",
    "min",
    "sin",
    "sqrt",
    "tan",
)  # which give a float
UNDECIDED: Final = (ArithmeticError, TypeError, ValueError)
_FLOAT, _NUMBER, _TRUTH = "float", "number", "truth value"  # kinds: what is a float, may be one, is none


class _UnfitError(Exception):
    """What must be left to the evaluator."""


@functools.lru_cache(maxsize=4096)
def of_floats(source: str, names: tuple[str, ...]) -> Callable[..., Any] | None:
    """A function of the values of these names, in their order; None if the expression is not purely numeric.

    It gives None, or raises one of ``UNDECIDED``, for what the evaluator must decide: a value that is not exactly a
    float, a result that is not finite.
    """
    writer = _Writer(source, names)
    try:
        text = writer.end(writer.write(parse(source)))
    except _UnfitError:
        return None
    exact = "".join(f"type({name}) is " for name in writer.names.values())
    code = f"lambda {', '.join(writer.names.values())}: {text}" + (f" if {exact}float else None" if exact else "")
    try:
        return eval(compile(code, "<expression>", "eval"), KNOWN)  # type: ignore[no-any-return]
    except (MemoryError, RecursionError, SyntaxError):  # nested more deeply than Python's compiler allows
        return None


def _beyond() -> None:
    raise OverflowError


# Everything that a function can name.
KNOWN: Final[dict[str, Any]] = {
    "__builtins__": {}, "type": type, "float": float, "beyond": _beyond, "power": BINARY[ast.Pow],
    **{name: FUNCTIONS[name] for name in _OF_FLOATS},
}  # fmt: skip


class _Writer:
    """Writes the nodes of a checked tree as Python; gives text and kind of each."""

    def __init__(self, source: str, names: tuple[str, ...]) -> None:
        self.names = {name: f"v{place}" for place, name in enumerate(names)}
        self._source = source
        self._held = 0  # results that were checked

    def end(self, written: tuple[str, str]) -> str:
        """The result of the whole expression: None if it is not finite."""
        text, kind = written
        return text if kind == _TRUTH else f"(r if -1e999 < (r := {text}) < 1e999 else None)"

    def _finite(self, node: ast.expr) -> tuple[str, str]:
        """A part whose value may not show in the result: it must be finite, unless it is a name."""
        text, kind = self.write(node)
        if kind == _TRUTH or isinstance(node, ast.Name) or not free_names(node, frozenset()):
            return text, kind
        self._held += 1
        return f"(w{self._held} if -1e999 < (w{self._held} := {text}) < 1e999 else beyond())", kind

    def write(self, node: ast.expr) -> tuple[str, str]:
        """A node's text and kind; raises ``_UnfitError``."""
        if not free_names(node, frozenset()) - CONSTANTS.keys():
            return self._constant(node)
        match node:
            case ast.Name(id=name) if name in self.names:
                return self.names[name], _FLOAT
            case ast.UnaryOp(op=ast.Not()):
                return f"(not {self._finite(node.operand)[0]})", _TRUTH
            case ast.UnaryOp():
                text, kind = self.write(node.operand)
                return f"({_SIGNS[type(node.op)]}{text})", _FLOAT if kind == _FLOAT else _NUMBER
            case ast.BinOp():
                return self._operation(node)
            case ast.BoolOp():
                parts = [self._finite(each) for each in node.values]
                return f"({_SIGNS[type(node.op)].join(text for text, _ in parts)})", _common(parts)
            case ast.Compare() if all(type(sign) in _SIGNS for sign in node.ops):
                first, *others = (self._finite(each)[0] for each in (node.left, *node.comparators))
                rest = "".join(_SIGNS[type(sign)] + text for sign, text in zip(node.ops, others, strict=True))
                return f"({first}{rest})", _TRUTH
            case ast.IfExp():
                test, branches = self._finite(node.test)[0], [self.write(node.body), self.write(node.orelse)]
                return f"({branches[0][0]} if {test} else {branches[1][0]})", _common(branches)
            case ast.Call(func=ast.Name(id=name)) if name in _OF_FLOATS:
                parts = [self._finite(each) for each in node.args]
                if _common(parts) == _FLOAT:
                    return f"{name}({', '.join(text for text, _ in parts)})", _FLOAT
        raise _UnfitError

    def _constant(self, node: ast.expr) -> tuple[str, str]:
        end = node.end_col_offset
        try:
            value = evaluate(self._source[node.col_offset : end], {})
        except ExpressionError:
            raise _UnfitError from None
        if not isinstance(value, (bool, int, float)) or isinstance(value, Quantity) or not math.isfinite(value):
            raise _UnfitError
        return f"({value!r})", _TRUTH if isinstance(value, bool) else _FLOAT if isinstance(value, float) else _NUMBER

    def _operation(self, node: ast.BinOp) -> tuple[str, str]:
        """Two numbers, one of them a float: whole numbers have bounds of their own."""
        keeps_left = isinstance(node.op, (ast.Add, ast.Sub, ast.Mult, ast.Div))
        keeps_right = isinstance(node.op, (ast.Add, ast.Sub, ast.Mult))
        left, kind = self.write(node.left) if keeps_left else self._finite(node.left)
        right, other = self.write(node.right) if keeps_right else self._finite(node.right)
        if _FLOAT not in (kind, other):
            raise _UnfitError
        if isinstance(node.op, ast.Pow):
            return f"power({left}, {right})", _FLOAT
        return f"({left}{_SIGNS[type(node.op)]}{right})", _FLOAT


def _common(parts: list[tuple[str, str]]) -> str:
    kinds = {kind for _, kind in parts}
    return kinds.pop() if len(kinds) == 1 else _NUMBER
