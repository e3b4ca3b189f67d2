"""A text that is read again after a change: what its other lines hold is taken from before.

The change is in some entries of a mapping, or items of a list, that stand in lines of their own.  These lines alone are
parsed; what they hold is what they would hold among the others, because an entry ends where the next one begins.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from ..model.text.document import LINE_BREAK, MAX_NODES, Entry, Mapping, Node, Scalar, Sequence, parse
from ..model.text.problems import Position, Problems

# Anchors, and what ends a document or begins an odd key, mean something beyond their lines.
_ODD = re.compile(r"&|^(?:---|\.\.\.|%|[ \t-]*\?(?:\s|\Z))", re.MULTILINE)
_DASH = re.compile(r" *-[ \t]+\Z")


@dataclass(frozen=True)
class _Change:
    """A stretch of lines, of which the first one is ``first``; it ended before ``old`` and ends before ``new``."""

    text: str
    name: str
    starts: list[int]  # where the lines begin
    first: int
    old: int
    new: int

    def read(self, start: int, end: int, depth: int) -> Node | None:
        """What lines hold that ended before ``end``, all that is different among them; None if something is wrong."""
        lines = self.text[self.starts[start] : self.starts[end + self.new - self.old]]
        problems = Problems()
        node = parse("\n" * start + lines, self.name, problems, depth=depth)
        return None if problems.found else node


def alike(one: str | list[str], other: str | list[str]) -> tuple[int, int]:
    """How many items are the same at the beginning and, of the rest, at the end."""
    most = min(len(one), len(other))
    first = next((at for at in range(most) if one[at] != other[at]), most)
    return first, next((at for at in range(most - first) if one[-1 - at] != other[-1 - at]), most - first)


def read_again(text: str, name: str, before: str, root: Node) -> Node | None:
    """What a text holds, by what it held before a change; None if it must be read as a whole."""
    if text == before:
        return root
    # Without anchors, a text has fewer nodes than characters.
    if len(text) >= MAX_NODES or _ODD.search(text) or _ODD.search(before):
        return None
    old, new = LINE_BREAK.split(before), LINE_BREAK.split(text)
    first, behind = alike(old, new)
    starts = [0, *(found.end() for found in LINE_BREAK.finditer(text)), len(text)]
    change = _Change(text, name, starts, first, len(old) - behind, len(new) - behind)
    return _changed(root, change, len(old), 0)


def _changed(node: Node, change: _Change, end: int, depth: int) -> Node | None:
    """A mapping or list, whose lines ended before ``end``, after a change within it."""
    if isinstance(node, Scalar) or _has_brackets(node):
        return None
    parts, is_mapping = _parts(node), isinstance(node, Mapping)
    places = [(each.key if is_mapping else each).position for each in parts]
    lines = [place.line - 1 for place in places]
    if not lines or change.first < lines[0]:
        return None
    # Before the first line of an entry, there may be another line of the text that the one before ends with.
    one = max(0, sum(line < change.first for line in lines) - 1)
    other = next((number for number, line in enumerate(lines) if number > one and line >= change.old), len(lines))
    stop = lines[other] if other < len(lines) else end
    inner = parts[one].value if is_mapping else parts[one]
    if other == one + 1 and (inner := _changed(inner, change, stop, depth + 1)) is not None:
        made, at = [Entry(parts[one].key, inner) if is_mapping else inner], node.position
    else:
        edges = [places[one], *places[other : other + 1]]
        if not all(_begins_line(each, is_mapping) for each in edges):
            return None
        read = change.read(lines[one], stop, depth)
        if type(read) is not type(node) or read.position.column != node.position.column or _has_brackets(read):
            return None
        made, at = _parts(read), read.position
    whole = [*parts[:one], *made, *(_moved(each, change.new - change.old) for each in parts[other:])]
    at = node.position if one else at
    if not is_mapping:
        return Sequence(tuple(whole), at)
    entries = {each.key.text: each for each in whole}
    return Mapping(entries, at) if len(entries) == len(whole) else None


def _parts(node: Mapping | Sequence) -> list[Any]:
    """The entries of a mapping, or the items of a list."""
    return list(node.entries.values() if isinstance(node, Mapping) else node.items)


def _has_brackets(node: Node) -> bool:
    return node.position.source[node.position.column - 1 :][:1] in ("{", "[")


def _begins_line(at: Position, is_key: bool) -> bool:
    """Whether nothing but a dash stands before an entry or item on its line."""
    before = at.source[: at.column - 1]
    return not before.strip(" ") if is_key else _DASH.match(before) is not None


def _moved(node: Any, by: int) -> Any:
    """A node, or an entry, that stands so many lines below."""
    if not by:
        return node
    if isinstance(node, Entry):
        return Entry(_moved(node.key, by), _moved(node.value, by))
    at = node.position
    at = Position(at.file, at.line + by, at.column, at.length, at.source)
    if isinstance(node, Scalar):
        return Scalar(node.value, node.text, node.plain, at)
    if isinstance(node, Sequence):
        return Sequence(tuple([_moved(each, by) for each in node.items]), at)
    return Mapping({key: _moved(each, by) for key, each in node.entries.items()}, at)
