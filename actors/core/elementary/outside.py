"""Arguments where a function has no value, or none that a double can hold: Python raises, compiled code gets NaN or
infinity."""

from __future__ import annotations

from typing import Any


def undefined(*arguments: Any) -> float:
    """For arguments outside the domain; compiled code gets NaN."""
    raise ValueError("math domain error")


def infinite(sign: float) -> float:
    """For a result beyond the largest double; compiled code gets an infinity of this sign."""
    raise OverflowError("math range error")


def pole(sign: float) -> float:
    """For a result that is infinite, as log(0); compiled code gets an infinity of this sign."""
    raise ValueError("math domain error")
