"""Expressions as the text of Python functions, which give what the evaluator would, or leave it to that.

Only a checked tree is written, node by node, in names and signs of our own.  Numbers are computed inline, and
everything else by the functions of ``operations.py``.  Where all names are floats, what the evaluator refuses on the
way, an overflow or NaN, is not lost in between: + - * and the sign keep it until the end, and it is checked wherever
anything else takes it in.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable
from typing import Final

from ..core import Quantity
from .budget import MAX_STEPS
from .evaluation import evaluate
from .syntax import ExpressionError, free_names
from .tables import tables_of
from .values import CONSTANTS, MAX_INT

_SIGNS: Final[dict[type[ast.AST], str]] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%",
    ast.USub: "-", ast.UAdd: "+", ast.And: " and ", ast.Or: " or ",
    ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
}  # fmt: skip
_OF_FLOATS: Final = frozenset(("abs", "atan2", "cos", "exp", "hypot", "log", "max", "min", "sin", "sqrt", "tan"))
_GIVE_NUMBERS: Final = frozenset(
    ("abs", "atan2", "ceil", "cos", "degrees", "exp", "float", "floor", "hypot", "int", "interpolate", "log",
     "radians", "round", "sin", "sqrt", "sum", "tan")
)  # fmt: skip
# Kinds of values: a float that may be infinite or NaN, a number, a truth value, any token as it came.
FLOAT, NUMBER, _TRUTH, ANY = "float", "number", "truth value", "any"
_SIMPLE: Final = (
    ast.Constant, ast.Name, ast.UnaryOp, ast.BinOp, ast.BoolOp, ast.Compare, ast.IfExp,
    ast.operator, ast.unaryop, ast.boolop, ast.cmpop, ast.expr_context,
)  # fmt: skip
_LITERAL: Final = (ast.List, ast.Tuple, ast.Constant, ast.UnaryOp, ast.unaryop, ast.expr_context)
_SPENT: Final = 1_000  # more than what an expression of 500 parts and 2,000 characters takes without its lists
_LARGEST: Final = f"{float(MAX_INT)!r}"

Written = tuple[str, str]  # text and kind


class UntranslatableError(Exception):
    """What must be left to the evaluator."""


class Writer:
    """Writes the nodes of a checked tree as Python; gives text and kind of each."""

    def __init__(self, source: str, names: dict[str, str], kind: str) -> None:
        self._names = names
        self._kinds = dict.fromkeys(names, kind)
        self._source = source
        self._held = 0  # values that have a name
        self._atoms = set(names.values())  # texts that can be repeated
        self.weighs = False  # whether there is something to be paid for by its size

    def whole(self, tree: ast.expr) -> str:
        """The text of the whole expression, whose value is checked; raises ``UntranslatableError``."""
        text, kind = self._write(tree)
        if kind == FLOAT:
            text = f"(r if -1e999 < (r := {text}) < 1e999 else undecided())"
        elif kind == NUMBER:
            text = f"(r if -{_LARGEST} <= (r := {text}) <= {_LARGEST} else handed(r))"
        elif kind == ANY:
            text = f"(r if type(r := {text}) in NUMBERS and -{_LARGEST} <= r <= {_LARGEST} else handed(r))"
        return f"({text} if (left := [{MAX_STEPS - _SPENT}]) else None)" if self.weighs else text

    # -- texts ----------------------------------------------------------------------------------------------------

    def _new(self) -> str:
        self._held += 1
        return f"w{self._held}"

    def _named(self, text: str) -> tuple[str, str]:
        """A text where it comes first, and where it comes again."""
        if text in self._atoms:
            return text, text
        name = self._new()
        return f"({name} := {text})", name

    def _left(self) -> str:
        self.weighs = True
        return "left"

    def settled(self, node: ast.expr, written: Written | None = None) -> Written:
        """A part whose value may not show in the result: it must be finite, unless it is a name."""
        text, kind = written or self._write(node)
        if kind != FLOAT or text in self._atoms:
            return text, kind
        name = self._new()
        return f"({name} if -1e999 < ({name} := {text}) < 1e999 else undecided())", kind

    def _tested(self, node: ast.expr) -> str:
        return _test(self.settled(node))

    def _weighed(self, text: str) -> str:
        return f"weighed({text}, {self._left()})"

    # -- nodes ----------------------------------------------------------------------------------------------------

    def _write(self, node: ast.expr) -> Written:
        """A node's text and kind; raises ``UntranslatableError``."""
        if not free_names(node, frozenset()) - (CONSTANTS.keys() - self._names.keys()) and (
            found := self._constant(node)
        ):
            self._atoms.add(found[0])
            return found
        match node:
            case ast.Name(id=name) if name in self._names:
                return self._names[name], self._kinds[name]
            case ast.List() | ast.Tuple():
                parts = [self.settled(each) for each in node.elts]
                return f"[{', '.join(text for text, _ in parts)}]", ANY
            case ast.Dict():
                return self._dict(node)
            case ast.UnaryOp(op=ast.Not()):
                return f"(not {self._tested(node.operand)})", _TRUTH
            case ast.UnaryOp():
                return self._signed(node)
            case ast.BinOp():
                return self._operation(node)
            case ast.BoolOp():
                parts = [self.settled(each) for each in node.values]
                return f"({_SIGNS[type(node.op)].join(map(_test, parts))})", _common(parts)
            case ast.Compare():
                return self._compared(node)
            case ast.IfExp():
                branches = [self._write(node.body), self._write(node.orelse)]
                if (kind := _common(branches)) != FLOAT:
                    branches = [self.settled(node.body, branches[0]), self.settled(node.orelse, branches[1])]
                return f"({branches[0][0]} if {self._tested(node.test)} else {branches[1][0]})", kind
            case ast.Subscript():
                return self._subscript(node)
            case ast.Call(func=ast.Name(id=name)):
                return self._called(name, node.args)
            case ast.ListComp(generators=[ast.comprehension(target=ast.Name())]):
                return self._list_of(node)
        raise UntranslatableError

    def _constant(self, node: ast.expr) -> Written | None:
        """A part without names that is a number or a text."""
        if isinstance(node, ast.Constant):
            value: object = node.value
        elif all(
            isinstance(each, _SIMPLE) and not isinstance(getattr(each, "value", None), str) for each in ast.walk(node)
        ):
            try:
                value = evaluate(self._source[node.col_offset : node.end_col_offset], {})
            except ExpressionError:
                raise UntranslatableError from None
        else:
            return None
        if value is None or isinstance(value, str):
            return repr(value), ANY
        if isinstance(value, bool):
            return f"{value!r}", _TRUTH
        if not isinstance(value, (int, float)) or isinstance(value, Quantity):
            return None
        if isinstance(value, float) and not math.isfinite(value):
            return ("(1e999)" if value > 0 else "(-1e999)"), NUMBER
        return f"({value!r})", FLOAT if isinstance(value, float) else NUMBER

    def _dict(self, node: ast.Dict) -> Written:
        keys = [each.value if isinstance(each, ast.Constant) else None for each in node.keys]
        if not all(isinstance(key, str) for key in keys) or len({*keys}) < len(keys):
            raise UntranslatableError
        items = zip(keys, map(self.settled, node.values), strict=True)
        return f"{{{', '.join(f'{key!r}: {text}' for key, (text, _) in items)}}}", ANY

    def _signed(self, node: ast.UnaryOp) -> Written:
        text, kind = self._write(node.operand)
        sign = _SIGNS[type(node.op)]
        if kind != ANY:
            return f"({sign}{text})", FLOAT if kind == FLOAT else NUMBER
        first, again = self._named(text)
        return f"({sign}{again} if type({first}) in NUMBERS else by_{type(node.op).__name__}({again}))", NUMBER

    def _operation(self, node: ast.BinOp) -> Written:
        keeps_left = isinstance(node.op, (ast.Add, ast.Sub, ast.Mult, ast.Div))
        keeps_right = isinstance(node.op, (ast.Add, ast.Sub, ast.Mult))
        left, right = self._write(node.left), self._write(node.right)
        kinds = {left[1], right[1]}
        is_of_floats = FLOAT in kinds <= {FLOAT, NUMBER}
        if not (is_of_floats and keeps_left):
            left = self.settled(node.left, left)
        if not (is_of_floats and keeps_right):
            right = self.settled(node.right, right)
        if is_of_floats and isinstance(node.op, ast.Pow):
            return f"power({left[0]}, {right[0]})", FLOAT
        if is_of_floats:
            return f"({left[0]}{_SIGNS[type(node.op)]}{right[0]})", FLOAT
        other = f"by_{type(node.op).__name__}"
        if isinstance(node.op, ast.Pow):
            return f"{other}({left[0]}, {right[0]}, {self._left()})", NUMBER
        # Whole numbers have bounds of their own.
        tests, (one, two) = self._tests((left, right), "NUMBERS", {FLOAT, NUMBER})
        name = self._new()
        is_bounded = f"-{_LARGEST} <= ({name} := {one}{_SIGNS[type(node.op)]}{two}) <= {_LARGEST}"
        text = f"({name} if {tests}{' and ' if tests else ''}{is_bounded} else {other}({one}, {two}, {self._left()}))"
        may_be_list = isinstance(node.op, (ast.Add, ast.Mult)) and kinds.isdisjoint({FLOAT, NUMBER})
        may_be_list = may_be_list or (isinstance(node.op, ast.Mult) and FLOAT not in kinds and ANY in kinds)
        return text, ANY if may_be_list else NUMBER

    def _tests(self, parts: Iterable[Written], among: str, known: set[str]) -> tuple[str, list[str]]:
        """Whether the types of values are among some, and their texts behind that."""
        tests, texts = [], []
        for text, kind in parts:
            first, again = self._named(text)
            texts.append(again)
            if kind not in known or first != again:  # a value that has no name yet is computed here in any case
                tests.append(f"(type({first}) in {among})")
        return " & ".join(tests), texts

    def _compared(self, node: ast.Compare) -> Written:
        found, first = [], self.settled(node.left)
        nodes = [node.left, *node.comparators]
        for place, sign in enumerate(node.ops, 1):
            second = self.settled(nodes[place])
            if place < len(node.ops):  # is compared again
                text, again = self._named(second[0])
                found.append(self._comparison(sign, first, (text, second[1]), nodes[place]))
                first = again, second[1]
                self._atoms.add(again)
            else:
                found.append(self._comparison(sign, first, second, nodes[place]))
        return f"({' and '.join(found)})", _TRUTH

    def _comparison(self, sign: ast.cmpop, left: Written, right: Written, node: ast.expr) -> str:
        other = f"by_{type(sign).__name__}"
        known = {FLOAT, NUMBER, _TRUTH}
        if isinstance(sign, (ast.In, ast.NotIn)):
            return f"{other}({left[0]}, {right[0]}, {self._left()})"
        if {left[1], right[1]} <= known:
            return f"({left[0]}{_SIGNS[type(sign)]}{right[0]})"
        if not isinstance(sign, (ast.Eq, ast.NotEq)):
            tests, (one, two) = self._tests((left, right), "NUMBERS", known)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            first, one = self._named(left[0])
            two, most = right[0], max(len(node.value), 9)
            tests = f"type({first}) is str and size({one}) <= {most}"
        else:
            tests, (one, two) = self._tests((left, right), "LIGHT", known)
        return f"({one}{_SIGNS[type(sign)]}{two} if {tests} else {other}({one}, {two}, {self._left()}))"

    def _subscript(self, node: ast.Subscript) -> Written:
        whole, kind = self._write(node.value)
        if kind != ANY:
            raise UntranslatableError
        if isinstance(node.slice, ast.Slice):
            bounds = [each and self.settled(each)[0] for each in (node.slice.lower, node.slice.upper, node.slice.step)]
            return f"cut({whole}, {', '.join(each or 'None' for each in bounds)}, {self._left()})", ANY
        index, kind = self.settled(node.slice)
        is_key = isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, str)
        is_number = index in self._atoms and kind == NUMBER and index not in self._names.values()
        if not (is_key or is_number) or isinstance(node.value, ast.Constant):
            return f"part({whole}, {index})", ANY
        first, again = self._named(whole)
        return (
            f"({again}[{index}] if type({first}) is {'dict' if is_key else 'list'} else part({again}, {index}))",
            ANY,
        )

    def _called(self, name: str, arguments: list[ast.expr]) -> Written:
        if name == "interpolate" and (found := self._interpolated(arguments)):
            return found
        parts = [self.settled(each) for each in arguments]
        if name in _OF_FLOATS and {kind for _, kind in parts} == {FLOAT}:
            own = name if name in ("sin", "cos") else f"f_{name}"  # these check nothing, and take floats alone
            return f"{own}({', '.join(text for text, _ in parts)})", FLOAT
        if name == "len" and len(parts) == 1:
            first, again = self._named(parts[0][0])
            return f"(size({again}) if type({first}) is list else f_len({again}))", NUMBER
        texts = [text if kind != ANY else self._weighed(text) for text, kind in parts]
        text = f"f_{name}({', '.join(texts)})"
        if name == "bool":
            return text, _TRUTH
        is_number = name in _GIVE_NUMBERS or (name in ("min", "max") and {kind for _, kind in parts} <= {FLOAT, NUMBER})
        return (text, NUMBER) if is_number else (f"paid({text}, {self._left()})", ANY)

    def _interpolated(self, arguments: list[ast.expr]) -> Written | None:
        """A table of constants, which is checked here once."""
        many = len(arguments) // 2
        numbers = [self.settled(each) for each in arguments[:many]]
        tables = arguments[many:]
        if len(arguments) not in (3, 5) or any(
            not isinstance(part, _LITERAL) for each in tables for part in ast.walk(each)
        ):
            return None
        try:
            given = tables_of([evaluate(self._source[each.col_offset : each.end_col_offset], {}) for each in tables])
        except (ExpressionError, TypeError, ValueError):  # the evaluator says what is wrong
            raise UntranslatableError from None
        if {kind for _, kind in numbers} == {FLOAT}:
            texts = [text for text, _ in numbers] + [repr(each) for each in given]
            return f"{'along' if many == 1 else 'across'}({', '.join(texts)})", FLOAT
        return f"looked_up({given!r}, {', '.join(text for text, _ in numbers)})", NUMBER

    def _list_of(self, node: ast.ListComp) -> Written:
        """A list comprehension over one list."""
        (generator,) = node.generators
        whole, kind = self._write(generator.iter)
        if kind != ANY:
            raise UntranslatableError
        assert isinstance(generator.target, ast.Name)
        source, item, before = self._new(), f"b{self._held}", (self._names, self._kinds)
        self._names, self._kinds = (
            {**self._names, generator.target.id: item},
            {**self._kinds, generator.target.id: ANY},
        )
        self._atoms.add(item)
        conditions = [f" if {self._tested(each)}" for each in generator.ifs]
        text, kind = self.settled(node.elt)
        self._names, self._kinds = before
        steps = 2 + sum(1 for each in (node.elt, *generator.ifs) for _ in ast.walk(each)) + len(self._source) // 5
        text = (
            f"([{text} for {item} in {source}{''.join(conditions)}] "
            f"if ({source} := turns({whole}, {self._left()}, {steps})) else [])"
        )
        return text, ANY


def _test(written: Written) -> str:
    text, kind = written
    return f"plain({text})" if kind == ANY else text


def _common(parts: list[Written]) -> str:
    kinds = {kind for _, kind in parts}
    return kinds.pop() if len(kinds) == 1 else NUMBER if kinds == {FLOAT, NUMBER} else ANY
