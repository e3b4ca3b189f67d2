"""Matrices of a few numbers, as rows of floats: products, and the exponential that solves linear equations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from ..core.elementary import total

Vector = list[float]
Matrix = list[Vector]

_GROUP: Final = 4  # powers computed directly; the others are products with the last of them
# 1 / k!, up to 16, which leaves 1e-20 of a matrix of norm 1/2.
_INVERSE: Final = tuple(1.0 / math.factorial(k) for k in range(4 * _GROUP + 1))
_ROUNDS: Final = 100  # rounds of balancing; a few suffice
_GAIN: Final = 0.95  # a round that reduces row and column by less does not count


def applied(matrix: Sequence[Sequence[float]], vector: Sequence[float]) -> Vector:
    """A matrix times a vector."""
    found = []
    for row in matrix:
        value = 0.0
        for factor, each in zip(row, vector, strict=True):
            value += factor * each
        found.append(value)
    return found


def product(left: Matrix, right: Matrix) -> Matrix:
    """A matrix times a matrix."""
    columns = list(zip(*right, strict=True))
    return [applied(columns, row) for row in left]


class Exponential:
    """exp(A t) - 1 for one matrix A and any time t.

    Scaling and squaring with a Taylor polynomial: C. Moler and C. Van Loan, Nineteen Dubious Ways to Compute the
    Exponential of a Matrix, SIAM Review 45 (2003), method 3.  What exceeds 1 is squared, so that slow motions keep
    their digits beside fast ones.  A is balanced first, by powers of two: B. Parlett and C. Reinsch, Balancing a Matrix
    for Calculation of Eigenvalues and Eigenvectors, Numer. Math. 13 (1969).
    """

    def __init__(self, matrix: Sequence[Sequence[float]]) -> None:
        self._matrix, self._scales = balanced(matrix)
        self._norm = max((total(map(abs, row)) for row in self._matrix), default=0.0)

    def less_one(self, time: float) -> Matrix:
        """exp(A t) - 1."""
        halvings = max(0, math.frexp(self._norm * time)[1] + 1) if self._norm * time < math.inf else 0
        share = math.ldexp(time, -halvings)
        powers = [[[share * each for each in row] for row in self._matrix]]
        while len(powers) < _GROUP:
            powers.append(product(powers[0], powers[-1]))
        size = range(len(self._matrix))
        found = [[_INVERSE[-1] * (i == j) for j in size] for i in size]
        for first in range(len(_INVERSE) - 1 - _GROUP, -1, -_GROUP):
            found = product(powers[-1], found)
            for factor, power in zip(_INVERSE[first + 1 :], powers[:-1], strict=False):
                found = [
                    [one + factor * two for one, two in zip(*rows, strict=True)]
                    for rows in zip(found, power, strict=True)
                ]
            for number, row in enumerate(found):
                row[number] += _INVERSE[first] if first else 0.0
        for _ in range(halvings):  # (1 + F)^2 - 1
            square = product(found, found)
            found = [
                [2.0 * one + two for one, two in zip(*rows, strict=True)] for rows in zip(found, square, strict=True)
            ]
        scales = self._scales
        return [
            [each * (up / down) for each, down in zip(row, scales, strict=True)]
            for row, up in zip(found, scales, strict=True)
        ]


def balanced(matrix: Sequence[Sequence[float]]) -> tuple[Matrix, Vector]:
    """D^-1 A D with rows and columns of similar size, and the diagonal of D, powers of two."""
    rows = [[float(each) for each in row] for row in matrix]
    size, scales = range(len(rows)), [1.0] * len(rows)
    for _ in range(_ROUNDS):
        is_settled = True
        for i in size:
            column = total(abs(rows[j][i]) for j in size if j != i)
            row = total(abs(rows[i][j]) for j in size if j != i)
            factor = _balance(column, row)
            if factor == 1.0 or column * factor + row / factor >= _GAIN * (column + row):
                continue
            is_settled = False
            scales[i] *= factor
            rows[i] = [each / factor for each in rows[i]]
            for each in rows:
                each[i] *= factor
        if is_settled:
            break
    return rows, scales


def _balance(column: float, row: float) -> float:
    """The power of two by which a column grows, and its row shrinks, until they are similar, or 1 at most."""
    if column == row == 0.0:
        return 1.0
    if 0.0 in (column, row):  # inputs have empty rows; a state that nothing depends on has an empty column
        exponent = math.frexp(row)[1] if row else -math.frexp(column)[1]
        return math.ldexp(1.0, exponent if (exponent > 0) == (row > 0.0) else 0)
    return math.ldexp(1.0, (math.frexp(row)[1] - math.frexp(column)[1]) // 2)
