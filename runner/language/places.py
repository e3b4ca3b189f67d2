"""Places in a model file: connections between ports, and the pointcuts of aspects."""

from __future__ import annotations

from dataclasses import replace

from ..text import Mapping, Node, NodeReader, Scalar, Sequence, Text, inside, split
from .declarations import ConnectionText, PointcutText
from .fields import (
    AT,
    FLAG,
    NAME,
    TEXTS,
    Construct,
    Key,
    Schema,
    Shape,
    computed,
    looks_like,
    node_as,
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
PORTS_SCHEMA: Schema = {"anyOf": [ref("port"), {"type": "array", "items": ref("port"), "minItems": 1}]}
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

_ENDS = TEXTS.described(ref("ports"))
CONNECTION = Construct(
    "From ports, to ports.",
    {
        "from": Key(_ENDS, "The sending ports.", name="sources"),
        "to": Key(_ENDS, "The receiving ports.", name="destinations"),
        "all": Key(
            FLAG,
            "Connect each to all, as '=>' does; otherwise several on both sides are connected in pairs.",
            called="'all' of a connection",
            name="to_all",
        ),
        "shared": Key(
            FLAG,
            "Make it one channel at each port, whoever sends and receives; otherwise each pair is one.",
            called="'shared' of a connection",
        ),
        "delay": Key(
            node_as(computed("number", 0.0, unit="s")),
            "How long a token takes, such as 100 ms; 0 is the next microstep.",
        ),
    },
)


def connection(reader: NodeReader, node: Node, what: str = "") -> ConnectionText | None:
    """``a.out -> b.in``, ``a[*].out => b[*].in``, ``{from: ..., to: ..., delay: ...}`` or ``{remove: ...}``."""
    problems = reader.problems
    if isinstance(node, Mapping) and list(node.entries) == ["remove"]:
        removed = connection(reader, node.entries["remove"].value)
        return None if removed is None else replace(removed, removes=node.position)
    if isinstance(node, Scalar):
        return _arrow(reader, node)
    if not isinstance(node, Mapping):
        hint = "write 'actor.port -> actor.port' or {from: ..., to: ..., delay: ...}"
        problems.add("this is not a connection", node.position, hint)
        return None
    entries = CONNECTION.entries(reader, node, "a connection") or {}
    before = len(problems)
    said = CONNECTION.values(reader, entries, "a connection", node.position)
    for key in ("from", "to"):
        if not said.setdefault(CONNECTION.keys[key].name, ()) and len(problems) == before:
            problems.add(f"the connection has no {key!r}", node.position)
    is_whole = said["sources"] and said["destinations"]
    return ConnectionText(position=node.position, **said) if is_whole else None


def _arrow(reader: NodeReader, node: Scalar) -> ConnectionText | None:
    text = node.value if isinstance(node.value, str) else node.text
    places = [(start, end) for arrow in ("->", "=>") for start, end in split(text, arrow)[1:]]
    if len(places) != 1:
        reader.problems.add(f"{text!r} is not a connection", node.position, "write 'actor.port -> actor.port'")
        return None
    right = places[0][0]
    sources, destinations = _endpoints(node, text, 0, right - 2), _endpoints(node, text, right, len(text))
    if not sources or not destinations:
        side = "right" if sources else "left"
        reader.problems.add(f"{text!r} has no port on its {side}", node.position, "write 'actor.port -> actor.port'")
        return None
    return ConnectionText(sources, destinations, node.position, to_all=text[right - 2] == "=")


def _endpoints(node: Scalar, text: str, start: int, end: int) -> tuple[Text, ...]:
    """The comma-separated ports of one side of a connection; brackets around the list are allowed."""
    side = text[start:end]
    if side.strip().startswith("[") and side.strip().endswith("]"):
        start, end = start + side.index("[") + 1, start + side.rindex("]")
    found = []
    for first, last in split(text[start:end], ","):
        part = text[start + first : start + last]
        if name := part.strip():
            offset = start + first + len(part) - len(part.lstrip())
            found.append(Text(name, inside(node, text, offset, name)))
    return tuple(found)


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
POINTCUT = Construct(
    "",
    {
        "at": Key(
            AT.described(_POINTCUT_SCHEMA), "Ports or actors, as a pattern, or a connection.", called=_OF_POINTCUT
        ),
        "type": Key(
            AT, "The type of the actors and composites that it attaches to, directly or at their ports.", _OF_POINTCUT
        ),
        "tag": Key(
            AT, "A tag of the actors and composites that it attaches to, directly or at their ports.", _OF_POINTCUT
        ),
        "port": Key(AT, "The name of the port (default: all ports that it can attach to).", _OF_POINTCUT),
        "parameter": Key(AT, "The name of a parameter of the actors, for an aspect that alters numbers.", _OF_POINTCUT),
        "request": Key(AT, "For an aspect that is a composite: the input that receives these tokens.", _OF_POINTCUT),
        "time": Key(node_as(ref("firing_time")), "For a composite at actors: how long their firings take."),
    },
    type="object",
)


def pointcuts(reader: NodeReader, node: Node, what: str) -> tuple[PointcutText, ...]:
    """A pattern, ``!pattern``, ``{at: ...}``, ``{type: ..., port: ...}`` or ``{tag: ...}``, or a list of these."""
    found = []
    for item in node.items if isinstance(node, Sequence) else (node,):
        if not isinstance(item, Mapping):
            found += [PointcutText.of(text) for text in reader.texts(item, what)]
            continue
        entries = POINTCUT.entries(reader, item, "a pointcut") or {}
        said = POINTCUT.values(reader, entries, "a pointcut", item.position)
        at = said.pop("at", None)
        where = PointcutText("", item.position) if at is None else PointcutText.of(at)
        if sum(key in entries for key in ("at", "type", "tag")) != 1 or (at is not None and "port" in said):
            hint = "write {at: ...}, {type: ..., port: ...} or {tag: ...}"
            reader.problems.add("a pointcut selects by pattern, type or tag", item.position, hint)
            said = {}
        found.append(replace(where, **said))
    return tuple(found)


POINTCUTS_SCHEMA = one_or_more({"anyOf": [_POINTCUT_SCHEMA, POINTCUT.schema]})
PATTERNS = node_as(ref("patterns"))
POINTCUTS = Shape(ref("pointcuts"), pointcuts)
CONNECTIONS = Shape(
    {"type": ["array", "null"], "items": ref("connection")},
    lambda reader, node, what: (
        None if (items := reader.items(node, what)) is None else tuple(connection(reader, each) for each in items)
    ),
)
