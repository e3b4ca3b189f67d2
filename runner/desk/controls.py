"""What a person may set in a model, as fields; where a drawn wire belongs; and what is valid of a broken text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from epicycle.actors import Parameter, declared_parameters, paths

from ..model.catalogue.reference import as_written, doc_of, first_sentence, shown
from ..model.text.document import LINE_BREAK, Node, Scalar, plain
from ..model.text.document import Mapping as MappingNode
from . import parts
from .changes import sample
from .knowledge import Knowledge, as_parameter
from .names import MODEL
from .parts import EditError
from .places import value_of
from .reading import NO_TEXTS, Reading, Texts, read

_ATTEMPTS = 3


def so_far(reading: Reading, texts: Texts = NO_TEXTS) -> Reading:
    """A reading that has a model: without the lines in which the text is no YAML, if that helps."""
    tried, text = reading, dict(reading.files.values()).get(reading.path, "")
    for _ in range(_ATTEMPTS):
        at = tried.problems[0].position if tried.problems else None
        if tried.loading.model is not None or at is None or at.file != reading.name:
            break
        lines = LINE_BREAK.split(text)
        lines[at.line - 1] = ""
        text = "\n".join(lines)
        tried = read(reading.path, {**texts, reading.path.resolve(): text}, reading.types, parsed=reading.parsed)
    return reading if tried.loading.model is None else tried


# -- fields -----------------------------------------------------------------------------------------------------------


def parameters(knowledge: Knowledge) -> list[dict[str, Any]]:
    """The parameters that the model declares in this text, as fields."""
    model = knowledge.reading.loading.model
    declared, values = ({}, {}) if model is None else (model.declared, model.parameters)
    return [
        _field(
            name,
            as_parameter(declared[name], type(values.get(name))) if name in declared else None,
            value_of(entry.value, "value") if isinstance(entry.value, MappingNode) else entry.value,
            values.get(name),
        )
        for name, entry in knowledge.names.declared(MODEL, "parameter").items()
        if entry.key.position.file == knowledge.file
    ]


def fields(knowledge: Knowledge, owner: str, section: str, name: str) -> list[dict[str, Any]]:
    """The parameters of an actor or aspect, as fields."""
    entry = knowledge.names.entry(owner, section, name)
    made = knowledge.made(owner, section, name)
    made = made.aspect if section == "aspects" and made is not None else made
    known: dict[str, Parameter[Any]] = {}
    for kind in knowledge.names.types_of(owner, name):
        known |= knowledge.parameters_of(kind, section)
    return [
        _field(
            each,
            parameter,
            value_of(entry.value, each) if entry is not None else None,
            parameter.value_in(made) if made is not None and each in declared_parameters(type(made)) else None,
        )
        for each, parameter in known.items()
    ]


def _field(name: str, parameter: Parameter[Any] | None, said: Node | None, value: Any) -> dict[str, Any]:
    """A parameter: what was written, what it is, and what it may be."""
    written = "" if said is None else said.text if isinstance(said, Scalar) else parts.written(plain(said))
    found = {"name": name, "said": written, "value": "" if value is None else shown(as_written(value)), "kind": "text"}
    if parameter is None:
        return found
    return found | {
        "kind": "choice" if parameter.choices else "switch" if parameter.type is bool else "text",
        "unit": "" if parameter.unit == "1" else parameter.unit,
        "choices": list(parameter.choices),
        "doc": parameter.doc,
        "low": _finite(parameter.min),
        "high": _finite(parameter.max),
        "whole": parameter.type is int,
        "number": _finite(value),
        "computed": "${" in written,
    }


def _finite(value: Any) -> float | None:
    """A number that JSON knows."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return value if is_number and abs(value) < 1e300 else None


def aspects(knowledge: Knowledge) -> Iterator[dict[str, Any]]:
    """The aspects that the model attaches in this text, with their fields."""
    for name, entry in knowledge.names.declared(MODEL, "aspect").items():
        if entry.key.position.file != knowledge.file or value_of(entry.value, "type") is None:
            continue
        data: Any = plain(entry.value)
        yield {
            "name": name,
            "type": str(data["type"]),
            "at": parts.written(data.get("at", "")).strip('"'),
            "on": data.get("enabled") is not False,
            "fields": fields(knowledge, MODEL, "aspects", name),
        }


def types(knowledge: Knowledge) -> dict[str, list[dict[str, Any]]]:
    """All types of actors and aspects, and the values that a new one needs."""
    catalogue, _ = knowledge.catalogue.loaded()
    return {
        section: [
            {
                "name": name,
                "doc": first_sentence(doc_of(cls)),
                "needs": {
                    each.name: value
                    for each in declared_parameters(cls).values()
                    if each.required and (value := sample(each)) is not None
                },
            }
            for name, cls in known.items()
        ]
        for section, known in (("actors", catalogue.actors), ("aspects", catalogue.aspects))
    }


# -- wires ------------------------------------------------------------------------------------------------------------


def local_ends(knowledge: Knowledge, source: str, target: str) -> list[str]:
    """The class in which two ports of the graph are connected, and how it names them; raises ``EditError``.

    Ports are paths of the graph; ``[*]`` is all of an array.
    """
    graph = knowledge.graph
    if graph is None:
        raise EditError("there is no graph yet")
    owners = []
    for each in (source, target):
        first = each.replace("[*]", "[0]")
        if first not in graph.ports:
            raise EditError(f"there is no port {each}")
        owners.append((paths.parent(first), graph.direction(first)))
    (one, from_), (other, to) = owners
    # Seen from inside, tokens come from an input of the composite, and go to an output.
    scope = one if from_ == "input" else one.rpartition(".")[0]
    if scope != (other if to == "output" else other.rpartition(".")[0]):
        raise EditError(f"{source} and {target} are not in one composite")
    kind = graph.components[scope].kind if scope else MODEL
    entry = knowledge.names.entry(MODEL, "composite", kind)
    if scope and (entry is None or entry.key.position.file != knowledge.file):
        raise EditError(f"{kind} is declared in another file: change it there")
    inside = f"{scope}." if scope else ""
    return [kind, source[len(inside) :], target[len(inside) :]]
