"""What the language allows at a place: the JSON Schema of model files, followed along the keys that lead there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from ..model.catalogue.types import figure_types, installed, load_all
from ..model.language.schema import json_schema
from ..model.text.document import Mapping, Node, Scalar, Sequence

Schema = dict[str, Any]


@cache
def language(types: tuple[type, ...]) -> Schema:
    """The schema with all types that are installed, and others."""
    catalogue, _ = installed().with_types(types).loaded()
    return json_schema(catalogue, load_all(figure_types())[0], {})


def allowed(root: Schema, node: Node, keys: Iterable[str | int]) -> list[Schema]:
    """The schemas of the value at the end of some keys; without those that what is written rules out."""
    found, here = [root], node
    for key in keys:
        inner: Node = Scalar(None, "", True, here.position)
        if isinstance(here, Mapping) and key in here.entries:
            inner = here.entries[str(key)].value
        elif isinstance(here, Sequence) and isinstance(key, int) and key < len(here.items):
            inner = here.items[key]
        found = [below for each in applying(root, found, here) for below in _below(each, key)]
        here = inner
    return list(applying(root, found, here))


def applying(root: Schema, schemas: Iterable[Schema], node: Node) -> Iterator[Schema]:
    """Schemas and those that they consist of, as far as they apply to a node."""
    waiting = list(schemas)
    while waiting:
        each = waiting.pop(0)
        if "$ref" in each:
            own = {key: each[key] for key in ("description",) if key in each}
            waiting.append({**root["$defs"][each["$ref"].rpartition("/")[2]], **own})
            continue
        yield each
        waiting += [*each.get("allOf", ()), *each.get("anyOf", ())]
        if "if" in each:
            branch = each.get("then" if _holds(each["if"], node) else "else")
            waiting += [branch] if isinstance(branch, dict) else []


def described(schemas: Iterable[Schema]) -> str:
    """What the language says of a value."""
    return next((each["description"] for each in schemas if "description" in each), "")


def _below(schema: Schema, key: str | int) -> Iterator[Schema]:
    if isinstance(key, int):
        found = schema.get("items")
    else:
        found = schema.get("properties", {}).get(key, schema.get("additionalProperties"))
    if isinstance(found, dict):
        yield found


def _holds(condition: Schema, node: Node) -> bool:
    """Whether a node has what a condition asks for: of all its forms, those on which it depends what may be written."""
    values = {key: each.value for key, each in node.entries.items()} if isinstance(node, Mapping) else {}
    wanted = {key: each["const"] for key, each in condition.get("properties", {}).items() if "const" in each}
    return values.keys() >= set(condition.get("required", ())) and all(
        getattr(values.get(key), "value", None) == each for key, each in wanted.items()
    )
