"""What the core does all the time, and C has a shorter way for; compiled, where a compiler was there."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

nearest: Final = round  # the nearest whole number, the even one of two


_MOST: Final = 64  # words taken from the generator at once, which costs a tenth of taking them one by one


class Words:
    """Random bits, 64 at a time."""

    __slots__ = ("_ahead", "_bits", "_block")

    def __init__(self, bits: np.random.PCG64) -> None:
        self._bits = bits
        self._ahead: list[int] = []  # words that have been taken already, the next one last
        self._block = 16

    def word(self) -> int:
        """The next 64 random bits, as a number that is not negative."""
        if not self._ahead:
            self._block = min(2 * self._block, _MOST)
            self._ahead = self._bits.random_raw(self._block)[::-1].tolist()
        return self._ahead.pop()


def is_alone(thing: object) -> bool:
    """Whether nobody else holds a thing that the caller has in a variable; Python does not look."""
    return False


def empty(tokens: list[Any]) -> None:
    """Take everything out of a list."""
    tokens.clear()
