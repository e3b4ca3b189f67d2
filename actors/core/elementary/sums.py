"""Sums in the order of their terms: from Python 3.12 on, the built-in ``sum`` of floats compensates rounding errors."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from operator import add
from typing import Any


def total(numbers: Iterable[Any]) -> Any:
    """The sum, added from left to right; whole numbers stay whole, and the empty sum is 0."""
    return reduce(add, numbers, 0)
