"""Euclidean lengths: the square root of a sum of squares, corrected by the difference between its square and that
sum."""

from __future__ import annotations

from collections.abc import Sequence
from math import frexp, inf, ldexp, nan, sqrt

from .tables import POWERS


def hypot(x: float, y: float = 0.0, *more: float) -> float:
    """The length of a vector, without overflow on the way; compiled code calls it with two numbers."""
    if more:
        return _length((x, y, *more))
    return _plane(x, y)


def distance(one: Sequence[float], other: Sequence[float]) -> float:
    """The Euclidean distance of two points with the same number of coordinates."""
    if len(one) == 2 == len(other):
        return _plane(one[0] - other[0], one[1] - other[1])
    return _length([a - b for a, b in zip(one, other, strict=True)])


def _plane(x: float, y: float) -> float:
    a = x * 1.0 if x >= 0.0 else -x
    b = y * 1.0 if y >= 0.0 else -y
    if a < b:
        a, b = b, a
    scale = 1.0
    if not 1e-140 < a < 1e140 or b != b:
        a, b, scale = _brought_near(a, b)
    h = sqrt(a * a + b * b)
    c = a * 134217729.0
    a_first = c - (c - a)
    a_rest = a - a_first
    c = b * 134217729.0
    b_first = c - (c - b)
    b_rest = b - b_first
    c = h * 134217729.0
    h_first = c - (c - h)
    h_rest = h - h_first
    missed = (
        ((a_first * a_first - h_first * h_first) + b_first * b_first)
        + 2.0 * ((a_first * a_rest - h_first * h_rest) + b_first * b_rest)
    ) + ((a_rest * a_rest - h_rest * h_rest) + b_rest * b_rest)
    return (h + 0.5 * missed / h) * scale


def _brought_near(a: float, b: float) -> tuple[float, float, float]:
    """Sides scaled to about 1 and the power of two, or the length itself if it is 0 or not finite."""
    if inf in (a, b):
        return 1.0, 0.0, inf
    if a == 0.0 or a != a or b != b:
        return 1.0, 0.0, 0.0 + a + b
    _, e = frexp(a)
    e -= 1
    half = e // 2  # 2**-e itself may be too small or too large for a double
    a = a * POWERS[2048 - half] * POWERS[2048 - e + half]
    b = b * POWERS[2048 - half] * POWERS[2048 - e + half]
    return a, b, POWERS[2048 + e]


def _length(vector: Sequence[float]) -> float:
    sizes = [abs(x * 1.0) for x in vector]
    largest = max(sizes, default=0.0)
    if inf in sizes:
        return inf
    if any(x != x for x in sizes):
        return nan
    if largest == 0.0:
        return 0.0
    _, e = frexp(largest)
    total = missed = 0.0
    for x in sizes:
        x = ldexp(x, -e)  # what a small one loses here is negligible beside the largest
        c = x * 134217729.0
        first = c - (c - x)
        rest = x - first
        square = x * x
        before = total
        total += square
        more = total - before
        missed += (before - (total - more)) + (square - more)
        missed += ((first * first - square) + 2.0 * first * rest) + rest * rest
    h = sqrt(total)
    c = h * 134217729.0
    first = c - (c - h)
    rest = h - first
    missed += ((total - first * first) - 2.0 * first * rest) - rest * rest
    return (h + 0.5 * missed / h) * 2.0 * POWERS[2047 + e]
