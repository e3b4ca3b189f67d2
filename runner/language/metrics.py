"""Metrics: the numbers that a model file computes from what ports send."""

from __future__ import annotations

from typing import Any

from epicycle.actors import Parameter, declared_parameters

from ..catalogue import TAKES, Measure, take_problem
from ..text import Entry, NodeReader
from .declarations import MetricText
from .fields import AT, Construct, Key, about, named, node_as, ref, schema_of
from .places import PATTERN_SCHEMA


def _of_metric(key: str, parameter: Parameter[Any]) -> Key:
    schema = ref("text") if key in ("unit", "to", "doc", "label") else schema_of(parameter)
    if key == "take":
        schema = {"enum": list(TAKES), "enumDescriptions": [f"{each.doc} ({each.over})" for each in TAKES.values()]}
    return Key(node_as(schema), about(parameter))


METRIC = Construct(
    "A number computed from what a port sends.",
    {
        "of": Key(
            node_as(PATTERN_SCHEMA),
            "The output port (or a pattern for several).",
            missing=("{what} has no port", "add 'of: actor.port'"),
        ),
        **{key: _of_metric(key, each) for key, each in declared_parameters(Measure).items()},
    },
    type="object",
    required=["of"],
)


def _metric(reader: NodeReader, name: str, entry: Entry) -> MetricText | None:
    """``name: {of: port, take: last, unit: s, doc: ...}``."""
    entries = METRIC.entries(reader, entry.value, f"metric {name!r}")
    if entries is None:
        return None
    said = METRIC.values(reader, entries, f"metric {name!r}", entry.key.position)
    port = AT.read(reader, said["of"], "of") if "of" in said else None
    take = reader.text(said["take"], "take") if "take" in said else "last"
    if take is not None and (problem := take_problem(name, take)):
        reader.problems.add(problem[0], entries["take"].value.position, problem[1])
    if port is None or take not in TAKES:
        return None
    return MetricText(name, port, {key: each for key, each in entries.items() if key != "of"}, entry.key.position)


METRICS = named(ref("metric"), _metric)
