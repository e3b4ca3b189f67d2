"""What may be written at a place."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

from epicycle.actors import units_like
from epicycle.actors.expression import FUNCTIONS

from ..model.text.document import LINE_BREAK, Mapping
from .knowledge import Knowledge, Known, owner_of
from .names import MODEL
from .places import Keys, Place, place_at, value_of
from .reading import Parsed, Texts, read
from .schema import allowed, applying, described, language

_PATH = re.compile(r"!?\s*((?:[\w*]+(?:\[[^\]\s]*\])?\.)*)[\w*\[\]]*\Z")
_QUANTITY = re.compile(r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(\s*)([^\s\d]*)\Z")
_ENDS = re.compile(r"->|=>|,|\[(?![\d*.])")
_OF_PORTS = {"of", "record", "stop_when", "property", "signals", "robots", "obstacle"}


def complete(
    path: Path,
    offset: int,
    texts: Texts,
    types: tuple[type, ...] = (),
    parsed: Parsed | None = None,
) -> list[Known]:
    """What may be written in one of some texts before a character; they may have been ``parsed``."""
    text = texts[path.resolve()]
    place = place_at(text, offset)
    if place is None:
        return []
    knowledge = Knowledge(read(path, {**texts, path.resolve(): place.text}, types, parsed=parsed))
    follows = text[offset:]
    found = list(_keys(place, knowledge, follows) if place.is_key else _values(place, knowledge))
    if not place.is_key and LINE_BREAK.split(text[:offset])[-1].strip() == place.before:  # perhaps a first key
        found += _keys(place, knowledge, follows)
    return list({(each.text, each.kind): each for each in found}.values())


# -- keys -------------------------------------------------------------------------------------------------------------


def _keys(place: Place, knowledge: Knowledge, follows: str) -> Iterator[Known]:
    root, here = language(knowledge.reading.types), place.around[-1]
    there = here.entries if place.is_key and isinstance(here, Mapping) else {}
    found: dict[str, tuple[str, str]] = {}
    for each in allowed(root, place.around[0], place.keys):
        for key, said in each.get("properties", {}).items():
            if isinstance(said, dict) and key not in found:
                found[key] = "", described(applying(root, [said], here))
    owner, keys = owner_of(place.keys)
    if len(keys) == 2 and keys[0] in ("actors", "aspects"):
        for kind in knowledge.names.inner(owner, str(keys[1])):
            for name, parameter in knowledge.composite_parameters(kind).items():
                found[name] = f"parameter of {kind}", parameter.doc
    ending = "" if re.match(r"\w*[ \t]*:", follows) else ": "
    return (Known(key + ending, "key", *said, len(place.before)) for key, said in found.items() if key not in there)


# -- values -----------------------------------------------------------------------------------------------------------


def _values(place: Place, knowledge: Knowledge) -> Iterator[Known]:
    owner, keys = owner_of(place.keys)
    before = place.before
    named = [key for key in keys if isinstance(key, str)]
    if before.rfind("${") > before.rfind("}"):
        yield from _names(owner, before, knowledge)
    elif keys[:1] == ("connections",) and named[-1] in ("connections", "from", "to"):
        yield from _ends(owner, named, before, knowledge)
    elif named[-1:] == ["type"] or (named[-1:] == ["extends"] and owner != MODEL):
        yield from _types(owner, keys, before, knowledge, place)
    elif named[-1:] == ["inherit"]:
        names = ["all", *knowledge.names.declared(owner, "parameter")]
        yield from (Known(each, "parameter", replaces=len(before)) for each in names)
    else:
        yield from _plain(owner, keys, before, knowledge, place)


def _names(owner: str, before: str, knowledge: Knowledge) -> Iterator[Known]:
    """Inside of an expression."""
    length = len(before) - len(re.sub(r"\w+\Z", "", before))
    model = knowledge.reading.loading.model if owner == MODEL else None
    known = knowledge.composite_parameters(owner) if model is None else model.declared
    for name in knowledge.names.declared(owner, "parameter"):
        value = f"= {model.parameters[name]}" if model is not None and name in model.parameters else ""
        yield Known(name, "parameter", value, known[name].doc if name in known else "", length)
    yield Known("index", "parameter", "the index of an instance in its array", "", length)
    yield from (Known(name, "function", replaces=length) for name in sorted(FUNCTIONS))


def _ends(owner: str, keys: list[str], before: str, knowledge: Knowledge) -> Iterator[Known]:
    """The ends of a connection."""
    is_source = not re.search("->|=>", before) if keys[-1] not in ("from", "to") else keys[-1] == "from"
    direction = "output" if is_source else "input"
    part = _ENDS.split(before)[-1].lstrip()
    actor, dot, port = part.rpartition(".")
    if dot:
        name = actor.partition("[")[0]
        yield from (replace(each, replaces=len(port)) for each in knowledge.ports_of(owner, name, direction))
        return
    for name, entry in knowledge.names.declared(owner, "actor").items():
        if not any(knowledge.ports_of(owner, name, direction)) and knowledge.names.types_of(owner, name):
            continue
        is_array = value_of(entry.value, "count") is not None
        kind = ", ".join(knowledge.names.types_of(owner, name))
        yield Known(f"{name}[*]" if is_array else name, "actor", kind, "", len(part))
    # Seen from inside, tokens come from an own input.
    own = knowledge.own_ports(owner, "input" if is_source else "output") if owner != MODEL else ()
    yield from (replace(each, replaces=len(part)) for each in own)


def _types(owner: str, keys: Keys, before: str, knowledge: Knowledge, place: Place) -> Iterator[Known]:
    if keys == ("extends",) or (len(keys) == 3 and keys[0] in ("actors", "aspects")):
        for name in knowledge.names.classes:
            if name not in ("", owner):
                yield Known(name, "type", "composite", knowledge.of_type(name, "actors"), len(before))
    yield from _chosen(place, knowledge, "type")


def _plain(owner: str, keys: Keys, before: str, knowledge: Knowledge, place: Place) -> Iterator[Known]:
    yield from _chosen(place, knowledge, "value")
    yield from _units(knowledge.unit_of(owner, keys), before)
    parameter = knowledge.parameter(owner, keys)
    choices = parameter.choices if parameter is not None else ()
    yield from (Known(str(each), "value", replaces=len(before)) for each in choices)
    named = [key for key in keys if isinstance(key, str)]
    at = "at" in named[2:] and keys[0] == "aspects"
    if at and named[-1] == "port":
        return
    directions = frozenset({"output"})
    if at:
        kind = next(iter(knowledge.names.types_of(owner, named[1])), "")
        cls: Any = knowledge.type_called(kind, "aspects")
        anywhere = frozenset({"input", "output"})
        directions = frozenset() if cls is not None and not cls.at_ports else getattr(cls, "stands_at", anywhere)
    elif not _OF_PORTS & set(named) and "." not in before:
        return
    tail = re.split(r"->|[\s,(\[](?![\d*])", before)[-1]
    if (found := _PATH.match(tail)) is not None:
        names = knowledge.next_names(owner, found[1], frozenset(directions))
        yield from (replace(each, replaces=len(tail) - found.end(1)) for each in names)


def _units(unit: str, before: str) -> Iterator[Known]:
    if unit and (found := _QUANTITY.match(before)) is not None:
        gap = "" if found[1] else " "
        for each in units_like(unit):
            yield Known(f"{gap}{each}", "unit", "the parameter's unit" if each == unit else "", "", len(found[2]))


def _chosen(place: Place, knowledge: Knowledge, kind: str) -> Iterator[Known]:
    """The values that the schema lists."""
    root = language(knowledge.reading.types)
    for each in allowed(root, place.around[0], place.keys):
        for value, doc in zip_longest(each.get("enum", ()), each.get("enumDescriptions", ()), fillvalue=""):
            yield Known(str(value), kind, "", doc, len(place.before))
        kinds = each["type"] if isinstance(each.get("type"), list) else [each.get("type")]
        if "boolean" in kinds and "number" not in kinds:
            yield from (Known(said, kind, "", "", len(place.before)) for said in ("true", "false"))
