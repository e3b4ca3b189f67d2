"""MultiInstanceComposite: as many composites as it says, and wires to each of them."""

from __future__ import annotations

from copy import deepcopy
from itertools import count

from .actors import face_of
from .document import MomlError
from .entities import ABSTRACT_COMPOSITE, MAX_ENTITIES, Entity, Link, Property, Relation, kind
from .notes import Notes
from .scope import Scope
from .syntax import ExpressionError
from .table import counterpart_of

_PARAMETER = "ptolemy.data.expr.Parameter"


def expand_instances(model: Entity, notes: Notes) -> None:
    """Put all instances beside each other, each with the number of its own that its parameters may name."""
    _Expansion(notes).inside(model, Scope(model))


class _Expansion:
    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        self._orders = count(2_000_000)  # behind all links of the file
        self._left = MAX_ENTITIES

    def inside(self, composite: Entity, scope: Scope) -> None:
        for child in list(composite.entities.values()):
            if kind(child) == "MultiInstanceComposite":
                self._expand(composite, child, scope)
        for child in composite.entities.values():
            self.inside(child, scope.inside(child))

    def _expand(self, composite: Entity, first: Entity, scope: Scope) -> None:
        try:
            said = first.properties.get("nInstances")
            number = 1 if said is None else scope.inside(first).value_of(said)
        except ExpressionError as error:
            self._notes.error(f"{first.name}.nInstances: {error}")
            return
        if type(number) is not int:
            self._notes.error(f"{first.name}.nInstances = {number!r}: it is no whole number")
            return
        self._left -= max(number, 1) * sum(1 for _ in first.everything())
        if self._left < 0:
            raise MomlError(f"{first.name}: its instances come to more than {MAX_ENTITIES:,} entities")
        _number(first, 0)
        first.java = ABSTRACT_COMPOSITE
        ports = {name: list(composite.links.get(f"{first.name}.{name}", ())) for name in first.ports}
        for place in range(1, number):
            each = deepcopy(first)
            each.name = f"{first.name}_{place}"
            _number(each, place)
            composite.entities[each.name] = each
            for name, links in ports.items():
                for link in links:
                    if link.relation is not None:
                        self._join(composite, first, each, name, link.relation)

    def _join(self, composite: Entity, first: Entity, each: Entity, port: str, relation: str) -> None:
        """Join a port of an instance with what that of the first is joined with, a multiport by one more channel."""
        sends = first.ports[port].flag("output")
        joined = relation
        others = [path for path, links in composite.links.items() if any(link.relation == relation for link in links)]
        for path in others:
            actor, _, name = path.rpartition(".")
            other = composite.entities.get(actor) if actor else composite
            face = None if other is None else face_of(counterpart_of(other.java), other, name)
            takes = face is not None and (face.direction == "input") == bool(actor)
            if face is None or takes is not sends or (actor, name) == (first.name, port):
                continue
            if face.multi:
                joined = f"r_{each.name}_{port}"
                composite.relations.setdefault(joined, Relation(joined))
                self._link(composite, path, joined)
        self._link(composite, f"{each.name}.{port}", joined)

    def _link(self, composite: Entity, port: str, relation: str) -> None:
        composite.links.setdefault(port, []).append(Link(port, relation, 0, next(self._orders)))


def _number(entity: Entity, place: int) -> None:
    entity.properties["instance"] = Property("instance", _PARAMETER, str(place), entity.line)
    entity.properties.pop("showClones", None)
