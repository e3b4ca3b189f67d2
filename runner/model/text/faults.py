"""From what is wrong with a value to a problem at its place in a file or a program."""

from __future__ import annotations

from typing import Any

from epicycle.actors import EpicycleError, Fault, FaultError

from .document import Mapping, Node, Scalar, Sequence
from .kinds import CODE, OF_FAULTS, VALUE, Kind
from .patterns import in_general
from .problems import POISON, Fix, Poison, Position, Problems
from .program import describe, raised_at
from .reading import inside


def place_in(node: Node, fault: Fault) -> Position:
    """Where in a value a fault is, as far as it is written out."""
    for number, key in enumerate(fault.keys, start=1):
        if isinstance(node, Sequence) and isinstance(key, int):
            node = node.items[key]
        elif isinstance(node, Mapping) and key in node.entries:
            entry = node.entries[str(key)]
            if fault.of_key and number == len(fault.keys):
                return entry.key.position
            node = entry.value
        else:
            items = node.items if isinstance(node, Sequence) else ()
            named = next((item for item in items if isinstance(item, Scalar) and item.value == key), None)
            if named is None:
                return node.position
            node = named
    offset, length = fault.span or (0, 0)
    if not length or not isinstance(node, Scalar) or "${" in node.text:  # of which the value is something else
        return node.position
    return inside(node, node.text, offset, node.text[offset : offset + length] or " ")


def blame(
    problems: Problems,
    label: str,
    error: Exception,
    where: Node | Position,
    scope: str = "",
    *more: str,
    in_all: bool = False,
    kind: Kind = VALUE,
) -> Poison:
    """Add what is wrong with a node, or with something at a position, or how the code of a user's class failed.

    ``label`` is its name in messages, ``more`` further help; ``in_all``: what is wrong for all of an array is reported
    once.  ``kind`` is for faults that name none.
    """
    at = where if isinstance(where, Position) else where.position
    if isinstance(where, Scalar) and where.giver:
        more = (f"given by {where.giver}", *more)

    def tell(message: str, place: Position, *hints: str, number: int = 0, **of_user: Any) -> None:
        about = (in_general(label), str(number)) if in_all else ()
        of_user.setdefault("kind", kind)
        problems.add(f"{label}: {message}", place, *hints, *more, scope=scope, about=about, **of_user)

    if isinstance(error, FaultError):
        for number, fault in enumerate(error.faults):
            place = at if isinstance(where, Position) else place_in(where, fault)
            fix = Fix(place, fault.meant) if fault.meant and place.file else None
            of_fault = OF_FAULTS.get(fault.kind, kind)
            tell(fault.message, place, *fault.help, number=number, kind=of_fault, fix=fix)
    elif isinstance(error, EpicycleError):
        tell(str(error), at)
    else:
        told = str(error) if isinstance(error, ValueError) else ""
        of_error = kind if told else CODE
        tell(told or describe(error), at, raised=raised_at(error), cause=error, kind=of_error)
    return POISON
