"""Converts names of a MoML file to names of the model language, which keeps them where it can."""

from __future__ import annotations

import re
from collections.abc import Iterable
from keyword import iskeyword

from epicycle.actors.expression import CONSTANTS, FUNCTIONS

_STRANGE = re.compile(r"[^A-Za-z0-9_]+")
_WORDS = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_TAKEN = {"index", "time", "mode_time", "token", *CONSTANTS, *FUNCTIONS}


def snake(name: str) -> str:
    """``trueOutput`` as ``true_output``."""
    return _WORDS.sub("_", name).lower()


class Names:
    """The names of one namespace: each name of the file has a unique name of ours."""

    def __init__(self, taken: Iterable[str] = (), *, in_expressions: bool = False) -> None:
        self._of: dict[str, str] = {}
        self._taken = set(taken)
        self._next: dict[str, int] = {}  # the number to try first, by name
        self._in_expressions = in_expressions  # in which keywords and functions cannot be names

    def of(self, name: str) -> str:
        """Our name for a name of the file."""
        if name not in self._of:
            self._of[name] = self.fresh(name)
        return self._of[name]

    def fresh(self, name: str) -> str:
        """A similar name that is still unused."""
        base = _STRANGE.sub("_", name.strip()).strip("_") if _STRANGE.search(name) else name
        if not base or not base[0].isalpha():
            base = f"_{base}" if base[:1] != "_" else base
        if self._in_expressions and (iskeyword(base) or base in _TAKEN):
            base += "_"
        found, number = base, self._next.get(base, 2)
        while found in self._taken:
            found, number = f"{base}_{number}", number + 1
        self._next[base] = number
        self._taken.add(found)
        return found

    def take(self, name: str) -> None:
        """Reserve a name."""
        self._taken.add(name)

    def renamed(self) -> dict[str, str]:
        """The names that could not be kept."""
        return {name: ours for name, ours in self._of.items() if name != ours}
