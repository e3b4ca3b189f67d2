"""A JSON Schema of model files, disturbances and studies, made from the declared keys and types of the language.

An editor's YAML language server uses it to complete, explain and check while you type.  It sees one file at a time:
``epicycle validate`` refuses everything that it refuses, and more.  Wherever a value may be computed, a text with
``${...}`` in it passes.  Regular expressions mean the same in Python and ECMAScript.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from epicycle.actors import Configurable, declared_parameters
from epicycle.aspects import FiringTimeParameter

from ..catalogue.reference import doc_of, first_sentence, parts_of
from ..catalogue.types import Catalogue
from .dimensions import RANGE, dimension_schema
from .fields import (
    EXPRESSION,
    LABEL,
    NAME,
    Schema,
    about,
    looks_like,
    one_or_more,
    part_name,
    ref,
    schema_of,
)
from .metrics import METRIC, MONITOR
from .models import COMPOSITE, DIRECTOR, DISTURBANCE, LIBRARY, MODEL, MODEL_DIRECTOR, RUN, composite_schema
from .parts import BESIDE, RESERVED
from .places import CONNECTION, PATTERN_SCHEMA, POINTCUT, POINTCUTS_SCHEMA, PORT_SCHEMA, PORTS_SCHEMA, connection_schema
from .ports import PARAMETER, PORT
from .questions import CLAIM, GUIDELINE
from .sampling import HYPERCUBE, MORRIS_INDICES, SOBOL_INDICES
from .settings import ACT
from .study import METRIC as METRIC_OF_STUDY
from .study import STUDY, UNTIL

# The records with keys of their own, for a reference.
RECORDS = {
    "A model": MODEL,
    "A file of composite classes": LIBRARY,
    "A composite class": COMPOSITE,
    "A parameter": PARAMETER,
    "A port of a composite": PORT,
    "A director": DIRECTOR,
    "The director of the model": MODEL_DIRECTOR,
    "A connection": CONNECTION,
    "A pointcut": POINTCUT,
    "Besides the parameters of an actor or aspect": BESIDE,
    "A run": RUN,
    "A monitor": MONITOR,
    "A disturbance": DISTURBANCE,
    "An act of an aspect": ACT,
    "A study": STUDY,
    "A range": RANGE,
    "A Latin hypercube": HYPERCUBE,
    "Sobol indices": SOBOL_INDICES,
    "Morris indices": MORRIS_INDICES,
    "A metric of a study": METRIC_OF_STUDY,
    "Until": UNTIL,
    "A claim": CLAIM,
    "A guideline": GUIDELINE,
}
_WIDTH = 120
_OTHER_TYPE = rf"^({NAME}(\.{NAME})?|\$\{{{NAME}\}})$"  # a composite, a type of another package, or one that is chosen


def json_schema(
    catalogue: Catalogue, figures: Mapping[str, type[Configurable]], study_figures: Mapping[str, type[Configurable]]
) -> Schema:
    """The schema of model files, of files of composites that are included, of disturbances, and of studies."""
    types: dict[str, Mapping[str, type[Configurable]]] = {
        "actor": dict(sorted(catalogue.actors.items())),
        "aspect": dict(sorted(catalogue.aspects.items())),
        "figure": figures,
        "study_figure": study_figures,
    }
    parts = parts_of([cls for known in types.values() for cls in known.values()])
    definitions: Schema = {
        "name": {
            "type": "string",
            **looks_like(f"^{NAME}$", "a name has letters, digits and _, and does not start with a digit"),
        },
        "text": LABEL,
        "texts": one_or_more({"type": "string"}),
        "expression": {"type": "string", "pattern": EXPRESSION},
        "firing_time": schema_of(FiringTimeParameter()),
        "port": PORT_SCHEMA,
        "ports": PORTS_SCHEMA,
        "patterns": one_or_more(PATTERN_SCHEMA),
        "pointcuts": POINTCUTS_SCHEMA,
        "parameter": PARAMETER.schema,
        "connection": connection_schema(),
        "metric": METRIC.schema,
        "monitor": MONITOR.schema,
        "act": ACT.schema,
        "run": RUN.schema,
        "claim": CLAIM.schema,
        "dimension": dimension_schema(),
        "director": DIRECTOR.schema,
        "model_director": MODEL_DIRECTOR.schema,
        "composite": composite_schema(),
        "port_declaration": PORT.schema,
        "changed_actor": _changed("actor"),
        "changed_aspect": _changed("aspect"),
        "actor": _typed(types["actor"], "actor", open_to=_OTHER_TYPE),
        "aspect": {**ref("added_aspect"), "required": ["at"]},
        "added_aspect": _typed(types["aspect"], "aspect", open_to=_OTHER_TYPE),
        "whole": {"not": {"required": ["inherit"]}},
        "figure": _typed(figures, "figure"),
        "study_figure": _typed(study_figures, "study_figure"),
    }
    for kind, known in types.items():
        for name, cls in known.items():
            definitions[f"{kind}.{name}"] = _type(name, cls, kind)
    for base, variants in parts.items():
        definitions[part_name(base)] = _part(base, variants)
        for name, cls in variants.items():
            definitions[f"{part_name(base)}.{name}"] = _type(name, cls, "figure")
    _share(definitions)
    model_only = [key for key in MODEL.keys if key not in LIBRARY.keys]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Epicycle model",
        "description": "A model, a file of composite classes that models include, a disturbance, or a study.",
        "type": "object",
        "minProperties": 1,
        "if": {"required": ["study"]},
        "then": STUDY.schema,
        "else": {
            "if": {"required": ["disturbance"]},
            "then": DISTURBANCE.schema,
            "else": {
                **composite_schema(MODEL),
                # Without a name, it is a file to be included, which has only composites.
                "dependentRequired": {key: ["model"] for key in model_only if key != "model"},
            },
        },
        "$defs": definitions,
    }


def schema_text(schema: Schema) -> str:
    return _written(schema) + "\n"


def _written(value: Any, indent: int = 0) -> str:
    """A value as JSON, on one line if it is short."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if len(text) + indent <= _WIDTH or not isinstance(value, (dict, list)):
        return text
    pad = "\n" + " " * (indent + 1)
    if isinstance(value, list):
        return f"[{pad}{f',{pad}'.join(_written(each, indent + 1) for each in value)}\n{' ' * indent}]"
    entries = (f"{json.dumps(key)}: {_written(each, indent + 1)}" for key, each in value.items())
    return f"{{{pad}{f',{pad}'.join(entries)}\n{' ' * indent}}}"


def _share(definitions: Schema) -> None:
    """Let types that take the same parameter refer to one definition of it."""
    at: dict[tuple[str, str], list[Schema]] = {}
    for owner in definitions.values():
        for key, each in owner.get("properties", {}).items():
            if isinstance(each, dict) and len(each) > 1:
                at.setdefault((key, json.dumps(each)), []).append(owner["properties"])
    for (key, text), places in at.items():
        if len(places) > 1:
            number = len([each for each in definitions if each.startswith(f"given.{key}.")])
            definitions[name := f"given.{key}.{number + 1}"] = json.loads(text)
            for properties in places:
                properties[key] = ref(name)


def _beside(kind: str) -> Schema:
    """The keys besides the parameters of an actor, aspect or figure."""
    return {key: BESIDE.keys[key].schema for key in sorted(RESERVED[kind] - {"type"})}


def _changed(kind: str) -> Schema:
    """The schema of an actor or aspect in a class that extends another."""
    return {
        "type": ["object", "null"],
        "description": f"A new {kind}, changes to an inherited one, or null to remove it.",
        "properties": {"type": {"type": "string"}, **_beside(kind)},
    }


def _choice(types: Mapping[str, type]) -> Schema:
    return {"enum": list(types), "enumDescriptions": [first_sentence(doc_of(cls)) for cls in types.values()]}


def _by_type(types: Mapping[str, type], prefix: str) -> list[Schema]:
    """The conditions that depend on the type."""
    return [
        {"if": {"properties": {"type": {"const": name}}, "required": ["type"]}, "then": ref(f"{prefix}.{name}")}
        for name in types
    ]


def _typed(types: Mapping[str, type], kind: str, required: tuple[str, ...] = ("type",), *, open_to: str = "") -> Schema:
    """A mapping with a type; types other than the known ones (composites) fit the pattern ``open_to``."""
    choice = _choice(types)
    if open_to:
        choice = {"anyOf": [choice, {"type": "string", "pattern": open_to}]}
    return {
        "type": "object",
        "properties": {
            "type": {**choice, "description": f"The type of the {kind.replace('_', ' ')}."},
            **_beside(kind),
        },
        "required": list(required),
        "allOf": _by_type(types, kind),
    }


def _part(base: type, known: Mapping[str, type]) -> Schema:
    """A parameter that is a mapping with a type of its own."""
    return {
        "type": ["object", "string"],
        **looks_like(EXPRESSION, f"expected a mapping with a type, one of {', '.join(known)}"),
        "description": first_sentence(doc_of(base)),
        "properties": {"type": {"anyOf": [_choice(known), ref("expression")]}},
        "required": ["type"],
        **({"allOf": _by_type(known, part_name(base))} if known else {}),
    }


def _type(name: str, cls: type, kind: str) -> Schema:
    """What may and must be given for one type."""
    declared = declared_parameters(cls)
    required = [key for key, parameter in declared.items() if parameter.required]
    given: Schema = {"if": ref("whole"), "then": {"required": required}} if required else {}
    return {
        "description": doc_of(cls),
        "properties": {
            "type": {"const": name},
            **dict.fromkeys(_beside(kind), True),  # whose rules are where the type is
            **{key: {**schema_of(parameter), "description": about(parameter)} for key, parameter in declared.items()},
        },
        **given,
        "additionalProperties": False,
    }
