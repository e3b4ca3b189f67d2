"""Converts publishers and subscribers, which share a channel name, to wires.

A channel reaches all transparent composites under one director.  A ``global`` channel reaches the whole model.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import count, pairwise
from typing import NamedTuple

from .budget import spend
from .entities import Entity, Port, Property, director_of, is_text
from .notes import Notes
from .scope import Scope
from .syntax import ExpressionError

_LINK = 5  # steps
_FIRST_LINK = 1_000_000  # after all links of the file
_CHECKS = dict.fromkeys(("PublisherTest", "PublisherNonStrictTest"), "Publisher")  # which stay


class _Terminal(NamedTuple):
    """A Publisher or Subscriber, or a port of that kind: its place, from the model down, and its channel."""

    around: tuple[Entity, ...]
    name: str  # the actor's, or "composite.port"
    channel: str
    is_global: bool
    is_source: bool

    def hears(self, source: _Terminal) -> bool:
        """Whether this subscriber receives what ``source`` publishes."""
        is_near = _region(self.around) is _region(source.around) or source.is_global or self.is_global
        return source.channel == self.channel and is_near


def _region(around: tuple[Entity, ...]) -> Entity:
    """The composite whose director governs a place."""
    return next((each for each in reversed(around) if director_of(each) is not None), around[0])


def join_channels(model: Entity, notes: Notes) -> None:
    """Join the relations of the publishers and subscribers of each channel, and remove these actors."""
    terminals = list(_terminals(model, (), Scope(model)))
    sources = [each for each in terminals if each.is_source]
    orders = count(_FIRST_LINK)
    for each in terminals:
        spend(len(sources))
        heard = [] if each.is_source else [source for source in sources if each.hears(source)]
        for source in heard:
            shared = sum(1 for one, other in zip(source.around, each.around, strict=False) if one is other)
            for end in (source, each):
                _lead(end, end.around[shared - 1 :], orders)
        if not heard and not each.is_source:
            path = ".".join([*(composite.name for composite in each.around[1:]), each.name])
            notes.error(f"{path} receives nothing: no Publisher within reach has its channel")
    for each in terminals:
        if "." not in each.name and each.around[-1].entities[each.name].kind not in _CHECKS:
            del each.around[-1].entities[each.name]
            for port in ("input", "output"):
                each.around[-1].links.pop(f"{each.name}.{port}", None)


def _terminals(composite: Entity, around: tuple[Entity, ...], scope: Scope) -> Iterator[_Terminal]:
    around = (*around, composite)
    for child in composite.entities.values():
        inner = Scope(child, scope)
        places: dict[str, tuple[Property, str]] = {child.name: (child, _CHECKS.get(child.kind, child.kind))}
        places |= {f"{child.name}.{name}": (port, port.kind.removesuffix("Port")) for name, port in child.ports.items()}
        for name, (said, word) in places.items():
            if word in ("Publisher", "Subscriber") and (said is child or said.kind != word):
                is_global = said.word("global") == "true"
                yield _Terminal(around, name, _channel(said, inner), is_global, word == "Publisher")
        yield from _terminals(child, around, inner)


def _channel(said: Property, scope: Scope) -> str:
    """The channel of a Publisher or Subscriber, or of a port that is one."""
    text, inner = (said.text("channel") or "channel1").strip(), Scope(said, scope)
    if text.startswith('"') and not is_text(said.properties["channel"]):
        try:
            return str(inner.value(text))
        except ExpressionError:
            pass
    return inner.filled(text.strip('"'))


def _lead(terminal: _Terminal, way: tuple[Entity, ...], orders: Iterator[int]) -> None:
    """Link a terminal to the relation of its channel, through the composites between."""
    relation = f"channel {terminal.channel}"
    for composite in way:
        composite.link(relation, 0)
    inner = way[-1]
    if "." in terminal.name:
        _link(inner, terminal.name, relation, orders)
    for port in ("input", "output"):
        for link in inner.links.get(f"{terminal.name}.{port}", ()):
            if link.relation is not None and link.relation != relation:
                inner.joined.append((relation, link.relation, link.order))
                link.relation = relation
    for outer, inner in pairwise(way):
        port = re.sub(r"\W+", "_", terminal.channel) + ("_out" if terminal.is_source else "_in")
        direction = "output" if terminal.is_source else "input"
        inner.ports.setdefault(port, Port(port, properties={direction: Property(direction, value="true")}))
        _link(inner, port, relation, orders)
        _link(outer, f"{inner.name}.{port}", relation, orders)


def _link(composite: Entity, port: str, relation: str, orders: Iterator[int]) -> None:
    """Link a port to a relation, unless it is linked already."""
    links = composite.links.get(port, ())
    spend(_LINK + len(links))
    if all(link.relation != relation for link in links):
        composite.link(relation, next(orders), port)
