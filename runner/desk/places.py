"""Where one is in a text, half-written or not: the keys that lead there, and what is written beside it.

A mark is put at the place, and what is open there is closed, until the text can be parsed; the place is where the mark
is found among the nodes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import yaml

from ..model.text.document import LINE_BREAK, Mapping, Node, Scalar, Sequence, parse
from ..model.text.problems import Problems

Keys = tuple[str | int, ...]
MARK = "epicycle_mark_here"
_LOADER: type[yaml.CSafeLoader] | type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_CLOSING = {"{": "}", "[": "]"}
_QUOTED = re.compile(r"'(?:[^']|'')*'|\"(?:[^\"\\]|\\.)*\"|(?<![^\s])#.*")


class Stands(NamedTuple):
    """A key or value in a text, and the nodes around it, outermost first.

    ``keys`` lead to the value, or to the mapping of the key.
    """

    keys: Keys
    is_key: bool
    node: Scalar
    around: tuple[Node, ...]


@dataclass(frozen=True)
class Place:
    """A place in a text.

    ``keys`` lead to the value, or to the mapping of the key that is written there (``is_key``); ``before`` is what the
    value or key has before the place, ``whole`` all of it.  ``around`` are the nodes along the keys, outermost first.
    """

    keys: Keys
    is_key: bool
    before: str
    whole: str
    around: tuple[Node, ...]
    text: str  # as it was parsed, with the mark


def lines_of(text: str) -> list[str]:
    """The lines of a text, as positions count them."""
    return LINE_BREAK.split(text)


def place_at(text: str, line: int, column: int) -> Place | None:
    """The place at a line and column, which count from 0; None if the text is too broken to say."""
    lines = lines_of(text)
    if line >= len(lines):
        return None
    here = lines[line]
    column = min(column, len(here))
    # The word under the cursor belongs to the place.
    end = column + len(re.match(r"\w*", here[column:])[0])  # type: ignore[index]
    for tried in _attempts(lines, line, column, end):
        root = parse(tried, "", Problems()) if _is_yaml(tried) else None
        if root is not None and (found := _marked(root, tried)) is not None:
            return found
    return None


def _is_yaml(text: str) -> bool:
    """Whether a text can be parsed; it takes longer to say why not."""
    try:
        for _ in yaml.parse(text, Loader=_LOADER):
            pass
    except (yaml.YAMLError, ValueError):
        return False
    return True


def _attempts(lines: list[str], line: int, column: int, end: int) -> Iterator[str]:
    """The text with the mark, as it is and completed in several ways."""
    start, rest, above, below = lines[line][:column], lines[line][column:], lines[:line], lines[line + 1 :]
    word, closing = lines[line][column:end], _closing(start)
    indent = start[: len(start) - len(start.lstrip())]
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
        yield "\n".join([*above, here, *below])
        yield "\n".join([*above, here, *(each for each in below if _is_outside(each, indent))])
        yield "\n".join([*above, here])
        yield "\n".join([*above, here]) + _closing("\n".join([*above, start]))


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


def walk(node: Node, keys: Keys = (), around: tuple[Node, ...] = ()) -> Iterator[Stands]:
    """All that stands in a node."""
    if isinstance(node, Scalar):
        yield Stands(keys, False, node, around)
    elif isinstance(node, Sequence):
        for number, item in enumerate(node.items):
            yield from walk(item, (*keys, number), (*around, node))
    else:
        for key, entry in node.entries.items():
            yield Stands(keys, True, entry.key, (*around, node))
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
    for keys, is_key, node, around in walk(root):
        if MARK in node.text:
            before, _, after = node.text.partition(MARK)
            if not around:  # all of the text: it may become the first key
                is_key, around = True, (Mapping({}, node.position),)
            return Place(keys, is_key, before, before + after, around, text)
    return None
