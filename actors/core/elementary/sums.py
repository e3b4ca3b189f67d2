"""Sums in the order of their terms: from Python 3.12 on, the built-in ``sum`` of floats carries its rounding errors."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from operator import add
from typing import Any


def total(numbers: Iterable[Any]) -> Any:
    """The sum, each number added to that of those before it; whole numbers stay whole, and of none it is 0."""
    return reduce(add, numbers, 0)
