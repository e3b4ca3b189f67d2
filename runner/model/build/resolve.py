"""Settling parameters: a setting from outside wins over a given value, and that over the default.

What a type declares becomes an object with the values; what a composite declares, the names of its expressions.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from epicycle.actors import (
    Configurable,
    Distribution,
    InputPort,
    Parameter,
    declared_parameters,
    declared_ports,
    did_you_mean,
    nearest,
    paths,
    unknown_parameter,
    variants,
)
from epicycle.actors.expression import Budget

from ..graph.model_graph import ModelGraph
from ..language.models import CompositeText
from ..language.parts import PartText
from ..language.settings import Setting, Settings
from ..language.values import OUTSIDE, Locals, Values, advice_on
from ..text.document import Entry, Scalar
from ..text.document import Mapping as MappingNode
from ..text.files import data_file
from ..text.kinds import MISSING_PARAMETER, UNKNOWN_PARAMETER
from ..text.kinds import OUTSIDE as FROM_OUTSIDE
from ..text.limits import RAISE_IT
from ..text.patterns import TooManyError
from ..text.problems import POISON, Fix, Poison, Position, Problems, instead

T = TypeVar("T")

_INDEX = re.compile(r"\[(\d+|\*)\]")
# What users may try to set, and how to do it.
_NO_PARAMETERS = {
    "seed": "set the seed of a run with --seed",
    "stop": "set the end of a single run with --until, or give the model a parameter for it: 'stop: ${end}'",
    "count": "give the model a parameter for it: 'count: ${n}'",
    "priority": "give the model a parameter for it: 'priority: ${p}'",
    "enabled": "remove an aspect with --without, or give the model a parameter for it: 'enabled: ${on}'",
    "at": "attach an aspect elsewhere with --aspect name=Type,at=...",
}


class ParameterResolver(Values):
    """Finds the values of all parameters of a model, makes objects of them, and reports wrong ones."""

    def __init__(self, problems: Problems, settings: Settings | None = None, budget: Budget | None = None) -> None:
        super().__init__(problems, budget)
        self.settings = settings or Settings()
        self._settable: dict[str, None] = {}

    def parameters(
        self,
        path: str,
        composite: CompositeText,
        given: Mapping[str, Entry],
        outer: Mapping[str, object],
        position: Position | None,
    ) -> dict[str, object]:
        """The values of a composite's parameters: set from outside, else given, else the default."""
        names: dict[str, object] = {}
        label, valid = path or composite.name, composite.parameters
        kind = f"{label}: {composite.name}"
        given = self._as_meant(
            given, valid, lambda key: f"{kind} has no parameter {key!r}{did_you_mean(key, valid)}", path
        )
        for name, declared in valid.items():
            full = paths.join(path, name)
            node, local = declared.value, Locals(path, names, valid.keys())
            if name in given:
                node, local = given[name].value, Locals(path, outer)
            if (setting := self._setting(full)) is not None:
                node, local = setting.value, OUTSIDE
            if node is None:
                who, at = kind if path else label, position or declared.position
                names[name] = self._add_missing(who, name, (declared.doc, declared.undecided), at, path)
            else:
                names[name] = self.declared(declared, node, local, full)
        return names

    def configured(
        self,
        cls: type,
        entries: Mapping[str, Entry],
        local: Locals,
        label: str,
        position: Position,
        *,
        make: Callable[..., T] | None = None,
        path: str | None = None,
        evaluated: Mapping[str, object] = MappingProxyType({}),
    ) -> T | Poison:
        """An object of the class with the values of these entries, made by ``make``; what is wrong is reported.

        ``label`` is its name in messages, ``position`` its place.  With a ``path``, its parameters may be set from
        outside; ``evaluated`` are values that need no evaluation, or defaults.
        """
        declared = declared_parameters(cls)
        given = self._as_meant(entries, declared, lambda key: f"{label}: {unknown_parameter(cls, key)}", local.path)
        is_whole = given.keys() == entries.keys()
        chosen: dict[str, tuple[Entry, Locals]] = {}
        found: dict[str, Any] = {}
        for name, parameter in declared.items():
            setting = None if path is None else self._setting(f"{path}.{name}")
            if setting is not None:
                chosen[name] = setting, OUTSIDE
            elif name in given:
                chosen[name] = given[name], local
            if name in evaluated and setting is None:
                found[name] = evaluated[name]
            elif name in chosen:
                found[name] = self._value(parameter, *chosen[name], f"{label}.{name}")
            elif parameter.required:
                self._add_missing(f"{label}: {cls.__name__}", name, (parameter.doc,), position, local.path)
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
                    hints = _where_it_belongs(cls, label, name, found[name])
                    self.blame(f"{label}.{name}", error, entry.value, known, *hints, *advice_on(entry.value, known))
                    told = True
        if failure is not None and not told:
            written = MappingNode({name: entry for name, (entry, _) in chosen.items()}, position)
            self.blame(label, failure, written, local)
        return POISON

    def _as_meant(
        self, given: Mapping[str, Entry], valid: Collection[str], unknown: Callable[[str], str], scope: str
    ) -> dict[str, Entry]:
        """The values, with wrong names reported and corrected; otherwise they would seem to be missing as well."""
        result = {name: entry for name, entry in given.items() if name in valid}
        for name in (each for each in given if each not in valid):
            hint = f"valid parameters: {', '.join(valid) or 'none'}"
            meant, at = nearest(name, valid), given[name].key.position
            fix = None if meant is None else instead(at, name, meant)
            self.problems.add(unknown(name), at, hint, scope=scope, kind=UNKNOWN_PARAMETER, fix=fix)
            if meant is not None:
                result.setdefault(meant, given[name])
        return result

    def _add_missing(self, who: str, name: str, about: Iterable[str], position: Position, scope: str) -> Poison:
        hints = [f"{name}: {each}" for each in about if each]
        message, fix = f"{who} needs a value for {name!r}", Fix(position, "", name)
        return self.problems.add(message, position, *hints, scope=scope, kind=MISSING_PARAMETER, fix=fix)

    def _value(self, parameter: Parameter[Any], entry: Entry, local: Locals, label: str) -> Any:
        """The value of an entry; that of a file is where it is."""
        if parameter.type is not Path:
            return self.of(entry.value, local, label)

        def file(value: object) -> Path | None:
            found = parameter.convert(value)
            return None if found is None else data_file(found, entry.value.position)

        return self.converted(entry.value, local, label, file)

    def _setting(self, full: str) -> Entry | None:
        """The setting for a parameter, if there is one."""
        self._settable[full] = None
        try:
            found = self.settings.find(full)
        except TooManyError as error:
            self.problems.stop(f"{full}: {error}", self.settings.position, RAISE_IT)
        return None if found is None else Entry(Scalar(found.path, found.path, False, found.position), found.node)

    def set_from_outside(self, path: str, part: Configurable) -> dict[str, object]:
        """The new values of the parameters that are set from outside, of a part that already exists."""
        changed: dict[str, object] = {}
        for name, parameter in declared_parameters(type(part)).items():
            label = f"{path}.{name}"
            if (setting := self._setting(label)) is not None:
                value = self.converted(setting.value, OUTSIDE, label, parameter.convert)
                changed |= {} if value is POISON else {name: value}
        return changed

    def is_enabled(self, name: str, part: PartText, local: Locals) -> bool:
        """Whether an aspect is active; it is if that is unknown."""
        if part.enabled is None:
            return True
        found = self.value(part.enabled, local, f"aspect {name}.enabled")
        return found is POISON or bool(found)

    def check_unused(self, graph: ModelGraph) -> None:
        """Add a problem for every setting that no parameter took, unless it is for an array that is empty now."""
        for setting in self.settings.unused():
            if not graph.excuses(setting.path):
                self._add_unused(setting)

    def _add_unused(self, setting: Setting) -> None:
        known = list(dict.fromkeys(_in_terms_of(setting.path, path) for path in self._settable))
        owner, _, last = setting.path.rpartition(".")
        beside = [paths.name(path) for path in known if paths.parent(path) == owner]
        if last in _NO_PARAMETERS and last not in beside:
            message = f"{setting.path!r} matches no parameter"
            self.problems.add(message, setting.position, _NO_PARAMETERS[last], kind=FROM_OUTSIDE)
            return
        # One that differs only in indices, else the nearest one of the same owner, else the nearest of all.
        alike = [path for path in known if _INDEX.sub("", path) == _INDEX.sub("", setting.path)]
        meant, name = nearest(setting.path, alike), nearest(last, beside)
        if meant is None and name is not None:
            meant = paths.join(owner, name)
        meant = meant or nearest(setting.path, known)
        near = "" if meant is None else f", did you mean {meant!r}?"
        valid = (f"valid parameters {f'of {owner}' if owner else 'here'}: {', '.join(beside)}",) if beside else ()
        message = f"{setting.path!r} matches no parameter{near}"
        self.problems.add(message, setting.position, *(() if near else valid), kind=FROM_OUTSIDE)


def _where_it_belongs(cls: type, label: str, name: str, value: object) -> list[str]:
    """Which other parameters take such a part, a distribution that is given as a number, say; or what draws from it."""
    kind = value.get("type") if isinstance(value, Mapping) else None
    if not isinstance(kind, str):
        return []
    declared = declared_parameters(cls)
    bases = {each: other.type for each, other in declared.items() if each != name and isinstance(other.type, type)}
    takers = [each for each, base in bases.items() if issubclass(base, Configurable) and kind in variants(base)]
    is_number = declared[name].type in (int, float, int | float) and not declared[name].forms
    if takers or not is_number or kind not in variants(Distribution):
        return [f"{kind} is a value of {each!r}: {each}: {{type: {kind}, ...}}" for each in takers]
    source = f"{{type: Random, distribution: {{type: {kind}, ...}}}}, which draws for each of its triggers"
    if isinstance(declared_ports(cls).get(name), InputPort):
        return [f"{name!r} is one number, or comes by the input {label}.{name}: connect it to a {source}"]
    return [f"{name!r} is one number for the whole run; what varies is sent by a {source}"]


def _in_terms_of(pattern: str, path: str) -> str:
    """The path with ``[*]`` where the pattern has it or omits an index: ``a[*].b[0]`` for ``a[2].b[0]``."""
    asked, parts = pattern.split("."), path.split(".")
    for place, (wanted, part) in enumerate(zip(asked, parts, strict=False)):
        name, bracket, _ = part.partition("[")
        if bracket and (wanted == name or wanted.endswith("[*]")):
            parts[place] = f"{name}[*]"
    return ".".join(parts)
