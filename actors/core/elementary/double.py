"""Arithmetic with pairs: a number as the sum of two doubles, of which the second is the rounding error of the first.

134217729 is 2**27 + 1: multiplying by it and subtracting the excess halves the digits of a double (Veltkamp), and the
products of halves are exact (Dekker).
"""

from __future__ import annotations


def product(high: float, low: float, factor: float, factor_low: float) -> tuple[float, float]:
    """(high + low) * (factor + factor_low)."""
    c = high * 134217729.0
    first = c - (c - high)
    rest = high - first
    c = factor * 134217729.0
    factor_first = c - (c - factor)
    factor_rest = factor - factor_first
    result = high * factor
    missed = ((first * factor_first - result) + first * factor_rest + rest * factor_first) + rest * factor_rest
    missed += high * factor_low + low * factor
    total = result + missed
    return total, (result - total) + missed


def quotient(high: float, low: float, below: float, below_low: float) -> tuple[float, float]:
    """(high + low) / (below + below_low)."""
    first = high / below
    c = first * 134217729.0
    first_high = c - (c - first)
    first_low = first - first_high
    c = below * 134217729.0
    below_high = c - (c - below)
    rest = below - below_high
    product = first * below
    missed = ((first_high * below_high - product) + first_high * rest + first_low * below_high) + first_low * rest
    return first, (((high - product) - missed) + (low - first * below_low)) / below
