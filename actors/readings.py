"""Tokens as numbers for calculations, which must be finite."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

import numpy as np

from .core import EpicycleError, InputPort, brief, counted


def finite_number(port: InputPort[Any], token: Any) -> float:
    """The token of a port as a float; raises ``EpicycleError`` if it is not a finite number."""
    if isinstance(token, (float, int, np.integer, np.floating)) and not isinstance(token, bool):
        with suppress(OverflowError):  # a whole number may be too large for a float
            number = float(token)
            if math.isfinite(number):
                return number
    raise EpicycleError(f"{port.path} got {brief(token)}, expected a finite number")


def finite_numbers(port: InputPort[Any], token: Any, length: int) -> list[float]:
    """The token of a port as a given number of floats; a number is a list of one."""
    if length == 1 and np.ndim(token) == 0:
        return [finite_number(port, token)]
    items = token.tolist() if isinstance(token, np.ndarray) else token
    if not isinstance(items, (list, tuple)) or len(items) != length:
        raise EpicycleError(f"{port.path} got {brief(token)}, expected a list of {counted(length, 'number')}")
    return [finite_number(port, each) for each in items]
