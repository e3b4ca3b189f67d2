"""Converts the actors of a file to actors of the model language, using the table of counterparts."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import ParameterError, declared_parameters

from ..dialect import known_types
from .budget import spend
from .counterpart import UNSAID, Counterpart, ParameterSaid
from .entities import Entity, Property
from .notes import Notes
from .parts import Changing
from .relations import PortFace
from .scope import Scope, is_text, is_variable
from .syntax import ExpressionError, Tree
from .translate import translated

_LAYOUT = re.compile(
    r"vergil|\.gui\.|[iI]con|Location|Annotation|SizeAttribute|WindowProperties|VersionAttribute|TextAttribute|"
    r"Documentation|DocAttribute|GTIngredients|KeyAttribute|codegen|cgc?\.|ColorAttribute|ontolog|UserActorLibrary|"
    r"Tableau|Effigy|SingletonConfigurable|ConfigurableAttribute|HideAttribute|VisibleParameterEditor|"
    r"BackwardTypeInference|DependencyHighlighter|ModelErrorHandler|PeriodicDirectorHelper|GenerateCode|"
    r"SingletonAttribute|ProvenanceAttribute|DefaultContainer|CodeGenerat|UnitSystem"
)
_DECORATION = re.compile(
    r"\$\w*Attributes\Z|ResourceAttributes\Z|TimeAttributes\Z|DecorationParameters\Z|DecoratorAttributes"
)


_UNIMPORTANT = frozenset({
    "resetOnEachRun", "stopTimeIsLocal", "UNBOUNDED", "scaleOnLeft", "trainingMode",
})  # fmt: skip


def is_layout(said: Property) -> bool:
    """Whether an attribute only concerns a model's appearance or its authoring history."""
    return bool(_LAYOUT.search(said.java)) or (said.name.startswith("_") and said.name != "_priority")


def is_decoration(said: Property) -> bool:
    """Whether an attribute holds an aspect's settings for a port or an actor."""
    return bool(_DECORATION.search(said.java)) or said.name.startswith("DecoratorAttributesFor")


@dataclass
class Actor:
    """One actor that is being imported: its definition in the file, and its conversion."""

    entity: Entity
    path: str  # its name in messages
    scope: Scope
    notes: Notes
    row: Counterpart
    own_names: Mapping[str, str]  # parameters of the model around it, and our names for them
    full_name: str = ""  # in Java; random numbers depend on it
    seed: object = 0  # of all random actors of the model
    whole: frozenset[str] = frozenset()  # ports that are known to receive only whole numbers
    widths: Mapping[str, int] = field(default_factory=dict)  # how many channels its ports have
    values: dict[str, Any] = field(default_factory=dict)  # what is written
    ports: dict[str, str] = field(default_factory=dict)  # our names for its ports that are not in the row
    unwired: set[str] = field(default_factory=set)  # its own ports, connections to which are left out
    used: set[str] = field(default_factory=set)  # the parameters of the model that it uses
    told: set[str] = field(default_factory=set)  # parameters that have been handled
    # Makes our parameter follow an expression over variables, or the variable that the parameter ``name`` is.
    follow: Callable[[str, str, str], None] = lambda ours, text, name: None
    # Of an expression, the names that change during the run: each in terms of variables, and these variables.
    changing: Callable[[Tree], tuple[dict[str, str], dict[str, Changing]]] = lambda tree: ({}, {})
    arrays: frozenset[str] = frozenset()  # ports that receive only arrays
    reads: dict[str, Changing] = field(default_factory=dict)  # our ports that are connected to variables

    # -- reading the file -----------------------------------------------------------------------------------------

    def said(self, name: str) -> Property | None:
        """A parameter that the file sets; None if it keeps its default."""
        found = self.entity.properties.get(name)
        return found if found is not None and found.value is not None else None

    def get(self, name: str, default: object = None) -> Any:
        """The value of a parameter, for decisions made during the import."""
        self.told.add(name)
        said = self.said(name)
        if said is None or not (said.value or "").strip():
            return default
        try:
            return self.scope.value_of(said)
        except ExpressionError as error:
            self.notes.note(f"{self.path}.{name} = {said.value!r}: {error}")
            return default

    def text(self, name: str, default: str = "") -> str:
        """A parameter read as text, regardless of its class."""
        self.told.add(name)
        said = self.said(name)
        if said is None:
            return default
        text = (said.value or "").strip()
        if len(text) > 1 and text[0] == text[-1] == '"' and not is_text(said):
            text = text[1:-1]
        return self.scope.filled(text)

    # -- writing --------------------------------------------------------------------------------------------------

    def convert(self) -> None:
        """Find the values of all parameters."""
        if self.row.special is not None:
            self.row.special(self)
        for name, row in self.row.parameters.items():
            if name not in self.told:
                self._parameter(name, row)
        self._tell_fixed()
        given = {name: value for name, value in self.values.items() if not self._is_default(name, value)}
        self.values = {**self.row.fixed, **given}
        for name, said in self.entity.properties.items():
            if name in self.told or name in self.row.parameters or name in _UNIMPORTANT or not said.value:
                continue
            if is_layout(said) or is_decoration(said):
                continue
            if name == "_priority" or said.java.endswith(".Priority"):
                self.values["priority"] = self.get(name)
            elif name == "firingCountLimit":
                self._limit(name)
            elif not self._is_only_named(name, said):
                self.notes.note(f"{self.path}.{name} = {_brief(said.value or '')} has no counterpart")

    def _tell_fixed(self) -> None:
        """Report parameters that change during the run, though other values were computed from them before."""
        for name in sorted(self.told - self.row.parameters.keys()) if not self.reads else ():
            said = self.said(name)
            try:
                if said is not None and not is_text(said) and self.changing(self.scope.tree(said.value or ""))[1]:
                    self.notes.note(f"{self.path}.{name} = {_brief(said.value or '')} keeps its initial value")
            except ExpressionError:
                continue

    def _is_default(self, name: str, value: object) -> bool:
        """Whether our actor has this value by default under a director with ``like: ptolemy``."""
        kind = known_types().actors.get(self.row.type)
        parameter = None if kind is None or "type" in self.values else declared_parameters(kind).get(name)
        if parameter is None or parameter.required or (isinstance(value, str) and "${" in value):
            return False
        try:
            found = parameter.convert(value)
        except ParameterError:
            return False
        default = parameter.default_value
        return isinstance(found, (bool, int, float, str)) and type(found) is type(default) and found == default

    def _limit(self, name: str) -> None:
        """Limit the number of firings; 0 means no limit."""
        count = self.get(name)
        if isinstance(count, int) and count > 0 and self.row.type in ("Const", "Ramp", "Pulse"):
            self.values["limit"] = count
        elif isinstance(count, int) and count > 0:
            self.notes.note(f"{self.path}.{name} = {count} has no counterpart")

    def _is_only_named(self, name: str, said: Property) -> bool:
        """Whether this is an added parameter that only serves expressions of other parameters."""
        if not is_variable(said):
            return False
        spend(len(self.entity.properties) // 10)
        pattern = re.compile(rf"(?<!\w){re.escape(name)}(?!\w)")
        return any(pattern.search(other.value or "") for key, other in self.entity.properties.items() if key != name)

    def _parameter(self, name: str, row: ParameterSaid) -> None:
        self.told.add(name)
        said = self.said(name)
        if row.kind == "nothing":
            return
        self.follow(row.ours, "" if said is None or is_text(said) else said.value or "", name)
        if said is None or not (said.value or "").strip():
            if row.default is not UNSAID and self.values.get(row.ours, UNSAID) is UNSAID:
                self.values[row.ours] = written(row.default, row.kind)
            return
        if row.kind == "none":
            self.notes.note(f"{self.path}.{name} = {_brief(said.value or '')} has no counterpart")
            return
        if row.kind == "text":
            self.values[row.ours] = self.text(name)
            return
        try:
            found = self.scope.value_of(said)
            self.values[row.ours] = self._by_name(said, found, row.kind) or written(found, row.kind)
        except (ExpressionError, TypeError, ValueError, OverflowError) as error:
            self.notes.error(f"{self.path}.{name} = {_brief(said.value or '')}: {error}")

    def _by_name(self, said: Property, value: object, kind: str) -> str | None:
        """The value as an expression over the parameters of the model, if its value is the same."""
        if is_text(said) or kind not in ("value", "list", "number", "whole", "flag", "time", "times"):
            return None
        found = in_parameters(said.value or "", value, self.scope, self.own_names, is_time=kind in ("time", "times"))
        if found is None:
            return None
        text, used = found
        self.used |= used
        return text


def _kinds(value: object) -> object:
    """The types of a value and its parts."""
    return [_kinds(each) for each in value] if isinstance(value, list) else type(value)


def in_parameters(
    text: str, value: object, scope: Scope, own_names: Mapping[str, str], *, is_time: bool
) -> tuple[str, set[str]] | None:
    """``${...}`` over parameters with this value, and the parameters it uses; None if the values would differ."""
    from epicycle.actors.expression import ExpressionError as OwnError
    from epicycle.actors.expression import evaluate

    from .translate import names_of

    try:
        tree = scope.tree(text)
        used = {name for name in names_of(tree) & own_names.keys() if scope.own(name) is None}
        if not used:
            return None
        ours = translated(tree, {name: own_names[name] for name in used}, scope)
        found = evaluate(ours, {own_names[name]: scope(name) for name in used})
        if found == value and (is_time or _kinds(found) == _kinds(value)):
            return f"${{{ours}}}", used
    except (ExpressionError, OwnError, KeyError):
        pass
    return None


def written(value: Any, kind: str) -> object:
    """A value in the form written for a parameter of this kind."""
    if _has_nil(value):
        raise ValueError("nil cannot be written")
    if kind == "time":
        return seconds(value)
    if kind == "times":
        return [plain(each) for each in value]
    if kind == "list":
        return [plain(each) for each in (value if isinstance(value, list) else [value])]
    if kind == "whole":
        return int(value)
    if kind == "flag" and not isinstance(value, bool):
        raise ValueError("it is not a truth value")
    return plain(value)


def _has_nil(value: object) -> bool:
    if isinstance(value, (list, dict)):
        return any(map(_has_nil, value.values() if isinstance(value, dict) else value))
    return value is None


def plain(value: Any) -> object:
    """A value of Ptolemy's in its YAML form."""
    if isinstance(value, list):
        return [plain(each) for each in value]
    if isinstance(value, dict):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, float) and math.isnan(value):
        raise ValueError("NaN cannot be written")
    if callable(value):
        raise ValueError("a function cannot be written")
    if isinstance(value, str):
        return value.replace("${", "$${")
    return value


def seconds(value: Any) -> object:
    """A time in s, in the form in which models state it."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{value!r} is not a time")
    if math.isinf(value):
        return float(value)
    number = int(value) if float(value).is_integer() and abs(value) < 1e15 else value
    return f"{number!r} s"


def _brief(text: str) -> str:
    text = " ".join(text.split())
    return repr(text if len(text) <= 60 else text[:57] + "...")


def face_of(actor_row: Counterpart | None, entity: Entity, port: str) -> PortFace | None:
    """What wiring needs to know about an actor's port, from the table or from the file."""
    if actor_row is not None and port in actor_row.ports:
        return actor_row.ports[port].face
    said = entity.ports.get(port)
    if said is not None and (said.flag("input") or said.flag("output")):
        return PortFace("input" if said.flag("input") else "output", said.flag("multiport"))
    said_parameter = entity.properties.get(port)
    is_parameter = said_parameter is not None and said_parameter.java.endswith("PortParameter")
    row = None if actor_row is None else actor_row.parameters.get(port)
    if actor_row is not None and (is_parameter if row is None else row.kind != "nothing"):  # of a PortParameter
        return PortFace("input", False)
    return None
