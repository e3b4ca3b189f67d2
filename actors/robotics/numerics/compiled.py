"""How the kernels are compiled: numba, cached on disk, strict IEEE arithmetic (the same bits in every run)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile a pure function on arrays; ``error_model="numpy"`` gives inf and NaN instead of exceptions."""
    return cast(Function, numba.njit(cache=True, error_model="numpy", fastmath=False)(function))
