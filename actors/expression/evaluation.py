"""A safe evaluator for expressions: arithmetic, lists, conditions and a few functions.

Python's parser reads the text; the whole tree is checked against a whitelist and then interpreted here, never by
`eval`. Every cost (time, memory, depth, size of numbers) has a limit that is checked before it is spent.
"""

import ast
import contextlib
import operator
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import lru_cache
from typing import ParamSpec, TypeVar

from ..core import Quantity, UnitError, cut, did_you_mean, nearest
from .budget import MAX_ELEMENTS, MAX_TEXT, Budget, BudgetError
from .syntax import ExpressionError, free_names, parse, targets
from .values import BINARY, COMPARE, CONSTANTS, FUNCTIONS, UNARY, check_result, kind_of, subscript, text_of

_MAX_NAMES_SHOWN = 20

T = TypeVar("T")
P = ParamSpec("P")


def evaluate(source: str, names: Mapping[str, object], budget: Budget | None = None) -> object:
    """Return the value of an expression in which the given names are known; ``budget`` is for several together."""
    tree = parse(source)
    evaluation = _Evaluation(source, names, Budget(whole=budget))
    value = evaluation.guard(tree, evaluation.value, tree)
    evaluation.guard(tree, check_result, value)
    return value


def interpolate(text: str, names: Mapping[str, object], budget: Budget | None = None) -> object:
    """Return the text with its `${...}` evaluated; a text that is one `${...}` gives the value as it is.

    In a longer text, a quantity is written in the unit that follows it, or else in SI units.  `$${` stands for
    `${` itself.
    """
    pieces = _pieces(text)
    parts: list[str] = []
    for number, (offset, source) in enumerate(pieces):
        if offset is None:
            parts.append(source)
            continue
        with _shifted(offset):
            value = evaluate(source, names, budget)
            if len(pieces) == 1:
                return value
            parts.append(_as_text(source, _as_read(value, pieces[number + 1 :])))
    whole = "".join(parts)
    if len(whole) > MAX_TEXT and len(pieces) > 1:
        raise ExpressionError(f"the text becomes longer than {MAX_TEXT:,} characters", 0, len(text))
    return whole


@lru_cache(maxsize=4096)  # a model asks for the same few texts once per copy of an actor
def names_in(text: str) -> frozenset[str]:
    """Return the names that the `${...}` of a text use, without constants and functions."""
    return frozenset().union(*(free_names(tree, frozenset()) for _, tree in _trees(text))) - CONSTANTS.keys()


def check_names(text: str, known: Collection[str]) -> None:
    """Raise ``ExpressionError`` if the `${...}` of a text use an unknown name."""
    for offset, tree in _trees(text):
        strange = free_names(tree, frozenset()) - set(known) - CONSTANTS.keys() - FUNCTIONS.keys()
        for node in ast.walk(tree):
            if isinstance(node, ast.Name) and node.id in strange:
                length = (node.end_col_offset or 0) - node.col_offset
                meant = nearest(node.id, _nameable(known)) or ""
                raise ExpressionError(_unknown(node.id, known), offset + node.col_offset, length, meant)


def _nameable(names: Collection[str]) -> list[str]:
    return [*sorted(names), *CONSTANTS, *FUNCTIONS]


def _unknown(name: str, names: Collection[str]) -> str:
    known = sorted(names)
    shown = ", ".join(known[:_MAX_NAMES_SHOWN]) + (", ..." if len(known) > _MAX_NAMES_SHOWN else "")
    guess = did_you_mean(name, _nameable(names))
    return f"unknown name '{name}'{guess or ','} known names: {shown or 'none'}"


# --- finding expressions in a text --------------------------------------------------------------------

_WORD = re.compile(r"\s*([^\s,;.)]+)")  # the unit after a number, if it is one
_OPENING = re.compile(r"\$\$\{|\$\{")
_LEXEME = re.compile(
    r"""'''(?:[^\\]|\\.)*?'''|\"""(?:[^\\]|\\.)*?\"""|'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"|[{}]""", re.DOTALL
)


@lru_cache(maxsize=4096)
def _pieces(text: str) -> tuple[tuple[int | None, str], ...]:
    """Return the text in pieces: literal text with None, expressions with the offset at which they start."""
    pieces: list[tuple[int | None, str]] = []
    literal = ""
    done = 0
    while opening := _OPENING.search(text, done):
        literal += text[done : opening.start()]
        done = opening.end()
        if opening[0] == "$${":
            literal += "${"
            continue
        if literal:
            pieces.append((None, literal))
            literal = ""
        end = _end_of_expression(text, done)
        if end is None:
            start = opening.start()
            raise ExpressionError("this '${' has no closing '}'", start, len(text) - start)
        pieces.append((done, text[done:end]))
        done = end + 1
    literal += text[done:]
    if literal:
        pieces.append((None, literal))
    return tuple(pieces)


def _trees(text: str) -> Iterator[tuple[int, ast.expr]]:
    """The expressions in a text, each with the offset at which it starts."""
    for offset, source in _pieces(text):
        if offset is not None:
            with _shifted(offset):
                yield offset, parse(source)


def _end_of_expression(text: str, start: int) -> int | None:
    """Return where the `}` of the `${` before `start` stands; strings and inner braces are skipped."""
    depth = 1
    for lexeme in _LEXEME.finditer(text, start):
        if lexeme[0] == "{":
            depth += 1
        elif lexeme[0] == "}":
            depth -= 1
            if depth == 0:
                return lexeme.start()
    return None


@contextlib.contextmanager
def _shifted(offset: int) -> Iterator[None]:
    """Make the offsets of errors inside count from the start of the whole text."""
    try:
        yield
    except ExpressionError as error:
        raise ExpressionError(error.message, error.offset + offset, error.length) from None


def _as_read(value: object, behind: tuple[tuple[int | None, str], ...]) -> object:
    """The value, in the unit that follows it in the text, if it is a quantity and there is a unit."""
    if isinstance(value, Quantity) and behind and behind[0][0] is None and (unit := _WORD.match(behind[0][1])):
        with contextlib.suppress(UnitError):
            return value.to(unit[1])
    return value


def _as_text(source: str, value: object) -> str:
    try:
        return text_of(value)
    except BudgetError as error:
        raise ExpressionError(str(error), 0, len(source)) from None


# --- evaluating ---------------------------------------------------------------------------------------


class _Evaluation:
    """One walk over a checked tree."""

    def __init__(self, source: str, names: Mapping[str, object], budget: Budget) -> None:
        self._source = source
        self._names = names
        self._bound: list[dict[str, object]] = []
        self._budget = budget

    def _error(self, node: ast.expr, message: str) -> ExpressionError:
        return ExpressionError(message, node.col_offset, (node.end_col_offset or 0) - node.col_offset)

    def guard(self, node: ast.expr, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call the function; any Python error is reported for this node."""
        try:
            return function(*args, **kwargs)
        except ZeroDivisionError:
            message = f"{self._text(node)} divides by zero"
        except OverflowError:
            message = f"the result of {self._text(node)} is too large"
        except (BudgetError, TypeError, UnitError, ValueError) as error:
            message = f"{self._text(node)}: {error}"
        except (RecursionError, MemoryError):
            message = f"{self._text(node)} needs too much memory"
        raise self._error(node, message)

    def _text(self, node: ast.expr) -> str:
        return cut(self._source[node.col_offset : node.end_col_offset])

    def value(self, node: ast.expr) -> object:
        self._budget.spend(1)
        match node:
            case ast.Constant():
                return node.value
            case ast.Name():
                return self._lookup(node)
            case ast.List() | ast.Tuple():
                return self._paid(node, [self.value(item) for item in node.elts])
            case ast.Dict():
                return self._paid(node, self._dict(node))
            case ast.UnaryOp(op=ast.Not()):
                return not self.value(node.operand)
            case ast.UnaryOp():
                operand = self.value(node.operand)
                return self.guard(node, UNARY[type(node.op)], operand)
            case ast.BinOp():
                left, right = self.value(node.left), self.value(node.right)
                return self._paid(node, self.guard(node, BINARY[type(node.op)], left, right))
            case ast.BoolOp():
                decided: object = None
                for item in node.values:
                    decided = self.value(item)
                    if bool(decided) is isinstance(node.op, ast.Or):
                        break
                return decided
            case ast.Compare():
                return self._compare(node)
            case ast.IfExp():
                return self.value(node.body if self.value(node.test) else node.orelse)
            case ast.Subscript():
                return self._subscript(node)
            case ast.Call(func=ast.Name(id=name)):
                arguments = [self.value(item) for item in node.args]
                if name != "len":  # whose size is known
                    for item, argument in zip(node.args, arguments, strict=True):
                        self._weighed(item, argument)
                return self._paid(node, self.guard(node, FUNCTIONS[name], *arguments))
            case ast.ListComp():
                items: list[object] = []
                self._comprehend(node, 0, items)
                return self._paid(node, items)
            case _:
                raise AssertionError(f"{type(node).__name__} passed the check")

    def _paid(self, node: ast.expr, value: T) -> T:
        """Pay for a value that was made, and check that it is not too long."""
        self.guard(node, self._budget.pay, value)
        return value

    def _weighed(self, node: ast.expr, value: T) -> T:
        """Pay for a value that is searched, and check that it is not too large."""
        self.guard(node, self._budget.weigh, value)
        return value

    def _lookup(self, node: ast.Name) -> object:
        name = node.id
        for scope in reversed(self._bound):
            if name in scope:
                return scope[name]
        if name in self._names:
            if name in CONSTANTS:
                raise self._error(node, f"'{name}' is a constant and cannot be the name of something else: rename it")
            value = self._names[name]
            return self._paid(node, list(value)) if isinstance(value, tuple) else value
        if name in CONSTANTS:
            return CONSTANTS[name]
        if name in FUNCTIONS:
            raise self._error(node, f"'{name}' is a function: write {name}(...)")
        known = {*self._names, *(bound for scope in self._bound for bound in scope)}
        raise self._error(node, _unknown(name, known))

    def _dict(self, node: ast.Dict) -> dict[str, object]:
        result: dict[str, object] = {}
        for key_node, value_node in zip(node.keys, node.values, strict=True):
            assert key_node is not None  # '**' has been refused
            key = self.value(key_node)
            if not isinstance(key, str):
                raise self._error(key_node, f"a key must be a text, but this one is {kind_of(key)}")
            if key in result:
                raise self._error(key_node, f"duplicate key '{key}'")
            result[key] = self.value(value_node)
        return result

    def _compare(self, node: ast.Compare) -> bool:
        left = self.value(node.left)
        for sign, right_node in zip(node.ops, node.comparators, strict=True):
            right = self._weighed(right_node, self.value(right_node))
            if not self.guard(node, COMPARE[type(sign)], left, right):
                return False
            left = right
        return True

    def _subscript(self, node: ast.Subscript) -> object:
        whole = self.value(node.value)
        if not isinstance(node.slice, ast.Slice):
            index = self.value(node.slice)
            return self.guard(node, subscript, whole, index)
        bounds = (node.slice.lower, node.slice.upper, node.slice.step)
        parts = [None if bound is None else self.value(bound) for bound in bounds]
        for part in parts:
            if part is not None and type(part) is not int:
                raise self._error(node, f"a slice needs whole numbers, not {kind_of(part)}")
        if not isinstance(whole, (list, tuple, str)):
            raise self._error(node, f"only a list or a text can be sliced, not {kind_of(whole)}")
        cut = self.guard(node, operator.getitem, whole, slice(*parts))
        return self._paid(node, list(cut) if isinstance(cut, tuple) else cut)

    def _comprehend(self, node: ast.ListComp, level: int, items: list[object]) -> None:
        if level == len(node.generators):
            if len(items) >= MAX_ELEMENTS:
                raise self._error(node, f"the list would have more than {MAX_ELEMENTS:,} elements")
            items.append(self.value(node.elt))
            return
        generator = node.generators[level]
        source = self.value(generator.iter)
        if not isinstance(source, (list, tuple)):
            raise self._error(generator.iter, f"'for' needs a list, not {kind_of(source)}")
        names = targets(generator) or []
        scope: dict[str, object] = {}
        self._bound.append(scope)
        for item in source:
            self._budget.spend(1)
            if isinstance(generator.target, ast.Name):
                item = [item]
            elif not isinstance(item, (list, tuple)) or len(item) != len(names):
                wanted = f"a list of {len(names)}"
                raise self._error(generator.iter, f"each element must be {wanted}, not {kind_of(item)}")
            scope.update(zip(names, item, strict=True))
            if all(self.value(condition) for condition in generator.ifs):
                self._comprehend(node, level + 1, items)
        self._bound.pop()
