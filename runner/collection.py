"""The garbage collector, and when it is only in the way."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_collection() -> Iterator[None]:
    """Keep the garbage collector from looking through a model again and again while it grows: all of it is kept."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@contextmanager
def importing(*, for_good: bool) -> Iterator[None]:
    """Look for no garbage among what modules are made of; ``for_good``: nor later on, and when the process ends.

    A command takes a sixth less time so.  It is for programs alone, which have nothing but modules then.
    """
    with without_collection():
        yield
    if for_good:
        gc.freeze()


@contextmanager
def seldom_collecting() -> Iterator[None]:
    """Look for garbage less often: for a program of ours, most of whose objects stay to its end, and while a run lasts.

    What a run makes is gone before it counts among what lives long, of which the
    compiled numerics have brought 150,000 objects: to look through them takes as long as a run.  The threshold is one
    for all threads, so those beside the main one leave it alone.
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
    """Never look again for garbage among what is there now: for a process that makes one run after the other."""
    gc.collect()
    gc.freeze()
