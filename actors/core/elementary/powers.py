"""Powers: exp(y log(x)), its exponent as a pair."""

from __future__ import annotations

from math import copysign, floor, inf
from typing import Any

from .double import product
from .exponential import exponential_parts, scaled
from .logarithm import logarithm_parts
from .outside import infinite, pole, undefined


def pow(x: float, y: float) -> float:  # noqa: A001 (as in the module math)
    """x to the power of y, as C99 has it, with 0 and NaN to the power of 0 being 1."""
    if y == 2.0:
        result = x * x
        return infinite(1.0) if result == inf and -inf < x < inf else result
    if 0.0 < x < inf and -1e19 < y < 1e19 and y != 0.0:
        return _positive_power(x, y)
    return _far_power(x, y)


def _positive_power(x: float, y: float) -> float:
    high, low = logarithm_parts(x, 0.0)
    if not -750.0 < high * y < 710.0:
        return infinite(1.0) if high * y > 0.0 else 0.0
    high, low = product(high, low, y, 0.0)
    high, low, power = exponential_parts(high, low)
    return scaled(high, low, power)


def _far_power(x: float, y: float) -> float:
    if y == 0.0 or x == 1.0:
        return 1.0
    if x != x or y != y:
        return x + y
    size = abs(x)
    if y in (inf, -inf):
        return 1.0 if size == 1.0 else inf if (size > 1.0) == (y > 0.0) else 0.0
    whole = -9007199254740992.0 < y < 9007199254740992.0 and y == floor(y)
    odd = whole and 0.5 * y != floor(0.5 * y)
    negative = x < 0.0 or (x == 0.0 and copysign(1.0, x) < 0.0)
    sign = -1.0 if odd and negative else 1.0
    if size == 0.0:
        return pole(sign) if y < 0.0 else sign * 0.0
    if size == inf:
        return sign * (inf if y > 0.0 else 0.0)
    if x < 0.0 and not whole and -9007199254740992.0 < y < 9007199254740992.0:
        return undefined(x, y)
    if size == 1.0:
        return sign
    if not -1e19 < y < 1e19:
        return infinite(1.0) if (size > 1.0) == (y > 0.0) else 0.0
    return sign * _positive_power(size, y)


def power(base: Any, exponent: Any) -> Any:
    """``base ** exponent`` of whole numbers and floats, as in Python, but with a ``ValueError`` where it is complex."""
    if isinstance(base, int) and isinstance(exponent, int) and exponent >= 0:
        return base**exponent
    if base == 0 and exponent < 0:
        raise ZeroDivisionError("0 cannot be raised to a negative power")
    if base < 0 and exponent % 1 != 0 and abs(exponent) != inf:
        raise ValueError("the result is not a real number")
    return pow(float(base), float(exponent))
