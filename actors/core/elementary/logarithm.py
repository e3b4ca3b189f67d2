"""Logarithms.

x = 2**e m with m between 1/2 and 1, and m = F (1 + r) with F = i / 512 next to it: the logarithm of x is
e ln(2) + ln(F) + ln(1 + r).  The first parts of the three have so few bits that their sum is exact; next to 1, the
first two cancel out.
"""

from __future__ import annotations

from math import frexp, inf

from .double import product
from .outside import pole, undefined
from .tables import INVERSES, LN_2_HIGH, LN_2_LOW, LOG_HIGH, LOG_LOW, POWERS


def log(x: float) -> float:
    """The natural logarithm."""
    if not 0.0 < x < inf:
        return _far_log(x)
    m, e = frexp(x)
    i = int(m * 512.0 + 0.5)
    point = i * 0.001953125
    inverse = INVERSES[i]
    r = (m - point) * inverse
    bent = r * r * (0.5 - r * (0.3333333333333333 - r * (0.25 - r * (0.2 - r * 0.16666666666666666))))
    start = e * LN_2_HIGH + LOG_HIGH[i]
    if start == 0.0:
        return r - bent
    first = (r + 393216.0) - 393216.0
    rest = ((m - point) - first * point) * inverse
    return (start + first) + (rest + ((e * LN_2_LOW + LOG_LOW[i]) - bent))


def _far_log(x: float) -> float:
    if x < 0.0:
        return undefined(x)
    return pole(-1.0) if x == 0.0 else x * 1.0


def logarithm_parts(x: float, low: float) -> tuple[float, float]:
    """The natural logarithm of x + low as a pair, good to 2**-70 of it; x is positive and finite, low far smaller."""
    m, e = frexp(x)
    if low != 0.0:
        low *= POWERS[2048 - e]
    i = int(m * 512.0 + 0.5)
    point = i * 0.001953125
    inverse = INVERSES[i]
    r = (m - point) * inverse
    first = (r + 393216.0) - 393216.0
    rest = (((m - point) - first * point) + low) * inverse
    start = (e * LN_2_HIGH + LOG_HIGH[i]) + first
    square = -0.5 * (first * first)  # exact, as `first` has at most 25 bits
    middle = start + rest
    high = middle + square
    missed = ((start - middle) + rest) + ((middle - high) + square)
    r = first + rest
    bent = 0.2 - r * (0.16666666666666666 - r * (0.14285714285714285 - r * 0.125))
    cube = r * r * r * (0.3333333333333333 - r * (0.25 - r * bent))
    return high, missed + ((e * LN_2_LOW + LOG_LOW[i]) + (cube - rest * (first + 0.5 * rest)))


def log1p(x: float) -> float:
    """The natural logarithm of 1 + x, accurate near 0."""
    if not -1.0 < x < 1e18:
        return log(1.0 + x)
    if -1e-17 < x < 1e-17:
        return x * 1.0
    total = 1.0 + x
    high, low = logarithm_parts(total, (1.0 - total) + x if x < 1.0 else (x - total) + 1.0)
    return high + low


def log2(x: float) -> float:
    """The logarithm to base 2, exact for powers of two."""
    if not 0.0 < x < inf:
        return _far_log(x)
    high, low = logarithm_parts(x, 0.0)
    high, _ = product(high, low, 1.4426950408889634, 2.0355273740931033e-17)
    return high


def log10(x: float) -> float:
    """The logarithm to base 10, exact for powers of ten."""
    if not 0.0 < x < inf:
        return _far_log(x)
    high, low = logarithm_parts(x, 0.0)
    high, _ = product(high, low, 0.4342944819032518, 1.098319650216765e-17)
    return high
