"""Student's t distribution, the same to the bit on every machine: only + - * / and square roots.

The tail is the incomplete beta function I_x(n/2, 1/2) at x = n / (n + t^2), by its continued fraction (Abramowitz and
Stegun 26.5.8, 26.7.1); a quantile is where the tail crosses the given probability.
"""

from __future__ import annotations

import math
from functools import lru_cache

_SQRT_PI = 1.7724538509055160273
_RECURSIVE = 200  # degrees of freedom up to which the ratio of gamma functions is multiplied out


def student_tail(t: float, freedom: int) -> float:
    """The probability that Student's variable with these degrees of freedom (at least 1) is greater than ``t``."""
    if math.isnan(t):
        return math.nan
    if t < 0:
        return 1.0 - student_tail(-t, freedom)
    if t > 1e150:  # its square exceeds the range of floats
        return 0.0
    square = t * t
    near, far = square / (freedom + square), freedom / (freedom + square)
    # x^a (1 - x)^b / B(a, b) for a = n/2, b = 1/2, at x = far.
    weight = _power(math.sqrt(far), freedom) * math.sqrt(near) * _gamma_ratio(freedom) / _SQRT_PI
    if weight == 0.0:
        return 0.5 if near < far else 0.0
    half = freedom / 2
    if far * (half + 2.5) < half + 1.0:
        return 0.5 * weight * _fraction(half, 0.5, far) / half
    return 0.5 - weight * _fraction(0.5, half, near)


@lru_cache(maxsize=4096)
def student_quantile(p: float, freedom: int) -> float:
    """The number below which Student's variable lies with the probability ``p``, between 0 and 1."""
    if not 0.0 < p < 1.0 or freedom < 1:
        raise ValueError(f"there is no quantile {p} for {freedom} degrees of freedom")
    if p == 0.5:
        return 0.0
    tail = min(p, 1.0 - p)
    low, high = 0.0, 1.0
    while student_tail(high, freedom) > tail and high < 1e150:
        low, high = high, 2.0 * high
    while True:
        middle = low + 0.5 * (high - low)
        if not low < middle < high:
            break
        if student_tail(middle, freedom) > tail:
            low = middle
        else:
            high = middle
    return high if p > 0.5 else -high


def _fraction(a: float, b: float, x: float) -> float:
    """The continued fraction of I_x(a, b), by Lentz's method; it converges fast for x < (a + 1) / (a + b + 2)."""
    tiny = 1e-300
    c, d = 1.0, 1.0 - (a + b) * x / (a + 1.0)
    d = 1.0 / (d if d else tiny)
    found = d
    for m in range(1, 10_000):
        for factor in (
            m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0)),
        ):
            d = 1.0 + factor * d
            c = 1.0 + factor / c
            d = 1.0 / (d if d else tiny)
            c = c if c else tiny
            found *= c * d
        if abs(c * d - 1.0) < 3e-16:
            break
    return found


def _power(base: float, exponent: int) -> float:
    """A whole power, by repeated squaring."""
    found = 1.0
    while exponent:
        if exponent & 1:
            found *= base
        base *= base
        exponent >>= 1
    return found


@lru_cache(maxsize=256)
def _gamma_ratio(n: int) -> float:
    """Gamma((n + 1) / 2) / Gamma(n / 2)."""
    if n > _RECURSIVE:
        u = 1.0 / n
        series = 5.0 / 128.0 - u * (21.0 / 2048.0 + u * (399.0 / 8192.0 - u * 869.0 / 65536.0))
        return math.sqrt(n / 2) * (1.0 - u * (0.25 - u * (1.0 / 32.0 + u * series)))
    found = 1.0 / _SQRT_PI if n % 2 else _SQRT_PI / 2.0
    for k in range(1 if n % 2 else 2, n, 2):
        found = found * (k + 1) / k
    return found
