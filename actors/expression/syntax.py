"""Which expressions are welcome: Python's parser reads the text, a whitelist judges what it found."""

import ast
import functools
import re
import warnings
from typing import Final, NoReturn

from ..core import EpicycleError, did_you_mean
from .values import FUNCTIONS, MAX_INT

MAX_SOURCE = 2_000
MAX_PARTS = 500
MAX_NESTING = 50
_ALLOWED: Final = (
    "allowed are numbers, texts, names, lists, dicts with text keys, arithmetic, comparisons, and/or/not, "
    "'a if b else c', x[i], list comprehensions and the functions " + ", ".join(sorted(FUNCTIONS))
)


class ExpressionError(EpicycleError):
    """An expression that cannot be evaluated; `offset` and `length` say which part is to blame."""

    def __init__(self, message: str, offset: int = 0, length: int = 0) -> None:
        super().__init__(message, offset, length)
        self.message = message
        self.offset = offset
        self.length = length

    def __str__(self) -> str:
        return self.message


_NODES: Final = (
    ast.Constant, ast.Name, ast.List, ast.Tuple, ast.Dict, ast.UnaryOp, ast.BinOp, ast.Compare, ast.BoolOp,
    ast.IfExp, ast.Subscript, ast.Slice, ast.Call, ast.ListComp, ast.comprehension,
)  # fmt: skip
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


@functools.lru_cache(maxsize=4096)  # a model asks for the same few expressions once per copy of an actor
def parse(source: str) -> ast.expr:
    """Return the checked syntax tree of an expression."""
    if len(source) > MAX_SOURCE:
        raise ExpressionError(f"the expression is longer than {MAX_SOURCE:,} characters", 0, len(source))
    if not source.strip():
        raise ExpressionError("the expression is empty", 0, len(source))
    # Within ${...} a line break is just space. Blanks for blanks, so that all offsets stay true.
    code = re.sub(r"[\t\n\v\f\r]", " ", source)
    indent = len(code) - len(code.lstrip(" "))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # Python only warns of '\d' and of 1if; here they are mistakes
            tree = ast.parse(code[indent:], mode="eval").body
    except SyntaxError as error:
        offset = max(error.offset or 1, 1) - 1 + indent
        length = max((error.end_offset or 0) - (error.offset or 0), 1)
        message = "this is not an expression: " + error.msg.replace(" or ':='", "")
        raise ExpressionError(message, min(offset, len(source)), length) from None
    except (RecursionError, MemoryError):
        raise ExpressionError(f"nested deeper than {MAX_NESTING} levels", 0, len(source)) from None
    except (ValueError, Warning) as error:
        raise ExpressionError(f"this is not an expression: {error}", 0, len(source)) from None
    _check(tree, code[indent:], indent)
    for node in ast.walk(tree):
        if isinstance(node, ast.expr):
            node.col_offset, node.end_col_offset = _extent(node, code[indent:], indent)
    return tree


def _extent(node: ast.AST, code: str, indent: int) -> tuple[int, int]:
    """Return where a node starts and ends in the source, in characters; Python counts UTF-8 bytes."""
    start, end = getattr(node, "col_offset", 0), getattr(node, "end_col_offset", 0)
    if code.isascii():
        return start + indent, end + indent
    data = code.encode()
    return len(data[:start].decode()) + indent, len(data[:end].decode()) + indent


def _check(tree: ast.expr, code: str, indent: int) -> None:
    """Refuse whatever is not on the whitelist, before anything is evaluated."""

    def refuse(node: ast.AST, message: str) -> NoReturn:
        # A comprehension's `for` has no place of its own in the tree.
        start, end = _extent(node.target if isinstance(node, ast.comprehension) else node, code, indent)
        raise ExpressionError(message, start, end - start)

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
        children = [child for child in ast.iter_child_nodes(node) if not _is_detail(child)]
        if isinstance(node, ast.Call):
            children.remove(node.func)  # judged with the call
        stack += [(child, depth + 1) for child in reversed(children)]


def _is_detail(node: ast.AST) -> bool:
    """True for nodes that only qualify their parent."""
    return isinstance(node, (ast.expr_context, ast.operator, ast.unaryop, ast.boolop, ast.cmpop))


def _objection(node: ast.AST) -> str | None:
    """Return why a node, seen without its children, is refused; None if it is welcome."""
    if isinstance(node, ast.Attribute):
        return _objection_to_attribute(node)
    if not isinstance(node, _NODES):
        what = _REFUSED.get(type(node), f"'{type(node).__name__}'")
        return f"{what} is not allowed in an expression: {_ALLOWED}"
    if isinstance(node, ast.Name):
        is_hidden = node.id.startswith("__")
        return f"the name '{node.id}' is not allowed: it starts with '__'" if is_hidden else None
    if isinstance(node, ast.Constant):
        return _objection_to_constant(node.value)
    if isinstance(node, ast.Call):
        return _objection_to_call(node.func)
    if isinstance(node, ast.Dict) and None in node.keys:
        return f"'**' before a value is not allowed in an expression: {_ALLOWED}"
    if isinstance(node, ast.comprehension) and (node.is_async or targets(node) is None):
        return "a list comprehension needs plain names between 'for' and 'in'"
    operators: list[ast.AST] = []
    if isinstance(node, (ast.BinOp, ast.UnaryOp)):
        operators = [node.op]
    elif isinstance(node, ast.Compare):
        operators = list(node.ops)
    for used in operators:
        if sign := _OPERATOR_SIGNS.get(type(used)):
            return f"the operator '{sign}' is not allowed in an expression{_OPERATOR_HINTS.get(sign, '')}"
    return None


def _objection_to_attribute(node: ast.Attribute) -> str:
    hint = "" if node.attr.startswith("_") else f" (an entry of a dict is written d['{node.attr}'])"
    return f"'.{node.attr}' is not allowed in an expression{hint}: {_ALLOWED}"


def _objection_to_constant(value: object) -> str | None:
    if isinstance(value, str):
        is_sound = value.isascii() or not any("\ud800" <= character <= "\udfff" for character in value)
        return None if is_sound else "this text has half a character (a lone surrogate) in it"
    if value is None or isinstance(value, bool):
        return None
    if isinstance(value, (int, float)):
        is_bearable = value < float("inf") if isinstance(value, float) else value <= MAX_INT
        return None if is_bearable else "this number is too large"
    what = {bytes: "a bytes text", complex: "a complex number"}.get(type(value), "'...'")
    return f"{what} is not allowed in an expression: {_ALLOWED}"


def _objection_to_call(function: ast.expr) -> str | None:
    if isinstance(function, ast.Attribute):
        return _objection_to_attribute(function)
    if not isinstance(function, ast.Name):
        return "only a function can be called, by its name"
    if function.id not in FUNCTIONS:
        known = ", ".join(sorted(FUNCTIONS))
        guess = did_you_mean(function.id, FUNCTIONS)
        return f"there is no function '{function.id}'{guess or ','} known functions: {known}"
    return None


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
