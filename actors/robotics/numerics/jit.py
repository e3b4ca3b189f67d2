"""Kernels compiled by numba: strict IEEE arithmetic, the same bits in every run; kept on disk, with checksums."""

from __future__ import annotations

import functools
import hashlib
import logging
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numba
import numba.extending
from numba.core import caching as _caching

from ...core.elementary.in_numba import register
from .kept import folder

config: Any = numba.config
caching: Any = _caching
types: Any = numba.types  # numba's declarations of them are not sufficient
_overload: Any = numba.extending.overload
_njit: Any = numba.njit
_LOGGER = logging.getLogger("epicycle")


def options(**others: bool) -> dict[str, Any]:
    """The options of every compilation, and ``others``; ``error_model="numpy"`` gives inf and NaN instead of
    exceptions.

    With explicit ``_nrt`` (whether references to arrays are counted): numba would otherwise use its caller's.
    """
    return {"error_model": "numpy", "fastmath": False, "no_cfunc_wrapper": True, "_nrt": True, **others}


@contextmanager
def cached() -> Iterator[None]:
    """Kernels declared in this context are cached in the ``folder``, with checksums."""
    before = config.CACHE_DIR, caching.IndexDataCacheFile
    config.CACHE_DIR, caching.IndexDataCacheFile = str(folder()), _Checked
    try:
        yield
    finally:
        config.CACHE_DIR, caching.IndexDataCacheFile = before


@functools.cache
def dispatcher(function: Callable[..., Any]) -> Any:
    """A kernel as other kernels call it."""
    with cached():
        return _njit(**options(cache=True, no_cpython_wrapper=True))(function)


def typed(function: Callable[..., Any]) -> Any:
    """The type of a kernel where other kernels call it."""
    return types.Dispatcher(dispatcher(function))


def callable_from_kernels(function: Callable[..., Any], **others: bool) -> None:
    """Let compiled code call a function of Python: its source is compiled."""
    overloaded(function, lambda *arguments: function, no_cpython_wrapper=True, **others)


def overloaded(function: Callable[..., Any], made: Callable[..., Any], **others: bool) -> None:
    """Let compiled code call a function as what is made for the types of its arguments."""
    _overload(function, jit_options=options(**others), strict=False)(made)


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


register()
