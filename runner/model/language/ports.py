"""Parameters and ports of composites and models: what a file declares of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from keyword import iskeyword, kwlist
from typing import Any

from epicycle.actors import Parameter, UnitError, convert, in_si, parse_unit
from epicycle.actors.expression import CONSTANTS, FUNCTIONS

from ..text.document import Entry, Mapping, Node, Scalar
from ..text.faults import blame
from ..text.kinds import NAME as NOT_A_NAME
from ..text.problems import POISON, Poison, Position
from ..text.reading import NAME, NodeReader, Text, is_empty
from .fields import (
    AT,
    LABEL,
    QUANTITY_SCHEMA,
    TEXT,
    Reader,
    Record,
    keyed,
    named,
    names_of,
    node_as,
    number,
    one_or_more,
    ref,
    sound,
)
from .fields import NAME as NAME_PATTERN


@dataclass(frozen=True)
class PortText:
    """A port that a composite declares; without a type it takes that of the ports connected to it."""

    name: str
    position: Position
    type: Text | None = keyed(
        AT,
        "What passes through it, such as float, 'float | int', array[2] or a token class.",
        called="the type of {what}",
        default=None,
    )
    doc: str = keyed(TEXT, "What it is.", default="")


PORT = Record.of(PortText, "A port of a composite: its type, or {type, doc}.", type=["object", "string", "null"])


def _ports(reader: NodeReader, node: Node, what: str) -> dict[str, PortText]:
    """``[a, b]`` or ``{a: type, b: {type: ..., doc: ...}, c: }``."""
    if isinstance(node, Mapping):
        found = [_port(reader, name, entry) for name, entry in node.entries.items()]
    else:
        found = [PortText(text.text, text.position) for text in reader.texts(node, what) or ()]
    ports: dict[str, PortText] = {}
    for port in found:
        if not NAME.match(port.name):
            reader.problems.add(f"{port.name!r} is not a port name", port.position, kind=NOT_A_NAME)
            continue
        if port.name in ports:
            reader.problems.add(f"port {port.name!r} is declared twice", port.position, kind=NOT_A_NAME)
        ports[port.name] = port
    return ports


def _port(reader: NodeReader, name: str, entry: Entry) -> PortText:
    what = f"port {name!r}"
    if isinstance(entry.value, Mapping):
        said = PORT.read(reader, entry.value, what) or {}
    else:
        said = {} if is_empty(entry.value) else {"type": AT.read(reader, entry.value, f"the type of {what}")}
    return PortText(name, entry.key.position, **sound(said))


def _unit(reader: NodeReader, node: Node, what: str) -> str | Poison:
    unit = reader.text(node, f"unit of {what}")
    try:
        if unit:
            parse_unit(unit)
    except UnitError as error:
        return blame(reader.problems, what, error, node)
    return unit


def _choices(reader: NodeReader, node: Node, what: str) -> dict[str, Text] | Poison:
    """``[A, B]``, or ``{a: A, b: B}`` for choices that mean types with other names."""
    if isinstance(node, Mapping):
        types = {name: reader.placed(entry.value, f"the type of {name!r}") for name, entry in node.entries.items()}
        chosen: dict[str, Text] | Poison = POISON if POISON in types.values() else sound(types)
    else:
        texts = reader.texts(node, "choices")
        chosen = POISON if texts is POISON else {text.text: text for text in texts}
    if chosen is POISON:
        return POISON
    return chosen or reader.problems.add(f"{what} has an empty list of choices", node.position)


_FREE_NUMBER = number(float)


def _bound(reader: NodeReader, node: Node, what: str) -> float | str | Poison:
    """A number, or a text with a unit, which is converted once the parameter's own is known."""
    value = node.value if isinstance(node, Scalar) else None
    try:
        if isinstance(value, str) and in_si(value) is not None:
            return value
    except UnitError as error:
        return blame(reader.problems, what, error, node)
    found: float | Poison = _FREE_NUMBER.read(reader, node, what)
    return found


@dataclass(frozen=True)
class ParameterText:
    """A parameter that a model or composite declares; its value is poison if its declaration is wrong."""

    name: str
    position: Position
    value: Node | Poison | None = keyed(node_as({}), "The default; without one, a value must be given.", default=None)
    unit: str = keyed(
        Reader(ref("text"), _unit),
        "The unit of numbers, such as m/s; 1 for a pure number.",
        called="{what}",
        default="",
    )
    # As written: a text has a unit of its own.
    min: float | str | None = keyed(
        Reader(QUANTITY_SCHEMA, _bound),
        "The smallest value, in its unit or with one of its own.",
        default=None,
    )
    max: float | str | None = keyed(
        Reader(QUANTITY_SCHEMA, _bound),
        "The largest value, in its unit or with one of its own.",
        default=None,
    )
    above: float | str | None = keyed(
        Reader(QUANTITY_SCHEMA, _bound),
        "What every value is greater than, in its unit or with one of its own.",
        default=None,
    )
    choices: dict[str, Text] = keyed(
        Reader({"anyOf": [one_or_more(LABEL), names_of(ref("text"))]}, _choices),
        "The texts to choose from; where one chooses the type of an actor, those of types, or {text: type}.",
        called="{what}",
        default_factory=dict,
    )
    doc: str = keyed(TEXT, "What it is.", default="")
    given: tuple[str, ...] = ("value",)  # the keys of the declaration, which change those of an inherited one
    # Of a part's parameter that it stands for: that parameter, its type and name, and why it gives no default.
    of: Parameter[Any] | None = None
    source: str = ""
    undecided: str = ""

    def bounds(self) -> tuple[float | None, float | None, float | None]:
        """The least value, what is below all, and the greatest, in its unit; raises ``UnitError``."""
        low, above, high = (
            None if each is None else convert(each, self.unit or "1") for each in (self.min, self.above, self.max)
        )
        if low is not None and high is not None and low > high:
            raise UnitError("min is greater than max")
        if above is not None and high is not None and above >= high:
            raise UnitError("above is not less than max")
        return low, above, high


PARAMETER = Record.of(
    ParameterText, called="{key} of {what}", type=["object", "array", "string", "number", "boolean", "null"]
)
BOUNDS = ("min", "above", "max")
_NO_PARAMETERS = {"index", *CONSTANTS, *FUNCTIONS}


def _meaning(name: str) -> str:
    """What a name means in all expressions; empty if nothing."""
    if name == "index":
        return "the index of an instance in its array"
    if iskeyword(name):
        return "a keyword, as in Python"
    return "a function" if name in FUNCTIONS else "a constant" if name in CONSTANTS else ""


def _parameter(reader: NodeReader, name: str, entry: Entry) -> ParameterText:
    """``name: value`` or ``name: {value: ..., unit: ..., min: ..., max: ..., choices: ..., doc: ...}``."""
    if meaning := _meaning(name):
        message = f"a parameter cannot be called {name!r}: in expressions, that is {meaning}"
        reader.problems.add(message, entry.key.position, f"call it {name}_, for example", kind=NOT_A_NAME)
    if not isinstance(entry.value, Mapping):
        says_nothing = is_empty(entry.value) and not (isinstance(entry.value, Scalar) and entry.value.text)
        return ParameterText(name, entry.key.position, entry.value, given=() if says_nothing else ("value",))
    what = f"parameter {name!r}"
    entries = PARAMETER.entries(reader, entry.value, what) or {}
    said = PARAMETER.values(reader, entries, what, entry.key.position)
    found = ParameterText(name, entry.key.position, **sound(said), given=tuple(entries))
    literal = found.value.value if isinstance(found.value, Scalar) else None
    other = "'choices'" if "choices" in entries else "true or false" if isinstance(literal, bool) else ""
    for key in (each for each in ("unit", *BOUNDS) if other and each in entries):
        message, place = f"{what}: {key!r} cannot be used with {other}", entries[key].key.position
        said[key] = reader.problems.add(message, place, f"leave {key!r} out")
    if POISON in said.values():
        return replace(found, value=POISON)
    if found.unit or not {type(found.min), type(found.above), type(found.max)} & {str}:  # otherwise it may be inherited
        try:
            found.bounds()
        except UnitError as error:
            at = next(key for key in BOUNDS if key in entries)
            return replace(found, value=blame(reader.problems, what, error, entries[at].value))
    return found


PARAMETERS = Reader(
    {
        **names_of(ref("parameter")),
        "propertyNames": {"pattern": f"^{NAME_PATTERN}$", "not": {"enum": sorted({*_NO_PARAMETERS, *kwlist})}},
    },
    named({}, _parameter).read,
)
PORTS = Reader({"anyOf": [one_or_more(ref("name")), names_of(ref("port_declaration"))]}, _ports)
