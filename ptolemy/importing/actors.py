"""Converts the actors of a file to actors of the model language, by their rows in the table of counterparts."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from epicycle.actors import ParameterError, declared_parameters
from epicycle.actors.expression import ExpressionError as OwnError
from epicycle.actors.expression import evaluate

from ..dialect import known_types
from .budget import spend
from .entities import Property, is_aside, is_text, is_variable
from .notes import Notes
from .parts import Part
from .syntax import ExpressionError, names_of, parse
from .table import UNSAID, Row, Setting
from .tables import WORDS
from .translation import Code, Kind, Meaning, Value, code_of, kind_of, named
from .variables import Changing, Variables
from .writing import plain, seconds

_TIMES = ("time", "times", "end", "once")
_OF_PATTERNS = frozenset("\\^$.|?*+()[]{}")


class Actor:
    """One actor that is being imported: its definition in the file, and its conversion."""

    def __init__(self, part: Part, row: Row, notes: Notes, variables: Variables) -> None:
        self.part, self.row, self.scope, self.path = part, row, part.scope, part.path
        self.notes, self.variables = notes, variables
        self.widths: dict[str, int] = {}  # how many channels its ports have; 0 of inputs to which nothing sends
        self.kinds: dict[str, Kind] = {}  # of what its ports receive, where that is known
        self.values: dict[str, Any] = {}  # what is written
        self.held: dict[str, object] = {}  # the initial values of our inputs that keep their latest token
        self.ports: dict[str, str] = {}  # our names for its ports that are not in the row
        self.told: set[str] = set()  # parameters that have been handled
        self.reads: dict[str, Changing] = {}  # our ports that are connected to variables

    # -- reading the file -----------------------------------------------------------------------------------------

    def said(self, name: str) -> Property | None:
        """A parameter that the file sets; None if it keeps its default."""
        found = self.part.entity.properties.get(name)
        return found if found is not None and (found.value or "").strip() else None

    def get(self, name: str, default: object = None) -> Any:
        """The value of a parameter, for decisions made during the import."""
        self.told.add(name)
        said = self.said(name)
        return default if said is None else self.part.value(said, self.notes, default)

    def text(self, name: str, default: str = "") -> str:
        """A parameter read as text, regardless of its class."""
        self.told.add(name)
        said = self.part.entity.properties.get(name)
        if said is None or said.value is None:
            return default
        return self.scope.filled(said.value.strip() if is_text(said) else self.part.entity.word(name))

    def _tell(self, tell: Callable[[str], None], said: Property, what: str = " has no counterpart") -> None:
        text = " ".join((said.value or "").split())
        tell(f"{self.path}.{said.name} = {text if len(text) <= 60 else text[:57] + '...'!r}{what}")

    # -- expressions of the table -----------------------------------------------------------------------------------

    def meaning(self, text: object) -> Meaning:
        """What an expression of the table means for this actor, over its ports and parameters."""
        if not isinstance(text, str):
            return Value(text)
        tree = parse(text)
        return self.scope.meaning(tree, {name: said for name in names_of(tree) if (said := self._operand(name))})

    def value(self, text: object) -> Any:
        """The value of an expression of the table; None if it changes in a run."""
        found = self.meaning(text)
        return found.value if isinstance(found, Value) else None

    def _operand(self, name: str) -> Meaning | None:
        """A port or parameter; one that is both holds its latest token, and the value of the parameter before."""
        defaults: Mapping[str, object] = self.row.settings.get("given", {})
        said, port = self.said(name), self.row.ports.get(name)
        self.told.add(name)
        value: Meaning | None = None
        if said is not None and (port is not None or name in defaults):
            value = self.scope.meaning_of(said)
        elif name in defaults:
            value = self.meaning(defaults[name])
        if self.widths.get(name, 0) or (value is None and port is not None):
            ours = name if port is None else port.ours
            self.ports |= {name: ours} if port is None else {}
            if value is not None:
                self.held[ours] = plain(self.get(name, self.value(defaults.get(name))))
            return named(ours, self.kinds.get(name))
        inner = {"BlockExpression": ("block", "past"), "Expression": ("time",)}.get(self.row.type, ())
        return named(name) if value is None and name in inner else None if value is None else self.following(value)

    def following(self, said: Meaning) -> Meaning:
        """An expression, over inputs that are connected to the variables in it."""
        found = self.variables.in_(said)
        for each in found:
            self.reads[each.named()], self.ports[each.named()] = each, each.named()
            self.held[each.named()] = each.first()
        return named(self.variables.text(said)) if found else said

    def expression(self, said: Meaning) -> None:
        """Make it an Expression, or a HoldingExpression if inputs hold a value.

        The text names all inputs that are fed, because a name that it does not use would not be a port.
        """
        text = code_of(said).text
        if self.row.type == "Expression":
            ours = {name: port.ours for name, port in self.row.ports.items() if port.direction == "input"}
            fed = [each for name, each in {**ours, **self.ports}.items() if self.widths.get(name, 0)]
            if left := [each for each in fed if not re.search(rf"(?<!\w){each}(?!\w)", text)]:
                text = f"[{text}, {', '.join(left)}][0]"
            self.values |= {"type": "HoldingExpression", "held": self.held} if self.held else {}
        self.values["expression"] = text

    # -- parameters -----------------------------------------------------------------------------------------------

    def convert(self, special: Mapping[str, Callable[[Actor], None]]) -> None:
        """Find the values of all parameters; ``special`` has what a row cannot express."""
        settings = self.row.settings
        if "note" in settings:
            self.notes.note(f"{self.path}: {settings['note']}")
        try:
            if "how" in settings:
                special[settings["how"]](self)
            for name, row in self.row.parameters.items():
                if name not in self.told:
                    self._parameter(name, row)
            for ours, text in settings.get("compute", {}).items():
                if (value := self.value(text)) is not None:
                    self.values[ours] = plain(value)
            if "law" in settings:
                special["law"](self)
            if "expression" in settings:
                self.expression(self.meaning(settings["expression"]))
        except (ExpressionError, ValueError, TypeError) as error:
            self.notes.error(f"{self.path}: {error}")
        for name, said in self.part.entity.properties.items():
            if name not in self.row.parameters and said.value and not is_aside(said):
                self._rest(name, said)
        given = {name: value for name, value in self.values.items() if not self._is_default(name, value)}
        self.values = {**settings.get("set", {}), **given}

    def _parameter(self, name: str, row: Setting) -> None:
        self.told.add(name)
        said = self.said(name)
        if row.kind not in ("nothing", "word"):
            self.variables.follow(self.part, row.ours, name, said)
        if row.kind == "word":
            word = self.text(name, str(row.default))
            if word.lower() not in (row.words or {}):
                self.notes.error(f"{self.path}.{name} = {word!r} has no counterpart")
            self.values[row.ours] = (row.words or {}).get(word.lower())
        elif said is None:
            if (
                row.default is not UNSAID
                and row.kind not in ("must", "same", "nothing")
                and row.ours not in self.values
            ):
                self.values[row.ours] = written(row.default, row.kind)
        elif row.kind in ("text", "pattern"):
            self.values[row.ours] = text = self.text(name)
            if row.kind == "pattern" and self.widths.get(name, 0) and name == "pattern":
                self.notes.error(f"{self.path}.{name}: regular expressions from a port have no counterpart")
            elif row.kind == "pattern" and _OF_PATTERNS & set(text):
                self.notes.error(f"{self.path}.{name} = {text!r}: regular expressions have no counterpart")
        elif row.kind != "nothing":
            try:
                found = self.scope.value_of(said)
                if row.kind not in ("must", "same"):
                    value = self._by_name(said, found, row.kind) or written(found, row.kind)
                    self.values |= {} if value is None else {row.ours: value}
                elif found != row.default:
                    self._tell(self.notes.error if row.kind == "must" else self.notes.note, said)
            except (ExpressionError, TypeError, ValueError, OverflowError) as error:
                self._tell(self.notes.error, said, f": {error}")

    def _by_name(self, said: Property, value: object, kind: str) -> str | None:
        """``${...}`` over the parameters of the model with this value; None if the values would differ."""
        own, scope = self.part.around.own_names, self.scope
        if is_text(said):
            return None
        tree = parse(said.value or "")
        used = {each for each in names_of(tree) & own.keys() if scope.own(each) in (None, said)}
        try:
            ours = scope.meaning(tree, {each: named(own[each]) for each in used}, asking=said, during_run=False)
            found = evaluate(ours.text, {own[each]: scope(each) for each in used}) if isinstance(ours, Code) else None
        except (ExpressionError, OwnError, KeyError):
            return None
        if not isinstance(ours, Code) or found != value or (kind not in _TIMES and kind_of(found) != kind_of(value)):
            return None
        self.part.around.used |= used
        return f"${{{ours.text}}}"

    def _rest(self, name: str, said: Property) -> None:
        """A parameter that is not in the row."""
        if name in self.told:
            if not self.reads and self.variables.changes(said, self.scope):
                self._tell(self.notes.note, said, " keeps its initial value")
        elif name == "_priority" or said.kind == "Priority":
            self.values["priority"] = self.get(name)
        elif name == "firingCountLimit":
            count = self.get(name)
            if isinstance(count, int) and count > 0:
                if self.row.type in ("Const", "Ramp", "Pulse"):
                    self.values["limit"] = count
                else:
                    self._tell(self.notes.note, said)
        elif name not in WORDS["parameters without effect"] and not self._is_only_named(name, said):
            self._tell(self.notes.note, said)

    def _is_only_named(self, name: str, said: Property) -> bool:
        """Whether this is an added parameter that only serves expressions of other parameters."""
        others = [each.value or "" for each in self.part.entity.properties.values() if each is not said]
        spend(len(others) // 10)
        return is_variable(said) and any(re.search(rf"(?<!\w){re.escape(name)}(?!\w)", each) for each in others)

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


def written(value: Any, kind: str) -> object:
    """A value in the form written for a parameter of this kind; None if that is to be left out."""
    if _has_nil(value):
        raise ValueError("nil cannot be written")
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    match kind:
        case "limit":
            return value if is_number and value > 0 else None
        case "end":
            return seconds(value) if is_number and value < 1e300 else None
        case "once":
            return seconds(value) if not is_number or 0 <= value < math.inf else "1e8 s"
        case "time":
            return seconds(value)
        case "times" | "list":
            return [plain(each) for each in (value if isinstance(value, list) else [value])]
        case "whole":
            return int(value)
        case "flag" if not isinstance(value, bool):
            raise ValueError("it is not a truth value")
    return plain(value)


def _has_nil(value: object) -> bool:
    if isinstance(value, (list, dict)):
        return any(map(_has_nil, value.values() if isinstance(value, dict) else value))
    return value is None
