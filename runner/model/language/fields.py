"""How the language is declared: readers of values, fields, and records of these.

A key of the language is declared once.  The reading of its value, the messages about a wrong, unknown or missing one,
and the JSON Schema follow from that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from epicycle.actors import FaultError, MappingParameter, Parameter, to_nanoseconds

from ..catalogue.reference import as_written, is_part, shown
from ..text.document import Entry, Node, Scalar
from ..text.faults import blame
from ..text.kinds import MISSING_KEY
from ..text.problems import POISON, Poison, Position
from ..text.reading import NodeReader, is_empty

Schema: TypeAlias = dict[str, Any]
T = TypeVar("T")

NAME = "[A-Za-z_][A-Za-z0-9_]*"
EXPRESSION = r"\$\{"
NUMBER = r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?"
QUANTITY = rf"^\s*{NUMBER}\s*([A-Za-z%°µμ1(].*)?$"


# -- schemas ------------------------------------------------------------------------------------------------------


def ref(name: str) -> Schema:
    """A reference to a name in ``$defs``."""
    return {"$ref": f"#/$defs/{name}"}


def looks_like(pattern: str, message: str) -> Schema:
    """What a text must look like; editors show the message instead of the pattern."""
    return {"pattern": pattern, "patternErrorMessage": message}


def one_or_more(item: Schema) -> Schema:
    """One, or a list; empty entries are left out."""
    return {"anyOf": [item, {"type": "array", "items": {"anyOf": [item, {"type": "null"}]}}, {"type": "null"}]}


def names_of(item: Schema) -> Schema:
    """A mapping from names; no value counts as empty."""
    return {"type": ["object", "null"], "propertyNames": ref("name"), "additionalProperties": item}


def computed(kind: str, low: float | None = None, high: float | None = None, unit: str = "") -> Schema:
    """A number within bounds, a text with a unit, or an expression."""
    article = "an" if kind == "integer" else "a"
    found: Schema = {"type": [kind, "string"], **looks_like(EXPRESSION, f"expected {article} {kind}")}
    if unit or kind == "number":
        where = "" if unit in ("", "1") else f" in {unit}"
        found |= looks_like(f"{EXPRESSION}|{QUANTITY}", f"expected {article} {kind}{where}, alone or with its unit")
    for key, bound in (("minimum", low), ("maximum", high)):
        if bound is not None and math.isfinite(bound):
            found[key] = as_written(bound)
    return found


# -- readers ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reader:
    """What a value may be.

    ``read`` takes a reader, a node and its name in messages; it returns the value, ``POISON`` if it is wrong, or None
    if there is none.
    """

    schema: Schema
    read: Callable[[Any, Node, str], Any]

    def described(self, schema: Schema) -> Reader:
        """The same with another schema."""
        return Reader(schema, self.read)


def _flag(reader: NodeReader, node: Node, what: str) -> bool | Poison:
    if isinstance(node, Scalar) and isinstance(node.value, bool):
        return node.value
    return reader.problems.add(f"{what} is neither true nor false", node.position)


def node_as(schema: Schema) -> Reader:
    """A node as it is: one of the values of a part, which are read when its class is known."""
    return Reader(schema, lambda reader, node, what: node)


@dataclass(frozen=True)
class Computed:
    """A value that may be an expression, and how it is converted once it is known."""

    node: Node
    convert: Callable[[Any], Any]

    @property
    def position(self) -> Position:
        return self.node.position


def computed_as(
    parameter: Parameter[Any], convert: Callable[[Any], Any] | None = None, schema: Schema | None = None
) -> Reader:
    """A value like that of a parameter, which may be computed; ``convert`` makes something else of it."""
    conversion = convert or parameter.convert
    return Reader(schema or _scalar(parameter), lambda reader, node, what: Computed(node, conversion))


def nanoseconds(duration: object) -> int:
    """A time in seconds, or a text such as ``"500 ms"``, in ns; raises ``ParameterError`` or ``ValueError``."""
    seconds: Any = TIME.convert(duration)
    return to_nanoseconds(seconds or 0.0)


TIME = Parameter(float, unit="s", min=0.0)


def number(kind: type, low: float | None = None, high: float | None = None) -> Reader:
    """A number that is written out."""
    parameter: Parameter[Any] = Parameter(kind, min=low, max=high)
    schema: Schema = {"type": "integer" if kind is int else "number"}
    schema |= {key: as_written(bound) for key, bound in (("minimum", low), ("maximum", high)) if bound is not None}

    def read(reader: NodeReader, node: Node, what: str) -> Any:
        try:
            return parameter.convert(node.value if isinstance(node, Scalar) else "a list")
        except FaultError as error:
            return blame(reader.problems, what, error, node)

    return Reader(schema, read)


def named(schema: Schema, read: Callable[[Any, str, Entry], Any]) -> Reader:
    """A mapping from names to things, each read with its name; those that are wrong are left out."""

    def read_all(reader: NodeReader, node: Node, what: str) -> dict[str, Any] | Poison:
        entries = reader.named(node, what)
        return POISON if entries is POISON else sound({name: read(reader, name, entry) for name, entry in entries})

    return Reader(names_of(schema), read_all)


QUANTITY_SCHEMA: Schema = {
    "type": ["number", "string"],
    **looks_like(QUANTITY, "expected a number, alone or with its unit"),
}
LABEL: Schema = {"type": ["string", "number", "boolean", "null"]}  # any single value, taken as it is written
TEXT = Reader(ref("text"), NodeReader.text)
NAMED = Reader(ref("name"), NodeReader.name)
AT = Reader(ref("text"), NodeReader.placed)
TEXTS = Reader(one_or_more({"type": "string"}), NodeReader.texts)
FLAG = Reader({"type": "boolean"}, _flag)


def sound(found: Mapping[str, T | Poison]) -> dict[str, T]:
    """What is not wrong."""
    return {name: each for name, each in found.items() if each is not POISON}


# -- records ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Field:
    """A key of a record: the reader of its value, and what it means.

    ``called`` is the name of the value in messages, and ``missing`` the message and advice if there is none; in both,
    ``{what}`` is the record and ``{key}`` the key.  ``name`` is the attribute of the resulting object, if it differs
    from the key.
    """

    shape: Reader
    doc: str
    called: str = "{key}"
    missing: tuple[str, ...] = ()
    name: str = ""

    @property
    def schema(self) -> Schema:
        return {**self.shape.schema, "description": self.doc}


def keyed(
    shape: Reader, doc: str, *, key: str = "", called: str = "", missing: tuple[str, ...] = (), **default: Any
) -> Any:
    """A field of a declaration that is a key of the language, with its name unless ``key`` is another."""
    return field(metadata={"key": (key, Field(shape, doc, called, missing))}, **default)


class Record:
    """A mapping with these keys and no others; ``rules`` are further conditions in its schema."""

    def __init__(self, doc: str, keys: Mapping[str, Field], **rules: Any) -> None:
        self.doc = doc
        self.keys = dict(keys)
        self.rules = rules

    @classmethod
    def of(cls, declaration: type, doc: str = "", called: str = "{key}", **rules: Any) -> Record:
        """The mapping from which a declaration is read, by the keys that its fields say.

        ``called`` is what values are called that have no name of their own in messages.
        """
        keys: dict[str, Field] = {}
        for each in fields(declaration):
            if "key" in each.metadata:
                name, said = each.metadata["key"]
                keys[name or each.name] = replace(said, name=each.name, called=said.called or called)
        return cls(doc, keys, **rules)

    @property
    def schema(self) -> Schema:
        properties = {key: each.schema for key, each in self.keys.items()}
        found: Schema = {"type": ["object", "null"], "properties": properties, "additionalProperties": False}
        return {**({"description": self.doc} if self.doc else {}), **found, **self.rules}

    def entries(self, reader: NodeReader, node: Node, what: str) -> dict[str, Entry] | Poison:
        """The entries under its keys, unknown keys reported."""
        return reader.entries(node, what, tuple(self.keys))

    def values(self, reader: NodeReader, entries: Mapping[str, Entry], what: str, at: Position) -> dict[str, Any]:
        """The values of its keys, by attribute, with ``POISON`` for those that are wrong or missing, as told ``at``."""
        found = {}
        for key, each in self.keys.items():
            if key in entries and not (each.missing and is_empty(entries[key].value)):
                value = each.shape.read(reader, entries[key].value, each.called.format(what=what, key=key))
                if value is not None:
                    found[each.name or key] = value
            elif each.missing:
                message, *hints = (said.format(what=what, key=key) for said in each.missing)
                found[each.name or key] = reader.problems.add(message, at, *hints, kind=MISSING_KEY)
        return found

    def read(self, reader: NodeReader, node: Node, what: str, at: Position | None = None) -> dict[str, Any] | Poison:
        """The values in a node, by attribute."""
        entries = self.entries(reader, node, what)
        return POISON if entries is POISON else self.values(reader, entries, what, at or node.position)


COMPUTED_FLAG: Schema = {"type": ["boolean", "string"], **looks_like(EXPRESSION, "expected true or false")}


def part_name(base: type) -> str:
    """The name of a base of parts in the schema."""
    return base.__name__ if base.__module__.startswith("epicycle.") else f"{base.__module__}.{base.__name__}"


def schema_of(parameter: Parameter[Any]) -> Schema:
    """What may be given for a parameter."""
    found = _plain_value(parameter)
    if parameter.optional and "type" in found:
        found["type"] = [*found["type"], "null"]
    if not parameter.required and parameter.default is not None:
        found["default"] = as_written(parameter.default)
    return found


def _plain_value(parameter: Parameter[Any]) -> Schema:
    if parameter.forms:
        return {"anyOf": [_plain_value(form) for form in parameter.forms]}
    if isinstance(parameter, MappingParameter):
        found = {"type": ["object", "string"], "additionalProperties": _plain_value(parameter.item)}
        return found | looks_like(EXPRESSION, f"expected a {parameter.describe_type()}")
    if type(parameter).convert is not Parameter.convert:
        return {}  # only the conversion knows what a parameter with its own conversion takes
    if is_part(parameter):
        found = ref(part_name(parameter.type))
        return {"anyOf": [found, {"type": "null"}]} if parameter.optional else found
    if parameter.shape is not None:
        return _array(parameter, parameter.shape)
    if parameter.choices:
        null: list[Schema] = [{"type": "null"}] if parameter.optional else []
        return {"anyOf": [{"enum": list(parameter.choices)}, ref("expression"), *null]}
    return _scalar(parameter)


def _scalar(parameter: Parameter[Any]) -> Schema:
    if parameter.type is bool:
        return dict(COMPUTED_FLAG)
    if parameter.type in (str, Path):
        return {"type": ["string"]}
    if parameter.type in (int, float, int | float):
        found = computed("integer" if parameter.type is int else "number", parameter.min, parameter.max, parameter.unit)
        return found if parameter.above is None else {**found, "exclusiveMinimum": as_written(parameter.above)}
    return {"type": ["array", "boolean", "number", "object", "string"]}


def _array(parameter: Parameter[Any], shape: tuple[int | None, ...]) -> Schema:
    """A list of the parameter's shape; any level of it may be an expression."""
    if not shape:
        return _scalar(parameter)
    found: Schema = {"type": ["array", "string"], "items": _array(parameter, shape[1:])}
    if parameter.type is not str:  # a single text may replace a list of texts
        found |= looks_like(EXPRESSION, f"expected a {parameter.describe_type()}")
    if shape[0] is not None:
        found["minItems"] = found["maxItems"] = shape[0]
    return found


def about(parameter: Parameter[Any]) -> str:
    """The doc of a parameter with its unit and default, for an editor to show."""
    facts = [parameter.describe_type()]
    if parameter.unit and parameter.unit != "1":
        facts.append(f"in {parameter.unit}")
    if not parameter.required:
        facts.append(f"default {shown(as_written(parameter.default))}")
    doc = parameter.doc[:1].upper() + parameter.doc[1:]
    return f"{doc} ({', '.join(facts)})" if doc else ", ".join(facts).capitalize()
