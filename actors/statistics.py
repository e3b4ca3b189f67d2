"""Statistics of the latest tokens: MovingAverage, MovingStatistics.

Sums are kept as exact fractions, so that values leaving the window leave no rounding error: after a million tokens the
mean is as exact as if the window were summed again.
"""

from __future__ import annotations

import math
import operator
from collections import deque
from fractions import Fraction

from .core import Actor, EpicycleError, InputPort, OutputPort, Parameter, ParameterError, to_nanoseconds


class _Window(Actor):
    """The common part of these actors: the window, and the exact sums over it."""

    input = InputPort(float, doc="the numbers")

    size = Parameter(int, None, min=1, doc="number of latest tokens in the window")
    span = Parameter(float, None, unit="s", min=0, doc="largest age of a token in the window, inclusive")

    def check(self) -> None:
        if self.size is None and self.span is None:
            raise ParameterError("give a window: 'size', a number of tokens, or 'span', a time, or both")

    def initialize(self) -> None:
        self._times: deque[int] = deque()
        self._values: deque[float] = deque()
        self._sum = Fraction(0)

    def _enter(self, value: float) -> None:
        """Take a token into the window, and remove those that it displaces."""
        if not math.isfinite(value):
            raise EpicycleError(f"{value!r} is not a finite number, and cannot be part of a statistic")
        now = self.tag.time
        self._times.append(now)
        self._values.append(value)
        self._count(value, 1)
        oldest = None if self.span is None else now - to_nanoseconds(self.span)
        while (self.size is not None and len(self._values) > self.size) or (
            oldest is not None and self._times[0] < oldest
        ):
            self._times.popleft()
            self._count(self._values.popleft(), -1)

    def _count(self, value: float, sign: int) -> None:
        self._sum += sign * Fraction(value)

    @property
    def _mean(self) -> Fraction:
        return self._sum / len(self._values)


class MovingAverage(_Window):
    """The mean of the latest tokens, correctly rounded.

    It is sent for each token; until the window is full, it is over the tokens so far.
    Ptolemy: ``MovingAverage``; over a span without end and ``whole``, ``Average``.
    """

    reset = InputPort(required=False, doc="a true token empties the window, before the tokens of the tag are added")
    output = OutputPort(float, doc="the mean")

    whole = Parameter(bool, False, doc="whether the mean of whole numbers is rounded to a whole number, towards zero")

    def fire(self) -> None:
        if any(token is True for token in self.reset.tokens):
            self.initialize()
        for token in self.input.tokens:
            self._enter(token)
            is_whole = self.whole and isinstance(token, int)
            self.output.send(math.trunc(self._mean) if is_whole else float(self._mean))


class MovingStatistics(_Window):
    """Mean, standard deviation, minimum and maximum of the latest tokens; sent for each token.

    ``std`` is the sample standard deviation ``sqrt(sum((x - mean)^2) / (n - 1))``, sent from two tokens on.
    """

    mean = OutputPort(float, doc="the mean")
    std = OutputPort(float, doc="the sample standard deviation, sent from two tokens on")
    min = OutputPort(float, doc="the least")
    max = OutputPort(float, doc="the greatest")
    number = OutputPort(int, doc="number of tokens in the window")

    def initialize(self) -> None:
        super().initialize()
        self._squares = Fraction(0)
        # (number of the token, value): values that can no longer be the extreme of a window are dropped.
        self._least: deque[tuple[int, float]] = deque()
        self._greatest: deque[tuple[int, float]] = deque()
        self._entered = 0

    def _count(self, value: float, sign: int) -> None:
        super()._count(value, sign)
        self._squares += sign * Fraction(value) ** 2

    def fire(self) -> None:
        for token in self.input.tokens:
            self._enter(token)
            self._rank(token)
            number = len(self._values)
            self.mean.send(float(self._mean))
            if number > 1:
                variance = (self._squares - self._sum**2 / number) / (number - 1)
                self.std.send(root(variance))
            self.min.send(self._least[0][1])
            self.max.send(self._greatest[0][1])
            self.number.send(number)

    def _rank(self, token: float) -> None:
        for extremes, beats in ((self._least, operator.le), (self._greatest, operator.ge)):
            while extremes and beats(token, extremes[-1][1]):
                extremes.pop()
            extremes.append((self._entered, token))
            while extremes[0][0] <= self._entered - len(self._values):
                extremes.popleft()
        self._entered += 1


def root(square: Fraction) -> float:
    """The square root of a fraction that may be too large for a float; infinite if the root is, too."""
    shift = (square.numerator.bit_length() - square.denominator.bit_length()) // 2
    scaled = square / Fraction(4) ** shift  # close to 1
    try:
        return math.ldexp(math.sqrt(scaled), shift)
    except OverflowError:
        return math.inf
