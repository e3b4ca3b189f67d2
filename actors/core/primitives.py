"""Frequent operations of the core with a faster way in C; compiled if a compiler was available."""

from __future__ import annotations

from typing import Final

import numpy as np

nearest: Final = round  # the nearest whole number, of two the even one
empty: Final = list.clear

_MANY: Final = 64  # words taken from the generator at once, at a tenth of the cost of one by one


class Words:
    """Random bits, 64 at a time."""

    __slots__ = ("_ahead", "_bits")

    def __init__(self, bits: np.random.PCG64) -> None:
        self._bits = bits
        self._ahead: list[int] = []  # words taken in advance, the next one last

    def word(self) -> int:
        """The next 64 random bits, as a non-negative number."""
        if not self._ahead:
            self._ahead = self._bits.random_raw(_MANY)[::-1].tolist()
        return self._ahead.pop()


def is_alone(thing: object) -> bool:
    """Whether an object in a variable of the caller has no other reference; Python does not check."""
    return False
