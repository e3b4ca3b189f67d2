"""Evaluates guards whose inputs may have no token."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from ..core import EpicycleError
from ..expression import ExpressionError, Formula, evaluate


def is_true(guard: Formula, values: Mapping[str, Any]) -> bool:
    """Whether a guard holds; one that uses a name without a value does not."""
    if len(values) == len(guard.names):
        found = guard(values)
    else:
        try:
            found = evaluate(guard.source, _Silent(values, set(guard.names) - values.keys()))
        except _SilentError:
            return False
        except ExpressionError as error:
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
