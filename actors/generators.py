"""Generators of other programs, so that a model can be compared with them: JavaRandom, DRand.

All other models use the actor's own stream, which depends only on the seed of the run and the path of the actor.
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
    """Random numbers with the methods of a ``Stream`` that distributions use: write ``random``."""

    def __init__(self) -> None:
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
        raise EpicycleError(f"a generator of another program has no {name!r}; leave out 'generator'")


class Generator(Configurable):
    """Base of the generators of other programs."""

    def numbers(self) -> Numbers:
        """Its numbers, from the first one."""
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
    """``java.util.Random``, from which most random actors of Ptolemy II draw their numbers.

    In Ptolemy, the seed is ``privateSeed``, or ``seed`` plus Java's hash of the actor's full name, ``.Model.Actor``.
    Source: Lehmer's linear congruential generator modulo 2^48, as given in the documentation of Java 8.
    """

    seed = Parameter(int, doc="the seed, a whole number of which the last 64 bits are used")

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

    def gamma(self, shape: float, scale: float = 1.0) -> float:
        """Gamma, by the methods GS and GD of Ahrens and Dieter (Computing 12, 1974, and CACM 25, 1982)."""
        return scale * (self._small_gamma(shape) if shape < 1.0 else self._large_gamma(shape))

    def _small_gamma(self, shape: float) -> float:
        height = 1.0 + 0.36788794412 * shape
        while True:
            place = height * self.random()
            if place <= 1.0:
                found = elementary.exp(elementary.log(place) / shape)
                bound = -found
            else:
                found = -elementary.log((height - place) / shape)
                bound = (shape - 1.0) * elementary.log(found)
            if elementary.log(self.random()) <= bound:
                return found

    def _large_gamma(self, shape: float) -> float:
        square = shape - 0.5
        root = math.sqrt(square)
        normal = self._pair()[1]  # the first of the two, from separate numbers
        guess = root + 0.5 * normal
        if normal >= 0.0:
            return guess * guess
        uniform = self.random()
        if (5.656854249 - 12.0 * root) * uniform <= normal * normal * normal:
            return guess * guess
        first = _polynomial(_Q, 1.0 / shape)

        def quotient(t: float) -> float:
            share = t / (root + root)
            if abs(share) > 0.25:
                return first - root * t + 0.25 * t * t + (square + square) * elementary.log(1.0 + share)
            return first + 0.5 * t * t * _polynomial(_A, share)

        if guess > 0.0 and elementary.log(1.0 - uniform) <= quotient(normal):
            return guess * guess
        if shape <= 3.686:
            shift, width, hat = 0.463 + root - 0.178 * square, 1.235, 0.195 / root - 0.079 + 0.016 * root
        elif shape <= 13.022:
            shift, width, hat = 1.654 + 0.0076 * square, 1.68 / root + 0.275, 0.062 / root + 0.024
        else:
            shift, width, hat = 1.77, 0.75, 0.1515 / root
        while True:
            size = -elementary.log(self.random())
            side = 2.0 * self.random() - 1.0
            t = shift + math.copysign(size * width, side)
            if t <= -0.71874483771719:
                continue
            q = quotient(t)
            if q <= 0.0:
                continue
            grown = elementary.exp(q) - 1.0 if q > 0.5 else _polynomial(_E, q)
            if hat * abs(side) <= grown * elementary.exp(size - 0.5 * t * t):
                guess = root + 0.5 * t
                return guess * guess

    def poisson(self, mean: float) -> int:
        """Poisson with a mean below 10, by inversion."""
        if not mean < 10.0:
            raise EpicycleError(
                f"DRand draws Poisson numbers only with a mean below 10, not {mean:g}; leave out 'generator'"
            )
        while True:
            share = self.random()
            chance = total = elementary.exp(-mean)
            for number in range(36):
                if number:
                    chance *= mean / number
                    total += chance
                if share <= total:
                    return number

    def binomial(self, trials: int, probability: float) -> int:
        """Binomial with a mean of fewer than 10 successes or failures, by inversion."""
        small = min(probability, 1.0 - probability)
        mean, other = trials * small, 1.0 - small
        if not mean < 10.0:
            raise EpicycleError(
                f"DRand draws binomial numbers only with a mean below 10, not {mean:g}; leave out 'generator'"
            )
        if mean == 0.0:
            return trials if probability == 1.0 else 0
        most = min(trials, int(mean + 10.0 * math.sqrt(mean * other)))
        none = elementary.exp(trials * elementary.log(other))
        number, chance, share = 0, none, self.random()
        while share > chance:
            number += 1
            if number > most:
                number, chance, share = 0, none, self.random()
            else:
                share -= chance
                chance = (trials - number + 1) * small * chance / (number * other)
        return trials - number if probability > 0.5 else number

    def negative_binomial(self, successes: float, probability: float) -> int:
        """Failures before a number of successes: Poisson with a gamma mean."""
        return self.poisson((1.0 - probability) / probability * self.gamma(successes))

    def chisquare(self, freedom: float) -> float:
        """Chi-square, by Monahan's ratio of uniforms for its root (ACM TOMS 13, 1987)."""
        shift = math.sqrt(freedom - 1.0) if freedom > 1.0 else 0.0
        low = max(-0.6065306597 * (1.0 - 0.25 / (shift * shift + 1.0)), -shift)
        high = 0.6065306597 * (0.7071067812 + shift) / (0.5 + shift)
        width = high - low if shift else 0.857763884960707
        while True:
            u = self.random()
            z = (self.random() * width + (low if shift else 0.0)) / u
            if z < -shift:
                continue
            square = z * z
            rest = 2.5 - square + (square * z / (3.0 * (z + shift)) if z < 0.0 else 0.0)
            found = (z + shift) * (z + shift)
            if u < rest * 0.3894003915:
                return found
            if square > 1.036961043 / u + 1.4:
                continue
            drift = elementary.log(1.0 + z / shift) * shift * shift - z * shift if shift else 0.0
            if 2.0 * elementary.log(u) < drift - square * 0.5:
                return found

    def standard_t(self, freedom: float) -> float:
        """Student's t, by Bailey's polar method (Mathematics of Computation 62, 1994)."""
        while True:
            x, y = 2.0 * self.random() - 1.0, 2.0 * self.random() - 1.0
            square = x * x + y * y
            if square <= 1.0:
                grown = elementary.exp(-2.0 / freedom * elementary.log(square)) - 1.0
                return x * math.sqrt(freedom * grown / square)

    def standard_cauchy(self) -> float:
        """Cauchy, by inversion."""
        return elementary.tan((2.0 * self.random() - 1.0) * (math.pi / 2.0))

    def vonmises(self, mean: float, concentration: float) -> float:
        """Von Mises, by the method of Best and Fisher (Applied Statistics 28, 1979).

        Raises ``EpicycleError`` where the ratios lose all digits, and Colt's own loop does not end.
        """
        if not 1e-6 <= concentration <= 1e6:
            raise EpicycleError(
                f"DRand draws angles only with a concentration from 1e-6 to 1e6, not {concentration:g}; leave out "
                "'generator'"
            )
        tau = 1.0 + math.sqrt(1.0 + 4.0 * concentration * concentration)
        rho = (tau - math.sqrt(2.0 * tau)) / (2.0 * concentration)
        r = (1.0 + rho * rho) / (2.0 * rho)
        while True:
            u, v = self.random(), self.random()
            z = elementary.cos(math.pi * u)
            w = (1.0 + r * z) / (r + z)
            c = concentration * (r - w)
            if c * (2.0 - c) >= v or elementary.log(c / v) + 1.0 >= c:
                angle = elementary.acos(w)
                return mean + (angle if self.random() > 0.5 else -angle)


# Of Ahrens and Dieter, 1982: lowest power first, starting with the first.
_Q = (
    0.0416666664, 0.0208333723, 0.0079849875, 0.0015746717, -0.0003349403, 0.0003340332, 0.0006053049, -0.0004701849,
    0.0001710320,
)  # fmt: skip
_A = (
    0.333333333, -0.249999949, 0.199999867, -0.166677482, 0.142873973, -0.124385581, 0.110368310, -0.112750886,
    0.104089866,
)  # fmt: skip
_E = (1.0, 0.499999994, 0.166666848, 0.041664508, 0.008345522, 0.001353826, 0.000247453)


def _polynomial(coefficients: Sequence[float], x: float) -> float:
    """``c[0] x + c[1] x^2 + ...``"""
    found = 0.0
    for each in reversed(coefficients):
        found = (found + each) * x
    return found


class DRand(Generator):
    """The generator of the Colt library, from which the actors of Ptolemy II named Colt draw their numbers.

    The seed is as for ``JavaRandom``.  Laws of whole numbers are supported for means below 10.  Source: Colt 1.2,
    ``cern.jet.random``, after the papers that it cites.
    """

    seed = Parameter(int, doc="the seed, a whole number of which the last 32 bits are used")

    def numbers(self) -> Numbers:
        return _OfDRand(self.seed)
