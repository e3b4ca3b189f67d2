"""Publishers and subscribers: what is sent by the name of a channel, as wires."""

from __future__ import annotations

from collections.abc import Iterator

from .entities import Entity, Relation
from .notes import Notes


def join_channels(model: Entity, notes: Notes) -> None:
    """Join the relations of publishers and subscribers of one composite and channel, and take these actors out."""
    for composite in model.everything():
        senders = dict(_of_kind(composite, "Publisher"))
        for name, channel in list(_of_kind(composite, "Subscriber")):
            sources = [each for each, of in senders.items() if of == channel]
            if sources:
                _join(composite, [*sources, name], channel)
        for name in [*senders, *(name for name, _ in _of_kind(composite, "Subscriber"))]:
            links = composite.links.get(f"{name}.input") or composite.links.get(f"{name}.output")
            if name in senders or (links and links[0].relation and links[0].relation.startswith(_MARK)):
                del composite.entities[name]
                for port in ("input", "output"):
                    composite.links.pop(f"{name}.{port}", None)
            else:
                notes.note(f"{name} hears nothing: no Publisher beside it has its channel")


_MARK = "channel "


def _of_kind(composite: Entity, kind: str) -> Iterator[tuple[str, str]]:
    for name, each in composite.entities.items():
        if each.java == f"ptolemy.actor.lib.{kind}":
            yield name, (each.text("channel") or "channel1").strip().strip('"')


def _join(composite: Entity, names: list[str], channel: str) -> None:
    """One relation for all of a channel, to which those of its senders and receivers are linked."""
    relation = f"{_MARK}{channel}"
    composite.relations.setdefault(relation, Relation(relation))
    for name in names:
        for port in ("input", "output"):
            for link in composite.links.get(f"{name}.{port}", []):
                if link.relation is not None and link.relation != relation:
                    composite.joined.append((relation, link.relation, link.order))
                    link.relation = relation
