"""Metrics: the numbers that a model file computes from what ports send."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from epicycle.actors import Parameter, declared_parameters

from ..catalogue.metrics import TAKES, MetricSpec, take_fault
from ..text.document import Entry, Scalar
from ..text.kinds import CHOICE, MISSING_KEY
from ..text.problems import POISON, Poison, Position
from ..text.reading import NodeReader, Text
from .fields import AT, TEXTS, Field, Record, about, named, node_as, one_or_more, ref, schema_of
from .places import PATTERN_SCHEMA


@dataclass(frozen=True)
class MetricText:
    """A number computed from what ports send, or from other metrics; ``values`` are those of a ``MetricSpec``."""

    name: str
    ports: tuple[Text, ...]
    formula: Scalar | None
    values: dict[str, Entry]
    position: Position


def _of_metric(key: str, parameter: Parameter[Any]) -> Field:
    schema = ref("text") if key in ("unit", "to", "doc", "label") else schema_of(parameter)
    if key == "take":
        schema = {"enum": list(TAKES), "enumDescriptions": [f"{each.doc} ({each.over})" for each in TAKES.values()]}
    return Field(node_as(schema), about(parameter))


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
        **{key: _of_metric(key, each) for key, each in declared_parameters(MetricSpec).items()},
    },
    type="object",
    anyOf=[{"required": ["of"]}, {"required": ["from"]}],
)
_WITH_FORMULA = ("from", "unit", "to", "doc", "label")


def _metric(reader: NodeReader, name: str, entry: Entry) -> MetricText | Poison:
    """``name: {of: port, take: last, unit: s, doc: ...}``, or ``name: {from: delivered / sent, doc: ...}``."""
    what = f"metric {name!r}"
    entries = METRIC.entries(reader, entry.value, what)
    if entries is POISON:
        return POISON
    said = METRIC.values(reader, entries, what, entry.key.position)
    if "from" in said:
        for key in entries:
            if key not in _WITH_FORMULA:
                message = f"{what}: {key!r} cannot be used with 'from'"
                reader.problems.add(message, entries[key].key.position, f"it can have {', '.join(_WITH_FORMULA[1:])}")
        formula = entries["from"].value
        values = {key: each for key, each in entries.items() if key in _WITH_FORMULA[1:]}
        if said["from"] is POISON or not isinstance(formula, Scalar):
            return POISON
        return MetricText(name, (), formula, values, entry.key.position)
    ports = said.get("of", ())
    if ports == ():
        hint = "add 'of: actor.port', or 'from: delivered / sent' over other metrics"
        ports = reader.problems.add(f"{what} has no port", entry.key.position, hint, kind=MISSING_KEY)
    take = reader.text(said["take"], "take") if "take" in said else "last"
    if take is not POISON and (fault := take_fault(name, take)):
        take = reader.problems.add(fault.message, entries["take"].value.position, *fault.help, kind=CHOICE)
    if ports is POISON or take is POISON:
        return POISON
    return MetricText(
        name, ports, None, {key: each for key, each in entries.items() if key != "of"}, entry.key.position
    )


METRICS = named(ref("metric"), _metric)
