"""Samples: tags and tokens in order, stored as numbers where they are numbers."""

from __future__ import annotations

from array import array
from typing import Any, TypeVar

T = TypeVar("T")


class Past(list[T]):
    """Past events of a run, which no longer change: a copy of the run shares the items of the list."""


class Samples:
    """Tags, and tokens that are all floats or all ints: about 20 bytes for both, where objects take 130."""

    __slots__ = ("kind", "microsteps", "times", "tokens")

    def __init__(self) -> None:
        self.times = array("q")
        self.microsteps = array("i")
        self.tokens: Any = array("d")
        self.kind: type | None = float  # type of all tokens; None if there are others, and ``tokens`` is a list

    def add(self, time: int, microstep: int, token: Any) -> None:
        """Append a token."""
        if type(token) is not self.kind and self.kind is not None:
            self._make_room(token)
        # Ctrl-C may come between any two of these lines: a token counts once its microstep is there, which is added
        # last.
        try:
            self.tokens.append(token)
        except OverflowError:  # an int of more than 64 bits
            self.tokens = Past([*self.tokens, token])
            self.kind = None
        self.times.append(time)
        self.microsteps.append(microstep)

    def _make_room(self, token: Any) -> None:
        """Prepare for a token of a different type."""
        if type(token) is int and not self.tokens:
            self.tokens, self.kind = array("q"), int
        else:
            self.tokens, self.kind = Past(self.tokens), None
