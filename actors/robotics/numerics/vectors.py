"""Vectors and matrices in two or three dimensions, as tuples of floats.

The number of dimensions is part of a tuple's type: compiled code has every loop over it unrolled, so that the plane
costs what it would if it were written out.  Sums are in index order and begin with their first term, not with 0.

A matrix is given by rows, and a symmetric one as its upper triangle, by rows.  A quadratic function is its gradient
followed by its symmetric Hessian; a ``Term`` is a function's value, gradient and Hessian at one point.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ...core.elementary import hypot
from .compiled import Array, borrower, in_kernels, inlined

Vector = tuple[float, ...]  # d numbers
Matrix = tuple[float, ...]  # d * d
Symmetric = tuple[float, ...]  # d (d + 1) / 2
Quadratic = tuple[float, ...]  # d, then d (d + 1) / 2
Term = tuple[float, ...]  # 1, then those of a quadratic function


def replaced(values: Vector, place: int, value: float) -> Vector:
    """The tuple with another value at one place."""
    return (*values[:place], value, *values[place + 1 :])


@in_kernels(replaced)
def _replaced(values: Any, place: Any, value: Any) -> Any:
    from numba.cpython.unsafe import tuple as tuples

    set_item: Any = tuples.tuple_setitem
    return lambda values, place, value: set_item(values, place, value)  # noqa: PLW0108 - numba reads its names


@inlined
def symmetric_size(d: int) -> int:
    """The numbers in a symmetric matrix."""
    return d * (d + 1) // 2


@inlined
def quadratic_size(d: int) -> int:
    """The numbers in a quadratic function without its constant."""
    return d * (d + 3) // 2


def _zeros(size_of: Callable[[int], int]) -> Callable[[Vector], Vector]:
    """A function of a vector that gives zeros, as many as ``size_of`` its dimensions."""

    def zeros(vector: Vector) -> Vector:
        return (0.0,) * size_of(len(vector))

    @in_kernels(zeros)
    def _(vector: Any) -> Any:
        made = (0.0,) * size_of(vector.count)
        return lambda vector: made

    return zeros


zero_vector, zero_matrix = _zeros(lambda d: d), _zeros(lambda d: d * d)
zero_symmetric, zero_quadratic = _zeros(lambda d: d * (d + 1) // 2), _zeros(lambda d: d * (d + 3) // 2)
zero_term = _zeros(lambda d: 1 + d * (d + 3) // 2)


@inlined
def packed(d: int, i: int, j: int) -> int:
    """The place of row i and column j in a symmetric matrix."""
    return i * d - i * (i + 1) // 2 + j if i <= j else j * d - j * (j + 1) // 2 + i


@inlined
def read(like: Vector, table: Array, row: int, column: int) -> Vector:
    """A tuple of the length of ``like`` from the columns of a table's row."""
    for c in range(len(like)):
        like = replaced(like, c, table[row, column + c])
    return like


@inlined
def write(table: Array, row: int, column: int, values: Vector) -> None:
    for c in range(len(values)):
        table[row, column + c] = values[c]


@inlined
def total(u: Vector, v: Vector) -> Vector:
    for c in range(len(u)):
        u = replaced(u, c, u[c] + v[c])
    return u


@inlined
def less(u: Vector, v: Vector) -> Vector:
    for c in range(len(u)):
        u = replaced(u, c, u[c] - v[c])
    return u


@inlined
def plus(u: Vector, k: float, v: Vector) -> Vector:
    """u + k v."""
    for c in range(len(u)):
        u = replaced(u, c, u[c] + k * v[c])
    return u


@inlined
def scaled(k: float, u: Vector) -> Vector:
    for c in range(len(u)):
        u = replaced(u, c, k * u[c])
    return u


@inlined
def dot(u: Vector, v: Vector) -> float:
    summed = u[0] * v[0]
    for c in range(1, len(u)):
        summed += u[c] * v[c]
    return summed


@inlined
def squared(u: Vector) -> float:
    return dot(u, u)


@borrower
def length_of(u: Vector) -> float:
    """The Euclidean length, whatever the size of the numbers."""
    length = hypot(u[0], u[1])
    for c in range(2, len(u)):
        length = hypot(length, u[c])
    return length


@inlined
def steeper(u: Vector, k: float) -> Vector:
    """The vector with its height, if it has one, times ``k``."""
    for c in range(2, len(u)):
        u = replaced(u, c, k * u[c])
    return u


@inlined
def side(m: Matrix) -> int:
    """The dimensions of a matrix."""
    return 2 if len(m) == 4 else 3


@inlined
def row(like: Vector, m: Matrix, i: int) -> Vector:
    """The i-th so many numbers of a tuple as ``like`` has."""
    for c in range(len(like)):
        like = replaced(like, c, m[i * len(like) + c])
    return like


@inlined
def transposed(m: Matrix) -> Matrix:
    """The transpose."""
    d, made = side(m), m
    for i in range(d):
        for j in range(d):
            made = replaced(made, i * d + j, m[j * d + i])
    return made


@inlined
def times(m: Matrix, n: Matrix) -> Matrix:
    d, product = side(m), m
    for i in range(d):
        for j in range(d):
            summed = m[i * d] * n[j]
            for k in range(1, d):
                summed += m[i * d + k] * n[k * d + j]
            product = replaced(product, i * d + j, summed)
    return product


@inlined
def applied(m: Matrix, v: Vector) -> Vector:
    d, image = len(v), v
    for i in range(d):
        summed = m[i * d] * v[0]
        for k in range(1, d):
            summed += m[i * d + k] * v[k]
        image = replaced(image, i, summed)
    return image


@inlined
def spread(symmetric: Symmetric, v: Vector) -> Vector:
    """A symmetric matrix, applied to a vector."""
    d, image = len(v), v
    for i in range(d):
        summed = symmetric[packed(d, i, 0)] * v[0]
        for k in range(1, d):
            summed += symmetric[packed(d, i, k)] * v[k]
        image = replaced(image, i, summed)
    return image


@inlined
def inverse_of(m: Symmetric, like: Matrix) -> tuple[bool, Matrix]:
    """Whether a symmetric matrix is positive definite, by its leading minors, and its inverse, by its cofactors."""
    if len(m) == 3:
        first, determinant = m[0], m[0] * m[2] - m[1] * m[1]
        like = replaced(replaced(like, 0, m[2]), 1, -m[1])
        like = replaced(replaced(like, 2, -m[1]), 3, m[0])
        definite = determinant > 0.0 and first > 0.0
    else:
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            for other in range(3):
                p, q = (other + 1) % 3, (other + 2) % 3
                minor = m[packed(3, j, p)] * m[packed(3, k, q)] - m[packed(3, j, q)] * m[packed(3, k, p)]
                like = replaced(like, 3 * i + other, minor)
        determinant = m[0] * like[0] + m[1] * like[1] + m[2] * like[2]
        definite = determinant > 0.0 and m[0] > 0.0 and like[len(like) - 1] > 0.0
    return definite, scaled(1.0 / determinant, like)


@inlined
def frame_of(n: Vector, like: Matrix) -> Matrix:
    """An orthonormal basis, by rows, that begins with the unit vector n; its second vector is horizontal."""
    d, last = len(n), len(n) - 1
    for c in range(d):
        like = replaced(like, c, n[c])
    across, along = -n[1], n[0]
    if d == 3:
        level = math.sqrt(n[0] * n[0] + n[1] * n[1])
        across, along = (across / level, along / level) if level > 0.0 else (0.0, 1.0)
        like = replaced(replaced(replaced(like, 3 + last, 0.0), 6, -n[last] * along), 7, n[last] * across)
        like = replaced(like, 6 + last, level)
    return replaced(replaced(like, d, across), d + 1, along)
