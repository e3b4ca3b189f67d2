"""Settling parameters: a setting from outside wins over a given value, and that over the default."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from epicycle.actors import Configurable, Parameter, declared_parameters, did_you_mean, nearest, to_nanoseconds

from ..catalogue.like import LIKE
from ..graph.model_graph import ModelGraph
from ..language.models import CompositeText
from ..language.parts import PartText
from ..language.settings import Setting, Settings
from ..language.values import OUTSIDE, Locals, Values
from ..text.document import Entry, Scalar
from ..text.kinds import OUTSIDE as FROM_OUTSIDE
from ..text.limits import RAISE_IT
from ..text.patterns import TooManyError
from ..text.problems import POISON, Poison, Position, Problems
from .configure import Chosen, as_meant, configure, tell_missing

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


class ParameterResolver:
    """Finds the values of all parameters of a model, and reports wrong ones."""

    def __init__(self, settings: Settings, problems: Problems, values: Values | None = None) -> None:
        self.settings = settings
        self.problems = problems
        self.values = values or Values(problems)
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

        def unknown(key: str) -> str:
            return f"{kind} has no parameter {key!r}{did_you_mean(key, valid)}"

        given = as_meant(given, valid, self.problems, unknown, path)
        for name, declared in valid.items():
            full = f"{path}.{name}" if path else name
            node, local = declared.value, Locals(path, names, valid.keys())
            if name in given:
                node, local = given[name].value, Locals(path, outer)
            if (setting := self._setting(full)) is not None:
                node, local = setting[0].value, OUTSIDE
            if node is None:
                who, at = kind if path else label, position or declared.position
                about = (declared.doc, declared.undecided)
                names[name] = tell_missing(who, name, about, at, self.problems, path)
            else:
                names[name] = self.values.declared(declared, node, local, full)
        return names

    def _setting(self, full: str) -> Chosen | None:
        """The setting for a parameter, if there is one."""
        self._settable[full] = None
        try:
            found = self.settings.find(full)
        except TooManyError as error:
            self.problems.stop(f"{full}: {error}", self.settings.position, RAISE_IT)
        if found is None:
            return None
        return Entry(Scalar(found.path, found.path, False, found.position), found.node), OUTSIDE

    def set_from_outside(self, path: str, part: Configurable) -> dict[str, object]:
        """The new values of the parameters that are set from outside, of a part that already exists."""
        changed: dict[str, object] = {}
        for name, parameter in declared_parameters(type(part)).items():
            label = f"{path}.{name}"
            if (setting := self._setting(label)) is not None:
                value = self.values.converted(setting[0].value, OUTSIDE, label, parameter.convert)
                changed |= {} if value is POISON else {name: value}
        return changed

    def configured(self, cls: type, part: PartText, local: Locals, label: str, make: Callable[..., T]) -> T | Poison:
        """An object of the class with the values of a part."""
        return configure(
            cls,
            part.values,
            local,
            label,
            part.position,
            self.values,
            make=make,
            outside=lambda name: self._setting(f"{local.path}.{name}"),
        )

    def is_enabled(self, name: str, part: PartText, local: Locals) -> bool:
        """Whether an aspect is active; it is if that is unknown."""
        if part.enabled is None:
            return True
        found = self.values.value(part.enabled, local, f"aspect {name}.enabled")
        return found is POISON or bool(found)

    def check_unused(self, graph: ModelGraph) -> None:
        """Add a problem for every setting that no parameter took, unless it is for an array that is empty now."""
        for setting in self.settings.unused():
            if not graph.excuses(setting.path):
                self._add_unused(setting)

    def _add_unused(self, setting: Setting) -> None:
        known = list(dict.fromkeys(_in_terms_of(setting.path, path) for path in self._settable))
        owner, _, last = setting.path.rpartition(".")
        beside = [path.rpartition(".")[2] for path in known if path.rpartition(".")[0] == owner]
        if last in _NO_PARAMETERS and last not in beside:
            message = f"{setting.path!r} matches no parameter"
            self.problems.add(message, setting.position, _NO_PARAMETERS[last], kind=FROM_OUTSIDE)
            return
        # One that differs only in indices, else the nearest one of the same owner, else the nearest of all.
        alike = [path for path in known if _INDEX.sub("", path) == _INDEX.sub("", setting.path)]
        meant, name = nearest(setting.path, alike), nearest(last, beside)
        if meant is None and name is not None:
            meant = f"{owner}.{name}" if owner else name
        meant = meant or nearest(setting.path, known)
        near = "" if meant is None else f", did you mean {meant!r}?"
        valid = (f"valid parameters {f'of {owner}' if owner else 'here'}: {', '.join(beside)}",) if beside else ()
        message = f"{setting.path!r} matches no parameter{near}"
        self.problems.add(message, setting.position, *(() if near else valid), kind=FROM_OUTSIDE)


def _in_terms_of(pattern: str, path: str) -> str:
    """The path with ``[*]`` where the pattern has it or omits an index: ``a[*].b[0]`` for ``a[2].b[0]``."""
    asked, parts = pattern.split("."), path.split(".")
    for place, (wanted, part) in enumerate(zip(asked, parts, strict=False)):
        name, bracket, _ = part.partition("[")
        if bracket and (wanted == name or wanted.endswith("[*]")):
            parts[place] = f"{name}[*]"
    return ".".join(parts)


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
