"""What the schema says of the values of declared parameters: those of actors, aspects, figures and metrics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from epicycle.actors import MappingParameter, Parameter

from ..catalogue import as_written, is_part, shown
from .fields import EXPRESSION, Schema, computed, looks_like, ref

COMPUTED_FLAG: Schema = {"type": ["boolean", "string"], **looks_like(EXPRESSION, "expected true or false")}


def part_name(base: type) -> str:
    """What a base of parts is called in the schema."""
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
        return {}  # what a parameter with a conversion of its own takes, only the conversion knows
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
    if parameter.type is not str:  # a single text will do for a list of texts
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
