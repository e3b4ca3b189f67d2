"""Functions of numbers and of CasADi's symbols, so that a dynamics, a sensor or an objective is written once for both.

Of a float they are those of ``elementary``, with the same bits on every machine; of an array, those of its elements.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from ..core import elementary

_TINY = 1e-18  # gives a root a slope also at zero


def _function(name: str, of_floats: Callable[..., float]) -> Callable[..., Any]:
    def of_one(*given: Any) -> Any:
        if all(isinstance(each, (int, float)) for each in given):
            return of_floats(*given)
        return getattr(import_module("casadi"), name)(*given)

    def function(*given: Any) -> Any:
        if not any(isinstance(each, np.ndarray) for each in given):
            return of_one(*given)
        found = of_each(*given)
        symbols = any(isinstance(each, np.ndarray) and each.dtype == object for each in given)
        return found if symbols else found.astype(float)

    of_each = np.vectorize(of_one, otypes=[object])
    function.__name__, function.__doc__ = name, f"``{name}`` of numbers, of symbols, and of arrays of either."
    return function


sin, cos, tan = (_function(name, getattr(elementary, name)) for name in ("sin", "cos", "tan"))
exp, log, atan2 = (_function(name, getattr(elementary, name)) for name in ("exp", "log", "atan2"))
_root = _function("sqrt", math.sqrt)


def sqrt(square: Any) -> Any:
    """The square root, of ``square`` + 1e-18: it has a slope also at zero."""
    return _root(square + _TINY)


def norm(offset: Sequence[Any]) -> Any:
    """The Euclidean length, with a slope also at zero."""
    total = offset[0] * offset[0]
    for each in offset[1:]:
        total = total + each * each
    return sqrt(total)
