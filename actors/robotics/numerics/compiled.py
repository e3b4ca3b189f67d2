"""How the kernels are compiled: numba, cached on disk, strict IEEE arithmetic (the same bits in every run)."""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import caching as _caching
from numpy.typing import NDArray

from ...core import elementary
from ...core.elementary.in_numba import register

config: Any = numba.config
Array = NDArray[np.float64]  # the one array type of the kernels
_LOGGER = logging.getLogger("epicycle")
caching: Any = _caching
Function = TypeVar("Function", bound=Callable[..., object])


def options(**others: bool) -> dict[str, Any]:
    """The options of every compilation, and ``others``; ``error_model="numpy"`` gives inf and NaN instead of
    exceptions."""
    return {"error_model": "numpy", "fastmath": False, **others}


def _compiled(function: Function, **others: bool) -> Function:
    """Strict, with explicit ``_nrt`` (whether references to arrays are counted): numba would otherwise use its
    caller's.

    The unused entry from C would take a tenth of the time of compiling.
    """
    compiler: Any = numba.njit
    return cast(Function, compiler(**options(no_cfunc_wrapper=True, **others))(function))


def folder() -> Path:
    """Where numba keeps compiled code; named after all sources of this package and of the elementary functions.

    By itself, numba checks only the file of a kernel, and would keep using old code that it calls from others.
    """
    if _FOLDER:  # the user's own, NUMBA_CACHE_DIR
        above = Path(_FOLDER)
    elif os.access(_HERE, os.W_OK):
        above = _HERE / "__pycache__"
    else:
        above = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "epicycle"
    return above / _SOURCES


@contextmanager
def cached() -> Iterator[None]:
    """Kernels declared in this context are cached in the ``folder``, with checksums."""
    before = config.CACHE_DIR, caching.IndexDataCacheFile
    config.CACHE_DIR, caching.IndexDataCacheFile = str(folder()), _Checked
    try:
        yield
    finally:
        config.CACHE_DIR, caching.IndexDataCacheFile = before


def kernel(function: Function, counts: bool = True) -> Function:
    """Compile a pure function on arrays."""
    with cached():
        return _compiled(function, cache=True, _nrt=counts)


_Kept: Any = caching.IndexDataCacheFile


class _Checked(_Kept):  # type: ignore[misc]
    """Compiled code on disk with its checksum; what is damaged is compiled again, and what cannot be kept is not."""

    def load(self, key: object) -> Any:
        """The code for a signature; None if there is none, or none that is whole."""
        try:
            if (found := super().load(key)) is None:
                return None
            digest, data = found
            if digest == hashlib.sha256(data).digest():
                return pickle.loads(data)
            damage = "it does not match its checksum"
        except Exception as error:  # unpickling bytes that were damaged may raise anything
            damage = f"{type(error).__name__}: {error}"
        _LOGGER.warning("compiled code in %s is damaged (%s) and is made again", self._index_path, damage)
        with suppress(OSError):
            self.flush()
        return None

    def save(self, key: object, data: object) -> None:
        """Keep the code for a signature."""
        written = self._dump(data)
        try:
            super().save(key, (hashlib.sha256(written).digest(), written))
        except Exception as error:  # such as a full disk; the index may be damaged
            _LOGGER.warning("compiled code cannot be kept in %s: %s", self._index_path, error)


def inner(function: Function) -> Function:
    """Like ``kernel``, for functions that only kernels call: without the entry from Python, which takes long to
    compile.

    It is not cached on disk by itself, as the cached code of every calling kernel contains it.
    """
    return _compiled(function, no_cpython_wrapper=True, _nrt=True)


def borrower(function: Function) -> Function:
    """Like ``inner``, for functions that neither make nor return arrays: they do not count references to their
    arguments.

    Counting is an atomic operation for each array of a tuple at each call; it took a third of a solve.
    """
    return _compiled(function, no_cpython_wrapper=True, _nrt=False)


def inlined(function: Function) -> Function:
    """A ``borrower`` that is inlined in its callers, for calls in long loops."""
    return _compiled(function, no_cpython_wrapper=True, _nrt=False, forceinline=True)


_HERE = Path(__file__).parent
_FILES = [path for folder in (_HERE, Path(elementary.__file__).parent) for path in sorted(folder.glob("*.py"))]
_FOLDER = config.CACHE_DIR
_SOURCES = hashlib.sha256(b"".join(path.read_bytes() for path in _FILES)).hexdigest()[:16]
register()
