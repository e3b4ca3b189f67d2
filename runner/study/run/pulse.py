"""How far a study is: a bar on a terminal, a line a minute elsewhere."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ...printing import complain, console
from .backlog import Backlog

EVERY = 60.0  # s between two lines where there is no terminal


class Pulse:
    """The rate of a session, and what is left to do."""

    def __init__(self) -> None:
        self.started = time.monotonic()

    def line(self, backlog: Backlog) -> str:
        """``120 of 6,000 runs, 2 failed, 3.1 runs/s, 32 min left``."""
        parts = [f"{backlog.over:,} of {backlog.total:,} runs"]
        if backlog.failed:
            parts.append(f"{backlog.failed:,} failed")
        if rate := backlog.made.total() / ((time.monotonic() - self.started) or math.inf):
            parts += [f"{rate:.3g} runs/s", f"{duration(backlog.left / rate)} left"]
        return ", ".join(parts)


@contextmanager
def progress(name: str) -> Iterator[Callable[[Backlog], None]]:
    """What a session calls now and then."""
    pulse = Pulse()
    terminal = console(stderr=True)
    if not terminal.is_terminal:
        last = pulse.started

        def tell(backlog: Backlog) -> None:
            nonlocal last
            if time.monotonic() - last >= EVERY:
                last = time.monotonic()
                complain(f"{time.strftime('%H:%M:%S')} {name}: {pulse.line(backlog)}")

        yield tell
        return
    from rich.progress import BarColumn, Progress, TextColumn

    texts = (TextColumn(text, markup=False) for text in ("{task.description}", "{task.fields[line]}"))
    with Progress(next(texts), BarColumn(), next(texts), console=terminal, transient=True) as bar:
        task = bar.add_task(name, total=None, line="")
        yield lambda now: bar.update(task, total=now.total, completed=now.over, line=pulse.line(now))


def duration(seconds: float) -> str:
    """A time as people say it."""
    for limit, size, unit in ((100, 1, "s"), (6_000, 60, "min"), (172_800, 3600, "h"), (63_072_000, 86_400, "days")):
        if seconds < limit:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds / 31_536_000:,.0f} years"
