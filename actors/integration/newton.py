"""Tools of implicit methods: the Jacobian by differences, linear systems, and a monitored Newton iteration."""

from __future__ import annotations

import math
import sys
from typing import Final

from .stepper import Derivative, Limits, State, taken

Matrix = list[list[float]]

_PRECISION: Final = sys.float_info.epsilon
# A difference of derivatives is too inexact if it is this small beside them; outside these bounds, the next one
# should be taken over a wider or narrower stretch (D. E. Salane, Sandia report 86-1319, 1986).
_USELESS: Final = 2e-14
_SMALL: Final = 2e-12
_LARGE: Final = 1e-4
_LEAST: Final = 1e3 * _PRECISION


class Jacobian:
    """The derivatives with respect to each state, by differences whose widths adapt from call to call."""

    def __init__(self, derivative: Derivative, size: int, threshold: float) -> None:
        self._derivative = derivative
        self._threshold = threshold  # a state is treated as at least this large
        self._widths = [1.5e-8] * size

    def at(self, time: float, state: State, rates: State) -> Matrix:
        """The matrix of d(rate of row)/d(state of column); ``rates`` are the derivatives there."""
        columns = []
        for number, (value, rate) in enumerate(zip(state, rates, strict=True)):
            # In the direction of the solution, where the derivatives should be defined.
            reach = max(self._threshold, abs(value)) * (1.0 if rate >= 0.0 else -1.0)
            width = self._widths[number]
            while (value + width * reach) - value == 0.0:
                width *= 10.0
            column, change, size = self._difference(time, state, rates, number, width * reach)
            if change < _USELESS * size:
                wider = self._difference(time, state, rates, number, 10.0 * width * reach)
                if change * wider[2] < wider[1] * size:
                    (column, change, size), width = wider, 10.0 * width
            columns.append(column)
            if change < _SMALL * size:
                width *= 10.0
            elif change > _LARGE * size:
                width *= 0.1
            self._widths[number] = max(width, _LEAST)
        return [list(row) for row in zip(*columns, strict=True)]

    def _difference(
        self, time: float, state: State, rates: State, number: int, move: float
    ) -> tuple[State, float, float]:
        """A column of the Jacobian, the largest change behind it, and the rate that changed most."""
        moved = list(state)
        moved[number] += move
        move = moved[number] - state[number]
        other = self._derivative(time, moved)
        changes = taken(other, rates)
        change, size = max(
            (abs(each), max(abs(new), abs(old))) for each, new, old in zip(changes, other, rates, strict=True)
        )
        return [each / move for each in changes], change, size


class Factors:
    """The LU factorisation of a matrix, with the largest pivot of each column.

    Raises ``ZeroDivisionError`` if the matrix is singular.
    """

    def __init__(self, matrix: Matrix) -> None:
        rows = [list(row) for row in matrix]
        order = list(range(len(rows)))
        for column in range(len(rows)):
            best = max(range(column, len(rows)), key=lambda row: abs(rows[row][column]))
            rows[column], rows[best] = rows[best], rows[column]
            order[column], order[best] = order[best], order[column]
            pivot = rows[column]
            for row in rows[column + 1 :]:
                share = row[column] = row[column] / pivot[column]
                if share != 0.0:
                    for number in range(column + 1, len(rows)):
                        row[number] -= share * pivot[number]
        self._rows, self._order = rows, order
        self._inverse = [1.0 / row[number] for number, row in enumerate(rows)]

    def solve(self, right: State) -> State:
        """The solution for a right-hand side."""
        found: State = []
        for number, row in zip(self._order, self._rows, strict=True):
            total = right[number]
            for factor, value in zip(row, found, strict=False):
                total -= factor * value
            found.append(total)
        for number in range(len(found) - 1, -1, -1):
            row, total = self._rows[number], found[number]
            for behind in range(number + 1, len(found)):
                total -= row[behind] * found[behind]
            found[number] = total * self._inverse[number]
        return found


class Convergence:
    """Monitors one Newton iteration of at most ``most`` corrections."""

    def __init__(self, limits: Limits, most: int) -> None:
        relative = limits.relative
        self._tolerance = max(10.0 * _PRECISION / relative, min(0.03, math.sqrt(relative)))
        self._left = most
        self._before: float | None = None
        self.rate = 0.0  # the ratio of the latest correction to the one before
        self.count = 0
        self.is_reached = False

    def goes_on(self, correction: float) -> bool:
        """Whether, given the size of the next correction, it is worth continuing; if not, ``is_reached`` says why."""
        self.count += 1
        if correction == 0.0:
            self.is_reached = True
        elif self._before is not None:
            self.rate = rate = correction / self._before
            if not rate < 1.0:
                return False
            rest = rate / (1.0 - rate) * correction  # the sum of all further corrections
            self.is_reached = rest < self._tolerance
            expected = rest
            for _ in range(self._left - 1):
                expected *= rate
            if expected > self._tolerance:
                return False
        self._before = correction
        self._left -= 1
        return not self.is_reached and self._left > 0 and correction < math.inf
