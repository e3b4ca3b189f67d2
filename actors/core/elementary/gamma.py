"""The logarithm of the gamma function, for densities and for methods that draw random numbers."""

from __future__ import annotations

from math import inf

from .logarithm import log
from .outside import undefined


def log_gamma(x: float) -> float:
    """ln(gamma(x)) of a positive number, within 1e-14 of the larger of it and 1: Stirling's series from 10 on."""
    if not 0.0 < x < inf:
        return undefined(x) if x <= 0.0 else x * 1.0
    factors = 1.0
    while x < 10.0:
        factors *= x
        x += 1.0
    z = 1.0 / (x * x)
    tail = 0.0007936507936507937 - z * (0.0005952380952380953 - z * (0.0008417508417508417 - z * 0.0019175269175269176))
    tail = (0.08333333333333333 - z * (0.002777777777777778 - z * tail)) / x
    return ((x - 0.5) * log(x) - x) + (0.9189385332046728 + tail) - log(factors)
