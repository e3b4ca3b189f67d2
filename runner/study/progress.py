"""How far a study is: a bar on a terminal, a line a minute elsewhere."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ..printing import complain, console
from .schedule import OK, Schedule
from .session import duration

if TYPE_CHECKING:
    from collections.abc import Callable

EVERY = 60.0  # s between two lines where there is no terminal


class Pulse:
    """The rate of a session, and what is left to do."""

    def __init__(self) -> None:
        self.started = time.monotonic()

    def line(self, schedule: Schedule) -> str:
        """``120 of 6,000 runs, 2 failed, 3.1 runs/s, 32 min left``."""
        made = schedule.made.total()
        failed = schedule.over - schedule.made[OK] - schedule.there[OK]
        parts = [f"{schedule.over:,} of {schedule.total:,} runs"]
        if failed:
            parts.append(f"{failed:,} failed")
        seconds = time.monotonic() - self.started
        if made and seconds > 0:
            rate = made / seconds
            parts += [f"{rate:.3g} runs/s", f"{duration(schedule.left / rate)} left"]
        return ", ".join(parts)


@contextmanager
def progress(name: str) -> Iterator[Callable[[Schedule], None]]:
    """What a session calls now and then."""
    pulse = Pulse()
    terminal = console(stderr=True)
    if terminal.is_terminal:
        from rich.progress import BarColumn, Progress, TextColumn

        with Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.fields[line]}", markup=False),
            console=terminal,
            transient=True,
        ) as bar:
            task = bar.add_task(name, total=None, line="")
            yield lambda schedule: bar.update(
                task, total=schedule.total, completed=schedule.over, line=pulse.line(schedule)
            )
        return
    last = pulse.started

    def tell(schedule: Schedule) -> None:
        nonlocal last
        if time.monotonic() - last >= EVERY:
            last = time.monotonic()
            complain(f"{time.strftime('%H:%M:%S')} {name}: {pulse.line(schedule)}")

    yield tell
