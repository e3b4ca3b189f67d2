"""When the garbage collector only costs time."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_collection() -> Iterator[None]:
    """Keep the garbage collector from scanning a growing model again and again: all of it is kept."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@contextmanager
def importing(*, for_good: bool) -> Iterator[None]:
    """Do not search modules for garbage; with ``for_good``, neither later nor when the process ends.

    This saves a command a sixth of its time.  Only programs use it, which hold nothing but modules at that point.
    """
    with without_collection():
        yield
    if for_good:
        gc.freeze()


@contextmanager
def seldom_collecting() -> Iterator[None]:
    """Collect garbage less often: in our own programs, most of whose objects stay to the end, and during a run.

    The objects of a run are freed before they join the long-lived ones, to which the compiled numerics add 150,000:
    scanning these takes as long as a run.  All threads share the threshold, so only the main thread changes it.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = gc.get_threshold()
    gc.set_threshold(10_000, 5, 5)
    try:
        yield
    finally:
        gc.set_threshold(*before)


def keep_for_good() -> None:
    """Never search the present objects for garbage again: for a process that makes one run after another."""
    gc.collect()
    gc.freeze()
