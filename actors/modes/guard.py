"""Evaluates guards whose inputs may have no token."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from ..core import EpicycleError
from ..expression import UNDECIDED, ExpressionError, Formula, evaluate, operand


def is_true(guard: Formula, tokens: dict[str, Any]) -> bool:
    """Whether a guard holds, over the tokens by name; one that uses a name that is not among them does not."""
    try:
        found = guard.of(tokens)  # which cannot decide about what is absent
    except UNDECIDED:
        known = {name: operand(tokens[name]) for name in guard.names if name in tokens}
        try:
            found = evaluate(guard.source, _Silent(known, set(guard.names) - known.keys()))
        except _SilentError:
            return False
        except ExpressionError as error:
            if len(known) == len(guard.names):
                return bool(guard.decided(known))  # raises an error that shows the values, too
            raise EpicycleError(f"{guard.source!r}: {error}") from None
    if not isinstance(found, (bool, int, float)):
        raise EpicycleError(f"the guard {guard} gives {found!r}, which is neither true nor false")
    return bool(found)


class _SilentError(Exception):
    """A guard uses an input that has no token."""


class _Silent(dict[str, Any]):
    """Values that raise ``_SilentError`` for ``silent`` names."""

    def __init__(self, values: Mapping[str, Any], silent: Collection[str]) -> None:
        super().__init__(values)
        self._silent = silent

    def __contains__(self, name: object) -> bool:
        if name in self._silent:
            raise _SilentError
        return super().__contains__(name)
