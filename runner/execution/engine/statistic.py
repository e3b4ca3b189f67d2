"""Running statistics of numbers with weights: tokens weigh 1, spells of time their nanoseconds.

Sums are exact, and everything else uses + - * / and square roots in the order of the numbers: the same bits on every
machine.
"""

from __future__ import annotations

import math
import sys
from array import array
from fractions import Fraction
from itertools import chain
from typing import Any

from ...model.catalogue.metrics import MetricSpec

MOST = sys.float_info.max
NANOSECONDS = 1e9  # in a second
_KEPT = 512  # numbers until they are summed up


class Total:
    """A sum that is exact until it is read."""

    __slots__ = ("_terms",)

    def __init__(self) -> None:
        self._terms: list[float] = []

    def add(self, value: float) -> None:
        """Add a number; raises ``OverflowError`` once the sum is certain to exceed the range of floats."""
        if not -MOST <= value <= MOST:
            raise OverflowError
        self._terms.append(value)
        if len(self._terms) > _KEPT:
            self._terms = self._condensed()

    def _condensed(self) -> list[float]:
        """A few numbers with the same sum: the rounded sum, its error, and so on."""
        found: list[float] = []
        while (rest := math.fsum(chain(self._terms, (-each for each in found)))) != 0.0:
            found.append(rest)
        return found

    @property
    def value(self) -> float:
        """The sum, correctly rounded; raises ``OverflowError`` if it exceeds the range of floats."""
        return math.fsum(self._terms)


class Statistic:
    """A statistic of the numbers so far."""

    __slots__ = ()

    def add(self, value: Any, weight: int) -> None:
        """One more number."""
        raise NotImplementedError

    @property
    def value(self) -> Any:
        """Its value; None if there is none yet.  Raises ``OverflowError``."""
        raise NotImplementedError


class First(Statistic):
    """The first, or the last."""

    __slots__ = ("_is_empty", "_last", "_value")

    def __init__(self, *, last: bool = False) -> None:
        self._last = last
        self._is_empty = True
        self._value: Any = None

    def add(self, value: Any, weight: int) -> None:
        if self._is_empty or self._last:
            self._value, self._is_empty = value, False

    @property
    def value(self) -> Any:
        return self._value


class Least(Statistic):
    """The least, or the greatest."""

    __slots__ = ("_greatest", "_value")

    def __init__(self, *, greatest: bool = False) -> None:
        self._greatest = greatest
        self._value: Any = None

    def add(self, value: Any, weight: int) -> None:
        if self._value is None or (value > self._value if self._greatest else value < self._value):
            self._value = value

    @property
    def value(self) -> Any:
        return self._value


class Count(Statistic):
    """How many there are."""

    __slots__ = ("_count",)

    def __init__(self) -> None:
        self._count = 0

    def add(self, value: Any, weight: int) -> None:
        self._count += 1

    @property
    def value(self) -> int:
        return self._count


class Sum(Statistic):
    """Their sum, a whole number if all of them are."""

    __slots__ = ("_rest", "_whole")

    def __init__(self) -> None:
        self._whole = 0
        self._rest: Total | None = None

    def add(self, value: Any, weight: int) -> None:
        if isinstance(value, int):
            self._whole += value
            return
        if self._rest is None:
            self._rest = Total()
        self._rest.add(float(value))

    @property
    def value(self) -> float | int:
        return self._whole if self._rest is None else float(self._whole) + self._rest.value


class Mean(Statistic):
    """Their weighted mean."""

    __slots__ = ("_total", "_weight")

    def __init__(self) -> None:
        self._total = Total()
        self._weight = 0

    def add(self, value: Any, weight: int) -> None:
        number: float = value
        self._total.add(number * weight)
        self._weight += weight

    @property
    def value(self) -> float | None:
        return self._total.value / self._weight if self._weight else None


class Integral(Mean):
    """Their sum with each weighted by the seconds that it lasts."""

    __slots__ = ()

    @property
    def value(self) -> float | None:
        return self._total.value / NANOSECONDS if self._weight else None


class Spread(Statistic):
    """Their standard deviation: of a sample or, with weights, of the population.  Source: D. H. D. West (1979)."""

    __slots__ = ("_is_sample", "_mean", "_squares", "_weight")

    def __init__(self, *, sample: bool) -> None:
        self._is_sample = sample
        self._weight = 0
        self._mean = 0.0
        self._squares = 0.0

    def add(self, value: float, weight: int) -> None:
        self._weight += weight
        gap = value - self._mean
        self._mean += gap * (weight / self._weight)
        self._squares += gap * (value - self._mean) * weight

    @property
    def value(self) -> float | None:
        weight = self._weight - self._is_sample
        return math.sqrt(max(self._squares, 0.0) / weight) if weight > 0 else None  # rounding may make it negative


class Quantile(Statistic):
    """The number below which a share of them lies, interpolated between two: type 7 of Hyndman and Fan."""

    __slots__ = ("_p", "_values")

    def __init__(self, p: float) -> None:
        self._p = p
        self._values = array("d")

    def add(self, value: float, weight: int) -> None:
        self._values.append(value)

    @property
    def value(self) -> float | None:
        if not self._values:
            return None
        ordered = sorted(self._values)
        place = (len(ordered) - 1) * self._p
        below = int(place)
        rest = place - below
        return ordered[below] + rest * (ordered[below + 1] - ordered[below]) if rest else ordered[below]


class TimeQuantile(Statistic):
    """The least number such that it and the lower ones have at least a share of all weight."""

    __slots__ = ("_p", "_weights")

    def __init__(self, p: float) -> None:
        self._p = Fraction(p)
        self._weights: dict[float, int] = {}

    def add(self, value: float, weight: int) -> None:
        self._weights[value] = self._weights.get(value, 0) + weight

    @property
    def value(self) -> float | None:
        wanted = self._p * sum(self._weights.values())
        below = 0
        for value in sorted(self._weights):
            below += self._weights[value]
            if below >= wanted:
                return value
        return None


def statistic_of(measure: MetricSpec) -> Statistic:
    """The statistics of metrics by name."""
    take, p = measure.take, measure.p
    if take in ("first", "last"):
        return First(last=take == "last")
    if take in ("min", "max"):
        return Least(greatest=take == "max")
    if take in ("count", "rate"):
        return Count()
    if take == "sum":
        return Sum()
    if take in ("integral", "duration"):
        return Integral()
    if take in ("std", "time_std"):
        return Spread(sample=take == "std")
    if take in ("quantile", "time_quantile"):
        assert p is not None
        return Quantile(p) if take == "quantile" else TimeQuantile(p)
    return Mean()
