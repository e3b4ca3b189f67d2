"""Expressions as Python functions of tokens: what ``writing.py`` writes, compiled."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable
from types import FunctionType
from typing import Any, Final

from ..core import elementary
from . import operations
from .syntax import free_names, parse
from .tables import across, along, looked_up
from .values import BINARY, FUNCTIONS
from .writing import ANY, FLOAT, NUMBER, UntranslatableError, Writer

UNDECIDED: Final = operations.UNDECIDED  # what a function raises where the evaluator must decide
# With what Python's compiler raises for what is nested too deeply.
_NOT_TRANSLATED: Final = (UntranslatableError, MemoryError, RecursionError, SyntaxError)


@functools.lru_cache(maxsize=4096)
def translated(source: str, arguments: tuple[str, ...], fields: tuple[str, ...] = ()) -> Callable[..., Any] | None:
    """A function of the values of names, in their order; None if the expression does not fit.

    Those that are ``fields`` of the first argument, which is a token, are read there.  The function raises one of
    ``UNDECIDED`` for what the evaluator must decide.
    """
    try:
        known, text = _written(source, arguments, fields)
        code = compile(f"lambda {', '.join(known)}: {text}", "<expression>", "eval")
    except _NOT_TRANSLATED:
        return None
    return eval(code, KNOWN)  # type: ignore[no-any-return]


@functools.lru_cache(maxsize=4096)
def translated_whole(
    source: str, arguments: tuple[str, ...], fields: tuple[str, ...]
) -> tuple[FunctionType, FunctionType] | None:
    """The function of ``translated`` that asks ``decide`` itself, and one that gives a finite number, or asks
    ``refuse``.  These are their last parameters; the first one of the latter says what the number is.
    """
    try:
        known, text = _written(source, arguments, fields)
        code = compile(_WHOLE.format(known=", ".join(known), text=text), "<expression>", "exec")
    except _NOT_TRANSLATED:
        return None
    made: dict[str, Any] = {}
    exec(code, KNOWN, made)
    return made["value"], made["number"]


_WHOLE: Final = """
def value({known}, decide):
    try:
        return {text}
    except UNDECIDED:
        return decide({known})
def number(what, {known}, decide, refuse):
    try:
        found = {text}
    except UNDECIDED:
        found = decide({known})
    return found if type(found) in NUMBERS and -1e999 < found < 1e999 else refuse(what, found)
"""


def _written(source: str, arguments: tuple[str, ...], fields: tuple[str, ...]) -> tuple[list[str], str]:
    """The names of the arguments in a function, and the expression that is its value."""
    names = {name: f"v{place}" for place, name in enumerate((*fields, *arguments))}
    tree = parse(source)
    text = Writer(source, names, ANY).whole(tree)
    if not fields:
        text = _of_floats(source, tree, names) + text
    known = [names[name] for name in arguments]
    if fields:
        token = known[0]
        found = [
            f"({names[each]} := {token}[{each!r}] if type({token}) is dict else part({token}, {each!r})), "
            for each in fields
        ]
        text = f"{text} if ({''.join(found)}) else None"
    return known, text


@functools.lru_cache(maxsize=256)
def all_translated(
    sources: tuple[str, ...], names: tuple[str, ...]
) -> tuple[Callable[..., Any], tuple[str, ...]] | None:
    """A function of the values of all these names, which must be floats, to the values of the expressions, as floats;
    and these as texts over ``v0``, ``v1``, ...

    It raises one of ``UNDECIDED`` where the evaluator must decide; None if an expression is not purely numeric.
    """
    places = {name: f"v{place}" for place, name in enumerate(names)}
    if len(places) < len(names):
        return None
    parts = []
    for source in sources:
        writer = Writer(source, places, FLOAT)
        try:
            text, kind = writer.settled(parse(source))
        except UntranslatableError:
            return None
        if kind not in (FLOAT, NUMBER) or writer.weighs:
            return None
        parts.append(text if kind == FLOAT else f"float({text})")
    code = f"lambda {', '.join(places.values())}: [{', '.join(parts)}]"
    try:
        return eval(compile(code, "<expression>", "eval"), KNOWN), tuple(parts)
    except _NOT_TRANSLATED:
        return None


def undecided_by(*values: object) -> Any:
    """The function of an expression that the evaluator must decide in any case."""
    operations.undecided()


def _of_floats(source: str, tree: ast.expr, names: dict[str, str]) -> str:
    """The beginning of a function: what it does if the values of all names are floats."""
    used = [place for name, place in names.items() if name in free_names(tree, frozenset())]
    if not used:
        return ""
    try:
        text = Writer(source, names, FLOAT).whole(tree)
    except UntranslatableError:
        return ""
    return f"{text} if {''.join(f'type({each}) is ' for each in used)}float else "


# Everything that a function can name.
KNOWN: Final[dict[str, Any]] = {
    "__builtins__": {}, "type": type, "float": float, "dict": dict, "list": list, "str": str, "size": len,
    "NUMBERS": operations.NUMBERS, "LIGHT": operations.LIGHT, "power": BINARY[ast.Pow],
    "UNDECIDED": UNDECIDED, "undecided": operations.undecided,
    "handed": operations.handed, "paid": operations.paid, "weighed": operations.weighed,
    "sin": elementary.sin, "cos": elementary.cos, "along": along, "across": across, "looked_up": looked_up,
    "plain": operations.plain, "part": operations.part, "cut": operations.cut, "turns": operations.turns,
    **{f"by_{kind.__name__}": function for kind, function in operations.OPERATORS.items()},
    **{f"f_{name}": function for name, function in FUNCTIONS.items()},
}  # fmt: skip
