"""The text of a property: ``always (machine.busy == 1 implies eventually within 3 s machine.done)``.

From the loosest to the tightest: ``implies``; ``or``; ``and``; ``until``; ``not``, ``always``, ``eventually``; ``for``.
What is between these words is an expression over ports.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from typing import Final

from epicycle.actors import EpicycleError, FaultError, Quantity, convert, counted_in_si, to_nanoseconds
from epicycle.actors.expression import DOTTED, ExpressionError, PortFormula

from .property import OPERATORS, Condition, Junction, Not, Property, Quantified, Sends, Until

WORDS: Final = (
    "always", "eventually", "until", "implies", "and", "or", "not", "within", "after", "from", "to", "for", "sends",
)  # fmt: skip
MAX_LENGTH: Final = 10_000  # characters
MAX_NESTING: Final = 50
_TOKEN: Final = re.compile(r"\s*('[^']*'|\"[^\"]*\"|[A-Za-z_][\w.\[\]]*|[\d.]+(?:[eE][+-]?\d+)?|[^\s\w])")
_UNIT: Final = r"[A-Za-zµ°]+(?:\^-?\d+)?(?:[/*][A-Za-zµ°]+(?:\^-?\d+)?)*|%(?!\s*[\w(.])"
_QUANTITY: Final = re.compile(
    rf"('[^']*'|\"[^\"]*\")|(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?)(?![eE][+-]?\d)\s*({_UNIT})(?![\w.])"
)
_SIGNS: Final = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip


class PropertyError(FaultError, ValueError):
    """A text that is no property; ``offset`` and ``length`` say which part of it is wrong."""

    def __init__(self, message: str, offset: int, length: int, hint: str = "") -> None:
        super().__init__(message, span=(offset, length), help=[hint] if hint else [])
        self.args = (message, offset, length, hint)  # what pickle rebuilds the error from
        self.offset = offset
        self.length = length
        self.hint = hint


def property_of(source: str) -> Property:
    """What a text says; raises ``PropertyError``."""
    if len(source) > MAX_LENGTH:
        raise PropertyError(f"the property is longer than {MAX_LENGTH:,} characters", 0, len(source))
    found = _Parser(source).whole()
    if bare := _bare(found):
        hint = f"write 'always {bare}' or 'eventually {bare}'"
        message = f"{bare!r} would only be judged at the beginning of the run"
        raise PropertyError(message, max(source.find(bare), 0), len(bare), hint)
    return found


def _bare(tree: Property) -> str:
    """A condition that is in none of 'always', 'eventually' and 'until', if there is one."""
    match tree:
        case Condition():
            return tree.source
        case Sends():
            return f"sends {tree.port}"
        case Not():
            return _bare(tree.of)
        case Junction():
            return _bare(tree.left) or _bare(tree.right)
        case _:
            return ""


class _Parser:
    def __init__(self, source: str) -> None:
        self.source = source
        self.tokens: list[tuple[str, int]] = []
        place = 0
        while match := _TOKEN.match(source, place):
            self.tokens.append((match[1], match.start(1)))
            place = match.end()
        self.place = 0
        self.nesting = 0

    # -- tokens ---------------------------------------------------------------------------------------------------

    @property
    def word(self) -> str:
        """The token that comes next; nothing at the end."""
        return self.tokens[self.place][0] if self.place < len(self.tokens) else ""

    def takes(self, *words: str) -> str:
        """The next token, which is taken, if it is one of these."""
        if (found := self.word) not in words or not found:
            return ""
        self.place += 1
        return found

    def fail(self, message: str, hint: str = "", first: int | None = None, last: int | None = None) -> PropertyError:
        """An error at some tokens, or at the next one."""
        first = self.place if first is None else first
        if first >= len(self.tokens):
            return PropertyError(message, max(len(self.source) - 1, 0), 1, hint)
        token, offset = self.tokens[max(first if last is None else last - 1, first)]
        start = self.tokens[first][1]
        return PropertyError(message, start, offset + len(token) - start, hint)

    # -- the grammar ----------------------------------------------------------------------------------------------

    def whole(self) -> Property:
        found = self.implication()
        if self.word:
            raise self.fail(f"{self.word!r} is not expected here", "and, or, implies and until join two properties")
        return found

    def implication(self) -> Property:
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise self.fail(f"the property is nested deeper than {MAX_NESTING} levels")
        left = self.joined("or", lambda: self.joined("and", self.until))
        if self.takes("implies"):
            left = Junction(True, Not(left), self.implication())
        self.nesting -= 1
        return left

    def joined(self, word: str, part: Callable[[], Property]) -> Property:
        found = part()
        while self.takes(word):
            found = Junction(word == "or", found, part())
        return found

    def until(self) -> Property:
        left = self.unary()
        if not self.takes("until"):
            return left
        start, end = self.window()
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise self.fail(f"the property is nested deeper than {MAX_NESTING} levels")
        found = Until(left, self.until(), start, end)
        self.nesting -= 1
        return found

    def unary(self) -> Property:
        prefixes = []
        while word := self.takes("not", "always", "eventually"):
            prefixes.append((word, (0, None) if word == "not" else self.window()))
            if len(prefixes) + self.nesting > MAX_NESTING:
                raise self.fail(f"the property is nested deeper than {MAX_NESTING} levels")
        found = self.primary()
        if self.takes("for"):
            found = Quantified(False, found, 0, self.time())
        for word, (start, end) in reversed(prefixes):
            found = Not(found) if word == "not" else Quantified(word == "eventually", found, start, end)
        return found

    def window(self) -> tuple[int, int | None]:
        """``within 3 s``, ``after 3 s``, ``from 1 s to 3 s``, or nothing: how much later (ns)."""
        if self.takes("within"):
            return 0, self.time()
        if self.takes("after"):
            return self.time(), None
        if not self.takes("from"):
            return 0, None
        first = self.place
        start = self.time()
        if not self.takes("to"):
            raise self.fail("'from' has no 'to'", "write 'from 1 s to 3 s', or 'after 1 s'")
        end = self.time()
        if end < start:
            raise self.fail("the window ends before it begins", "", first, self.place)
        return start, end

    def time(self) -> int:
        """A time with a unit, or in s; in ns."""
        first = self.place
        number = self.word
        self.place += 1
        unit = self.word if number[:1].isdigit() and self.word.isalpha() and self.word not in WORDS else ""
        self.place += bool(unit)
        message = "a time is missing here"
        try:
            seconds = convert(f"{number} {unit}", "s") if unit else float(number)
            if 0.0 <= seconds < 1e9:
                return to_nanoseconds(seconds)
            message = "this time is not between 0 and 1e9 s"
        except (ValueError, EpicycleError):
            pass
        self.place = min(self.place, len(self.tokens))
        raise self.fail(message, "write one such as '3 s' or '100 ms'", first, self.place)

    def primary(self) -> Property:
        if self.takes("sends"):
            port = self.word
            if not re.fullmatch(r"[A-Za-z_]\w*(\[\d+\])?(\.[A-Za-z_]\w*(\[\d+\])?)+", port):
                raise self.fail("'sends' names no port", "write 'sends actor.port'")
            self.place += 1
            return Sends(port)
        if self.word == "(" and self._is_group():
            self.place += 1
            found = self.implication()
            self.place += 1
            return found
        return self.condition()

    def _closing(self, opening: int) -> int:
        """The place of the parenthesis that closes one."""
        depth = 0
        for place in range(opening, len(self.tokens)):
            depth += self.tokens[place][0] in "([{"
            depth -= self.tokens[place][0] in ")]}"
            if depth == 0:
                return place
        raise self.fail("this parenthesis is not closed", "", opening, opening + 1)

    def _is_group(self) -> bool:
        """Whether a parenthesis is around a property, not around a part of an expression."""
        after = self._closing(self.place) + 1
        return after == len(self.tokens) or self.tokens[after][0] in (*WORDS, ")")

    def condition(self) -> Condition:
        first = self.place
        while (word := self.word) and word not in WORDS and word not in ")]}":
            self.place = self._closing(self.place) + 1 if word in "([{" else self.place + 1
        if self.place == first:
            what = f"before {self.word!r}" if self.word else "at the end"
            raise self.fail(f"a condition is missing {what}", "write one such as 'actor.port >= 2 m'")
        start = self.tokens[first][1]
        token, offset = self.tokens[self.place - 1]
        text = self.source[start : offset + len(token)]
        try:
            return condition_of(text)
        except ExpressionError as error:
            if error.length and not _QUANTITY.search(text):  # which is rewritten, so that places in it move
                raise PropertyError(str(error), start + error.offset, error.length) from None
            raise self.fail(str(error), "", first, self.place) from None


def condition_of(source: str) -> Condition:
    """A condition over ports; numbers with units count in SI.  Raises ``ExpressionError``."""
    plain = _QUANTITY.sub(_in_si, source)
    units = tuple(match[3] for match in _QUANTITY.finditer(source) if _is_quantity(match))
    whole = PortFormula(plain)  # the errors of an expression
    names = DOTTED.sub(lambda match: "_" * len(match[0]), plain)  # of which only the length matters here
    tree = ast.parse(names, mode="eval").body
    if not isinstance(tree, ast.Compare) or any(type(each) not in _SIGNS for each in tree.ops):
        return Condition(source, whole, PortFormula(f"[{plain}]"), (), units=units)
    parts = [tree.left, *tree.comparators]
    sides = [f"({plain[part.col_offset : part.end_col_offset]})" for part in parts]
    signs = tuple(_SIGNS[type(each)] for each in tree.ops)
    assert set(signs) <= set(OPERATORS)
    is_single = len(signs) == 1 and signs[0] in ("<", "<=", ">", ">=")
    difference = PortFormula(" - ".join(sides)) if is_single else None
    texts = (each.strip().removeprefix("-") for each in re.split("[<>=!]=?", source))
    matches = (_QUANTITY.fullmatch(each.strip()) for each in texts)
    compared = tuple(match[3] for match in matches if match is not None and _is_quantity(match))
    return Condition(source, whole, PortFormula(f"[{', '.join(sides)}]"), signs, difference, units, compared)


def _is_quantity(match: re.Match[str]) -> bool:
    text, _, unit = match.groups()
    return text is None and unit not in ("if", "else", "in", "is", "and", "or", "not", "for")


def _in_si(match: re.Match[str]) -> str:
    if not _is_quantity(match):
        return match[0]
    _, number, unit = match.groups()
    try:
        return repr(counted_in_si(Quantity(float(number), unit)))
    except EpicycleError as error:
        raise ExpressionError(str(error), match.start(), len(match[0])) from None
