"""Generators of other programs, whose numbers a model may ask for to be compared with them: JavaRandom, DRand.

Everybody else takes the numbers of the actor's own stream, which depend on the run's seed and the actor's path alone.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import Any

from .core import Configurable, EpicycleError, Parameter, elementary

_OF_LONG = 2**64 - 1
_STEP = 1.0 / 2**53


class Numbers:
    """Random numbers with those methods of a ``Stream`` that distributions ask for: write ``random``."""

    def __init__(self) -> None:
        self._gaussian: float | None = None  # which is left of a pair

    def random(self) -> float:
        """Uniform in [0, 1)."""
        raise NotImplementedError

    def weighted(self, sums: Sequence[float]) -> int:
        """An index, as likely as its weight; ``sums`` are those of the weights up to each."""
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

    def lognormal(self, mean: float = 0.0, sigma: float = 1.0) -> float:
        """A number whose logarithm is normal."""
        return elementary.exp(self.normal(mean, sigma))

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
        raise EpicycleError(f"a generator of another program has no {name!r}: leave 'generator' out")


class Generator(Configurable):
    """Base of the generators of other programs."""

    def numbers(self) -> Numbers:
        """Its numbers from the first on."""
        raise NotImplementedError(f"{type(self).__name__} has no numbers()")


class _OfJava(Numbers):
    def __init__(self, seed: int) -> None:
        super().__init__()
        self._state = (seed ^ 0x5DEECE66D) % 2**48

    def _bits(self, count: int) -> int:
        self._state = (self._state * 0x5DEECE66D + 0xB) % 2**48
        return self._state >> 48 - count

    def random(self) -> float:
        return ((self._bits(26) << 27) + self._bits(27)) * _STEP


class JavaRandom(Generator):
    """``java.util.Random``, of which most random actors of Ptolemy II take their numbers.

    There the seed is ``privateSeed``, or ``seed`` plus Java's hash of the actor's full name, ``.Model.Actor``.
    Source: Lehmer's linear congruential generator modulo 2^48, as the documentation of Java 8 gives it.
    """

    seed = Parameter(int, doc="the seed, a whole number of 64 bits")

    def numbers(self) -> Numbers:
        return _OfJava(self.seed & _OF_LONG)


class _OfDRand(Numbers):
    def __init__(self, seed: int) -> None:
        super().__init__()
        seed = abs((seed + 2**31) % 2**32 - 2**31)  # of 32 bits, with its sign
        self._state = 4 * (seed if seed < (2**32 - 1) // 4 else seed >> 3) + 1

    def random(self) -> float:
        self._state = self._state * 0x278DDE6D % 2**32
        return self._state * 2.3283064365386963e-10

    def exponential(self, mean: float = 1.0) -> float:
        return -elementary.log(self.random()) * mean

    def _pair(self) -> tuple[float, float]:
        x, y = super()._pair()
        return y, x


class DRand(Generator):
    """The generator of the Colt library, of which the actors of Ptolemy II that are called Colt take their numbers.

    The seed is as for ``JavaRandom``.  Source: Colt 1.2, ``cern.jet.random.engine.DRand``, after Marsaglia's remarks on
    congruential generators modulo 2^32.
    """

    seed = Parameter(int, doc="the seed, a whole number of 32 bits")

    def numbers(self) -> Numbers:
        return _OfDRand(self.seed)
