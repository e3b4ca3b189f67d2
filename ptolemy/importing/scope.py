"""The meaning of names in expressions: attributes of an entity and of everything that contains it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cached_property
from typing import Any

from .budget import spend
from .entities import Entity, Property
from .operators import java_text
from .syntax import ExpressionError, Tree, parse
from .values import CONSTANTS, evaluate

TEXTS = ("StringParameter", "FileParameter", "StringAttribute", "PortParameterString", "TextAttribute", "DateAttribute",
         "ColorAttribute", "CommitActionsAttribute", "OutputActionsAttribute", "FileOrDirectoryParameter")  # fmt: skip
_VARIABLES = ("Parameter", "Variable", "ParameterSet")
_REFERENCE = re.compile(r"\$(?:(\$)|\{([A-Za-z_][\w.]*)\}|\(((?:[^()]|\([^()]*\))+)\)|([A-Za-z_]\w*))")
MAX_DEPTH = 50


def is_text(said: Property) -> bool:
    """Whether the value is used as written, except for ``$name``."""
    return said.java.rpartition(".")[2] in TEXTS or said.text("_stringMode") == "true"


def is_variable(said: Property) -> bool:
    """Whether expressions may name it."""
    kind = said.java.rpartition(".")[2]
    return said.value is not None and (kind.endswith(_VARIABLES) or kind in ("", "Priority"))


class Scope:
    """The attributes of one entity, nested in those of its surroundings."""

    def __init__(
        self, entity: Property, around: Scope | None = None, defaults: Mapping[str, object] | None = None
    ) -> None:
        self.entity = entity
        self.around = around
        self.defaults = defaults or {}
        self._values: dict[str, object] = {}
        self._failed: dict[str, str] = {}
        self._open: set[str] = set()

    def inside(self, entity: Entity, defaults: Mapping[str, object] | None = None) -> Scope:
        """The scope of an entity inside this one."""
        return Scope(entity, self, defaults)

    def find(self, name: str) -> Property | None:
        """The attribute that a name refers to, here or further out."""
        scope: Scope | None = self
        while scope is not None:
            if (found := scope.own(name)) is not None:
                return found
            scope = scope.around
        return None

    def own(self, name: str) -> Property | None:
        """The attribute of that name here."""
        found = self.entity.properties.get(name)
        if found is not None and is_variable(found):
            return found
        return next((each.properties[name] for each in self._extending if name in each.properties), None)

    @cached_property
    def _extending(self) -> list[Property]:
        """The attributes here that extend the scope."""
        extending = ("ScopeExtendingAttribute", "ScopeExtender")
        return [each for each in self.entity.properties.values() if each.java.endswith(extending)]

    @cached_property
    def set_by_class(self) -> dict[tuple[str, str], list[Property]]:
        """The attributes with a value of everything inside, by the class of their owner and by name."""
        found: dict[tuple[str, str], list[Property]] = {}
        for each in self.entity.everything() if isinstance(self.entity, Entity) else ():
            for name, said in each.properties.items():
                if (said.value or "").strip():
                    found.setdefault((each.java, name), []).append(said)
        return found

    def home(self, name: str) -> Scope | None:
        """Where a name is declared."""
        scope: Scope | None = self
        while scope is not None:
            if scope.own(name) is not None:
                return scope
            scope = scope.around
        return None

    def __call__(self, name: str) -> object:
        """The value of a name; raises ``KeyError``, or ``ExpressionError`` if its own expression has no value."""
        scope: Scope | None = self
        while scope is not None:
            if (found := scope.own(name)) is not None:
                return scope._value(name, found)
            if name in scope.defaults:
                return scope.defaults[name]
            scope = scope.around
        raise KeyError(name)

    def _value(self, name: str, said: Property) -> object:
        if name in self._failed:
            raise ExpressionError(self._failed[name])
        if name not in self._values:
            if name in self._open or len(self._open) > MAX_DEPTH:
                raise ExpressionError(f"{name!r} is defined in terms of itself")
            self._open.add(name)
            try:
                self._values[name] = self.value_of(said)
            except ExpressionError as error:
                if len(self._open) == 1:  # otherwise it may be too deep only from where it was asked for
                    self._failed[name] = str(error)
                raise
            finally:
                self._open.discard(name)
        return self._values[name]

    def value_of(self, said: Property) -> Any:
        """The value of an attribute; raises ``ExpressionError``."""
        text = said.value or ""
        if is_text(said):
            return self.filled(text, as_is=said.java.endswith("StringAttribute"))
        return self.value(text)

    def value(self, text: str) -> Any:
        """The value of an expression; None if it is empty."""
        return evaluate(self.tree(text), self) if text.strip() else None

    def tree(self, text: str) -> Tree:
        """The expression, with ``$name`` in its texts resolved."""
        spend(1 + len(text) // 10)
        return parse(text)

    def filled(self, text: str, *, as_is: bool = False) -> str:
        """A text with its ``$name`` filled in."""
        if as_is or "$" not in text:
            return text

        def value(match: re.Match[str]) -> str:
            if match[1]:
                return "$"
            name = match[2] or match[4]
            try:
                return java_text(self(name) if name else self.value(match[3]))
            except (KeyError, ExpressionError, TypeError):
                return match[0]

        return _REFERENCE.sub(value, text)

    def is_constant(self, name: str) -> bool:
        """Whether a name is a constant of the language itself."""
        return name in CONSTANTS and self.find(name) is None
