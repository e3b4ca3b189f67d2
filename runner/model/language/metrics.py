"""Metrics and monitors: what a model file computes from what ports send, and the properties that it requires of it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from epicycle.actors import Configurable, declared_parameters

from ..catalogue.metrics import TAKES, MetricSpec, take_fault
from ..temporal import Requirement
from ..text.document import Entry, Mapping, Scalar
from ..text.kinds import CHOICE, MISSING_KEY
from ..text.problems import POISON, Poison, Position
from ..text.reading import NodeReader, Text
from .fields import AT, TEXTS, Field, Record, about, named, node_as, one_or_more, ref, schema_of
from .places import PATTERN_SCHEMA


@dataclass(frozen=True)
class WatchText:
    """A metric or a monitor; ``values`` are those of a ``MetricSpec``, or of a ``Requirement``.

    A metric has ``ports``, or a ``formula`` over other metrics.
    """

    name: str
    values: dict[str, Entry]
    position: Position
    ports: tuple[Text, ...] = ()
    formula: Scalar | None = None

    def place(self, key: str) -> Position:
        """Where one of its values is; its own place if that is a default."""
        return self.values[key].value.position if key in self.values else self.position


def _options(declaration: type[Configurable], texts: Collection[str]) -> dict[str, Field]:
    """A key for each parameter of a declaration; in ``texts``, numbers need no quotes."""
    return {
        key: Field(
            node_as(ref("text") if key in texts else schema_of(each)),
            about(each),
            missing=("{what} has no {key}", "add 'property: always ...'") if each.required else (),
        )
        for key, each in declared_parameters(declaration).items()
    }


_TAKES = {"enum": list(TAKES), "enumDescriptions": [f"{each.doc} ({each.over})" for each in TAKES.values()]}
_SHOWN = ("unit", "to", "doc", "label")
_OF_METRICS = _options(MetricSpec, _SHOWN)
METRIC = Record(
    "A number computed from what ports send, or from other metrics.",
    {
        "of": Field(
            TEXTS.described(one_or_more(PATTERN_SCHEMA)),
            "The output port, a pattern for several, or a list of these.",
        ),
        "from": Field(
            AT,
            "An expression over other metrics, such as 'delivered / sent', with '${...}' for values of the model.",
        ),
        **_OF_METRICS,
        "take": Field(node_as(_TAKES), _OF_METRICS["take"].doc),
    },
    type="object",
    anyOf=[{"required": ["of"]}, {"required": ["from"]}],
)
MONITOR = Record(
    "A property that a run must have: its text, or this.",
    _options(Requirement, ("property", "unit", "doc", "label")),
    type=["object", "string"],
    required=["property"],
)


def _metric(reader: NodeReader, name: str, entry: Entry) -> WatchText | Poison:
    """``name: {of: port, take: last, unit: s, doc: ...}``, or ``name: {from: delivered / sent, doc: ...}``."""
    what, at = f"metric {name!r}", entry.key.position
    entries = METRIC.entries(reader, entry.value, what)
    if entries is POISON:
        return POISON
    said = METRIC.values(reader, entries, what, at)
    if "from" in said:
        for key in entries:
            if key not in ("from", *_SHOWN):
                message = f"{what}: {key!r} cannot be used with 'from'"
                reader.problems.add(message, entries[key].key.position, f"it can have {', '.join(_SHOWN)}")
        formula = entries["from"].value
        if said["from"] is POISON or not isinstance(formula, Scalar):
            return POISON
        return WatchText(name, {key: each for key, each in entries.items() if key in _SHOWN}, at, formula=formula)
    ports = said.get("of", ())
    if ports == ():
        hint = "add 'of: actor.port', or 'from: delivered / sent' over other metrics"
        ports = reader.problems.add(f"{what} has no port", at, hint, kind=MISSING_KEY)
    take = reader.text(said["take"], "take") if "take" in said else "last"
    if take is not POISON and (fault := take_fault(name, take)):
        take = reader.problems.add(fault.message, entries["take"].value.position, *fault.help, kind=CHOICE)
    if ports is POISON or take is POISON:
        return POISON
    return WatchText(name, {key: each for key, each in entries.items() if key != "of"}, at, ports)


def _monitor(reader: NodeReader, name: str, entry: Entry) -> WatchText | Poison:
    """``name: always ...`` or ``name: {property: always ..., between: linear, unit: m, doc: ...}``."""
    at = entry.key.position
    if not isinstance(entry.value, Mapping):
        return WatchText(name, {"property": entry}, at)
    entries = MONITOR.entries(reader, entry.value, f"monitor {name!r}")
    if entries is POISON or POISON in MONITOR.values(reader, entries, f"monitor {name!r}", at).values():
        return POISON
    return WatchText(name, entries, at)


METRICS, MONITORS = named(ref("metric"), _metric), named(ref("monitor"), _monitor)
