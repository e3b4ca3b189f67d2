"""Converts publishers and subscribers, which share a channel name, to wires.

A channel reaches all transparent composites under one director.  A ``global`` channel reaches the whole model.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count, pairwise

from .budget import spend
from .directors import director_of
from .entities import Entity, Link, Port, Property, Relation, kind
from .notes import Notes

_LINK = 5  # steps


@dataclass(frozen=True)
class _Terminal:
    """A Publisher or Subscriber, or a port of that kind: its place, from the model down, and its channel."""

    around: tuple[Entity, ...]
    name: str  # the actor's, or "composite.port"
    channel: str
    is_global: bool
    is_source: bool

    @property
    def path(self) -> str:
        return ".".join([*(each.name for each in self.around[1:]), self.name])

    @property
    def region(self) -> Entity:
        """The composite whose director governs it."""
        return next((each for each in reversed(self.around) if director_of(each) is not None), self.around[0])

    def hears(self, source: _Terminal) -> bool:
        """Whether this subscriber receives what ``source`` publishes."""
        is_near = self.region is source.region or source.is_global or self.is_global
        return source.channel == self.channel and is_near


def join_channels(model: Entity, notes: Notes) -> None:
    """Join the relations of the publishers and subscribers of each channel, and remove these actors."""
    terminals = list(_terminals(model, ()))
    sources = [each for each in terminals if each.is_source]
    orders = count(1_000_000)  # after all links of the file
    for each in terminals:
        spend(len(sources))
        heard = [] if each.is_source else [source for source in sources if each.hears(source)]
        for source in heard:
            shared = _shared(source.around, each.around)
            _lead(source, shared, orders)
            _lead(each, shared, orders)
        if not heard and not each.is_source:
            notes.error(f"{each.path} receives nothing: no Publisher within reach has its channel")
    for each in terminals:
        if "." not in each.name:
            home = each.around[-1]
            del home.entities[each.name]
            for port in ("input", "output"):
                home.links.pop(f"{each.name}.{port}", None)


def _terminals(composite: Entity, around: tuple[Entity, ...]) -> Iterator[_Terminal]:
    around = (*around, composite)
    for child in composite.entities.values():
        places: list[tuple[str, Property]] = [(f"{child.name}.{port.name}", port) for port in child.ports.values()]
        for name, said in [(child.name, child), *places]:
            word = kind(said).removesuffix("Port") if said is not child else kind(said)
            if word in ("Publisher", "Subscriber") and (said is child or kind(said) == f"{word}Port"):
                channel = (said.text("channel") or "channel1").strip().strip('"')
                is_global = (said.text("global") or "false").strip() == "true"
                yield _Terminal(around, name, channel, is_global, word == "Publisher")
        yield from _terminals(child, around)


def _shared(one: tuple[Entity, ...], other: tuple[Entity, ...]) -> int:
    """How many composites two places have in common."""
    return sum(1 for a, b in zip(one, other, strict=False) if a is b)


def _lead(terminal: _Terminal, shared: int, orders: Iterator[int]) -> None:
    """Link a terminal to the relation of its channel in the innermost shared composite."""
    relation = f"channel {terminal.channel}"
    way = terminal.around[shared - 1 :]
    for composite in way:
        composite.relations.setdefault(relation, Relation(relation))
    if "." in terminal.name:
        _link(way[-1], terminal.name, relation, orders)
    else:
        for link in _links(terminal):
            if link.relation is not None and link.relation != relation:
                way[-1].joined.append((relation, link.relation, link.order))
                link.relation = relation
    for outer, inner in pairwise(way):
        port = re.sub(r"\W+", "_", terminal.channel) + ("_out" if terminal.is_source else "_in")
        direction = "output" if terminal.is_source else "input"
        inner.ports.setdefault(port, Port(port, properties={direction: Property(direction, value="true")}))
        _link(inner, port, relation, orders)
        _link(outer, f"{inner.name}.{port}", relation, orders)


def _link(composite: Entity, port: str, relation: str, orders: Iterator[int]) -> None:
    """Link a port to a relation, unless it is linked already."""
    links = composite.links.setdefault(port, [])
    spend(_LINK + len(links))
    if all(link.relation != relation for link in links):
        links.append(Link(port, relation, 0, next(orders)))


def _links(terminal: _Terminal) -> list[Link]:
    known = terminal.around[-1].links
    return [link for port in ("input", "output") for link in known.get(f"{terminal.name}.{port}", [])]
