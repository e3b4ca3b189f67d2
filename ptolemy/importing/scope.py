"""The meaning of names in expressions: attributes of an entity and of everything that contains it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from epicycle.actors.expression import text_of

from .document import Property, is_text, is_variable
from .syntax import ExpressionError, Tree, parse
from .translation import Code, Meaning, Value, meaning_of

_REFERENCE = re.compile(r"\$(?:(\$)|\{([A-Za-z_][\w.]*)\}|\(((?:[^()]|\([^()]*\))+)\)|([A-Za-z_]\w*))")
MAX_DEPTH = 50
Changes = dict[tuple[int, str], Code]  # what stands for the parameters of entities that change in a run


class Scope:
    """The attributes of one entity, nested in those of its surroundings.

    Calling it gives the value of a name before the run; raises ``KeyError``, or ``ExpressionError`` if its own
    expression has no value.
    """

    def __init__(
        self, entity: Property, around: Scope | None = None, defaults: Mapping[str, object] | None = None
    ) -> None:
        self.entity, self.around, self._defaults = entity, around, defaults or {}
        self.changes: Changes = {} if around is None else around.changes
        self._found: dict[tuple[str, bool], Meaning] = {}
        self._open: set[str] = set()

    def _outwards(self) -> Iterator[Scope]:
        scope: Scope | None = self
        while scope is not None:
            yield scope
            scope = scope.around

    def home(self, name: str) -> Scope | None:
        """Where a name is declared."""
        return next((scope for scope in self._outwards() if scope.own(name) is not None), None)

    def own(self, name: str) -> Property | None:
        """The attribute of that name here."""
        found = self.entity.properties.get(name)
        return found if found is not None and is_variable(found) else None

    # -- what names and texts mean ----------------------------------------------------------------------------------

    def __call__(self, name: str) -> Any:
        return _value(self._named(name, None, during_run=False))

    def _named(self, name: str, asking: Property | None, *, during_run: bool) -> Meaning:
        """What a name means; to the attribute that is asking, its own name means one further out."""
        for scope in self._outwards():
            if during_run and (id(scope.entity), name) in scope.changes:
                return scope.changes[id(scope.entity), name]
            if (found := scope.own(name)) is not None and found is not asking:
                return scope._attribute(name, found, during_run=during_run)
            if name in scope._defaults:
                return Value(scope._defaults[name])
        raise KeyError(name)

    def _attribute(self, name: str, said: Property, *, during_run: bool) -> Meaning:
        key = name, during_run and bool(self.changes)
        if key not in self._found:
            if name in self._open or len(self._open) > MAX_DEPTH:
                raise ExpressionError(f"{name!r} is defined in terms of itself")
            self._open.add(name)
            try:
                self._found[key] = self.meaning_of(said, during_run=during_run)
            finally:
                self._open.discard(name)
        return self._found[key]

    def meaning_of(self, said: Property, *, during_run: bool = True) -> Meaning:
        """What an attribute means in a run, or before it."""
        text = said.value or ""
        if is_text(said):
            return Value(text if said.java.endswith("StringAttribute") else self.filled(text))
        return self.meaning(text, asking=said, during_run=during_run)

    def meaning(
        self, text: str | Tree, names: Mapping[str, Meaning] | None = None, *, asking: Property | None = None,
        during_run: bool = True,
    ) -> Meaning:  # fmt: skip
        """What an expression means, in which some names have a meaning of their own; None if it is empty."""
        if isinstance(text, str) and not text.strip():
            return Value(None)
        known = names or {}

        def lookup(name: str) -> Meaning:
            return known[name] if name in known else self._named(name, asking, during_run=during_run)

        return meaning_of(parse(text) if isinstance(text, str) else text, lookup)

    def value_of(self, said: Property) -> Any:
        """The value of an attribute before the run; raises ``ExpressionError``."""
        return _value(self.meaning_of(said, during_run=False))

    def value(self, text: str) -> Any:
        """The value of an expression before the run; None if it is empty."""
        return _value(self.meaning(text, during_run=False))

    def filled(self, text: str) -> str:
        """A text with its ``$name`` filled in."""

        def value(match: re.Match[str]) -> str:
            if match[1]:
                return "$"
            name = match[2] or match[4]
            try:
                found = self(name) if name else self.value(match[3])
            except (KeyError, ExpressionError):
                return match[0]
            return match[0] if found is None else text_of(found)

        return _REFERENCE.sub(value, text)


def _value(said: Meaning) -> Any:
    if isinstance(said, Code):
        raise ExpressionError(f"{said.text} changes during the run")
    return said.value
