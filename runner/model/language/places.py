"""Places in a model file: connections between ports, and the pointcuts of aspects."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from epicycle.aspects import FiringTime, FiringTimeParameter

from ..text.document import Mapping, Node, Scalar, Sequence
from ..text.kinds import MISSING_KEY
from ..text.problems import POISON, Poison, Position
from ..text.reading import NodeReader, Text, inside, is_empty, split
from .fields import (
    AT,
    FLAG,
    NAME,
    TIME,
    Computed,
    Field,
    Reader,
    Record,
    Schema,
    computed_as,
    keyed,
    looks_like,
    nanoseconds,
    one_or_more,
    ref,
)

_BOUND = r"(-?[0-9]{1,9}|\$\{[^}]*\})"
_INDEX = rf"\s*(\*|{_BOUND}|{_BOUND}?\s*\.\.\s*{_BOUND}?)\s*"
_ENDPOINT = rf"({NAME}(\[{_INDEX}(,{_INDEX})*\])?\.)?{NAME}"
_LIST = rf"[\s,]*{_ENDPOINT}(\s*,[\s,]*{_ENDPOINT})*[\s,]*"
_SIDE = rf"(\s*\[{_LIST}\]\s*|{_LIST})"
CONNECTION_TEXT = f"^{_SIDE}(->|=>){_SIDE}$"
_SEGMENT = rf"(\*\*|(\*|{NAME})(\[(\*|[0-9]{{1,9}})\])?)"
_PATH = rf"{_SEGMENT}(\.{_SEGMENT})*"
PATTERN = f"^{_PATH}$"
POINTCUT_TEXT = rf"^\s*!?\s*{_PATH}(\s*->\s*{_PATH})?\s*$"

PORT_SCHEMA: Schema = {
    "type": "string",
    **looks_like(
        f"^{_ENDPOINT}$",
        "expected actor.port, array[*].port, array[0].port, array[1..3].port or a port of this composite",
    ),
}
PORTS_SCHEMA: Schema = {
    "anyOf": [
        {"type": "string", **looks_like(f"^{_SIDE}$", "expected actor.port, or several of these with commas between")},
        {"type": "array", "items": ref("port"), "minItems": 1},
    ]
}
PATTERN_SCHEMA: Schema = {
    "type": "string",
    **looks_like(
        PATTERN, "expected a port as a dotted path; * is one segment, name[*] all of an array, ** any segments"
    ),
}
_POINTCUT_SCHEMA: Schema = {
    "type": "string",
    **looks_like(
        POINTCUT_TEXT, "expected ports or actors as a pattern, a connection 'a.out -> b.in', or one of these after '!'"
    ),
}


# -- connections --------------------------------------------------------------------------------------------------

_END = re.compile(r"(?:([A-Za-z_]\w*)(?:\[([^\[].*|)\])?\.)?([A-Za-z_]\w*)\Z", re.ASCII | re.DOTALL)
_FORMS = "'actor.port', 'array[*].port', 'array[0].port', 'array[1..3].port' or a port of this composite"


@dataclass(frozen=True)
class Endpoint:
    """One end of a connection: a port of an actor, or of one or several of an array, or of the composite itself."""

    text: str
    position: Position
    actor: str  # "" for a port of the composite itself
    index: str | None
    port: str


def endpoint(reader: NodeReader, text: Text) -> Endpoint | Poison:
    """What a text names as one end of a connection."""
    match = _END.match(text.text)
    if match is None:
        message = f"{text.text!r} is not a port that can be connected here"
        return reader.problems.add(message, text.position, f"write {_FORMS}")
    return Endpoint(text.text, text.position, match[1] or "", match[2], match[3])


def endpoints(reader: NodeReader, texts: Iterable[Text] | Poison) -> tuple[Endpoint, ...] | Poison:
    """What several texts name; poison if one of them is none."""
    found = [endpoint(reader, text) for text in texts or ()]
    sound = tuple(each for each in found if each)
    return POISON if texts is POISON or len(sound) < len(found) else sound


def _ends(reader: NodeReader, node: Node, what: str) -> tuple[Endpoint, ...] | Poison:
    if isinstance(node, Scalar) and isinstance(node.value, str):
        return endpoints(reader, _side(node, node.value, 0, len(node.value)))
    return endpoints(reader, reader.texts(node, what))


_ENDS = Reader(ref("ports"), _ends)


@dataclass(frozen=True)
class ConnectionText:
    """One entry of ``connections``; with ``to_all``, each source leads to all destinations, otherwise they are paired.

    If it is ``shared``, it is one channel at each port.
    """

    position: Position
    sources: tuple[Endpoint, ...] = keyed(_ENDS, "The sending ports.", key="from")
    destinations: tuple[Endpoint, ...] = keyed(_ENDS, "The receiving ports.", key="to")
    to_all: bool = keyed(
        FLAG,
        "Connect each to all, as '=>' does; otherwise several on both sides are connected in pairs.",
        key="all",
        called="'all' of a connection",
        default=False,
    )
    shared: bool = keyed(
        FLAG,
        "Make it one channel at each port, whoever sends and receives; otherwise each pair is one.",
        called="'shared' of a connection",
        default=False,
    )
    delay: Computed | None = keyed(
        computed_as(TIME, nanoseconds),
        "How long a token takes, such as 100 ms; 0 is the next microstep.",
        default=None,
    )
    removes: Position | None = None  # where the file removes these from the inherited ones


CONNECTION = Record.of(ConnectionText, "From ports, to ports.")


def connection(reader: NodeReader, node: Node, what: str = "") -> ConnectionText | Poison:
    """``a.out -> b.in``, ``a[*].out => b[*].in``, ``{from: ..., to: ..., delay: ...}`` or ``{remove: ...}``."""
    problems = reader.problems
    if isinstance(node, Mapping) and list(node.entries) == ["remove"]:
        removed = connection(reader, node.entries["remove"].value)
        return POISON if removed is POISON else replace(removed, removes=node.position)
    if isinstance(node, Scalar):
        return _arrow(reader, node)
    if not isinstance(node, Mapping):
        hint = "write 'actor.port -> actor.port' or {from: ..., to: ..., delay: ...}"
        return problems.add("this is not a connection", node.position, hint)
    entries = CONNECTION.entries(reader, node, "a connection") or {}
    said = CONNECTION.values(reader, entries, "a connection", node.position)
    for key in ("from", "to"):
        if said.get(CONNECTION.keys[key].name, ()) == ():
            said[key] = problems.add(f"the connection has no {key!r}", node.position, kind=MISSING_KEY)
    return POISON if POISON in said.values() else ConnectionText(position=node.position, **said)


def _arrow(reader: NodeReader, node: Scalar) -> ConnectionText | Poison:
    text, advice = node.value if isinstance(node.value, str) else node.text, "write 'actor.port -> actor.port'"
    places = [(start, end) for arrow in ("->", "=>") if arrow in text for start, end in split(text, arrow)[1:]]
    if len(places) != 1:
        return reader.problems.add(f"{text!r} is not a connection", node.position, advice)
    right = places[0][0]
    left, behind = _side(node, text, 0, right - 2), _side(node, text, right, len(text))
    if not left or not behind:
        side = "right" if left else "left"
        return reader.problems.add(f"{text!r} has no port on its {side}", node.position, advice)
    sources, destinations = endpoints(reader, left), endpoints(reader, behind)
    if sources is POISON or destinations is POISON:
        return POISON
    return ConnectionText(node.position, sources, destinations, to_all=text[right - 2] == "=")


def _side(node: Scalar, text: str, start: int, end: int) -> list[Text]:
    """The comma-separated ports of one side of a connection; brackets around the list are allowed."""
    side = text[start:end]
    if side.strip().startswith("[") and side.strip().endswith("]"):
        start, end = start + side.index("[") + 1, start + side.rindex("]")
    found = []
    for first, last in split(text[start:end], ",") if "," in text[start:end] else [(0, end - start)]:
        part = text[start + first : start + last]
        if name := part.strip():
            offset = start + first + len(part) - len(part.lstrip())
            found.append(Text(name, inside(node, text, offset, name)))
    return found


def connection_schema() -> Schema:
    """The schema of one entry of ``connections``."""
    declared = CONNECTION.schema
    removal = {"description": "A connection of the extended class to remove.", "$ref": "#/$defs/connection"}
    return {
        **declared,
        "properties": {**declared["properties"], "remove": removal},
        "type": ["object", "string"],
        "if": {"type": "object", "required": ["remove"]},
        "then": {"maxProperties": 1},
        "else": {"required": ["from", "to"]},
        **looks_like(CONNECTION_TEXT, "expected 'actor.port -> actor.port', with => for all to all"),
    }


# -- pointcuts ----------------------------------------------------------------------------------------------------

_OF_POINTCUT = "{key} of a pointcut"


@dataclass(frozen=True)
class PointcutText:
    """Where an aspect attaches: a pattern, or a type or tag and perhaps a port; ``exclude``: where it does not.

    A pattern of single connections has ``ends``.  For an aspect that is a model, ``request`` is the port by which
    tokens or firings come in, ``time`` makes it attach to actors and gives the time of their firings.
    """

    text: str
    position: Position
    exclude: bool = False
    ends: tuple[str, str] | None = None
    type: Text | None = keyed(
        AT,
        "The type of the actors and composites that it attaches to, directly or at their ports.",
        default=None,
    )
    tag: Text | None = keyed(
        AT,
        "A tag of the actors and composites that it attaches to, directly or at their ports.",
        default=None,
    )
    port: Text | None = keyed(AT, "The name of the port (default: all ports that it can attach to).", default=None)
    parameter: Text | None = keyed(
        AT,
        "The name of a parameter of the actors, for an aspect that alters numbers.",
        default=None,
    )
    request: Text | None = keyed(
        AT,
        "For an aspect that is a composite: the input that receives these tokens.",
        default=None,
    )
    time: Computed | None = keyed(
        computed_as(FiringTimeParameter(), schema=ref("firing_time")),
        "For a composite at actors: how long their firings take.",
        default=None,
    )
    firing_time: FiringTime = 0.0  # the value of ``time``

    @classmethod
    def of(cls, text: Text) -> PointcutText:
        """``pattern``, or ``!pattern`` for where an aspect does not attach."""
        pattern = text.text.strip()
        exclude = pattern.startswith("!")
        pattern = pattern[1:].strip() if exclude else pattern
        left, arrow, right = pattern.partition("->")
        return cls(pattern, text.position, exclude, (left.strip(), right.strip()) if arrow else None)

    @property
    def is_pattern(self) -> bool:
        """Whether it selects by a pattern, not by a type or tag."""
        return self.type is None and self.tag is None

    @property
    def head(self) -> str:
        """The actor that it names first."""
        return self.text.partition(".")[0].partition("[")[0]


_AT = AT.described(_POINTCUT_SCHEMA)
POINTCUT = Record.of(PointcutText, called=_OF_POINTCUT, type="object")
POINTCUT.keys = {"at": Field(_AT, "Ports or actors, as a pattern, or a connection.", _OF_POINTCUT), **POINTCUT.keys}


def pointcuts(reader: NodeReader, node: Node, what: str) -> tuple[PointcutText | Poison, ...]:
    """A pattern, ``!pattern``, ``{at: ...}``, ``{type: ..., port: ...}`` or ``{tag: ...}``, or a list of these."""
    found: list[PointcutText | Poison] = []
    for item in node.items if isinstance(node, Sequence) else (node,):
        if isinstance(item, Mapping):
            found.append(_pointcut(reader, item))
        else:
            texts = reader.texts(item, what)
            found += [POISON] if texts is POISON else map(PointcutText.of, texts)
    return tuple(found)


def _pointcut(reader: NodeReader, item: Mapping) -> PointcutText | Poison:
    entries = POINTCUT.entries(reader, item, "a pointcut") or {}
    said = POINTCUT.values(reader, entries, "a pointcut", item.position)
    places = [key for key in ("port", "parameter") if key in said]
    if sum(key in entries for key in ("at", "type", "tag")) != 1 or ("at" in entries and places):
        hint = "write {at: ...}, {type: ..., port: ...} or {tag: ...}"
        return reader.problems.add("a pointcut selects by pattern, type or tag", item.position, hint)
    if len(places) > 1:
        message = "a pointcut selects ports or a parameter, not both"
        return reader.problems.add(message, entries["parameter"].key.position, "leave out 'port' or 'parameter'")
    if POISON in said.values():
        return POISON
    at = said.pop("at", None)
    return replace(PointcutText("", item.position) if at is None else PointcutText.of(at), **said)


POINTCUTS_SCHEMA = one_or_more({"anyOf": [_POINTCUT_SCHEMA, POINTCUT.schema]})
PATTERNS = Reader(
    ref("patterns"),
    lambda reader, node, what: tuple(
        reader.placed(item, what)
        for item in (node.items if isinstance(node, Sequence) else (node,))
        if not is_empty(item)
    ),
)
POINTCUTS = Reader(ref("pointcuts"), pointcuts)
CONNECTIONS = Reader(
    {"type": ["array", "null"], "items": ref("connection")},
    lambda reader, node, what: (
        POISON if (items := reader.items(node, what)) is POISON else tuple(connection(reader, each) for each in items)
    ),
)
