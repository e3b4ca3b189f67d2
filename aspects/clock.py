"""Clocks that are wrong: actors that see another time than the model's."""

from __future__ import annotations

from abc import abstractmethod
from fractions import Fraction
from typing import ClassVar

from epicycle.actors import Parameter, Stream, to_nanoseconds

from .core import Aspect


class ClockAspect(Aspect):
    """Base of the aspects that change what actors see as the time: write ``error``.

    ``now`` and the tags that an actor sees, its wake-ups and the waits of a process go by its clock.  The model around
    it, the delays of connections, other aspects and the event log keep their time.  What the aspect is aimed at has
    one clock: all the actors of a composite.  Several errors of one clock add up.
    """

    refused: ClassVar[dict[str, str]] = {
        name: f"a clock is wrong from the beginning of a run to its end: leave out {name!r}"
        for name in ("from", "until", "every", "when")
    }

    @abstractmethod
    def error(self, random: Stream) -> tuple[int, Fraction]:
        """How far a clock is ahead in the beginning (ns), and how many times as fast it goes."""


class ClockDrift(ClockAspect):
    """Makes a clock run too fast or too slowly.

    After the time t of the clock around it, it has gone on by (1 + g) t, to the nanosecond below.  g is ``gain``, or
    drawn once for each clock from N(``gain``, ``deviation``^2).  A crystal oscillator is good for some ten millionths.
    Ptolemy: the drift of ``LocalClock``.
    """

    gain = Parameter(
        float, 0.0, unit="1", min=-0.999999, max=1e6, doc="seconds that the clock gains in a second; below 0 it loses"
    )
    deviation = Parameter(float, 0.0, unit="1", min=0.0, max=1e6, doc="standard deviation of that from clock to clock")

    def error(self, random: Stream) -> tuple[int, Fraction]:
        draw = self.deviation * random.standard_normal()
        # The decimals as they were written: 0.1 is a tenth here, and not the nearest binary fraction.
        return 0, max(Fraction(1, 1_000_000), 1 + Fraction(repr(self.gain)) + Fraction(repr(draw)))


class ClockOffset(ClockAspect):
    """Sets a clock ahead or back for the whole run.

    The offset is ``offset``, or drawn once for each clock from N(``offset``, ``deviation``^2).  What an actor does
    after some time is not affected; what it does at a time is, and what it says of the time.
    """

    offset = Parameter(float, 0.0, unit="s", min=-1e9, max=1e9, doc="how far the clock is ahead; below 0 it is late")
    deviation = Parameter(float, 0.0, min=0.0, max=1e8, unit="s", doc="standard deviation of that from clock to clock")

    def error(self, random: Stream) -> tuple[int, Fraction]:
        return to_nanoseconds(self.offset + self.deviation * random.standard_normal()), Fraction(1)
