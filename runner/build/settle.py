"""Settling parameters: a setting from outside wins over a given value, and that over the default."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from epicycle.actors import (
    Configurable,
    EpicycleError,
    Parameter,
    ParameterError,
    declared_parameters,
    to_nanoseconds,
    unknown_parameter,
)

from ..catalogue import LIKE
from ..language import CompositeText, PartText, Setting, Settings, Values
from ..text import (
    RAISE_IT,
    Entry,
    Mapping,
    Node,
    Position,
    Problems,
    Sequence,
    TooManyError,
    data_file,
    describe,
    did_you_mean,
    in_general,
    nearest,
    node_of,
    raised_at,
)
from .draft import Draft

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


class Settler:
    """Finds the values of all parameters of a model, and reports wrong ones."""

    def __init__(self, settings: Settings, problems: Problems, values: Values | None = None) -> None:
        self.settings = settings
        self.problems = problems
        self.values = values or Values(problems)
        self._settable: dict[str, None] = {}
        self._wrong: set[tuple[Position, str]] = set()  # settings that are wrong for a parameter, in all of an array

    def parameters(
        self,
        path: str,
        composite: CompositeText,
        given: dict[str, Entry],
        outer: dict[str, object],
        position: Position | None,
    ) -> dict[str, object]:
        """The values of a composite's parameters: set from outside, else given, else the default."""
        names: dict[str, object] = {}
        label, valid = path or composite.name, composite.parameters
        kind = f"{label}: {composite.name}"
        given = self._as_meant(
            given, valid, path, lambda key: f"{kind} has no parameter {key!r}{did_you_mean(key, valid)}"
        )
        later: Collection[str]
        for name, declared in valid.items():
            full = f"{path}.{name}" if path else name
            node, known, later, scope = declared.value, names, valid.keys(), path
            if name in given:
                node, known, later = given[name].value, outer, ()
            if (setting := self._setting(full)) is not None:
                node, known, later, scope = setting.node, self.values.outside, (), ""
            if node is None:
                self._tell_missing(kind if path else label, name, declared.doc, position or declared.position, path)
                names[name] = self.values.missing
            else:
                value = self.values.of(node, known, full, scope, later)
                names[name] = self.values.declared(full, declared, value, node.position, scope)
                if setting is not None and names[name] is self.values.missing:
                    self._wrong.add((setting.position, in_general(full)))
        return names

    def _as_meant(
        self, given: dict[str, Entry], valid: Collection[str], path: str, unknown: Callable[[str], str]
    ) -> dict[str, Entry]:
        """The values, with wrong names reported and corrected; otherwise they would seem to be missing as well."""
        result = {name: entry for name, entry in given.items() if name in valid}
        for name in (each for each in given if each not in valid):
            hint = f"valid parameters: {', '.join(valid) or 'none'}"
            self.problems.add(unknown(name), given[name].key.position, hint, scope=path)
            if (meant := nearest(name, valid)) is not None:
                result.setdefault(meant, given[name])
        return result

    def _tell_missing(self, who: str, name: str, doc: str, position: Position, path: str) -> None:
        hints = [f"{name}: {doc}"] if doc else []
        self.problems.add(f"{who} needs a value for {name!r}", position, *hints, scope=path)

    def _setting(self, full: str) -> Setting | None:
        """The setting for a parameter, if there is one; its errors are reported for one instance of an array."""
        self._settable[full] = None
        try:
            found = self.settings.find(full)
            if found is not None and (found.position, in_general(full)) in self._wrong:
                return replace(found, node=node_of(self.values.missing, found.position))
            return found
        except TooManyError as error:
            self.problems.stop(f"{full}: {error}", self.settings.position, RAISE_IT)

    def set_from_outside(self, path: str, part: Configurable) -> dict[str, object]:
        """The new values of the parameters that are set from outside, of a part that already exists."""
        changed: dict[str, object] = {}
        for name, parameter in declared_parameters(type(part)).items():
            setting = self._setting(f"{path}.{name}")
            if setting is not None:
                label = f"{path}.{name}"
                value = converted(self.values, setting.node, self.values.outside, label, "", parameter.convert)
                changed |= {} if value is self.values.missing else {name: value}
        return changed

    def configuration(
        self,
        label: str,
        cls: type,
        given: dict[str, Entry],
        names: dict[str, object],
        position: Position,
        path: str,
    ) -> dict[str, object] | None:
        """Converted values for a Configurable class; None if some are wrong."""
        declared = declared_parameters(cls)
        before, complete = len(self.problems), True
        result: dict[str, object] = {}
        outside: dict[str, Position] = {}  # what is set from there
        given = self._as_meant(given, declared, path, lambda key: f"{label}: {unknown_parameter(cls, key)}")
        for name, parameter in declared.items():
            node, known, scope = given[name].value if name in given else None, names, path
            if (setting := self._setting(f"{path}.{name}")) is not None:
                node, known, scope = setting.node, self.values.outside, ""
                outside[name] = setting.position
            if node is None:
                if parameter.required:
                    self._tell_missing(f"{label}: {cls.__name__}", name, parameter.doc, position, path)
                continue
            value = self.values.of(node, known, f"{label}.{name}", scope)
            if value is self.values.missing:
                complete = False
                continue
            try:
                found = parameter.convert(value)
                is_file = parameter.type is Path and found is not None
                result[name] = data_file(Path(value), node.position) if is_file else found
            except ParameterError as error:
                place = place_of(node, error.keys, of_key=error.of_key)
                self.problems.add(f"{label}.{name}: {error}", place, scope=scope)
            except Exception as error:  # of a user's class
                self.blame(f"{label}.{name}", error, node.position, scope)
        self._wrong |= {(at, in_general(f"{path}.{name}")) for name, at in outside.items() if name not in result}
        return result if complete and len(self.problems) == before else None

    def is_enabled(self, name: str, scope: str, part: PartText, names: dict[str, object]) -> bool:
        """Whether an aspect is active; it is if that is unknown."""
        if part.enabled is None:
            return True
        convert = Parameter(bool).convert
        found = converted(self.values, part.enabled, names, f"aspect {name}.enabled", scope, convert)
        return found is self.values.missing or bool(found)

    def place_in(self, given: dict[str, Entry], error: Exception, position: Position) -> Position:
        """The place, if known, of a value of a part that does not fit the others."""
        if not isinstance(error, ParameterError) or not error.keys or str(error.keys[0]) not in given:
            return position
        entry = given[str(error.keys[0])]
        return (
            entry.key.position if len(error.keys) == 1 else place_of(entry.value, error.keys[1:], of_key=error.of_key)
        )

    def blame(self, label: str, error: Exception, position: Position, scope: str) -> None:
        """Report why the code of a class rejects its values, or how it failed."""
        if isinstance(error, EpicycleError):
            self.problems.add(f"{label}: {error}", position, scope=scope)
            return
        told = str(error) if isinstance(error, ValueError) else ""
        self.problems.add(
            f"{label}: {told or describe(error)}", position, scope=scope, raised=raised_at(error), cause=error
        )

    def check_unused(self, draft: Draft) -> None:
        """Add a problem for every setting that no parameter took, unless it is for an array that is empty now."""
        for setting in self.settings.unused():
            if not draft.excuses(setting.path):
                self._add_unused(setting)

    def _add_unused(self, setting: Setting) -> None:
        known = list(dict.fromkeys(_in_terms_of(setting.path, path) for path in self._settable))
        owner, _, last = setting.path.rpartition(".")
        beside = [path.rpartition(".")[2] for path in known if path.rpartition(".")[0] == owner]
        if last in _NO_PARAMETERS and last not in beside:
            self.problems.add(f"{setting.path!r} matches no parameter", setting.position, _NO_PARAMETERS[last])
            return
        # One that differs only in indices, else the nearest one of the same owner, else the nearest of all.
        alike = [path for path in known if _INDEX.sub("", path) == _INDEX.sub("", setting.path)]
        meant, name = nearest(setting.path, alike), nearest(last, beside)
        if meant is None and name is not None:
            meant = f"{owner}.{name}" if owner else name
        meant = meant or nearest(setting.path, known)
        near = "" if meant is None else f", did you mean {meant!r}?"
        valid = (f"valid parameters {f'of {owner}' if owner else 'here'}: {', '.join(beside)}",) if beside else ()
        self.problems.add(f"{setting.path!r} matches no parameter{near}", setting.position, *(() if near else valid))


def _in_terms_of(pattern: str, path: str) -> str:
    """The path with ``[*]`` where the pattern has it or omits an index: ``a[*].b[0]`` for ``a[2].b[0]``."""
    asked, parts = pattern.split("."), path.split(".")
    for place, (wanted, part) in enumerate(zip(asked, parts, strict=False)):
        name, bracket, _ = part.partition("[")
        if bracket and (wanted == name or wanted.endswith("[*]")):
            parts[place] = f"{name}[*]"
    return ".".join(parts)


def nanoseconds(duration: object) -> int:
    """A time in seconds, or a text such as ``"500 ms"``, in ns; raises ``ParameterError`` or ``ValueError``."""
    seconds: Any = Parameter(float, unit="s", min=0.0).convert(duration)
    return to_nanoseconds(seconds or 0.0)


def local_nanoseconds(start: object) -> int:
    """The same for the start of a composite's local time, which may be negative."""
    return to_nanoseconds(Parameter(float, unit="s").convert(start) or 0.0)


def drift(value: object) -> float:
    found: Any = Parameter(float, unit="1", min=1e-6, max=1e6).convert(value)
    return 1.0 if found is None else float(found)


# What may be given for a director, and how it is converted.
OF_DIRECTORS: dict[str, Callable[[Any], Any]] = {
    "start": lambda start: None if start is None else local_nanoseconds(start),
    "drift": drift,
    "like": LIKE.convert,
}


def converted(
    values: Values, node: Node, names: dict[str, object], label: str, scope: str, convert: Callable[[Any], Any]
) -> Any:
    """A value as ``convert`` makes it; ``missing``, and a problem, if that fails."""
    value = values.of(node, names, label, scope)
    if value is not values.missing:
        try:
            return convert(value)
        except ParameterError as error:
            place = place_of(node, error.keys, of_key=error.of_key)
            values.problems.add(f"{label}: {error}", place, scope=scope)
        except ValueError as error:
            values.problems.add(f"{label}: {error}", node.position, scope=scope)
    return values.missing


def place_of(node: Node, keys: tuple[str | int, ...], *, of_key: bool) -> Position:
    """Where ``keys`` lead in a value, as far as it is written out; with ``of_key``, the last key itself."""
    for number, key in enumerate(keys, start=1):
        if isinstance(node, Sequence) and isinstance(key, int):
            node = node.items[key]
            continue
        if not isinstance(node, Mapping) or key not in node.entries:
            break
        if of_key and number == len(keys):
            return node.entries[key].key.position
        node = node.entries[key].value
    return node.position
