"""Where only whole numbers come: what they are divided by leaves no fractions in Ptolemy."""

from __future__ import annotations

from .entities import Entity, kind
from .parts import Converting
from .syntax import ExpressionError

_VALUES = {
    "DiscreteClock": ("values",), "Clock": ("values",), "PoissonClock": ("values",), "Sequence": ("values",),
    "Const": ("value",), "Ramp": ("init", "step"), "Counter": (), "CurrentMicrostep": (),
}  # fmt: skip
# The parameters that say what these send; whole numbers if they are left out.


def whole_ports(conversion: Converting, composite: Entity, child: Entity) -> frozenset[str]:
    """The ports of a child at which only whole numbers come, as far as its senders beside it tell."""
    found = set()
    for port in child.ports:
        nets = conversion.nets_at(composite, child.name, port)
        senders = [
            (composite.entities.get(end.actor), end.port)
            for net in nets
            for end in net.ends
            if (end.actor, end.port) != (child.name, port)
            and (face := conversion.face(composite.entities.get(end.actor, composite), end.port)) is not None
            and (face.direction == "output") == bool(end.actor)
        ]
        if senders and all(each is not None and _sends_whole(conversion, each) for each, _ in senders):
            found.add(port)
    return frozenset(found)


def _sends_whole(conversion: Converting, entity: Entity) -> bool:
    names = _VALUES.get(kind(entity))
    if names is None:
        return False
    for name in names:
        said = entity.properties.get(name)
        try:
            value = 0 if said is None else conversion.scope_of(entity).value_of(said)
        except ExpressionError:
            return False
        if not all(type(each) is int for each in (value if isinstance(value, list) else [value])):
            return False
    return True
