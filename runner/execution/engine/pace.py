"""Pace: a run held to the wall clock."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

SLOWEST = 1e-9  # model seconds per second: a nanosecond, the shortest step of time
LONGEST = 3_600.0  # s slept at once: the operating system has a limit


def notice(progress: Callable[[float], None] | None, now: int) -> None:
    """Report the progress at a time (ns).

    A run in C calls this now and then because it is Python: this lets signals be handled, and other threads run.
    """
    if progress is not None:
        progress(now / 1e9)


class Pace:
    """Limits model time to ``factor`` seconds per second of wall-clock time.

    A run that has fallen behind runs as fast as it can until it has caught up; ``behind`` is the delay of its latest
    instant and ``worst`` the greatest of all (s of wall-clock time).  Raises ``ValueError`` for a factor that is not a
    number of at least ``SLOWEST``.
    """

    def __init__(
        self,
        factor: float = 1.0,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        if not SLOWEST <= factor < math.inf:
            raise ValueError(f"a pace is a number of model seconds per second, at least {SLOWEST:g}, not {factor:g}")
        self.factor = factor
        self.behind = 0.0
        self.worst = 0.0
        self._clock = clock
        self._sleep = sleep
        self._start: float | None = None

    def wait_for(self, now: float) -> None:
        """Wait for the model time ``now`` (ns); the first call marks the beginning."""
        if self._start is None:
            self._start = self._clock()
        due = self._start + now / 1e9 / self.factor
        while (ahead := due - self._clock()) > 0.0:
            self._sleep(min(ahead, LONGEST))
        self.behind = -ahead
        self.worst = max(self.worst, self.behind)
