"""Tells numba how to compile the elementary functions: from the source that Python runs, with tables as arrays.

numba calls ``register``, an entry point of the package, before it compiles anything.
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic, overload

from . import arcs, circle, double, exponential, gamma, length, logarithm, outside, powers

_OPTIONS: Any = {"error_model": "numpy", "fastmath": False, "no_cfunc_wrapper": True, "no_cpython_wrapper": True}


def _read_as(to: Any, origin: Any) -> Any:
    """A function for compiled code that reads the bits of one type as another."""

    def typed(typing_context: Any, number: Any) -> Any:
        return to(origin), lambda context, builder, _, given: builder.bitcast(given[0], context.get_value_type(to))

    return intrinsic(typed)


_bits, _double = _read_as(types.int64, types.float64), _read_as(types.float64, types.int64)


def _frexp(x: float) -> tuple[float, int]:
    """math.frexp of a finite number but 0."""
    bits, shift = _bits(x), 1022
    if (bits >> 52) & 2047 == 0:
        bits, shift = _bits(x * 18014398509481984.0), 1076  # times 2**54, as it is below the smallest normal number
    return _double((bits & -9218868437227405313) | 4602678819172646912), ((bits >> 52) & 2047) - shift


_inner_frexp = numba.njit(**_OPTIONS)(_frexp)


def _twin(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same code with arrays as tables, which numba indexes quickly, and with numba's frexp."""
    names = {
        name: np.array(value) if isinstance(value, tuple) else _inner_frexp if value is math.frexp else value
        for name, value in function.__globals__.items()
    }
    return FunctionType(function.__code__, names, function.__name__, function.__defaults__)


def _compile_as(function: Callable[..., Any], twin: Callable[..., Any]) -> None:
    overload(function, jit_options=_OPTIONS, strict=False)(lambda *arguments: twin)


@functools.cache
def register() -> None:
    """Let compiled code call the elementary functions by the same names as Python code."""
    for module in (arcs, circle, double, exponential, gamma, logarithm, powers):
        for function in list(vars(module).values()):
            if inspect.isfunction(function) and function.__module__ == module.__name__:
                _compile_as(function, _twin(function))
    _compile_as(length.hypot, _twin(length._plane))
    _compile_as(length._brought_near, _twin(length._brought_near))
    _compile_as(outside.undefined, lambda *arguments: math.nan)
    _compile_as(outside.infinite, lambda sign: math.copysign(math.inf, sign))
    _compile_as(outside.pole, lambda sign: math.copysign(math.inf, sign))
