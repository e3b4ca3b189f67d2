"""Finds ports that receive only whole numbers or only arrays, judging by the actors connected to them.

In Ptolemy, the quotient of whole numbers has no fraction, and arrays are added item by item.
"""

from __future__ import annotations

from collections.abc import Callable

from .entities import Entity, kind
from .parts import Converting
from .syntax import ExpressionError

_VALUES = {
    "DiscreteClock": ("values",), "Clock": ("values",), "PoissonClock": ("values",), "Sequence": ("values",),
    "Const": ("value",), "Ramp": ("init", "step"), "Counter": (), "CurrentMicrostep": (),
}  # fmt: skip
# The parameters that determine what these send; whole numbers if they are left out.
_LISTS = ("DiscreteClock", "Clock", "PoissonClock", "Sequence")  # which send the items of a list
_OF_ARRAYS = frozenset({
    "SequenceToArray", "ElementsToArray",
    "ArrayAppend", "ArraySort", "ArrayExtract", "ArrayUpdate", "ArrayRemoveElement",
})  # fmt: skip


def whole_ports(conversion: Converting, composite: Entity, child: Entity) -> frozenset[str]:
    """The ports of a child that receive only whole numbers."""
    return _ports(conversion, composite, child, lambda entity: _sends(conversion, entity, int))


def array_ports(conversion: Converting, composite: Entity, child: Entity) -> frozenset[str]:
    """The ports of a child that receive only arrays."""

    def sends(entity: Entity) -> bool:
        return kind(entity) in _OF_ARRAYS or _sends(conversion, entity, list)

    return _ports(conversion, composite, child, sends)


def _ports(conversion: Converting, composite: Entity, child: Entity, sends: Callable[[Entity], bool]) -> frozenset[str]:
    found = set()
    for port in child.ports:
        nets = conversion.nets_at(composite, child.name, port)
        senders = [
            composite.entities.get(end.actor)
            for net in nets
            for end in net.ends
            if (end.actor, end.port) != (child.name, port)
            and (face := conversion.face(composite.entities.get(end.actor, composite), end.port)) is not None
            and (face.direction == "output") == bool(end.actor)
        ]
        if senders and all(each is not None and sends(each) for each in senders):
            found.add(port)
    return frozenset(found)


def _sends(conversion: Converting, entity: Entity, wanted: type) -> bool:
    """Whether everything that an actor sends is of a type."""
    names = _VALUES.get(kind(entity))
    if names is None or (wanted is list and not names):
        return False
    for name in names:
        said = entity.properties.get(name)
        try:
            value = 0 if said is None else conversion.scope_of(entity).value_of(said)
        except ExpressionError:
            return False
        values = value if isinstance(value, list) and (wanted is int or kind(entity) in _LISTS) else [value]
        if not all(type(each) is wanted for each in values):
            return False
    return True
