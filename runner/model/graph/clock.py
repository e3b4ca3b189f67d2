"""Clock: the local time of a composite with its own director, computed from the time of the model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from epicycle.actors import Tag


@dataclass(frozen=True)
class Clock:
    """Local time is ``start`` when the run begins, and runs ``rate`` times as fast as the time of the model.

    Both times are whole nanoseconds, and local time is rounded down; so a clock that is slower than the model's shows
    each of its nanoseconds once or several times, and a faster one skips some.
    """

    start: int = 0  # ns
    rate: Fraction = Fraction(1)

    def inside(self, start: int | None, drift: float) -> Clock:
        """The clock of a composite inside: it starts with this one by default, and runs ``drift`` times as fast."""
        # The decimal as written: 0.1 is a tenth here, not the nearest binary fraction.
        return Clock(self.start if start is None else start, self.rate * Fraction(repr(drift)))

    @property
    def is_global(self) -> bool:
        """Whether it shows the time of the model."""
        return self == Clock()

    def local(self, time: int) -> int:
        """The local time at a time of the model (ns)."""
        return self.start + math.floor(self.rate * time)

    def outer(self, time: int) -> int:
        """The time of the model at which this clock first shows ``time`` or more (ns)."""
        return math.ceil((time - self.start) / self.rate)

    def span(self, now: int, delay: int) -> int:
        """How long ``delay`` of this clock lasts, from the time ``now`` of the model (ns)."""
        return self.outer(self.local(now) + delay) - now if delay > 0 else delay

    def tag(self, tag: Tag) -> Tag:
        """A tag of the model in local time."""
        return Tag(self.local(tag.time), tag.microstep)
