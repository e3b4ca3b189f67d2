"""Turns publishers that check, and subscribers to several channels, into plain ones with an additional actor."""

from __future__ import annotations

import re
from itertools import count

from .budget import spend
from .entities import Entity, Link, Property, Relation, kind
from .notes import Notes
from .scope import Scope, is_text
from .syntax import ExpressionError

MAX_REPEATED = 3  # in a pattern: the time that it takes grows with the third power of the length of a name
_REPEATED = re.compile(r"[*+?{]")
_OF_GROUP = re.compile(r"\)[*+?{]")
_LIBRARY = "ptolemy.actor.lib."
_CHECKS = {"PublisherTest": "Test", "PublisherNonStrictTest": "NonStrictTest"}
_TERMINALS = ("Publisher", "Subscriber", "PublisherPort", "SubscriberPort", "SubscriptionAggregator")
_SUMS = {"add": ("AddSubtract", "plus"), "multiply": ("MultiplyDivide", "multiply")}


def plain_channels(model: Entity, notes: Notes) -> None:
    """Separate checks and sums from the publishers and subscribers that contain them."""
    orders = count(3_000_000)  # after all links of the file
    for composite in list(model.everything()):
        for child in list(composite.entities.values()):
            if kind(child) in _CHECKS:
                _check(composite, child)
    channels = _published(model, Scope(model))
    for composite in list(model.everything()):
        for child in list(composite.entities.values()):
            if kind(child) == "SubscriptionAggregator":
                _aggregate(composite, child, channels, orders, notes)


def _named(composite: Entity, name: str) -> str:
    while name in composite.entities:
        name += "_"
    return name


def _check(composite: Entity, child: Entity) -> None:
    """Replace it by a Test, and a Publisher of the same input."""
    publisher = Entity(_named(composite, f"{child.name}_publisher"), f"{_LIBRARY}Publisher", line=child.line)
    for name in ("channel", "global"):
        if name in child.properties:
            publisher.properties[name] = child.properties.pop(name)
    for name in ("propagateNameChanges", "initialTokens"):
        child.properties.pop(name, None)
    child.properties.setdefault("tolerance", Property("tolerance", "ptolemy.data.expr.Parameter", "1.0"))
    child.java = f"{_LIBRARY}{_CHECKS[kind(child)]}"
    composite.entities[publisher.name] = publisher
    composite.links.pop(f"{child.name}.output", None)
    inputs = composite.links.get(f"{child.name}.input", [])
    composite.links[f"{publisher.name}.input"] = [
        Link(f"{publisher.name}.input", each.relation, each.line, each.order) for each in inputs
    ]


def _published(composite: Entity, scope: Scope) -> list[str]:
    """The channels of all publishers, in order; resolves all channel names, including those of subscribers."""
    found: list[str] = []
    for child in composite.entities.values():
        inner = scope.inside(child)
        for said in (child, *child.ports.values()):
            if kind(said) in _TERMINALS and (channel := said.properties.get("channel")) is not None:
                channel.value = channel_name(said, inner)
            if kind(said) in ("Publisher", "PublisherPort"):
                found.append(channel_name(said, inner))
        found += _published(child, inner)
    return list(dict.fromkeys(found))


def channel_name(said: Property, scope: Scope) -> str:
    """The channel of a Publisher or Subscriber, or of a port that is one."""
    text = (said.text("channel") or "channel1").strip()
    if text.startswith('"') and not is_text(said.properties["channel"]):
        try:
            return str(Scope(said, scope).value(text))
        except ExpressionError:
            pass
    return Scope(said, scope).filled(text.strip('"'))


def _aggregate(composite: Entity, child: Entity, channels: list[str], orders: count[int], notes: Notes) -> None:
    """Replace it by several Subscribers, and the sum or product of what they receive."""
    text = (child.text("channel") or "channel1").strip().strip('"')
    if _OF_GROUP.search(text) or len(_REPEATED.findall(text)) > MAX_REPEATED:
        notes.error(
            f"{child.name}.channel = {text!r}: a pattern may have {MAX_REPEATED} repetitions, and none of a group"
        )
        return
    try:
        pattern = re.compile(text)
    except re.error as error:
        notes.error(f"{child.name}.channel = {text!r} is not a valid pattern: {error}")
        return
    java, port = _SUMS.get((child.text("operation") or "add").strip().strip('"'), _SUMS["add"])
    child.java = f"{_LIBRARY}{java}"
    is_global = child.properties.get("global")
    for name in ("channel", "global", "operation", "propagateNameChanges"):
        child.properties.pop(name, None)
    child.ports.pop("input", None)
    for each in channels:
        spend(1 + len(each) * len(each) * len(each) // 100)
    for number, channel in enumerate(each for each in channels if pattern.fullmatch(each)):
        name = _named(composite, f"{child.name}_subscriber_{number}")
        made = composite.entities[name] = Entity(name, f"{_LIBRARY}Subscriber", line=child.line)
        made.properties["channel"] = Property("channel", value=channel)
        if is_global is not None:
            made.properties["global"] = is_global
        relation = f"{child.name} hears {channel}"
        composite.relations[relation] = Relation(relation)
        for path in (f"{name}.output", f"{child.name}.{port}"):
            composite.links.setdefault(path, []).append(Link(path, relation, child.line, next(orders)))
