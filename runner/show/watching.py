"""Watching a run: a bar, and notices if it takes long."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..model.build.model import Model
from ..support.bars import bar
from ..support.printing import complain, console, notices
from ..support.shown import in_time

PATIENCE = 5.0  # s after which the length of a run can be judged
LONG = 600.0  # s that are worth a notice


def outlook(elapsed: float, now: float, end: float) -> str:
    """The notice about a run that has taken a while and will take long: a clock of 1 ns is easily written."""
    if now <= 0.0:  # perhaps a single step does not end
        state = f"still at 0 s of {end:g} s"
    elif (left := elapsed * (end - now) / now) > LONG:
        state = f"at {now:.3g} s of {end:g} s: at this pace it takes another {left / 3_600:,.1f} h"
    else:
        return ""
    return f"after {elapsed:.0f} s the run is {state}; Ctrl-C ends it, and what was recorded is kept"


@contextmanager
def watched(model: Model, until: float | None, after: float = 0.0) -> Iterator[Callable[[float], None]]:
    """Shows the progress of a run: a bar, and notices if it takes long."""
    end = until if until is not None else model.stop
    latest = -math.inf

    def look(now: float) -> None:
        nonlocal latest
        if latest < 0.0:  # time starts only now: before, actors were initialised, which says nothing about the run
            watch.start()
        latest = now
        if show is not None:
            show(now, end, f"{in_time(round(now, 1) if now >= 1.0 else now)} of model time")

    def judge() -> None:
        if end is not None and (text := outlook(PATIENCE, latest, end)):
            complain(text)

    # A step of the run may never end, so another thread watches it.
    watch = threading.Timer(PATIENCE, judge)
    watch.daemon = True
    terminal = console(stderr=True)
    try:
        with notices(terminal), bar(model.name, after=after, terminal=terminal) as show:
            if show is not None:
                show(0.0, end, "0 s of model time")
            yield look
    finally:
        watch.cancel()
