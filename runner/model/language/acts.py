"""Single acts of aspects that a file lets happen."""

from __future__ import annotations

from dataclasses import dataclass

from ..text.document import Node
from ..text.problems import POISON, Position
from ..text.reading import NodeReader, Text
from .fields import AT, Reader, Record, keyed, number, ref


@dataclass(frozen=True)
class ActText:
    """A single act of an aspect: its place, and the number of the token there, counted from 1."""

    position: Position
    aspect: Text = keyed(AT, "The name of the aspect.", missing=("an act names no aspect", "add 'aspect: NAME'"))
    at: Text = keyed(
        AT, "Its place: a port, a connection or an actor.", missing=("an act names no place", "add 'at: PATH'")
    )
    token: int = keyed(
        number(int, 1),
        "The number of the token, or firing, that passes it there: 1 is the first.",
        missing=("an act names no token", "add 'token: 1' for the first"),
    )


ACT = Record.of(ActText, "A single act of an aspect.", type="object")


def acts(reader: NodeReader, node: Node, what: str) -> tuple[ActText, ...]:
    """A list of acts; those that are wrong are left out."""
    read = [(ACT.read(reader, each, f"an act of {what!r}"), each) for each in reader.items(node, what) or ()]
    return tuple(ActText(**said, position=each.position) for said, each in read if said and POISON not in said.values())


ACTS = Reader({"type": ["array", "null"], "items": ref("act")}, acts)
