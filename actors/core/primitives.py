"""What the core does all the time, and C has a shorter way for; compiled, where a compiler was there."""

from __future__ import annotations

from typing import Any, Final

nearest: Final = round  # the nearest whole number, the even one of two


def empty(tokens: list[Any]) -> None:
    """Take everything out of a list."""
    tokens.clear()
