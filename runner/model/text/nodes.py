"""What a YAML text consists of: values with their places."""

from dataclasses import dataclass
from typing import TypeAlias

from .problems import Position
from .scalars import Value


@dataclass(frozen=True, slots=True)
class Scalar:
    """A single value; `text` is as written, without quotes, and `plain` means that it had none."""

    value: Value
    text: str
    plain: bool
    position: Position
    giver: str = ""  # a parameter around a part, whose value it is; its place is where the part says so


@dataclass(frozen=True, slots=True)
class Sequence:
    items: tuple["Node", ...]
    position: Position


@dataclass(frozen=True, slots=True)
class Entry:
    """A key and its value; the key is always text."""

    key: Scalar
    value: "Node"


@dataclass(frozen=True, slots=True)
class Mapping:
    """Entries by key, in the order of the file."""

    entries: dict[str, Entry]
    position: Position


Node: TypeAlias = Scalar | Sequence | Mapping


def plain(node: Node) -> object:
    """Return the node as ordinary dicts, lists and scalars."""
    if isinstance(node, Mapping):
        return {key: plain(entry.value) for key, entry in node.entries.items()}
    if isinstance(node, Sequence):
        return [plain(item) for item in node.items]
    return node.value
