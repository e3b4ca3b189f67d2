"""Where one is in a text, half-written or not: the keys that lead there, and what is written beside it.

A mark is put at the place, and what is open there is closed, until the text can be parsed; the place is where the mark
is found among the nodes.

The lines of the Language Server Protocol end only at CR and LF, and its columns are code units.  All lines and columns
count from 0 here, and ours do not count a byte order mark; an offset counts all characters before a place.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import yaml

from ..model.text.document import LINE_BREAK, LOADER, Mapping, Node, Scalar, Sequence, parse
from ..model.text.problems import Problems

Keys = tuple[str | int, ...]
MARK = "epicycle_mark_here"
_THEIRS = re.compile("\r\n|\n|\r")
_BYTES = {"utf-8": 1, "utf-16": 2, "utf-32": 4}
BOM = "\ufeff"
_CLOSING = {"{": "}", "[": "]"}
_QUOTED = re.compile(r"'(?:[^']|'')*'|\"(?:[^\"\\]|\\.)*\"|(?<![^\s])#.*")


class Place(NamedTuple):
    """A place in a text: a key or value, and the nodes around it, outermost first.

    ``keys`` lead to the value, or to the mapping of the key (``is_key``).
    """

    keys: Keys
    is_key: bool
    node: Scalar
    around: tuple[Node, ...]
    text: str = ""  # as it was parsed, if there is a mark

    @property
    def before(self) -> str:
        """What the key or value has before the mark."""
        return self.node.text.partition(MARK)[0]

    @property
    def whole(self) -> str:
        return self.node.text.replace(MARK, "", 1)


def place_at(text: str, offset: int) -> Place | None:
    """The place before a character; None if the text is too broken to say."""
    for tried in _attempts(text, offset):
        root = parse(tried, "", Problems()) if _is_yaml(tried) else None
        if root is not None and (found := _marked(root, tried)) is not None:
            return found
    return None


def _is_yaml(text: str) -> bool:
    """Whether a text can be parsed; it takes longer to say why not."""
    try:
        for _ in yaml.parse(text, Loader=LOADER):
            pass
    except (yaml.YAMLError, ValueError):
        return False
    return True


def _attempts(text: str, offset: int) -> Iterator[str]:
    """The text with the mark, as it is and completed in several ways."""
    start, rest = LINE_BREAK.split(text[:offset])[-1], LINE_BREAK.split(text[offset:], maxsplit=1)[0]
    above, below = text[: offset - len(start)], text[offset + len(rest) :]
    # The word under the cursor belongs to the place.
    word, closing = re.findall(r"\A\w*", rest)[0], _closing(start)
    indent = start[: len(start) - len(start.lstrip())]
    outside = "\n".join(each for each in LINE_BREAK.split(below) if _is_outside(each, indent))
    for here in (
        f"{start}{MARK}{rest}",
        f"{start}{MARK}: {rest}",
        f"{start} {MARK}{rest}",
        f"{start}{MARK}{word}{closing}",
        f"{start}{MARK}{word}: {closing}",
        f"{start} {MARK}{closing}",
        f"{start}{MARK}",
        f"{start}{MARK}: ",
    ):
        yield f"{above}{here}{below}"
        yield f"{above}{here}{outside}"
        yield f"{above}{here}"
        yield f"{above}{here}{_closing(above + start)}"


def _is_outside(line: str, indent: str) -> bool:
    """Whether a line belongs to nothing that is written at this indentation or deeper."""
    return not line.strip() or len(line) - len(line.lstrip()) < len(indent)


def _closing(text: str) -> str:
    """The brackets and the quote that a text leaves open, closed."""
    left = _QUOTED.sub("", text)
    quote = next((each for each in left if each in "'\""), "") if re.search(r"(?:^|[\s,\[{:])['\"]", left) else ""
    if quote:
        left = left[: left.index(quote)]
    open_ones: list[str] = []
    for each in left:
        if each in _CLOSING:
            open_ones.append(_CLOSING[each])
        elif open_ones and each == open_ones[-1]:
            open_ones.pop()
    return quote + "".join(reversed(open_ones))


def walk(node: Node, keys: Keys = (), around: tuple[Node, ...] = ()) -> Iterator[Place]:
    """All that stands in a node."""
    if isinstance(node, Scalar):
        yield Place(keys, False, node, around)
    elif isinstance(node, Sequence):
        for number, item in enumerate(node.items):
            yield from walk(item, (*keys, number), (*around, node))
    else:
        for key, entry in node.entries.items():
            yield Place(keys, True, entry.key, (*around, node))
            yield from walk(entry.value, (*keys, key), (*around, node))


def scalars(node: Node | None) -> list[Scalar]:
    """The values in a node."""
    return [each.node for each in walk(node) if not each.is_key] if node is not None else []


def value_of(node: Node | None, key: str) -> Node | None:
    """What a mapping has under a key."""
    return node.entries[key].value if isinstance(node, Mapping) and key in node.entries else None


def text_of(node: Node | None, key: str) -> str:
    """The text that a mapping has under a key; empty if there is none."""
    found = value_of(node, key)
    return found.text if isinstance(found, Scalar) else ""


def _marked(root: Node, text: str) -> Place | None:
    place = next((each for each in walk(root) if MARK in each.node.text), None)
    if place is not None and not place.around:  # all of the text: it may become the first key
        place = place._replace(is_key=True, around=(Mapping({}, root.position),))
    return place and place._replace(text=text)


# -- lines and columns -------------------------------------------------------------------------------------------------


class Positions:
    """The places of one text; ``encoding`` is that of the client's code units."""

    def __init__(self, text: str, encoding: str = "utf-16") -> None:
        self.text = text
        self._codec, self._size = (f"{encoding}-le" if encoding != "utf-8" else encoding), _BYTES[encoding]
        self._ours, self._theirs = (
            [0, *(found.end() for found in breaks.finditer(text))] for breaks in (LINE_BREAK, _THEIRS)
        )

    def offset(self, line: int, column: int) -> int:
        """The character at our line and column; what is behind the text is at its end."""
        if line >= len(self._ours):
            return len(self.text)
        return min(self._ours[line] + column + (line == 0 and self.text.startswith(BOM)), len(self.text))

    def place(self, offset: int) -> tuple[int, int]:
        """Our line and column of a character."""
        here = bisect_right(self._ours, offset) - 1
        return here, offset - self._ours[here] - (here == 0 and self.text.startswith(BOM))

    def to_client(self, offset: int) -> tuple[int, int]:
        """Line and column of the protocol for a character."""
        there = bisect_right(self._theirs, offset) - 1
        code = self.text[self._theirs[there] : offset].encode(self._codec, "surrogatepass")
        return there, len(code) // self._size

    def from_client(self, line: int, column: int) -> int:
        """The character at a line and column of the protocol."""
        if line >= len(self._theirs):
            return len(self.text)
        start, end = (*self._theirs, len(self.text))[line : line + 2]
        code = self.text[start:end].encode(self._codec, "surrogatepass")[: max(column, 0) * self._size]
        return start + len(code.decode(self._codec, "ignore" if self._size < 4 else "surrogatepass"))


@lru_cache(maxsize=8)
def positions(text: str, encoding: str = "utf-16") -> Positions:
    """The places of a text; those of the latest texts are kept."""
    return Positions(text, encoding)
