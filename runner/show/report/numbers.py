"""Numbers as they are printed: no more digits than the interval says something of."""

from __future__ import annotations

import math

from ...study import Estimate


def estimated(estimate: Estimate) -> str:
    """A number with its interval, to two digits of that: ``4.81 ± 0.06``."""
    half = (estimate.high - estimate.low) / 2
    if estimate.count == 0:
        return "–"
    if not math.isfinite(half) or half == 0:
        return rounded(estimate.value, half)
    return f"{rounded(estimate.value, 2 * half)} ± {rounded(half, 2 * half)}"


def rounded(value: float, width: float) -> str:
    """A number to two digits of half the interval around it; to six digits if there is no interval."""
    if not math.isfinite(value):
        return "–"
    if not math.isfinite(width) or width <= 0:
        return f"{value:.6g}"
    exponent = math.floor(math.log10(width / 2))
    if exponent < -12 or exponent > 12:
        return f"{value:.6g}"
    return f"{value:,.{max(0, 1 - exponent)}f}"
