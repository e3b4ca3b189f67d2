"""Where a function of one variable is zero."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final

_PRECISION: Final = sys.float_info.epsilon
_HALVINGS: Final = 200  # more than bisection alone needs


def root(function: Callable[[float], float], left: float, right: float, least: float = 1e-15) -> float:
    """Where a function that has different signs at both ends is zero, to the last bits or to ``least``.

    T. R. Chandrupatla, Adv. Eng. Softw. 28 (1997) 145-149: inverse quadratic interpolation where three points allow
    it, bisection elsewhere.
    """
    newest, other = left, right
    at_newest, at_other = function(left), function(right)
    share = 0.5
    for _ in range(_HALVINGS):
        middle = newest + share * (other - newest)
        at_middle = function(middle)
        if (at_middle > 0.0) == (at_newest > 0.0):
            third, at_third = newest, at_newest
        else:
            third, at_third = other, at_other
            other, at_other = newest, at_newest
        newest, at_newest = middle, at_middle
        best = newest if abs(at_newest) < abs(at_other) else other
        width = abs(other - newest)
        tolerance = 2.0 * _PRECISION * abs(best) + 0.5 * least
        if at_middle == 0.0 or 2.0 * tolerance >= width:
            return middle if at_middle == 0.0 else best
        share = 0.5
        place = (newest - other) / (third - other)
        height = (at_newest - at_other) / (at_third - at_other)
        if height * height < place and (1.0 - height) * (1.0 - height) < 1.0 - place:
            share = at_newest / (at_other - at_newest) * (at_third / (at_other - at_third))
            share += (
                (third - newest) / (other - newest)
                * (at_newest / (at_third - at_newest))
                * (at_other / (at_third - at_other))
            )  # fmt: skip
        least_share = tolerance / width
        share = min(max(share, least_share), 1.0 - least_share)
    return best
