"""Expands MultiInstanceComposite: one composite for each instance, and wires to each of them."""

from __future__ import annotations

from itertools import count

from .actors import face_of
from .document import MomlError
from .entities import ABSTRACT_COMPOSITE, MAX_ENTITIES, Entity, Link, Property, Relation, copied, kind
from .notes import Notes
from .scope import Scope
from .syntax import ExpressionError
from .table import counterpart_of

_PARAMETER = "ptolemy.data.expr.Parameter"


def expand_instances(model: Entity, notes: Notes) -> None:
    """Place all instances side by side, each with its number, which its parameters may use."""
    _Expansion(notes).inside(model, Scope(model))


class _Expansion:
    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        self._orders = count(2_000_000)  # after all links of the file
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
            self._notes.error(f"{first.name}.nInstances = {number!r} is not a whole number")
            return
        self._left -= max(number, 1) * sum(1 for _ in first.everything())
        if self._left < 0:
            raise MomlError(f"{first.name}: its instances have more than the maximum of {MAX_ENTITIES:,} entities")
        _number(first, 0)
        first.java = ABSTRACT_COMPOSITE
        joins = [
            (name, link.relation, self._beyond(composite, first, name, link.relation))
            for name in first.ports
            for link in composite.links.get(f"{first.name}.{name}", ())
            if link.relation is not None
        ]
        for place in range(1, number):
            each = copied(first)
            each.name = f"{first.name}_{place}"
            _number(each, place)
            composite.entities[each.name] = each
            for name, relation, beyond in joins:
                self._join(composite, f"{each.name}.{name}", relation, beyond)

    def _beyond(self, composite: Entity, first: Entity, port: str, relation: str) -> list[str]:
        """The multiports at the other end of a port's relation."""
        sends = first.ports[port].flag("output")
        found = []
        for path, links in composite.links.items():
            if all(link.relation != relation for link in links) or path == f"{first.name}.{port}":
                continue
            actor, _, name = path.rpartition(".")
            other = composite.entities.get(actor) if actor else composite
            face = None if other is None else face_of(counterpart_of(other.java), other, name)
            if face is not None and face.multi and ((face.direction == "input") == bool(actor)) is sends:
                found.append(path)
        return found

    def _join(self, composite: Entity, port: str, relation: str, beyond: list[str]) -> None:
        """Join a port of an instance as that of the first instance, using one more channel of each multiport."""
        if beyond:
            relation = f"r_{port.replace('.', '_')}"
            composite.relations[relation] = Relation(relation)
            for path in beyond:
                self._link(composite, path, relation)
        self._link(composite, port, relation)

    def _link(self, composite: Entity, port: str, relation: str) -> None:
        composite.links.setdefault(port, []).append(Link(port, relation, 0, next(self._orders)))


def _number(entity: Entity, place: int) -> None:
    entity.properties["instance"] = Property("instance", _PARAMETER, str(place), entity.line)
    entity.properties.pop("showClones", None)
