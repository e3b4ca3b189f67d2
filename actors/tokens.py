"""What can be said of the type of tokens that a model file gives."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


def token_type(values: Iterable[object]) -> Any:
    """The port type of these values: ``bool``, ``int``, ``float`` (also for a mixture with ints), ``str``, or any."""
    found = {type(value) for value in values}
    if found == {int, float}:
        return float
    return found.pop() if len(found) == 1 and found <= {bool, int, float, str} else Any
