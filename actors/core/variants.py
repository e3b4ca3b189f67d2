"""The classes whose instances may stand as a part in a model: those below a base, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .errors import ParameterError
from .messages import brief, did_you_mean, nearest


def variants(base: type) -> dict[str, type]:
    """The concrete classes below ``base`` by name; a class whose name starts with '_' stays hidden."""
    found: dict[str, type] = {}
    child: type
    for child in base.__subclasses__():
        if not child.__name__.startswith("_"):
            found[child.__name__] = child
        found.update(variants(child))
    return found


# Called with a name that is no variant's: each may import a class of that name.
part_finders: list[Callable[[str], None]] = []


def found_variants(base: type, name: object) -> dict[str, type]:
    """The variants of ``base``, after a search for one of that name."""
    if isinstance(name, str) and name not in variants(base):
        for find in part_finders:
            find(name)
    return variants(base)


def variant_of(base: type, value: object) -> tuple[type, dict[str, Any]]:
    """The variant of ``base`` that a mapping names with its ``type`` key, and what else the mapping holds."""
    name = value.get("type") if isinstance(value, Mapping) else None
    known = found_variants(base, name)
    valid = ", ".join(sorted(known))
    if not isinstance(value, Mapping):
        raise ParameterError(f"{brief(value)} is not a mapping {{type: ...}} with one of the types {valid}")
    if "type" not in value:
        raise ParameterError(f"{brief(value)} has no 'type'; expected one of {valid}")
    if not isinstance(name, str) or name not in known:
        message = f"{brief(name)} is not one of {valid}{did_you_mean(str(name), known)}"
        raise ParameterError(message, ("type",), kind="type", meant=nearest(str(name), known) or "")
    return known[name], {key: item for key, item in value.items() if key != "type"}
