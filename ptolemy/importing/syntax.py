"""Parses the expression language of Ptolemy II into trees."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, NoReturn

from .limits import spend

MAX_LENGTH, MAX_DEPTH, LARGEST = 100_000, 40, 2**63


class ExpressionError(Exception):
    """Text that is not an expression, or one that has no value or counterpart; the message states why."""


@dataclass(frozen=True)
class Tree:
    """One part of an expression: its form, its operands, and what else it states.

    The form is an operator (``?`` has three operands, ``-`` one or two) or one of ``value``, ``name``, ``call`` (the
    first operand is called), ``method`` and ``field`` (of the first operand), ``array``, ``matrix`` (an array for each
    row), ``steps`` (``[first : step : last]``) and ``record`` (``said`` names the fields).
    """

    form: str
    parts: tuple[Tree, ...] = ()
    said: Any = None


_TOKEN = re.compile(
    r"""\s*(?:(?P<comment>//[^\n]*|/\*.*?\*/)
    |(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?:[lLuUbBfFdDpPsS]+(?!\w))?)
    |(?P<text>"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*')
    |(?P<name>[A-Za-z_$](?:[\w$@]|::)*)
    |(?P<sign>>>>|\|\||&&|==|!=|<=|>=|<<|>>|\{\||\|\}|[-+*/%^!~<>?:;,.(){}\[\]=|&\#@]))""",
    re.VERBOSE | re.DOTALL,
)
_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f"}
_LEVELS = ("||", "&&", "|", "#", "&", "== !=", "< <= > >=", "<< >> >>>", "+ -", "* / %")
_LEVEL_OF = {sign: level for level, signs in enumerate(_LEVELS) for sign in signs.split()}  # how tightly they bind
_TRUTH = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}


def parse(text: str) -> Tree:
    """The tree of an expression; raises ``ExpressionError``."""
    spend(1 + len(text) // 10)
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"the expression has more than the maximum of {MAX_LENGTH:,} characters")
    return _Parser(text).whole()


def names_of(tree: Tree) -> set[str]:
    """All names in an expression, including those of functions."""
    found, waiting = set(), [tree]
    while waiting:
        each = waiting.pop()
        waiting += each.parts
        if each.form == "name":
            found.add(each.said)
    return found


def conjuncts(tree: Tree) -> list[Tree]:
    """The conditions that an expression joins by "and"."""
    return [each for part in tree.parts for each in conjuncts(part)] if tree.form in ("&&", "&") else [tree]


class _Parser:
    """Goes through the tokens of one expression."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens: list[tuple[str, Any]] = []
        self._place = self._depth = 0
        at, end = 0, len(text.rstrip())
        while at < end:
            match = _TOKEN.match(text, at)
            if match is None:
                raise ExpressionError(f"{_short(text)} cannot be read at {_short(text[at:].strip())}")
            at, kind = match.end(), match.lastgroup or ""
            if kind != "comment":
                self._tokens.append(_token(kind, match[kind]))
        self._tokens.append(("end", ""))

    def _peek(self, ahead: int = 0) -> str:
        """The next operator; "" if the next token is not one."""
        kind, value = self._tokens[min(self._place + ahead, len(self._tokens) - 1)]
        return value if kind == "sign" else ""

    def _take(self) -> tuple[str, Any]:
        token = self._tokens[self._place]
        self._place = min(self._place + 1, len(self._tokens) - 1)
        return token

    def _skip(self, *signs: str) -> str:
        """The next operator, if it is one of these; otherwise ""."""
        sign = self._peek()
        self._place += sign in signs
        return sign if sign in signs else ""

    def _expect(self, sign: str) -> None:
        if not self._skip(sign):
            self._fail(f"expected {sign!r}")

    def _fail(self, why: str) -> NoReturn:
        raise ExpressionError(f"{_short(self._text)} cannot be read: {why}")

    def whole(self) -> Tree:
        """The whole expression; nothing may follow it."""
        found = self._choice()
        while self._skip(";"):
            pass
        if self._tokens[self._place][0] != "end":
            self._fail(f"unexpected {self._tokens[self._place][1]!r}")
        return found

    def _choice(self) -> Tree:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            self._fail(f"nested deeper than {MAX_DEPTH} levels")
        if self._tokens[self._place] == ("name", "function") and self._peek(1) == "(":
            self._fail("functions that a model defines are not supported")
        found = self._level(0)
        if self._skip("?"):
            one = self._choice()
            self._expect(":")
            found = Tree("?", (found, one, self._choice()))
        self._depth -= 1
        return found

    def _level(self, least: int) -> Tree:
        left = self._unary()
        while self._skip("^"):  # a sign binds more tightly than a power: -2 to the power of 2 is 4
            left = Tree("^", (left, self._unary()))
        while (level := _LEVEL_OF.get(sign := self._peek(), -1)) >= least:
            self._place += 1
            left = Tree(sign, (left, self._level(level + 1)))
        return left

    def _unary(self) -> Tree:
        signs = []
        while sign := self._skip("-", "!", "~", "+"):
            signs.append(sign)
        found = self._element()
        for sign in reversed(signs):
            if sign == "-" and found.form == "value" and type(found.said) in (int, float):
                found = Tree("value", (), -found.said)
            elif sign != "+":
                found = Tree(sign, (found,))
        return found

    def _element(self) -> Tree:
        found = self._primary()
        while sign := self._skip("(", "."):
            if sign == "(":
                found = Tree("call", (found, *self._items(")")))
                continue
            kind, name = self._take()
            if kind != "name":
                self._fail("expected a name after '.'")
            is_method = self._skip("(")
            found = Tree("method" if is_method else "field", (found, *(self._items(")") if is_method else ())), name)
        return found

    def _items(self, end: str) -> tuple[Tree, ...]:
        if self._skip(end):
            return ()
        found = [self._choice()]
        while not self._skip(end):
            self._expect(",")
            found.append(self._choice())
        return tuple(found)

    def _primary(self) -> Tree:
        kind, value = self._take()
        if kind in ("value", "name"):
            return Tree(kind, (), value)
        if value == "(":
            found = self._choice()
            self._expect(")")
            return found
        ends = {"{": "}", "[": "]", "{|": "|}"}  # a union is a record with its one field
        if value not in ends:
            self._fail("it ends too early" if kind == "end" else f"unexpected {value!r}")
        if self._is_field():
            return self._record(ends[value])
        return self._matrix() if value == "[" else Tree("array", self._items(ends[value]))

    def _is_field(self) -> bool:
        return self._tokens[self._place][0] in ("name", "value") and self._peek(1) == "="

    def _record(self, end: str) -> Tree:
        fields: dict[str, Tree] = {}
        while self._is_field():
            name = str(self._take()[1])
            self._expect("=")
            fields[name] = self._choice()
            if self._skip(end):
                return Tree("record", tuple(fields.values()), tuple(fields))
            self._expect(",")
        return self._fail("expected a field 'name = value'")

    def _matrix(self) -> Tree:
        rows = [[self._choice()]]
        if self._skip(":"):
            rows[0].append(self._choice())
            self._expect(":")
            rows[0].append(self._choice())
            self._expect("]")
            return Tree("steps", tuple(rows[0]))
        while not self._skip("]"):
            if self._skip(";"):
                rows.append([])
            else:
                self._expect(",")
            rows[-1].append(self._choice())
        return Tree("matrix", tuple(Tree("array", tuple(row)) for row in rows))


def _token(kind: str, text: str) -> tuple[str, Any]:
    if kind == "number":
        return "value", _number(text)
    if kind == "text":
        return "value", re.sub(r"\\(u[0-9a-fA-F]{4}|.)", _character, text[1:-1], flags=re.DOTALL)
    return ("value", _TRUTH[text]) if kind == "name" and text in _TRUTH else (kind, text)


def _number(said: str) -> float:
    text = said.rstrip("lLuUbBfFdDpPsS")
    if "." in text or "e" in text.lower() or said[-1] in "fFdDpP":
        return float(text)
    try:
        found = int(text, 8 if text[0] == "0" else 10)  # as in Java
    except ValueError:
        raise ExpressionError(f"{_short(text)} is not a number") from None
    if found > LARGEST:
        raise ExpressionError("a whole number must be at least -2^63 and less than 2^63")
    return found


def _character(match: re.Match[str]) -> str:
    said = match[1]
    return chr(int(said[1:], 16)) if len(said) > 1 else _ESCAPES.get(said, said)


def _short(text: str) -> str:
    text = " ".join(text.split())
    return repr(text if len(text) <= 60 else text[:57] + "...")
