"""Wrong clocks: actors that see a time other than the model's."""

from __future__ import annotations

from abc import abstractmethod
from fractions import Fraction
from typing import ClassVar

from epicycle.actors import Parameter, Stream, to_nanoseconds

from .core import Aspect


class ClockAspect(Aspect):
    """Base of the aspects that change what actors see as the time: write ``error``.

    ``now`` and the tags that an actor sees, its wake-ups and the waits of a process follow its clock.  The model around
    it, the delays of connections, other aspects and the event log keep their time.  Each target has one clock: all the
    actors of a composite share it.  Several errors of one clock add up.
    """

    refused: ClassVar[dict[str, str]] = {
        name: f"a clock is wrong for the whole run; leave out {name!r}" for name in ("from", "until", "every", "when")
    }

    @abstractmethod
    def error(self, random: Stream) -> tuple[int, Fraction]:
        """How far a clock is ahead at the start (ns), and how many times as fast it runs."""


class ClockDrift(ClockAspect):
    """Makes a clock run too fast or too slowly.

    After a time t of the surrounding clock, it has advanced by (1 + g) t, rounded down to a nanosecond.  g is ``gain``,
    or drawn once for each clock from N(``gain``, ``deviation``^2).  A crystal oscillator has errors of tens of parts
    per million.
    Ptolemy: the drift of ``LocalClock``.
    """

    gain = Parameter(
        float,
        0.0,
        unit="1",
        min=-0.999999,
        max=1e6,
        doc="seconds that the clock gains per second; negative if it loses",
    )
    deviation = Parameter(float, 0.0, unit="1", min=0.0, max=1e6, doc="standard deviation from clock to clock")

    def error(self, random: Stream) -> tuple[int, Fraction]:
        draw = self.deviation * random.standard_normal()
        # The decimals as written: 0.1 is a tenth here, and not the nearest binary fraction.
        return 0, max(Fraction(1, 1_000_000), 1 + Fraction(repr(self.gain)) + Fraction(repr(draw)))


class ClockOffset(ClockAspect):
    """Sets a clock ahead or back for the whole run.

    The offset is ``offset``, or drawn once for each clock from N(``offset``, ``deviation``^2).  Actions of an actor
    after a delay are not affected; actions at an absolute time are, as are the times in its messages.
    """

    offset = Parameter(
        float, 0.0, unit="s", min=-1e9, max=1e9, doc="how far the clock is ahead; negative if it is behind"
    )
    deviation = Parameter(float, 0.0, min=0.0, max=1e8, unit="s", doc="standard deviation from clock to clock")

    def error(self, random: Stream) -> tuple[int, Fraction]:
        return to_nanoseconds(self.offset + self.deviation * random.standard_normal()), Fraction(1)
