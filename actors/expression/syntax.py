"""Valid expressions: Python's parser reads the text, and a whitelist decides what is allowed."""

import ast
import functools
import re
import warnings
from typing import Any, Final, NoReturn

from ..core import FaultError, did_you_mean
from .values import FUNCTIONS, MAX_INT

MAX_SOURCE = 2_000
MAX_PARTS = 500
MAX_NESTING = 50
_ALLOWED: Final = (
    "allowed are numbers, texts, names, lists, dicts with text keys, arithmetic, comparisons, and/or/not, "
    "'a if b else c', x[i], list comprehensions and the functions " + ", ".join(sorted(FUNCTIONS))
)


class ExpressionError(FaultError):
    """An expression that cannot be evaluated; `offset` and `length` locate the part at fault.

    ``reason`` is the message for somebody who knows that this is not an expression.
    """

    kind = "expression"

    def __init__(self, message: str, offset: int = 0, length: int = 0, meant: str = "", reason: str = "") -> None:
        super().__init__(message, span=(offset, length), meant=meant)
        self.args = (message, offset, length, meant, reason)  # what pickle rebuilds the error from
        self.offset = offset
        self.length = length
        self.reason = reason or message


_NODES: Final = (
    ast.Constant, ast.Name, ast.List, ast.Tuple, ast.Dict, ast.UnaryOp, ast.BinOp, ast.Compare, ast.BoolOp,
    ast.IfExp, ast.Subscript, ast.Slice, ast.Call, ast.ListComp, ast.comprehension,
)  # fmt: skip
_DETAILS: Final = (ast.expr_context, ast.operator, ast.unaryop, ast.boolop, ast.cmpop)
_REFUSED: Final[dict[type[ast.AST], str]] = {
    ast.Lambda: "'lambda'",
    ast.NamedExpr: "':='",
    ast.JoinedStr: "an f-string",
    ast.GeneratorExp: "a generator (write a list: [... for ... in ...])",
    ast.Set: "a set (write a list: [...])",
    ast.SetComp: "a set comprehension",
    ast.DictComp: "a dict comprehension",
    ast.Starred: "'*' before a value",
    ast.Await: "'await'",
    ast.Yield: "'yield'",
    ast.YieldFrom: "'yield'",
    ast.keyword: "an argument by name",
}
_OPERATOR_SIGNS: Final[dict[type[ast.AST], str]] = {
    ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.LShift: "<<", ast.RShift: ">>", ast.MatMult: "@",
    ast.Invert: "~", ast.Is: "is", ast.IsNot: "is not",
}  # fmt: skip
_OPERATOR_HINTS: Final = {"^": " (a power is written **)", "is": " (write ==)", "is not": " (write !=)"}
# Signs of other languages, which end Python's reading.
_OF_OTHERS: Final = re.compile(r"&&|\|\||\?|!(?!=)|(?<![=!<>])=(?!=)")
_OURS: Final = {"&&": "and", "||": "or", "?": "'a if b else c'", "!": "not", "=": "=="}


@functools.lru_cache(maxsize=4096)  # a model asks for the same few expressions once per copy of an actor
def parse(source: str) -> ast.expr:
    """Return the checked syntax tree of an expression."""
    if len(source) > MAX_SOURCE:
        raise ExpressionError(f"the expression is longer than {MAX_SOURCE:,} characters", 0, len(source))
    if not source.strip():
        raise ExpressionError("the expression is empty", 0, len(source))
    # Within ${...} a line break is a space.  One blank for each, so that all offsets stay valid.
    code = re.sub(r"[\t\n\v\f\r]", " ", source)
    indent = len(code) - len(code.lstrip(" "))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # Python only warns of '\d' and of 1if; here they are errors
            tree = ast.parse(code[indent:], mode="eval").body
    except SyntaxError as error:
        offset = max(error.offset or 1, 1) - 1 + indent
        length = max((error.end_offset or 0) - (error.offset or 0), 1)
        signs = (each[0] for each in _OF_OTHERS.finditer(code) if each.start() <= offset <= each.end())
        sign = next(signs, None) if error.msg == "invalid syntax" else None
        reason = error.msg.replace(" or ':='", "") + (f" (write {_OURS[sign]})" if sign else "")
        message = f"this is not an expression: {reason}"
        raise ExpressionError(message, min(offset, len(source)), length, reason=reason) from None
    except (RecursionError, MemoryError):
        raise ExpressionError(f"nested deeper than {MAX_NESTING} levels", 0, len(source)) from None
    except (ValueError, Warning) as error:
        raise ExpressionError(f"this is not an expression: {error}", 0, len(source), reason=str(error)) from None
    for node in ast.walk(tree):
        if isinstance(node, (ast.expr, ast.keyword)):
            end = node.end_col_offset or 0
            node.col_offset, node.end_col_offset = (_characters(code, each + indent) for each in (node.col_offset, end))
    _check(tree)
    return tree


def _characters(code: str, count: int) -> int:
    """How many characters so many bytes are, which Python counts."""
    return count if code.isascii() else len(code.encode()[:count].decode(errors="ignore"))


def _check(tree: ast.expr) -> None:
    """Refuse everything that is not on the whitelist, before anything is evaluated."""

    def refuse(node: Any, message: str) -> NoReturn:
        # A comprehension's `for` has no position in the tree.
        place: Any = node.target if isinstance(node, ast.comprehension) else node
        raise ExpressionError(message, place.col_offset, place.end_col_offset - place.col_offset)

    count = 0
    stack: list[tuple[ast.AST, int]] = [(tree, 1)]
    while stack:
        node, depth = stack.pop()
        count += 1
        if count > MAX_PARTS:
            refuse(tree, f"the expression has more than {MAX_PARTS} parts")
        if depth > MAX_NESTING:
            refuse(node, f"nested deeper than {MAX_NESTING} levels")
        if problem := _objection(node):
            refuse(node, problem)
        # What qualifies its parent, such as an operator, is checked with that, and so is the function of a call.
        children = [child for child in ast.iter_child_nodes(node) if not isinstance(child, _DETAILS)]
        if isinstance(node, ast.Call):
            children.remove(node.func)
        stack += [(child, depth + 1) for child in reversed(children)]


def _objection(node: ast.AST) -> str | None:
    """Return why a node, without its children, is refused; None if it is allowed."""
    operators: list[Any] = []
    match node:
        case ast.Attribute(attr=name) | ast.Call(func=ast.Attribute(attr=name)):
            hint = "" if name.startswith("_") else f" (an entry of a dict is written d['{name}'])"
            return f"'.{name}' is not allowed in an expression{hint}: {_ALLOWED}"
        case ast.Name(id=name):
            return f"the name '{name}' is not allowed: it starts with '__'" if name.startswith("__") else None
        case ast.Constant(value=value):
            return _objection_to_constant(value)
        case ast.Call(func=ast.Name(id=name)):
            if name in FUNCTIONS:
                return None
            guess = did_you_mean(name, FUNCTIONS) or ","
            return f"there is no function '{name}'{guess} known functions: {', '.join(sorted(FUNCTIONS))}"
        case ast.Call():
            return "only a function can be called, by its name"
        case ast.Tuple(elts=parts) if any(isinstance(part, ast.Slice) for part in parts):
            return "a slice stands alone between [ and ]: of a list of lists, write rows[0:1][0]"
        case ast.Dict() if None in node.keys:
            return f"'**' before a value is not allowed in an expression: {_ALLOWED}"
        case ast.comprehension() if node.is_async or targets(node) is None:
            return "a list comprehension needs plain names between 'for' and 'in'"
        case ast.BinOp() | ast.UnaryOp():
            operators = [node.op]
        case ast.Compare():
            operators = [*node.ops]
        case _ if not isinstance(node, _NODES):
            what = _REFUSED.get(type(node), f"'{type(node).__name__}'")
            return f"{what} is not allowed in an expression: {_ALLOWED}"
    for used in operators:
        if sign := _OPERATOR_SIGNS.get(type(used)):
            return f"the operator '{sign}' is not allowed in an expression{_OPERATOR_HINTS.get(sign, '')}"
    return None


def _objection_to_constant(value: object) -> str | None:
    if isinstance(value, str):
        is_sound = value.isascii() or not any("\ud800" <= character <= "\udfff" for character in value)
        return None if is_sound else "this text contains half a character (a lone surrogate)"
    if value is None or isinstance(value, bool):
        return None
    if isinstance(value, (int, float)):
        is_bearable = value < float("inf") if isinstance(value, float) else value <= MAX_INT
        return None if is_bearable else "this number is too large"
    what = {bytes: "a bytes text", complex: "a complex number"}.get(type(value), "'...'")
    return f"{what} is not allowed in an expression: {_ALLOWED}"


def targets(generator: ast.comprehension) -> list[str] | None:
    """Return the names that a `for` binds, or None if it binds anything else."""
    target = generator.target
    parts = target.elts if isinstance(target, (ast.Tuple, ast.List)) else [target]
    names = [part.id for part in parts if isinstance(part, ast.Name)]
    return names if len(names) == len(parts) else None


def free_names(node: ast.AST, bound: frozenset[str]) -> set[str]:
    """Return the names used in a checked tree that are not bound within it."""
    if isinstance(node, ast.Name):
        return set() if node.id in bound else {node.id}
    if isinstance(node, ast.Call):
        return set().union(*(free_names(argument, bound) for argument in node.args))
    found: set[str] = set()
    if isinstance(node, ast.ListComp):
        for generator in node.generators:
            found |= free_names(generator.iter, bound)
            bound |= frozenset(targets(generator) or ())
            for condition in generator.ifs:
                found |= free_names(condition, bound)
        return found | free_names(node.elt, bound)
    for child in ast.iter_child_nodes(node):
        found |= free_names(child, bound)
    return found
