"""Reading nodes as what they should be: mappings with known keys, lists, texts, names."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import lru_cache

from epicycle.actors import nearest

from .document import Entry, Mapping, Node, Scalar, Sequence
from .kinds import NAME as NOT_A_NAME
from .kinds import UNKNOWN_KEY
from .problems import POISON, Poison, Position, Problems

SURE = 0.75  # how similar a key must be to the valid one that it is read as
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
NAMES_HAVE = "use letters, digits and _, and no digit first"


@dataclass(frozen=True, slots=True)
class Text:
    """A piece of text and its position."""

    text: str
    position: Position


class NodeReader:
    """Reads nodes; what is malformed is added to ``problems`` and becomes ``POISON``."""

    def __init__(self, problems: Problems) -> None:
        self.problems = problems

    def entries(self, node: Node, what: str, valid: tuple[str, ...]) -> dict[str, Entry] | Poison:
        """The entries of a mapping, unknown keys reported and left out."""
        if not isinstance(node, Mapping):
            if is_empty(node):
                return {}
            return self.problems.add(f"{what} is not a mapping", node.position, f"valid keys: {', '.join(valid)}")
        known = {}
        for key, entry in node.entries.items():
            if key in valid:
                known[key] = entry
            else:
                hint = f"valid keys: {', '.join(valid)}"
                said, at = f"{what} has no key {key!r}", entry.key.position
                self.problems.add(said, at, hint, kind=UNKNOWN_KEY, near=(key, valid))
                # Continue as if it were spelled correctly; otherwise it would seem to be missing as well.  But only if
                # there is no doubt; otherwise its value would be checked as something else.
                if (meant := nearest(key, valid, SURE)) is not None and meant not in node.entries:
                    known.setdefault(meant, entry)
        return known

    def named(self, node: Node, what: str) -> list[tuple[str, Entry]] | Poison:
        """The entries of a mapping from names to things."""
        if is_empty(node):
            return []
        if not isinstance(node, Mapping):
            return self.problems.add(f"{what} is not a mapping from names", node.position)
        found = []
        for name, entry in node.entries.items():
            if NAME.match(name):
                found.append((name, entry))
            else:
                self.problems.add(f"{name!r} is not a name", entry.key.position, NAMES_HAVE, kind=NOT_A_NAME)
        return found

    def items(self, node: Node, what: str) -> tuple[Node, ...] | Poison:
        if isinstance(node, Sequence):
            return node.items
        if is_empty(node):
            return ()
        return self.problems.add(f"{what} is not a list", node.position, "begin each entry with '- '")

    def texts(self, node: Node, what: str) -> tuple[Text, ...] | Poison:
        """A text, or a list of texts; empty entries are left out."""
        nodes = node.items if isinstance(node, Sequence) else (node,)
        found = [self.placed(item, what) for item in nodes if not is_empty(item)]
        sound = tuple(each for each in found if each is not POISON)
        return sound if len(sound) == len(found) else POISON

    def placed(self, node: Node, what: str) -> Text | Poison:
        """A text with its place."""
        said = self.text(node, what)
        return POISON if said is POISON else Text(said, node.position)

    def text(self, node: Node, what: str) -> str | Poison:
        if isinstance(node, Scalar):
            return node.value if isinstance(node.value, str) else node.text
        return self.problems.add(f"{what} is not a text", node.position)

    def name(self, node: Node, what: str) -> str | Poison:
        text = self.text(node, what)
        if text is not POISON and not NAME.match(text):
            return self.problems.add(f"{what} {text!r} is not a name", node.position, NAMES_HAVE, kind=NOT_A_NAME)
        return text


def inside(node: Scalar, text: str, offset: int, part: str) -> Position:
    """The position of a part of a scalar's text from ``offset`` on; all of it if it is folded or has escapes."""
    at = node.position
    start = at.column - 1 + (0 if node.plain else 1)
    if not at.source.startswith(text, start):
        return at
    return Position(at.file, at.line, start + offset + 1, len(part), at.source)


def is_empty(node: Node) -> bool:
    """Whether there is no value."""
    return isinstance(node, Scalar) and node.value is None


def within(at: Position, part: str) -> Position:
    """The position of a part of a text at a place; all of it if the part cannot be found in the file."""
    start = at.source.find(part, at.column - 1)
    return at if start < 0 else replace(at, column=start + 1, length=len(part))


def split(text: str, sign: str) -> list[tuple[int, int]]:
    """Where the parts separated by ``sign`` begin and end; those in brackets do not count."""
    parts, depth, start = [], 0, 0
    for found in _divider(sign).finditer(text):
        if found[0] in ("[", "{", "("):
            depth += 1
        elif found[0] in ("]", "}", ")"):
            depth -= 1
        elif depth == 0:
            parts.append((start, found.start()))
            start = found.start() + len(sign)
    parts.append((start, len(text)))
    return parts


@lru_cache(maxsize=16)
def _divider(sign: str) -> re.Pattern[str]:
    return re.compile(rf"[\[{{(\]}})]|(?={re.escape(sign)})")
