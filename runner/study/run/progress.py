"""The progress of a study: a bar where somebody can see it, a line per minute elsewhere."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ...support.bars import bar
from ...support.printing import complain
from .backlog import Backlog

EVERY = 60.0  # s between two lines where there is no bar


def line(backlog: Backlog, elapsed: float) -> str:
    """``120 of 6,000 runs, 2 failed, 3.1 runs/s, 32 min left``, after so many seconds."""
    parts = [f"{backlog.over:,} of {backlog.total:,} runs"]
    if backlog.failed:
        parts.append(f"{backlog.failed:,} failed")
    if rate := backlog.made.total() / (elapsed or math.inf):
        parts += [f"{rate:.3g} runs/s", f"{duration(backlog.left / rate)} left"]
    return ", ".join(parts)


@contextmanager
def progress(name: str) -> Iterator[Callable[[Backlog], None]]:
    """A function for a session to call now and then."""
    with bar(name) as show:
        started = last = time.monotonic()
        if show is not None:
            show(0.0, None, "")

        def tell(backlog: Backlog) -> None:
            nonlocal last
            said = line(backlog, (now := time.monotonic()) - started)
            if show is not None:
                show(backlog.over, backlog.total, said)
            elif now - last >= EVERY:
                last = now
                complain(f"{time.strftime('%H:%M:%S')} {name}: {said}")

        yield tell


def duration(seconds: float) -> str:
    """A duration in words."""
    for limit, size, unit in ((100, 1, "s"), (6_000, 60, "min"), (172_800, 3600, "h"), (63_072_000, 86_400, "days")):
        if seconds < limit:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds / 31_536_000:,.0f} years"
