"""Statistics that are kept up to date over numbers with weights: tokens weigh 1, spells of time their nanoseconds.

Sums are exact, and everything else is made of + - * / and square roots in the order in which numbers come: the same
bits on every machine.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from array import array
from fractions import Fraction
from itertools import chain
from typing import Any

from ..catalogue import Measure

_KEPT = 512  # numbers until they are summed up


class Total:
    """A sum that is exact until it is asked for."""

    def __init__(self) -> None:
        self._terms: list[float] = []

    def add(self, value: float) -> None:
        """One more number; raises ``OverflowError`` as soon as it is clear that the sum is beyond all floats."""
        if math.isinf(value):
            raise OverflowError
        self._terms.append(value)
        if len(self._terms) > _KEPT:
            self._terms = self._condensed()

    def _condensed(self) -> list[float]:
        """A few numbers with the same sum: the sum, what it is off by, and so on."""
        found: list[float] = []
        while (rest := math.fsum(chain(self._terms, (-each for each in found)))) != 0.0:
            found.append(rest)
        return found

    @property
    def value(self) -> float:
        """The sum, correctly rounded; raises ``OverflowError`` if it is beyond all floats."""
        return math.fsum(self._terms)


class Statistic(ABC):
    """Something that is known of the numbers so far."""

    @abstractmethod
    def add(self, value: Any, weight: int) -> None:
        """One more number."""

    @property
    @abstractmethod
    def value(self) -> Any:
        """What is known; None if there is no such thing yet.  Raises ``OverflowError``."""


class First(Statistic):
    """The first, or the last."""

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

    def __init__(self) -> None:
        self._count = 0

    def add(self, value: Any, weight: int) -> None:
        self._count += 1

    @property
    def value(self) -> int:
        return self._count


class Sum(Statistic):
    """Their sum, a whole number if all of them are."""

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

    def __init__(self) -> None:
        self._total = Total()
        self._weight = 0

    def add(self, value: float, weight: int) -> None:
        self._total.add(value * weight)
        self._weight += weight

    @property
    def value(self) -> float | None:
        return self._total.value / self._weight if self._weight else None


class Spread(Statistic):
    """Their standard deviation: of a sample, or with weights that are all there is.  Source: D. H. D. West (1979)."""

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
        return math.sqrt(max(self._squares, 0.0) / weight) if weight > 0 else None  # rounding knows no sign


class Quantile(Statistic):
    """The number below which a share of them lies, interpolated between two: type 7 of Hyndman and Fan."""

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
    """The least number such that at least a share of all weight is on it and those below."""

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


def statistic_of(measure: Measure) -> Statistic:
    """What a metric is taken with."""
    match measure.take:
        case "first" | "last" as take:
            return First(last=take == "last")
        case "min" | "max" as take:
            return Least(greatest=take == "max")
        case "count" | "rate":
            return Count()
        case "sum":
            return Sum()
        case "std" | "time_std" as take:
            return Spread(sample=take == "std")
        case "quantile":
            assert measure.p is not None
            return Quantile(measure.p)
        case "time_quantile":
            assert measure.p is not None
            return TimeQuantile(measure.p)
        case _:
            return Mean()
