"""Pace: a run held to the wall clock."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

SLOWEST = 1e-9  # model seconds in a second: a nanosecond, than which no step of time is shorter
LONGEST = 3_600.0  # s that are slept at once: what the operating system takes has an end


def notice(progress: Callable[[float], None] | None, now: int) -> None:
    """Tell of the progress, at a time (ns).

    A run in C calls this now and then because it is Python: meanwhile signals are handled, and other threads go on.
    """
    if progress is not None:
        progress(now / 1e9)


class Pace:
    """Lets model time pass no faster than ``factor`` seconds of it in a second of the wall clock.

    A run that has fallen behind goes on as fast as it can until it has caught up; ``behind`` is how late its latest
    instant was and ``worst`` the latest of all (s of the wall clock).  Raises ``ValueError`` for a factor that is no
    number from ``SLOWEST`` up.
    """

    def __init__(
        self,
        factor: float = 1.0,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        if not SLOWEST <= factor < math.inf:
            raise ValueError(f"a pace is a number of model seconds in a second, {SLOWEST:g} or more, not {factor:g}")
        self.factor = factor
        self.behind = 0.0
        self.worst = 0.0
        self._clock = clock
        self._sleep = sleep
        self._start: float | None = None

    def wait_for(self, now: float) -> None:
        """Wait until the model time ``now`` (ns) has come; the first time is the beginning."""
        if self._start is None:
            self._start = self._clock()
        due = self._start + now / 1e9 / self.factor
        while (ahead := due - self._clock()) > 0.0:
            self._sleep(min(ahead, LONGEST))
        self.behind = -ahead
        self.worst = max(self.worst, self.behind)
