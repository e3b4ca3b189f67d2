"""Java's random numbers: the generators JavaRandom and DRand, and the actors that may use them."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import Any

from epicycle import actors
from epicycle.actors import Actor, Configurable, EpicycleError, InputPort, OutputPort, Parameter, elementary, rounds

LAWS = frozenset({"Bernoulli", "Choice", "Constant", "Exponential", "Normal", "Triangular", "Uniform"})
"""The distributions that can be drawn with these generators."""


class Numbers:
    """Random numbers with the methods of a ``Stream`` that distributions use: write ``random``."""

    def __init__(self, state: int) -> None:
        self._state = state
        self._gaussian: float | None = None  # the second of a pair

    def random(self) -> float:
        """Uniform in [0, 1)."""
        raise NotImplementedError

    def weighted(self, sums: Sequence[float]) -> int:
        """An index with a probability in proportion to its weight; ``sums`` are the cumulated weights."""
        return min(bisect_left(sums, self.random() * sums[-1]), len(sums) - 1)

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        """Uniform in [low, high)."""
        return self.random() * (high - low) + low

    def normal(self, mean: float = 0.0, deviation: float = 1.0) -> float:
        """Normal, by the polar method of Marsaglia."""
        if self._gaussian is not None:
            found, self._gaussian = self._gaussian, None
        else:
            found, self._gaussian = self._pair()
        return mean + deviation * found

    def _pair(self) -> tuple[float, float]:
        while True:
            x, y = 2.0 * self.random() - 1.0, 2.0 * self.random() - 1.0
            square = x * x + y * y
            if 0.0 < square < 1.0:
                factor = math.sqrt(-2.0 * elementary.log(square) / square)
                return x * factor, y * factor

    def exponential(self, mean: float = 1.0) -> float:
        """Exponential, by inversion."""
        return -elementary.log(1.0 - self.random()) * mean

    def triangular(self, low: float, mode: float, high: float) -> float:
        """Triangular, by inversion."""
        share, whole = self.random(), high - low
        if share * whole <= mode - low:
            return low + math.sqrt(share * whole * (mode - low))
        return high - math.sqrt((1.0 - share) * whole * (high - mode))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        raise EpicycleError(f"a generator of Java's has no {name!r}; leave out 'generator'")


class Generator(Configurable):
    """A generator of another program, for an actor to use in place of its own stream."""

    seed = Parameter(int, doc="a whole number")

    def numbers(self) -> Numbers:
        """Its numbers, from the first one."""
        raise NotImplementedError


class _OfJava(Numbers):
    def _bits(self, count: int) -> int:
        self._state = (self._state * 0x5DEECE66D + 0xB) % 2**48
        return self._state >> 48 - count

    def random(self) -> float:
        return ((self._bits(26) << 27) + self._bits(27)) / 2**53


class JavaRandom(Generator):
    """``java.util.Random``, from which most random actors of Ptolemy II draw their numbers.

    In Ptolemy, the seed is ``privateSeed``, or ``seed`` plus Java's hash of the actor's full name, ``.Model.Actor``.
    Source: Lehmer's linear congruential generator modulo 2^48, as given in the documentation of Java 8.
    """

    def numbers(self) -> Numbers:
        return _OfJava((self.seed ^ 0x5DEECE66D) % 2**48)


class _OfDRand(Numbers):
    def random(self) -> float:
        self._state = self._state * 0x278DDE6D % 2**32
        return self._state * 2.3283064365386963e-10

    def exponential(self, mean: float = 1.0) -> float:
        return -elementary.log(self.random()) * mean

    def _pair(self) -> tuple[float, float]:
        x, y = super()._pair()
        return y, x


class DRand(Generator):
    """The generator of the Colt library, from which the actors of Ptolemy II named Colt draw their numbers.

    The seed is as for ``JavaRandom``.  Source: Colt 1.2, ``cern.jet.random``.
    """

    def numbers(self) -> Numbers:
        seed = abs((self.seed + 2**31) % 2**32 - 2**31)  # of 32 bits, with its sign
        return _OfDRand(4 * (seed if seed < (2**32 - 1) // 4 else seed >> 3) + 1)


class _Drawing(Actor):
    """An actor that may draw from a generator."""

    generator = Parameter(Generator, None, doc="the generator to draw from; the actor's own stream if left out")

    def check(self) -> None:
        super().check()
        self._numbers = None if self.generator is None else self.generator.numbers()

    @property
    def random(self) -> Any:
        """The numbers of the generator, or else the actor's random stream."""
        return super().random if self._numbers is None else self._numbers


class Random(_Drawing, actors.Random):
    """Sends a token drawn from ``distribution`` for each trigger, with the numbers of a ``generator`` if it has one."""


class VaryingRandom(_Drawing, actors.VaryingRandom):
    """A ``Random`` whose distribution changes during the run."""


class Rician(_Drawing):
    """Sends, for each trigger, how far a point is from the origin whose two coordinates are drawn from normal laws.

    Ptolemy: ``Rician``.
    """

    trigger: InputPort[Any] = InputPort(multi=True, doc="when to send")
    output = OutputPort(float, doc="the drawn distance")

    x_mean = Parameter(float, 0.0, doc="the mean of the first coordinate")
    y_mean = Parameter(float, 0.0, doc="the mean of the second coordinate")
    standard_deviation = Parameter(float, 1.0, min=0, doc="the standard deviation of both")

    def fire(self) -> None:
        for _ in rounds(self.trigger):
            x = self.random.normal(self.x_mean, self.standard_deviation)
            y = self.random.normal(self.y_mean, self.standard_deviation)
            self.output.send(math.sqrt(x * x + y * y))


class PoissonClock(_Drawing, actors.PoissonClock):
    """Ticks at random: each of several triggers that come together causes a tick.

    The very last tick is the first one at or after ``stop_time``.
    """

    def initialize(self) -> None:
        self._tick = 0
        self._rest = 0.0
        self._is_over = False
        self._wake = self.context.wake(self, self.tag.time + (0 if self.fire_at_start else self.interval()))

    def interval(self) -> int:
        if self._numbers is None:
            return super().interval()
        # The rounding to whole nanoseconds is added to the next wait, or the difference to Java would accumulate.
        interval = self._numbers.exponential(self.mean_interval) + self._rest
        self._rest = interval - actors.to_seconds(actors.to_nanoseconds(interval))
        return actors.to_nanoseconds(interval)

    def fire(self) -> None:
        if self._is_over:
            return
        if self._wake is not None and not self._wake.due:
            self._wake.cancel()
        for _ in range(max(1, len(list(rounds(self.trigger))))):
            self._send(self._tick)
            self._tick += 1
            interval = self.interval()
            if self.stop_time is not None and self.tag.time >= actors.to_nanoseconds(self.stop_time):
                self._is_over, self._wake = True, None
                return
        self._wake = self.context.wake(self, self.tag.time + interval)
