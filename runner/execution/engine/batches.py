"""What one long run shows about its mean: an interval by batch means, and where the warm-up ends.

Batches need constant memory, however long the run: when there are too many, they are merged in pairs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from ...support.student import student_quantile
from ..results import Interval

BATCHES = 20  # more of them gain next to nothing (Schmeiser 1982)
MOST = 1024  # at most kept
OF_MSER = 5  # tokens in a batch
LEAST_OF_MSER = 10  # batches


class TokenBatches:
    """Sums over batches with equal numbers of tokens."""

    __slots__ = ("_count", "_size", "_sum", "_sums")

    def __init__(self) -> None:
        self._size = 1
        self._sums: list[float] = []
        self._sum = 0.0
        self._count = 0

    def add(self, value: float) -> None:
        """Take in a token."""
        self._sum += value
        self._count += 1
        if self._count == self._size:
            self._sums.append(self._sum)
            self._sum, self._count = 0.0, 0
            if len(self._sums) == MOST:
                self._sums = _pairs(self._sums)
                self._size *= 2

    def batches(self) -> tuple[list[float], list[float]]:
        """Their sums and weights, without an incomplete last one."""
        return self._sums, [float(self._size)] * len(self._sums)


class TimeBatches:
    """Sums over slices of time of equal width (ns), from ``start`` on: of values times their durations.

    At most ``most`` slices are kept; if more are needed, they are merged in pairs.
    """

    __slots__ = ("_covered", "_most", "_start", "_sums", "_width")

    def __init__(self, start: int, width: int = 1, most: int = MOST) -> None:
        self._start, self._width, self._most = start, width, most
        self._sums: list[float] = []
        self._covered: list[float] = []  # how long there was a value, over all ports

    def add(self, value: float, begin: int, end: int) -> None:
        """Add a value that lasts from ``begin`` to ``end``, neither before the start."""
        last = self._slice(end - 1)  # which may make them wider
        sums, covered, width = self._sums, self._covered, self._width
        for index in range((begin - self._start) // width, last + 1):
            edge = self._start + index * width
            length = float(min(end, edge + width) - max(begin, edge))
            before: float = sums[index]
            sums[index] = before + value * length
            before = covered[index]
            covered[index] = before + length

    def _slice(self, time: int) -> int:
        """The number of the slice of a time, which exists."""
        while (index := (time - self._start) // self._width) >= self._most:
            self._sums, self._covered = _pairs(self._sums), _pairs(self._covered)
            self._width *= 2
        if (missing := index + 1 - len(self._sums)) > 0:
            self._sums += [0.0] * missing
            self._covered += [0.0] * missing
        return index

    def count(self, time: int) -> None:
        """Count one arrival."""
        index = self._slice(time)
        self._sums[index] += 1.0

    def cover(self, end: int) -> None:
        """The observation lasted until ``end``."""
        self._slice(max(end - 1, self._start))
        for index in range(len(self._covered)):
            self._covered[index] = float(min(self._width, end - self._start - index * self._width))

    def batches(self, end: int) -> tuple[list[float], list[float]]:
        """Sums and weights of the slices complete at ``end``, from the first one with a value."""
        full = min((end - self._start) // self._width, len(self._sums))
        first = next((index for index in range(full) if self._covered[index] > 0), full)
        return self._sums[first:full], self._covered[first:full]


def _pairs(sums: list[float]) -> list[float]:
    """The values added in pairs; the last one may stay alone."""
    found = []
    for index in range(0, len(sums) - 1, 2):
        first: float = sums[index]
        second: float = sums[index + 1]
        found.append(first + second)
    return found + sums[len(sums) & ~1 :]


def batch_interval(sums: Sequence[float], weights: Sequence[float], value: float, level: float) -> Interval | None:
    """The interval around a mean, from the means of 20 batches; None if there are too few numbers.

    Student's interval with 19 degrees of freedom is widened by sqrt((1 + r) / (1 - r)), as for an autoregressive
    sequence of batch means; r is their autocorrelation at lag 1, less its bias, if this is above 0.
    Source: A. M. Law, *Simulation Modeling and Analysis*, 9.5.3; for the widening, A. Tafazzoli et al. (2011), Skart.
    """
    size = len(sums) // BATCHES
    if size == 0:
        return None
    first = len(sums) - size * BATCHES  # what does not fill equal batches is dropped at the start, where the warm-up is
    means = []
    for begin in range(first, len(sums), size):
        weight = math.fsum(weights[begin : begin + size])
        if weight == 0.0:
            return None
        means.append(math.fsum(sums[begin : begin + size]) / weight)
    mean = math.fsum(means) / BATCHES
    gaps = [each - mean for each in means]
    squares = math.fsum(gap * gap for gap in gaps)
    products = math.fsum(gap * other for gap, other in pairwise(gaps))
    correlation = products / squares if squares > 0.0 else 0.0
    known = min(max(correlation + 1.0 / BATCHES, 0.0), 0.99)
    variance = squares / (BATCHES - 1) / BATCHES * (1.0 + known) / (1.0 - known)
    half = student_quantile((1.0 + level) / 2.0, BATCHES - 1) * math.sqrt(variance)
    return Interval(level, value - half, value + half, BATCHES, correlation)


def mser(means: Sequence[float]) -> int | None:
    """How many batches are warm-up: those whose removal makes the standard error of the mean least.

    That is the d with the least sum of (x - mean)^2 / (n - d)^2 over the n - d others.  None if the end of the warm-up
    is in the second half of the run, which then is too short.
    Source: K. P. White, *An effective truncation heuristic for bias reduction in simulation output*, Simulation 69
    (1997); K. P. White, M. J. Cobb, S. C. Spratt, WSC 2000.
    """
    mean, squares = 0.0, 0.0
    best, least = 0, math.inf
    for count in range(1, len(means) + 1):  # from the end, so that each d costs one step
        place = len(means) - count
        gap = means[place] - mean
        mean += gap / count
        squares += gap * (means[place] - mean)
        if count >= OF_MSER and squares / (count * count) <= least:
            best, least = place, squares / (count * count)
    return best if best <= len(means) // 2 else None
