"""From entries to a configured object: the values of its parameters, and everything that is wrong with them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias, TypeVar

from epicycle.actors import Configurable, Parameter, declared_parameters, nearest, unknown_parameter, variants

from ..language.values import Locals, Values
from ..text.document import Entry
from ..text.document import Mapping as MappingNode
from ..text.files import data_file
from ..text.kinds import MISSING_PARAMETER, UNKNOWN_PARAMETER
from ..text.problems import POISON, Fix, Poison, Position, Problems, instead

T = TypeVar("T")
Chosen: TypeAlias = tuple[Entry, Locals]  # a value, and what it may use
# The setting of a parameter from outside, by its name, if there is one.
SetOutside: TypeAlias = Callable[[str], Chosen | None]


def as_meant(
    given: Mapping[str, Entry],
    valid: Collection[str],
    problems: Problems,
    unknown: Callable[[str], str],
    scope: str = "",
) -> dict[str, Entry]:
    """The values, with wrong names reported and corrected; otherwise they would seem to be missing as well."""
    result = {name: entry for name, entry in given.items() if name in valid}
    for name in (each for each in given if each not in valid):
        hint = f"valid parameters: {', '.join(valid) or 'none'}"
        meant, at = nearest(name, valid), given[name].key.position
        fix = None if meant is None else instead(at, name, meant)
        problems.add(unknown(name), at, hint, scope=scope, kind=UNKNOWN_PARAMETER, fix=fix)
        if meant is not None:
            result.setdefault(meant, given[name])
    return result


def configure(
    cls: type,
    entries: Mapping[str, Entry],
    local: Locals,
    label: str,
    position: Position,
    values: Values,
    *,
    make: Callable[..., T] | None = None,
    outside: SetOutside = lambda name: None,
    evaluated: Mapping[str, object] = MappingProxyType({}),
) -> T | Poison:
    """An object of the class with the values of these entries, made by ``make``; what is wrong is reported.

    ``label`` is its name in messages, ``position`` its place.  ``outside`` gives what is set from outside;
    ``evaluated`` are values that need no evaluation, or defaults.
    """
    declared, problems = declared_parameters(cls), values.problems
    given = as_meant(entries, declared, problems, lambda key: f"{label}: {unknown_parameter(cls, key)}", local.path)
    is_whole = given.keys() == entries.keys()
    chosen: dict[str, Chosen] = {}
    found: dict[str, Any] = {}
    for name, parameter in declared.items():
        here = outside(name) or ((given[name], local) if name in given else None)
        if here is not None:
            chosen[name] = here
        if name in evaluated and (here is None or not here[1].is_outside):
            found[name] = evaluated[name]
        elif here is not None:
            found[name] = _value(parameter, *here, f"{label}.{name}", values)
        elif parameter.required:
            tell_missing(f"{label}: {cls.__name__}", name, (parameter.doc,), position, problems, local.path)
            is_whole = False
    failure = None
    if is_whole and not any(value is POISON for value in found.values()):
        try:
            return (make or cls)(**found)
        except Exception as error:  # of a user's class
            failure = error
    told = False
    for name, (entry, known) in chosen.items():
        if found[name] is not POISON:
            try:
                declared[name].convert(found[name])
            except Exception as error:
                hints = _taken_by(declared, name, found[name])
                values.blame(f"{label}.{name}", error, entry.value, known, *hints)
                told = True
    if failure is not None and not told:
        values.blame(label, failure, MappingNode({name: entry for name, (entry, _) in chosen.items()}, position), local)
    return POISON


def _taken_by(declared: Mapping[str, Parameter[Any]], name: str, value: object) -> list[str]:
    """Which other parameters take such a part: a distribution that is given as a number, say."""
    kind = value.get("type") if isinstance(value, Mapping) else None
    bases = {each: other.type for each, other in declared.items() if each != name and isinstance(other.type, type)}
    takers = [
        each
        for each, base in bases.items()
        if issubclass(base, Configurable) and isinstance(kind, str) and kind in variants(base)
    ]
    return [f"{kind} is a value of {each!r}: {each}: {{type: {kind}, ...}}" for each in takers]


def _value(parameter: Parameter[Any], entry: Entry, local: Locals, label: str, values: Values) -> Any:
    """The value of an entry; that of a file is where it is."""
    if parameter.type is not Path:
        return values.of(entry.value, local, label)

    def file(value: object) -> Path | None:
        found = parameter.convert(value)
        return None if found is None else data_file(found, entry.value.position)

    return values.converted(entry.value, local, label, file)


def tell_missing(
    who: str, name: str, about: Iterable[str], position: Position, problems: Problems, scope: str
) -> Poison:
    hints = [f"{name}: {each}" for each in about if each]
    message, fix = f"{who} needs a value for {name!r}", Fix(position, "", name)
    return problems.add(message, position, *hints, scope=scope, kind=MISSING_PARAMETER, fix=fix)
