"""How the kernels are compiled: numba, cached on disk, strict IEEE arithmetic (the same bits in every run)."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def kernel(function: Function) -> Function:
    """Compile a pure function on arrays; ``error_model="numpy"`` gives inf and NaN instead of exceptions."""
    with _cache_of_these_sources():
        return cast(Function, numba.njit(cache=True, error_model="numpy", fastmath=False)(function))


def inner(function: Function) -> Function:
    """Like ``kernel``, for what only kernels call: without the way in from Python, which takes long to compile.

    It is not cached on disk by itself, as it is in the cached code of every kernel that calls it.
    """
    compiled = numba.njit(error_model="numpy", fastmath=False, no_cpython_wrapper=True)  # type: ignore[call-overload]
    return cast(Function, compiled(function))


@contextmanager
def _cache_of_these_sources() -> Iterator[None]:
    """Compiled code lies in a folder named after all sources of this package.

    By itself numba looks only at the file of a kernel, and would go on with old code of what that calls from others.
    """
    config: Any = numba.config
    before = config.CACHE_DIR
    if before:  # the user's own, NUMBA_CACHE_DIR
        config.CACHE_DIR = str(Path(before) / _SOURCES)
    elif os.access(_HERE, os.W_OK):
        config.CACHE_DIR = str(_HERE / "__pycache__" / _SOURCES)
    else:
        home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        config.CACHE_DIR = str(Path(home) / "epicycle" / _SOURCES)
    try:
        yield
    finally:
        config.CACHE_DIR = before


_HERE = Path(__file__).parent
_SOURCES = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(_HERE.glob("*.py")))).hexdigest()[:16]
