"""Parses the expression language of Ptolemy II into trees."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NoReturn, TypeAlias

MAX_LENGTH = 100_000
MAX_DEPTH = 40
MAX_TERMS = 200


class ExpressionError(Exception):
    """Text that is not an expression, or one that cannot be converted or evaluated; the message states why."""


@dataclass(frozen=True)
class Const:
    """A literal."""

    value: object


@dataclass(frozen=True)
class Name:
    """A constant, a parameter, or a port."""

    name: str


@dataclass(frozen=True)
class Unary:
    """``-x``, ``!x`` or ``~x``."""

    sign: str
    operand: Tree


@dataclass(frozen=True)
class Binary:
    """Two operands with an operator between them."""

    sign: str
    left: Tree
    right: Tree


@dataclass(frozen=True)
class Choice:
    """``test ? one : other``."""

    test: Tree
    one: Tree
    other: Tree


@dataclass(frozen=True)
class Call:
    """A function, or the value of a parameter, followed by arguments: ``max(a, b)``, ``array(0)``."""

    function: Tree
    arguments: tuple[Tree, ...]


@dataclass(frozen=True)
class Method:
    """``x.length()``, or ``record.field``, for which the arguments are None."""

    of: Tree
    name: str
    arguments: tuple[Tree, ...] | None


@dataclass(frozen=True)
class Array:
    """``{1, 2}``."""

    items: tuple[Tree, ...]


@dataclass(frozen=True)
class Record:
    """``{a = 1, b = 2}``."""

    fields: tuple[tuple[str, Tree], ...]


@dataclass(frozen=True)
class Matrix:
    """``[1, 2; 3, 4]``."""

    rows: tuple[tuple[Tree, ...], ...]


@dataclass(frozen=True)
class Steps:
    """``[first : step : last]``, a matrix of one row."""

    first: Tree
    step: Tree
    last: Tree


@dataclass(frozen=True)
class Lambda:
    """``function(x, y: int) x + y``, without the types."""

    names: tuple[str, ...]
    body: Tree


Tree: TypeAlias = Const | Name | Unary | Binary | Choice | Call | Method | Array | Record | Matrix | Steps | Lambda

_TOKEN = re.compile(
    r"""\s*(?:(?P<comment>//[^\n]*|/\*.*?\*/)
    |(?P<number>0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?P<suffix>(?:[lLuUbBfFdDpPiIjJsS]+(?!\w))?)
    |(?P<text>"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*')
    |(?P<name>[A-Za-z_$](?:[\w$@]|::)*)
    |(?P<sign>>>>|\|\||&&|==|!=|<=|>=|<<|>>|\{\||\|\}|[-+*/%^!~<>?:;,.(){}\[\]=|&\#@]))""",
    re.VERBOSE | re.DOTALL,
)
_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f"}
_LEVELS: dict[object, int] = {
    sign: level
    for level, signs in enumerate(("||", "&&", "|", "#", "&", "== !=", "< <= > >=", "<< >> >>>", "+ -", "* / %"))
    for sign in signs.split()
}  # how tightly operators bind
_CONSTANTS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}


def parse(text: str) -> Tree:
    """The tree of an expression; raises ``ExpressionError``."""
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"the expression has more than the maximum of {MAX_LENGTH:,} characters")
    try:
        return _Parser(text).whole()
    except RecursionError:  # the caller may be deep in the stack already
        raise ExpressionError(f"{_short(text)} is nested too deeply") from None


def unescaped(text: str) -> str:
    """The text between quotes, with its escapes resolved."""
    return re.sub(r"\\(u[0-9a-fA-F]{4}|.)", _character, text, flags=re.DOTALL)


def _character(match: re.Match[str]) -> str:
    said = match[1]
    return chr(int(said[1:], 16)) if len(said) > 1 else _ESCAPES.get(said, said)


class _Parser:
    """Goes through the tokens of one expression."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens: list[tuple[str, object]] = []
        self._place = 0
        self._depth = 0
        at, end = 0, len(text.rstrip())
        while at < end:
            match = _TOKEN.match(text, at)
            if match is None:
                raise ExpressionError(f"{_short(text)} cannot be read at {_short(text[at:].strip())}")
            at = match.end()
            self._read(match)
        self._tokens.append(("end", ""))

    def _read(self, match: re.Match[str]) -> None:
        if match["number"] is not None:
            self._tokens.append(("value", self._number(match["number"], match["suffix"].lower())))
        elif match["text"] is not None:
            self._tokens.append(("value", unescaped(match["text"][1:-1])))
        elif match["name"] is not None:
            self._tokens.append(("name", match["name"]))
        elif match["sign"] is not None:
            self._tokens.append(("sign", match["sign"]))

    def _number(self, text: str, suffix: str) -> object:
        if "i" in suffix or "j" in suffix:
            raise ExpressionError(f"{text}{suffix}: complex numbers are not supported")
        try:
            if text[:2].lower() == "0x":
                return int(text, 16)
            if "." in text or "e" in text.lower() or suffix in ("f", "d", "p"):
                return float(text)
            return int(text, 8 if text[0] == "0" else 10)  # as in Java
        except ValueError:
            raise ExpressionError(f"{_short(text)} is not a number") from None

    # -- tokens ---------------------------------------------------------------------------------------------------

    def _peek(self, ahead: int = 0) -> object:
        """The next operator; "" if the next token is not one."""
        kind, value = self._tokens[min(self._place + ahead, len(self._tokens) - 1)]
        return value if kind == "sign" else ""

    def _take(self) -> tuple[str, object]:
        token = self._tokens[self._place]
        self._place = min(self._place + 1, len(self._tokens) - 1)
        return token

    def _skip(self, sign: str) -> bool:
        if self._peek() == sign:
            self._place += 1
            return True
        return False

    def _expect(self, sign: str) -> None:
        if not self._skip(sign):
            self._fail(f"expected {sign!r}")

    def _fail(self, why: str) -> NoReturn:
        raise ExpressionError(f"{_short(self._text)} cannot be read: {why}")

    # -- grammar --------------------------------------------------------------------------------------------------

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
            made = self._lambda()
            self._depth -= 1
            return made
        test = self._level(0)
        if self._skip("?"):
            one = self._choice()
            self._expect(":")
            test = Choice(test, one, self._choice())
        self._depth -= 1
        return test

    def _lambda(self) -> Tree:
        self._take()
        self._expect("(")
        names: list[str] = []
        while not self._skip(")"):
            if names:
                self._expect(",")
            kind, name = self._take()
            if kind != "name":
                self._fail("expected the name of an argument")
            names.append(str(name))
            if self._skip(":"):
                self._choice()
        return Lambda(tuple(names), self._choice())

    def _level(self, least: int) -> Tree:
        left = self._power()
        count = 0
        while (level := _LEVELS.get(sign := self._peek(), -1)) >= least:
            self._place += 1
            left = Binary(str(sign), left, self._level(level + 1))
            count += 1
            if count > MAX_TERMS:
                self._fail("it is too long")
        return left

    def _power(self) -> Tree:
        """A sign binds more tightly than a power: -2 to the power of 2 is 4."""
        found = self._unary()
        count = 0
        while self._skip("^"):
            count += 1
            if count > MAX_DEPTH:
                self._fail("it is too long")
            found = Binary("^", found, self._unary())
        return found

    def _unary(self) -> Tree:
        signs = []
        while (sign := self._peek()) in ("-", "!", "~", "+"):
            self._place += 1
            signs.append(str(sign))
            if len(signs) > MAX_DEPTH:
                self._fail(f"nested deeper than {MAX_DEPTH} levels")
        found = self._element()
        for sign in reversed(signs):
            if sign != "+":
                plain = sign == "-" and isinstance(found, Const) and type(found.value) in (int, float)
                found = Const(-found.value) if plain else Unary(sign, found)  # type: ignore[union-attr, operator]
        return found

    def _element(self) -> Tree:
        found = self._primary()
        count = 0
        while True:
            count += 1
            if count > MAX_DEPTH:
                self._fail("it is too long")
            if self._skip("("):
                found = Call(found, self._arguments(")"))
            elif self._skip("."):
                kind, name = self._take()
                if kind != "name":
                    self._fail("expected a name after '.'")
                found = Method(found, str(name), self._arguments(")") if self._skip("(") else None)
            else:
                return found

    def _arguments(self, end: str) -> tuple[Tree, ...]:
        found: list[Tree] = []
        if self._skip(end):
            return ()
        while True:
            found.append(self._choice())
            if self._skip(end):
                return tuple(found)
            self._expect(",")

    def _primary(self) -> Tree:
        kind, value = self._take()
        if kind == "value":
            return Const(value)
        if kind == "name":
            return Const(_CONSTANTS[str(value)]) if value in _CONSTANTS else Name(str(value))
        if value == "(":
            found = self._choice()
            self._expect(")")
            return found
        if value == "{":
            return self._braces("}")
        if value == "[":
            return self._brackets()
        if value == "{|":
            return self._braces("|}")  # a union, as a record with its one field
        return self._fail("it ends too early" if kind == "end" else f"unexpected {value!r}")

    def _is_field(self) -> bool:
        kind = self._tokens[self._place][0]
        return kind in ("name", "value") and self._peek(1) == "="

    def _braces(self, end: str) -> Tree:
        if not self._is_field():
            return Array(self._arguments(end))
        fields: list[tuple[str, Tree]] = []
        while self._is_field():
            name = str(self._take()[1])
            self._expect("=")
            fields.append((name, self._choice()))
            if self._skip(end):
                return Record(tuple(fields))
            self._expect(",")
        return self._fail("expected a field 'name = value'")

    def _brackets(self) -> Tree:
        if self._is_field():
            return self._braces("]")
        first = self._choice()
        if self._skip(":"):
            step = self._choice()
            self._expect(":")
            last = self._choice()
            self._expect("]")
            return Steps(first, step, last)
        rows, row = [], [first]
        while not self._skip("]"):
            if self._skip(";"):
                rows.append(tuple(row))
                row = [self._choice()]
            else:
                self._expect(",")
                row.append(self._choice())
        return Matrix((*rows, tuple(row)))


def _short(text: str) -> str:
    text = " ".join(text.split())
    return repr(text if len(text) <= 60 else text[:57] + "...")
