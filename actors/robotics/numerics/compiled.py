"""How the kernels are compiled: numba, cached on disk, strict IEEE arithmetic (the same bits in every run)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile a pure function on arrays; ``error_model="numpy"`` gives inf and NaN instead of exceptions."""
    return cast(Function, numba.njit(cache=True, error_model="numpy", fastmath=False)(function))


def inner(function: Function) -> Function:
    """Like ``kernel``, for what only kernels call: without the way in from Python, which takes long to compile.

    It is not cached on disk by itself, as it is in the cached code of every kernel that calls it.
    """
    compiled = numba.njit(error_model="numpy", fastmath=False, no_cpython_wrapper=True)  # type: ignore[call-overload]
    return cast(Function, compiled(function))
