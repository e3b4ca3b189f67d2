"""A JSON Schema of model files, disturbances and studies, made from what is declared: the language's keys and types.

An editor's YAML language server completes, explains and checks with it while somebody types.  It knows one file at a
time: what it refuses, ``epicycle validate`` refuses too, but not the other way round.  Wherever a value may be
computed, a text with ``${...}`` in it passes.  Regular expressions keep to what Python and ECMAScript understand alike.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from keyword import kwlist
from pathlib import Path
from typing import Any

from epicycle.actors import Actor, Configurable, MappingParameter, Parameter, declared_parameters
from epicycle.actors.expression import CONSTANTS, FUNCTIONS
from epicycle.aspects import Aspect, FiringTimeParameter

from . import declarations as language
from .catalogue import Catalogue
from .limits import NORMAL
from .measure import TAKES, Measure
from .observation import MAX_SEED
from .reference import as_written, doc_of, first_sentence, is_part, parts_of, shown
from .schema_parts import QUANTITY, TEXT, Schema, mapping, one_or_more, ref, text
from .study_schema import STUDY_RULES, claim, dimension, study

NAME = "[A-Za-z_][A-Za-z0-9_]*"
EXPRESSION = r"\$\{"
_BOUND = r"(-?[0-9]{1,9}|\$\{[^}]*\})"
_INDEX = rf"\s*(\*|{_BOUND}|{_BOUND}?\s*\.\.\s*{_BOUND}?)\s*"
_ENDPOINT = rf"({NAME}(\[{_INDEX}(,{_INDEX})*\])?\.)?{NAME}"
_LIST = rf"[\s,]*{_ENDPOINT}(\s*,[\s,]*{_ENDPOINT})*[\s,]*"
_SIDE = rf"(\s*\[{_LIST}\]\s*|{_LIST})"
CONNECTION = f"^{_SIDE}(->|=>){_SIDE}$"
_SEGMENT = rf"(\*\*|(\*|{NAME})(\[(\*|[0-9]{{1,9}})\])?)"
_PATH = rf"{_SEGMENT}(\.{_SEGMENT})*"
PATTERN = f"^{_PATH}$"
POINTCUT = rf"^\s*!?\s*{_PATH}(\s*->\s*{_PATH})?\s*$"


def json_schema(
    catalogue: Catalogue,
    figures: Mapping[str, type[Configurable]],
    study_figures: Mapping[str, type[Configurable]],
) -> Schema:
    """The schema of model files, of files of composites that are included, of disturbances, and of studies."""
    actors, aspects = dict(sorted(catalogue.actors.items())), dict(sorted(catalogue.aspects.items()))
    parts = parts_of([*actors.values(), *aspects.values(), *figures.values(), *study_figures.values()])
    definitions: Schema = {
        "name": {"type": "string", **text(f"^{NAME}$", "a name has letters, digits and _, no digit first")},
        "text": TEXT,
        "texts": one_or_more({"type": "string"}),
        "expression": {"type": "string", "pattern": EXPRESSION},
        "firing_time": _value(FiringTimeParameter()),
        "port": {
            "type": "string",
            **text(
                f"^{_ENDPOINT}$", "expected actor.port, array[*].port, array[0].port, array[1..3].port or an own port"
            ),
        },
        "ports": {"anyOf": [ref("port"), {"type": "array", "items": ref("port"), "minItems": 1}]},
        "patterns": one_or_more(_PATTERN),
        "pointcuts": one_or_more(
            {"anyOf": [_POINTCUT_TEXT, {**mapping(language.POINTCUT_KEYS, _POINTCUT, None), "type": "object"}]}
        ),
        "parameter": _parameter_declaration(),
        "connection": _connection(),
        "metric": _metric(),
        "run": mapping(language.RUN_KEYS, _RUN, "How long a run takes, and what it records."),
        "claim": claim(),
        "dimension": dimension(),
        "director": mapping(language.DIRECTOR_KEYS, _DIRECTOR, "A director of its own, with a local clock."),
        "composite": _composite(),
        "port_declaration": _port_declaration(),
        "changed_actor": _changed("actor", Actor.reserved),
        "changed_aspect": _changed("aspect", Aspect.reserved),
        "actor": _typed(actors, "actor", Actor.reserved, open_to=f"^{NAME}(\\.{NAME})?$"),
        "aspect": _typed(aspects, "aspect", Aspect.reserved, ("type", "at"), open_to=f"^{NAME}(\\.{NAME})?$"),
        "added_aspect": _typed(aspects, "aspect", Aspect.reserved, open_to=f"^{NAME}(\\.{NAME})?$"),
        "figure": _typed(figures, "figure", frozenset({"type"})),
        "study_figure": _typed(study_figures, "study_figure", frozenset({"type"})),
    }
    for kind, types, reserved in (
        ("actor", actors, Actor.reserved),
        ("aspect", aspects, Aspect.reserved),
        ("figure", figures, frozenset({"type"})),
        ("study_figure", study_figures, frozenset({"type"})),
    ):
        for name, cls in types.items():
            definitions[f"{kind}.{name}"] = _type(name, cls, reserved)
    for base, known in parts.items():
        definitions[_part_name(base)] = _part(base, known)
        for name, cls in known.items():
            definitions[f"{_part_name(base)}.{name}"] = _type(name, cls, frozenset({"type"}))
    model_only = [key for key in language.MODEL_KEYS if key not in language.LIBRARY_KEYS]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Epicycle model",
        "description": "A model, a file of composite classes that models include, a disturbance, or a study.",
        "type": "object",
        "minProperties": 1,
        "if": {"required": ["study"]},
        "then": study(),
        "else": {
            "if": {"required": ["disturbance"]},
            "then": _disturbance(),
            "else": {
                **mapping(language.MODEL_KEYS, _BODY, None),
                # Without a name it is a file to be included, which has composites only.
                "dependentRequired": {key: ["model"] for key in model_only if key != "model"},
            },
        },
        "$defs": definitions,
    }


def schema_text(schema: Schema) -> str:
    """The schema as the text of a file."""
    return json.dumps(schema, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


# -- what stands under each key of the language ---------------------------------------------------------------------


def _named(definition: str) -> Schema:
    """A mapping from names; nothing at all counts as empty."""
    return {"type": ["object", "null"], "propertyNames": ref("name"), "additionalProperties": ref(definition)}


def _number(kind: str, low: float | None = None, high: float | None = None, unit: str = "") -> Schema:
    """A number within bounds, a text with a unit, or an expression."""
    article = "an" if kind == "integer" else "a"
    found: Schema = {"type": [kind, "string"], **text(EXPRESSION, f"expected {article} {kind}")}
    if unit or kind == "number":
        where = "" if unit in ("", "1") else f" in {unit}"
        found |= text(f"{EXPRESSION}|{QUANTITY}", f"expected {article} {kind}{where}, alone or with its unit")
    for key, bound in (("minimum", low), ("maximum", high)):
        if bound is not None and math.isfinite(bound):
            found[key] = as_written(bound)
    return found


_PATTERN: Schema = {
    "type": "string",
    **text(PATTERN, "expected a port as a dotted path; * is one segment, name[*] all of an array, ** any segments"),
}
_POINTCUT_TEXT: Schema = {
    "type": "string",
    **text(POINTCUT, "expected ports or actors as a pattern, a connection 'a.out -> b.in', or one of these after a !"),
}
_FLAG: Schema = {"type": ["boolean", "string"], **text(EXPRESSION, "expected true or false")}
_BODY: dict[str, tuple[Schema, str]] = {
    "model": (ref("name"), "The name of the model."),
    "disturbance": (ref("name"), "The name of the disturbance."),
    "doc": (ref("text"), "What it shows or does."),
    "set": ({"type": ["object", "null"]}, "Values for parameters of the model: 'path: value', as for --set."),
    "include": (one_or_more({"type": "string"}), "Files of composite classes, in or below this folder."),
    "parameters": (
        {
            **_named("parameter"),
            "propertyNames": {
                "pattern": f"^{NAME}$",
                "not": {"enum": sorted({"index", *CONSTANTS, *FUNCTIONS, *kwlist})},
            },
        },
        "Parameters: 'name: value' or 'name: {value, unit, min, max, choices, doc}'.",
    ),
    "composites": (_named("composite"), "Composite classes, for the types of actors."),
    "extends": (ref("name"), "The composite class that this one takes over and changes."),
    "inputs": (
        {"anyOf": [one_or_more(ref("name")), _named("port_declaration")]},
        "The input ports: a list of names, or 'name: type' or 'name: {type, doc}'.",
    ),
    "outputs": (
        {"anyOf": [one_or_more(ref("name")), _named("port_declaration")]},
        "The output ports: a list of names, or 'name: type' or 'name: {type, doc}'.",
    ),
    "director": (ref("director"), "A director of its own: the composite fires as one actor, in local time."),
    "actors": (_named("actor"), "The actors of the graph: 'name: {type, count, <parameter>: <value>, ...}'."),
    "connections": (
        {"type": ["array", "null"], "items": ref("connection")},
        "Wires: 'actor.port -> actor.port, actor.port', '=>' for all to all; or {from, to, all, delay}.",
    ),
    "aspects": (_named("aspect"), "What is woven around ports: 'name: {type, at, enabled, <parameter>: <value>}'."),
    "run": (ref("run"), "How long a run takes, and what it records."),
    "metrics": (_named("metric"), "Numbers taken from what ports send: 'name: {of, take, after, unit, ...}'."),
    "figures": (_named("figure"), "Pictures of a run: 'name: {type, ...}'."),
}
_RUN: dict[str, tuple[Schema, str]] = {
    "stop": (_number("number", 0.0, unit="s"), "Time at which a run ends, such as 30 s."),
    "stop_when": (ref("patterns"), "Output ports that end the run when they send true or a number other than 0."),
    "seed": (_number("integer", 0, MAX_SEED), "Seed of all random streams."),
    "record": (ref("patterns"), "Output ports whose tokens are kept, as patterns."),
}
_DIRECTOR: dict[str, tuple[Schema, str]] = {
    "start": (_number("number", unit="s"), "The local time when the run begins (default: as around it)."),
    "drift": (_number("number", unit="1"), "How fast local time goes, 1 being as fast as around it."),
}
_PARAMETER: dict[str, tuple[Schema, str]] = {
    "value": ({}, "The default; without one, a value must be given."),
    "unit": (ref("text"), "What numbers count in, such as m/s; 1 for a pure number."),
    "min": ({"type": "number"}, "The smallest value."),
    "max": ({"type": "number"}, "The greatest value."),
    "choices": (one_or_more(TEXT), "The texts to choose from."),
    "doc": (ref("text"), "What it is."),
}
_CONNECTION: dict[str, tuple[Schema, str]] = {
    "from": (ref("ports"), "The sending ports."),
    "to": (ref("ports"), "The receiving ports."),
    "all": ({"type": "boolean"}, "Each to all, as with '=>'; otherwise several and several are connected in pairs."),
    "delay": (_number("number", 0.0, unit="s"), "How long a token takes, such as 100 ms; 0 is the next microstep."),
}
_PORT: dict[str, tuple[Schema, str]] = {
    "type": (ref("text"), "What travels through it, such as float, 'float | int', array[2] or a token class."),
    "doc": (ref("text"), "What it is."),
}
_POINTCUT: dict[str, tuple[Schema, str]] = {
    "at": (_POINTCUT_TEXT, "Ports or actors, as a pattern, or a connection."),
    "type": (ref("text"), "The type of the actors and composites at which, or at whose ports, it stands."),
    "tag": (ref("text"), "A tag of the actors and composites at which, or at whose ports, it stands."),
    "port": (ref("text"), "The name of the port; none: all ports where it can stand."),
    "parameter": (ref("text"), "The name of a parameter of the actors, for an aspect that alters numbers."),
    "request": (ref("text"), "For an aspect that is a composite: the input by which these tokens come in."),
    "time": (ref("firing_time"), "For a composite at actors: how long their firings take."),
}
# What stands beside the parameters of an actor, aspect or figure.
_BESIDE: dict[str, tuple[Schema, str]] = {
    "count": (_number("integer", 0, NORMAL.actors), "How many instances, name[0] to name[count - 1]; see 'index'."),
    "priority": (
        _number("integer"),
        "Of two actors that could fire at the same tag and depth, the smaller one is first.",
    ),
    "at": (
        ref("pointcuts"),
        "Where it stands: patterns of ports or actors, 'a.out -> b.in', {type, port} or {tag, port}; not at !pattern.",
    ),
    "tags": (one_or_more(ref("text")), "Names by which aspects can choose it: 'at: {tag: ...}'."),
    "enabled": (_FLAG, "Whether it does anything (default: true)."),
}


def _parameter_declaration() -> Schema:
    declared = mapping(language.PARAMETER_KEYS, _PARAMETER, None)
    return {**declared, "type": ["object", "array", "string", "number", "boolean", "null"]}


def _port_declaration() -> Schema:
    declared = mapping(language.PORT_KEYS, _PORT, "A port of a composite: its type, or {type, doc}.")
    return {**declared, "type": ["object", "string", "null"]}


def _composite() -> Schema:
    """Where a class extends another, its actors and aspects may be changes to inherited ones."""
    found = mapping(language.COMPOSITE_KEYS, _BODY, "A composite class: a graph with ports of its own.")
    for key in ("actors", "aspects"):
        found["properties"][key] = {"description": _BODY[key][1]}
    return {
        **found,
        "if": {"required": ["extends"]},
        "then": {"properties": {"actors": _named("changed_actor"), "aspects": _named("changed_aspect")}},
        "else": {"properties": {"actors": _named("actor"), "aspects": _named("aspect")}},
    }


def _disturbance() -> Schema:
    """Its aspects may take over the ports of those whose places they take."""
    found = mapping(language.DISTURBANCE_KEYS, _BODY, "Aspects in a file of their own, to be added to a model.")
    found["properties"]["aspects"] = {**_named("added_aspect"), "description": _BODY["aspects"][1]}
    return found


def _changed(kind: str, reserved: frozenset[str]) -> Schema:
    beside = {key: _beside(key) for key in sorted(reserved - {"type"})}
    return {
        "type": ["object", "null"],
        "description": f"A new {kind}, what is to change of an inherited one, or null to do without it.",
        "properties": {"type": {"type": "string"}, **beside},
    }


def _connection() -> Schema:
    declared = mapping(language.CONNECTION_KEYS, _CONNECTION, "From ports, to ports.")
    written = text(CONNECTION, "expected 'actor.port -> actor.port', with => for all to all")
    removal = {"description": "A connection of the extended class to do without.", "$ref": "#/$defs/connection"}
    return {
        **declared,
        "properties": {**declared["properties"], "remove": removal},
        "type": ["object", "string"],
        "if": {"type": "object", "required": ["remove"]},
        "then": {"maxProperties": 1},
        "else": {"required": ["from", "to"]},
        **written,
    }


def _metric() -> Schema:
    return {
        **mapping(language.METRIC_KEYS, RULES["METRIC_KEYS"], "A number taken from what a port sends."),
        "type": "object",
        "required": ["of"],
    }


# -- actors, aspects, figures and what their parameters hold --------------------------------------------------------


def _choice(types: Mapping[str, type]) -> Schema:
    return {"enum": list(types), "enumDescriptions": [first_sentence(doc_of(cls)) for cls in types.values()]}


def _by_type(types: Mapping[str, type], prefix: str) -> list[Schema]:
    """What else holds, depending on the type."""
    return [
        {
            "if": {"properties": {"type": {"const": name}}, "required": ["type"]},
            "then": ref(f"{prefix}.{name}"),
        }
        for name in types
    ]


def _typed(
    types: Mapping[str, type],
    kind: str,
    reserved: frozenset[str],
    required: tuple[str, ...] = ("type",),
    *,
    open_to: str = "",
) -> Schema:
    """A mapping with a type; types other than the known ones (composites) fit the pattern ``open_to``."""
    choice = _choice(types)
    if open_to:
        choice = {"anyOf": [choice, {"type": "string", "pattern": open_to}]}
    beside = {key: _beside(key) for key in sorted(reserved - {"type"})}
    return {
        "type": "object",
        "properties": {"type": {**choice, "description": f"The type of the {kind.replace('_', ' ')}."}, **beside},
        "required": list(required),
        "allOf": _by_type(types, kind),
    }


def _part(base: type, known: Mapping[str, type]) -> Schema:
    """A parameter that is a mapping with a type of its own."""
    return {
        "type": ["object", "string"],
        **text(EXPRESSION, f"expected a mapping with a type, one of {', '.join(known)}"),
        "description": first_sentence(doc_of(base)),
        "properties": {"type": {"anyOf": [_choice(known), ref("expression")]}},
        "required": ["type"],
        "allOf": _by_type(known, _part_name(base)),
    }


def _part_name(base: type) -> str:
    return base.__name__ if base.__module__.startswith("epicycle.") else f"{base.__module__}.{base.__name__}"


def _beside(key: str) -> Schema:
    schema, description = _BESIDE.get(key, ({}, ""))
    return {**schema, "description": description}


def _type(name: str, cls: type, reserved: frozenset[str]) -> Schema:
    """What may and must be given for one type."""
    declared = declared_parameters(cls)
    return {
        "description": doc_of(cls),
        "properties": {
            "type": {"const": name},
            **dict.fromkeys(sorted(reserved - {"type"}), True),  # whose rules stand where the type does
            **{key: {**_value(parameter), "description": _about(parameter)} for key, parameter in declared.items()},
        },
        "required": [key for key, parameter in declared.items() if parameter.required],
        "additionalProperties": False,
    }


def _value(parameter: Parameter[Any]) -> Schema:
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
        return found | text(EXPRESSION, f"expected a {parameter.describe_type()}")
    if type(parameter).convert is not Parameter.convert:
        return {}  # what a parameter with a conversion of its own takes, only the conversion knows
    if is_part(parameter):
        found = ref(_part_name(parameter.type))
        return {"anyOf": [found, {"type": "null"}]} if parameter.optional else found
    if parameter.shape is not None:
        return _array(parameter, parameter.shape)
    if parameter.choices:
        null: list[Schema] = [{"type": "null"}] if parameter.optional else []
        return {"anyOf": [{"enum": list(parameter.choices)}, ref("expression"), *null]}
    return _scalar(parameter)


def _scalar(parameter: Parameter[Any]) -> Schema:
    if parameter.type is bool:
        return dict(_FLAG)
    if parameter.type in (str, Path):
        return {"type": ["string"]}
    if parameter.type in (int, float, int | float):
        found = _number("integer" if parameter.type is int else "number", parameter.min, parameter.max, parameter.unit)
        return found if parameter.above is None else {**found, "exclusiveMinimum": as_written(parameter.above)}
    return {"type": ["array", "boolean", "number", "object", "string"]}


def _array(parameter: Parameter[Any], shape: tuple[int | None, ...]) -> Schema:
    """A list of the parameter's shape; any level of it may be an expression."""
    if not shape:
        return _scalar(parameter)
    found: Schema = {"type": ["array", "string"], "items": _array(parameter, shape[1:])}
    if parameter.type is not str:  # a single text will do for a list of texts
        found |= text(EXPRESSION, f"expected a {parameter.describe_type()}")
    if shape[0] is not None:
        found["minItems"] = found["maxItems"] = shape[0]
    return found


def _about(parameter: Parameter[Any]) -> str:
    """The doc of a parameter with its unit and default, for an editor to show."""
    facts = [parameter.describe_type()]
    if parameter.unit and parameter.unit != "1":
        facts.append(f"in {parameter.unit}")
    if not parameter.required:
        facts.append(f"default {shown(as_written(parameter.default))}")
    doc = parameter.doc[:1].upper() + parameter.doc[1:]
    return f"{doc} ({', '.join(facts)})" if doc else ", ".join(facts).capitalize()


def _metric_rules() -> dict[str, tuple[Schema, str]]:
    found = {key: (_value(each), _about(each)) for key, each in declared_parameters(Measure).items()}
    found |= {key: (ref("text"), found[key][1]) for key in ("unit", "to", "doc")}
    takes = {"enum": list(TAKES), "enumDescriptions": [f"{each.doc} ({each.over})" for each in TAKES.values()]}
    found["take"] = takes, found["take"][1]
    return {"of": (_PATTERN, "The output port (or a pattern for several)."), **found}


# A key of the language that is missing here is allowed to hold anything; a test says so.
RULES = {
    "MODEL_KEYS": _BODY,
    "COMPOSITE_KEYS": _BODY,
    "DISTURBANCE_KEYS": _BODY,
    "LIBRARY_KEYS": _BODY,
    "RUN_KEYS": _RUN,
    "DIRECTOR_KEYS": _DIRECTOR,
    "PARAMETER_KEYS": _PARAMETER,
    "CONNECTION_KEYS": _CONNECTION,
    "PORT_KEYS": _PORT,
    "POINTCUT_KEYS": _POINTCUT,
    "METRIC_KEYS": _metric_rules(),
    **STUDY_RULES,
}
