"""The common part of all steppers: the scale of errors, step size control, and the polynomial along a step.

Everything here is computed in plain floats with + - * / and square roots, in a fixed order, so that a solution has
the same bits on every processor.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import add, mul, sub
from typing import Final

from ..core.elementary import total

State = list[float]
Derivative = Callable[[float, State], list[float]]
Bounds = tuple[float, float]

SHRINK_LIMIT: Final = 0.2  # a step becomes shorter by at most this factor at once,
GROWTH_LIMIT: Final = 10.0  # and longer by at most this one
_BITS: Final = 14


def root_power(base: float, exponent: float) -> float:
    """``base ** exponent`` for an exponent from 0 to 1, used to 14 binary places: square roots suffice."""
    result = 1.0
    for _ in range(_BITS):
        base = math.sqrt(base)
        exponent += exponent
        if exponent >= 1.0:
            exponent -= 1.0
            result *= base
            if exponent == 0.0:
                break
    return result


def norm(values: Sequence[float], scale: Sequence[float]) -> float:
    """The root mean square of the values, each divided by its scale."""
    squares = 0.0
    for value, unit in zip(values, scale, strict=True):
        ratio = value / unit
        squares += ratio * ratio
    return math.sqrt(squares / len(scale))


def added(one: Sequence[float], other: Sequence[float]) -> State:
    return list(map(add, one, other))


def taken(one: Sequence[float], other: Sequence[float]) -> State:
    return list(map(sub, one, other))


def dot(one: Sequence[float], other: Sequence[float]) -> float:
    result: float = total(map(mul, one, other))
    return result


def combined(weights: Sequence[float], rows: Sequence[State]) -> State:
    """The weighted sum of rows."""
    return [dot(weights, column) for column in zip(*rows, strict=True)]


@dataclass(slots=True)
class Piece:
    """The solution along one step, from ``start`` to ``end``: a polynomial for each state.

    With x = (time - origin) / width it is ``rows[0] + factor 1 * (rows[1] + factor 2 * (rows[2] + ...))``, where a
    factor is ``slope * x + offset``.
    """

    start: float
    end: float
    origin: float
    width: float
    factors: Sequence[tuple[float, float]]
    rows: Sequence[Sequence[float]]

    def at(self, time: float) -> State:
        """The states at a given time."""
        x = (time - self.origin) / self.width
        factors = [slope * x + offset for slope, offset in self.factors[::-1]]
        values = []
        for value, *rest in zip(*self.rows[::-1], strict=True):
            for factor, each in zip(factors, rest, strict=True):
                value = value * factor + each
            values.append(value)
        return values

    def bounds(self, left: float, right: float) -> list[Bounds]:
        """Bounds on each state between two times, by interval arithmetic."""
        x, y = (left - self.origin) / self.width, (right - self.origin) / self.width
        factors = [sorted((slope * x + offset, slope * y + offset)) for slope, offset in self.factors[::-1]]
        found = []
        for low, *rest in zip(*self.rows[::-1], strict=True):
            high = low
            for (a, b), each in zip(factors, rest, strict=True):
                if a >= 0.0:
                    low, high = low * (a if low >= 0.0 else b) + each, high * (b if high >= 0.0 else a) + each
                else:
                    products = (low * a, low * b, high * a, high * b)
                    low, high = min(products) + each, max(products) + each
            found.append((low, high))
        return found


@dataclass(frozen=True)
class Limits:
    """The tolerated error of a step, relative and absolute, and its longest length."""

    relative: float
    absolute: float
    max_step: float


class Stepper(ABC):
    """A method that continues a solution, step by step, from time 0.

    ``time`` and ``state`` are its present point.  ``order`` is that of the error, used to choose the first step.
    """

    def __init__(self, order: int, derivative: Derivative, state: State, limits: Limits) -> None:
        self.derivative = derivative
        self.limits = limits
        self.time = 0.0
        self.state = state
        self.rates = derivative(0.0, state)
        self.next_step = self._first_step(order)

    def step(self) -> bool:
        """Take one step; False if none is short enough."""
        least = self.least_step
        step = min(max(self.next_step, least), self.limits.max_step)
        self.prepare(step)
        while step >= least:
            end = self.time + step
            step = end - self.time
            factor = self.attempt(end, step)
            if factor is None:
                return True
            step *= factor
        return False

    @abstractmethod
    def prepare(self, step: float) -> None:
        """Prepare attempts, the first with a step of this length."""

    @abstractmethod
    def attempt(self, end: float, step: float) -> float | None:
        """Try to go to ``end``, a ``step`` away; None on success, otherwise the factor for a shorter attempt."""

    @abstractmethod
    def piece(self) -> Piece:
        """The solution along the latest step."""

    def scale(self, *states: State) -> list[float]:
        """The tolerated error of each state, by the largest of its values."""
        relative, absolute = self.limits.relative, self.limits.absolute
        sizes = map(abs, states[0]) if len(states) == 1 else (max(map(abs, each)) for each in zip(*states, strict=True))
        return [absolute + relative * size for size in sizes]

    @property
    def least_step(self) -> float:
        """The shortest step that moves the time well beyond rounding."""
        return 10.0 * (math.nextafter(self.time, math.inf) - self.time)

    def _first_step(self, order: int) -> float:
        """Guess the first step, so that an Euler step would be about right (Hairer, Norsett, Wanner, II.4)."""
        scale = self.scale(self.state)
        size, speed = norm(self.state, scale), norm(self.rates, scale)
        trial = 1e-6 if size < 1e-5 or speed < 1e-5 else 0.01 * size / speed
        state = [value + trial * rate for value, rate in zip(self.state, self.rates, strict=True)]
        change = taken(self.derivative(trial, state), self.rates)
        bend = norm(change, scale) / trial if trial else math.inf
        if speed <= 1e-15 and bend <= 1e-15:
            step = max(1e-6, trial * 1e-3)
        else:
            step = root_power(0.01 / max(speed, bend), 1.0 / (order + 1))
        return min(100.0 * trial, step, self.limits.max_step)


def stretch(error: float, safety: float, order: int) -> float:
    """The factor by which a step with this error may become longer, or must become shorter, for an error of 1."""
    shrunk = root_power(error, 1.0 / (order + 1))
    return safety / shrunk if shrunk else math.inf
