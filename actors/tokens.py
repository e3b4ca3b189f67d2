"""What can be said of the type of tokens that a model file gives."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from operator import or_
from typing import Any


def token_type(values: Iterable[object]) -> Any:
    """The port type of these values: ``bool``, ``int``, ``float`` (ints count as such beside floats), ``str``, or a
    union of these; any if there are others among them."""
    found = dict.fromkeys(type(value) for value in values)
    if not found or found.keys() - {bool, int, float, str}:
        return Any
    return reduce(or_, (each for each in found if each is not int or float not in found))
