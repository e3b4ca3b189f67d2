"""Monitors: the properties that a model file requires of its runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from epicycle.actors import Parameter, declared_parameters

from ..temporal import Requirement
from ..text.document import Entry, Mapping
from ..text.problems import POISON, Poison, Position
from ..text.reading import NodeReader
from .fields import Field, Record, about, named, node_as, ref, schema_of


@dataclass(frozen=True)
class MonitorText:
    """A property that a run must have; ``values`` are those of a ``Requirement``."""

    name: str
    values: dict[str, Entry]
    position: Position

    def place(self, key: str) -> Position:
        """Where one of its values is; its own place if that is a default."""
        return self.values[key].value.position if key in self.values else self.position


_WRITTEN = ("property", "unit", "doc", "label")  # texts, in which numbers need no quotes


def _of_monitor(key: str, parameter: Parameter[Any]) -> Field:
    schema = ref("text") if key in _WRITTEN else schema_of(parameter)
    missing = ("{what} has no property", "add 'property: always ...'") if parameter.required else ()
    return Field(node_as(schema), about(parameter), missing=missing)


MONITOR = Record(
    "A property that a run must have: its text, or this.",
    {key: _of_monitor(key, each) for key, each in declared_parameters(Requirement).items()},
    type=["object", "string"],
    required=["property"],
)


def _monitor(reader: NodeReader, name: str, entry: Entry) -> MonitorText | Poison:
    """``name: always ...`` or ``name: {property: always ..., between: linear, unit: m, doc: ...}``."""
    if not isinstance(entry.value, Mapping):
        return MonitorText(name, {"property": entry}, entry.key.position)
    entries = MONITOR.entries(reader, entry.value, f"monitor {name!r}")
    if entries is POISON:
        return POISON
    said = MONITOR.values(reader, entries, f"monitor {name!r}", entry.key.position)
    return POISON if POISON in said.values() else MonitorText(name, entries, entry.key.position)


MONITORS = named(ref("monitor"), _monitor)
