"""How the kernels are run: by Python at first, and compiled as soon as that pays.

Compiling takes some 20 s, once for all runs; Python needs 8 s for a run that compiled kernels make in 30 ms.  So the
first process that needs kernels takes them as they are written, unless its run is long; the next one compiles them.
Both give the same bits.  Numba is heavy, and imported where it compiles or loads (``jit``).
"""

from __future__ import annotations

import importlib
import os
import sys
import time
from collections.abc import Callable
from typing import Annotated, Any, TypeAlias, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from .. import arrays
from .kept import folder, mark

Array = NDArray[np.float64]  # the one array type of the kernels
# The same with its dimensions, which is what the annotations of a ``kernel`` say.
Row: TypeAlias = Annotated[Array, 1]
Table: TypeAlias = Annotated[Array, 2]
Layers: TypeAlias = Annotated[Array, 3]
Function = TypeVar("Function", bound=Callable[..., object])

_LIMIT = 10.0  # s that a process spends in kernels as Python before it compiles them


class _Ledger:
    """What this process has spent in kernels as Python."""

    def __init__(self) -> None:
        self.spent = 0.0
        self._limit: float | None = None  # not known before the first kernel is needed
        self.is_open = False  # a kernel is being called
        self.prepared: list[Callable[[], None]] = []  # what compiles the kernels that actors here need

    def close(self) -> None:
        """From now on, kernels are compiled."""
        self._limit = 0.0

    def allows(self) -> bool:
        """Whether kernels are still run by Python: nobody did so before this process, and it has not spent much."""
        if self._limit is None:
            self._limit = 0.0 if (folder() / "python").exists() else _LIMIT
            mark("python")
        return self.spent < self._limit

    def prepare(self) -> None:
        """Compile what actors asked for."""
        while self.prepared:
            self.prepared.pop(0)()

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """What a kernel gives as Python; kernels that it calls are counted with it."""
        began, self.is_open = time.perf_counter(), True
        try:
            with np.errstate(all="ignore"):
                return function(*arguments)
        finally:
            self.is_open = False
            self.spent += time.perf_counter() - began


LEDGER = _Ledger()


class Kernel:
    """A kernel that Python runs until it is worth compiling."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.__module__, self.__name__, self.__doc__ = function.__module__, function.__name__, function.__doc__
        self._function = function
        self._compiled: Any = None

    def __call__(self, *arguments: Any) -> Any:
        if self._compiled is None:
            if LEDGER.is_open:
                return self._function(*arguments)
            try:
                if LEDGER.allows():
                    return LEDGER.call(self._function, arguments)
            except (ArithmeticError, ValueError):  # where compiled code gives inf or NaN
                LEDGER.close()
            LEDGER.prepare()
            self._compiled = entered(self._function)
        return self._compiled(*arguments)

    def __reduce__(self) -> Any:
        return kernel_of, (self.__module__, self.__name__)

    @property
    def _numba_type_(self) -> Any:
        """As numba sees it where a kernel calls another."""
        return jit().typed(self._function)


def kernel_of(module: str, name: str) -> Any:
    """A kernel by its name."""
    return getattr(importlib.import_module(module), name)


def kernel(function: Function) -> Function:
    """A pure function that Python calls, and that its annotations give the types of.

    It takes and returns floats, ints, bools, and contiguous arrays of floats (``Row``, ``Table``, ``Layers``), and
    takes named tuples of them.
    """
    KERNELS.setdefault(function.__module__, []).append(function)
    if IS_PYTHON:
        return function
    # Numba's own entry is a function of Python, which no kernel can call.
    return cast(Function, entered(function) if IS_READY and arrays.Entry is not None else Kernel(function))


def entered(function: Callable[..., Any]) -> Any:
    """A kernel that is compiled, or found on disk, when it is called."""
    jit()
    from . import entry

    return entry.entered(function)


def _called_by_kernels(function: Function, **options: bool) -> Function:
    _declare(lambda jit: jit.callable_from_kernels(function, **options))
    return function


def inner(function: Function) -> Function:
    """A function that only kernels call: without an entry from Python, which takes long to compile.

    It is not cached on disk by itself, as the cached code of every calling kernel contains it.
    """
    return _called_by_kernels(function, _nrt=True)


def borrower(function: Function) -> Function:
    """Like ``inner``, for functions that neither make nor return arrays: they do not count references to their
    arguments.

    Counting is an atomic operation for each array of a tuple at each call; it took a third of a solve.
    """
    return _called_by_kernels(function, _nrt=False)


def inlined(function: Function) -> Function:
    """A ``borrower`` that is inlined in its callers, for calls in long loops."""
    return _called_by_kernels(function, _nrt=False, forceinline=True)


def in_kernels(function: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """What stands for a function in compiled code: given the types of its arguments, a function of the same."""

    def decorate(typed: Callable[..., Any]) -> Callable[..., Any]:
        _declare(lambda jit: jit.overloaded(function, typed))
        return typed

    return decorate


def _declare(declaration: Callable[[Any], None]) -> None:
    _DECLARED.append(declaration)
    if IS_READY or f"{__package__}.jit" in sys.modules:
        jit()


def jit() -> Any:
    """The module that compiles, which knows all that is declared so far."""
    from . import jit as module

    while _DECLARED:
        _DECLARED.pop(0)(module)
    return module


IS_PYTHON = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
IS_READY = not IS_PYTHON and (folder() / "compiled").exists()
KERNELS: dict[str, list[Callable[..., Any]]] = {}  # by module
_DECLARED: list[Callable[[Any], None]] = []
