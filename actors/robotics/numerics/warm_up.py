"""Compiles all kernels at once, so that the wait comes before time starts and can be announced."""

from __future__ import annotations

import functools
import gc
import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module

from .compiled import IS_PYTHON, IS_READY, KERNELS, LEDGER, jit
from .kept import folder, mark

_LOGGER = logging.getLogger("epicycle")
_PATIENCE = 1.0  # s before the wait is explained; loading the cached kernels is quicker


@functools.cache
def compile_kernels(dimensions: int = 2) -> None:
    """Compile every kernel of a run, which only the first call in a process does.

    All take any number of dimensions but the solver, which is compiled for the plane and for space by itself.
    """
    _prepare("the numeric kernels", functools.partial(_compile_all, dimensions), f"compiled_{dimensions}")


@functools.cache
def compile_tracking() -> None:
    """The same for the kernels of a tracker, which other models do not need."""
    compile_kernels()
    _prepare("the kernels of the tracker", functools.partial(compile_modules, "association"), "compiled_tracking")


@functools.cache
def compile_retreats() -> None:
    """The same for the kernels of a main robot that keeps a retreat open, and of its filter."""
    compile_kernels()
    work = functools.partial(compile_modules, "lines_of_sight", "retreat")
    _prepare("the kernels of the safe robot", work, "compiled_retreats")


def compile_now() -> None:
    """Compile the kernels of the plane for all later processes: ``python -m`` this module."""
    LEDGER.close()
    compile_kernels()


def _prepare(what: str, work: Callable[[], None], note: str) -> None:
    """Compile some kernels before time starts, or as soon as Python has run kernels for long enough; the ``note`` tells
    later processes that this is done, and that they only load them."""

    def compile_them() -> None:
        known = (folder() / note).exists()
        with _announced(f"loading {what} ..." if known else f"compiling {what} (once, about 20 s) ..."):
            work()
        mark(note)

    if IS_PYTHON:
        return
    if IS_READY or not LEDGER.allows():
        compile_them()
    else:
        LEDGER.prepared.append(compile_them)


@contextmanager
def _announced(message: str) -> Iterator[None]:
    """What is compiled here is announced if it takes long."""
    notice = threading.Timer(_PATIENCE, _LOGGER.info, (message,))
    notice.daemon = True
    notice.start()
    was_enabled = gc.isenabled()
    gc.disable()  # numba makes millions of objects, and garbage collection takes a sixth of the time
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
        notice.cancel()


def _compile_all(dimensions: int) -> None:
    with _others_meanwhile():
        solver = dimensions - 2
        compile_modules("barrier", which=slice(solver, solver + 1))
    compile_others()
    mark("compiled")


def compile_others() -> None:
    """Compile every kernel of a run except the solver."""
    compile_modules("ukf", "reachability", "mutual_information")


def compile_modules(*modules: str, which: slice = slice(None)) -> None:
    """Compile the kernels of some modules, or ``which`` of each, or load what was compiled before."""
    for module in (f"{__package__}.{each}" for each in modules):
        import_module(module)
        jit()
        from .entry import compile_now

        for function in KERNELS[module][which]:
            compile_now(function)


@contextmanager
def _others_meanwhile() -> Iterator[None]:
    """If nothing is compiled yet, a second process compiles everything except the solver, which takes longest.

    Both write to the same cache, each the code of kernels that the other does not need.  If the second one fails,
    everything is compiled here.
    """
    if (os.cpu_count() or 1) == 1 or any(folder().rglob("*.nbc")):
        yield
        return
    program = f"from {__spec__.name} import compile_others; compile_others()"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    null = subprocess.DEVNULL
    try:
        other = subprocess.Popen([sys.executable, "-c", program], env=environment, stdin=null, stdout=null, stderr=null)
    except OSError:  # there may be no such program if Python is embedded in another one
        yield
        return
    with other:  # and wait for it
        yield


if __name__ == "__main__":
    compile_now()
