"""What schemas of files are put together from."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

Schema = dict[str, Any]

NUMBER = r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?"
QUANTITY = rf"^\s*{NUMBER}\s*([A-Za-z%°µμ1(].*)?$"

TEXT: Schema = {"type": ["string", "number", "boolean", "null"]}


def ref(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def one_or_more(item: Schema) -> Schema:
    """One, or a list; empty entries are left out."""
    return {"anyOf": [item, {"type": "array", "items": {"anyOf": [item, {"type": "null"}]}}, {"type": "null"}]}


def text(pattern: str, message: str) -> Schema:
    """What a text must look like; the message is what editors show, which would be the pattern otherwise."""
    return {"pattern": pattern, "patternErrorMessage": message}


def mapping(keys: Iterable[str], rules: dict[str, tuple[Schema, str]], doc: str | None) -> Schema:
    """A mapping with these keys and no others."""
    properties = {}
    for key in keys:
        schema, description = rules.get(key, ({}, ""))
        properties[key] = {**schema, "description": description}
    found: Schema = {"type": ["object", "null"], "properties": properties, "additionalProperties": False}
    return {"description": doc, **found} if doc else found
