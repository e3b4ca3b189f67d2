"""exp, expm1 and the hyperbolic functions.

x = n ln(2) / 128 + r with |r| <= ln(2) / 256, and n = 128 e + j; then exp(x) = 2**e * 2**(j / 128) * exp(r).
n is found 2**18 too large, which makes it positive: its high bits are then the place of 2**e in ``POWERS``.
"""

from __future__ import annotations

from math import inf

from .double import quotient
from .outside import infinite
from .tables import POWERS, ROOT_HIGH, ROOT_LOW, STEP_HIGH, STEP_LOW


def exp(x: float) -> float:
    """e to the power of x."""
    if not -708.0 < x < 709.0:
        return _far_exp(x)
    i = int(x * 184.6649652337873 + 262144.5)
    n = i - 262144
    r = (x - n * STEP_HIGH) - n * STEP_LOW
    j = i & 127
    root = ROOT_HIGH[j]
    growth = r + r * r * (0.5 + r * (0.16666666666666666 + r * (0.041666666666666664 + r * 0.008333333333333333)))
    return (root + (ROOT_LOW[j] + root * growth)) * POWERS[i >> 7]


def _far_exp(x: float) -> float:
    if x != x:
        return x
    if x > 709.8:
        return x * 1.0 if x == inf else infinite(1.0)
    if x < -746.0:
        return 0.0
    high, low, power = exponential_parts(x, 0.0)
    return scaled(high, low, power)


def exponential_parts(x: float, low: float) -> tuple[float, float, int]:
    """exp(x + low) as a pair, the first between 1 and 2, times a power of two; |x| is below 1400."""
    i = int(x * 184.6649652337873 + 262144.5)
    n = i - 262144
    r = ((x - n * STEP_HIGH) - n * STEP_LOW) + low
    j = i & 127
    root = ROOT_HIGH[j]
    growth = r + r * r * (0.5 + r * (0.16666666666666666 + r * (0.041666666666666664 + r * 0.008333333333333333)))
    return root, ROOT_LOW[j] + root * growth, (i >> 7) - 2048


def scaled(high: float, low: float, power: int) -> float:
    """(high + low) * 2**power, rounded once; high is between 1 and 2 and low small."""
    if power > 1022:
        result = (high + low) * 2.0 * POWERS[min(power, 1024) + 2047] if power < 1025 else inf
        return infinite(1.0) if result == inf else result
    if power > -1023:
        return (high + low) * POWERS[power + 2048]
    if power < -1080:
        return 0.0
    high *= POWERS[power + 3070]  # in units of 2**-1022: adding 1 rounds away what is below 2**-52 of them
    low *= POWERS[power + 3070]
    total = 1.0 + high
    total += ((1.0 - total) + high) + low
    return (total - 1.0) * POWERS[1026]


def expm1(x: float) -> float:
    """exp(x) - 1, accurate near 0."""
    if not -40.0 < x < 40.0:
        return -1.0 if x < 0.0 else exp(x)
    i = int(x * 184.6649652337873 + 262144.5)
    n = i - 262144
    step = n * STEP_LOW
    start = x - n * STEP_HIGH
    r = start - step
    low = (start - r) - step
    bent = 0.041666666666666664 + r * (0.008333333333333333 + r * 0.001388888888888889)
    bent = low + r * r * (0.5 + r * (0.16666666666666666 + r * bent))
    if n == 0:
        return r + bent if x != 0.0 else x * 1.0
    j, power = i & 127, POWERS[i >> 7]
    high, low = ROOT_HIGH[j] * power, ROOT_LOW[j] * power
    # (high + low) (1 + r + bent) - 1, with r added to high - 1 exactly
    start = high - 1.0
    low += (high - start) - 1.0 if high > 1.0 else high - (start + 1.0)
    total = start + r
    return total + (((start - total) + r) + ((start + low) * r + (high * bent + low)))


def sinh(x: float) -> float:
    """The hyperbolic sine."""
    if -0.25 < x < 0.25:
        z = x * x
        p = 1.9841269847605672e-04 + z * (2.7557298881987873e-06 + z * 2.5081748616928534e-08)
        return x + x * z * (0.16666666666666666 + z * (0.008333333333332473 + z * p))
    if not -40.0 < x < 40.0:
        return _far_sinh(x)
    high, low, _, _ = _sinh_and_cosh(x)
    return 0.5 * (high + low)


def cosh(x: float) -> float:
    """The hyperbolic cosine."""
    if not -40.0 < x < 40.0:
        return abs(_far_sinh(x))
    _, _, high, low = _sinh_and_cosh(x)
    return 0.5 * (high + low)


def tanh(x: float) -> float:
    """The hyperbolic tangent."""
    if -0.25 < x < 0.25:
        z = x * x
        if z < 1e-17:
            return x * 1.0
        p = 0.003591687782468661 + z * (-0.0014487125241842871 + z * 5.273968581101644e-04)
        p = -0.053968253964366726 + z * (0.0218694882025766 + z * (-0.008863219672625362 + z * p))
        return x + x * z * (-0.3333333333333333 + z * (0.1333333333333114 + z * p))
    if not -22.0 < x < 22.0:
        return x * 1.0 if x != x else 1.0 if x > 0.0 else -1.0
    high, low, below, below_low = _sinh_and_cosh(x)
    above, divisor = high + low, below + below_low
    high, low = quotient(above, (high - above) + low, divisor, (below - divisor) + below_low)
    return high + low


def _sinh_and_cosh(x: float) -> tuple[float, float, float, float]:
    """2 sinh(x) and 2 cosh(x) as pairs: both of exp(r) and exp(-r) come from its even and its odd part."""
    i = int(x * 184.6649652337873 + 262144.5)
    n = i - 262144
    r = (x - n * STEP_HIGH) - n * STEP_LOW
    z = r * r
    even = z * (0.5 + z * (0.041666666666666664 + z * 0.001388888888888889))
    odd = r + r * z * (0.16666666666666666 + z * 0.008333333333333333)
    j, power = i & 127, POWERS[i >> 7]
    up, up_low = ROOT_HIGH[j] * power, ROOT_LOW[j] * power
    i = 262144 - n
    j, power = i & 127, POWERS[i >> 7]
    down, down_low = ROOT_HIGH[j] * power, ROOT_LOW[j] * power
    difference, total = up - down, up + down
    if n >= 0:
        missed, left = (up - difference) - down, (up - total) + down
    else:
        missed, left = up - (difference + down), (down - total) + up
    missed += up_low - down_low
    left += up_low + down_low
    return (
        difference,
        missed + (total * odd + difference * even),
        total,
        left + (difference * odd + total * even),
    )


def _far_sinh(x: float) -> float:
    if x != x or x in (inf, -inf):
        return x * 1.0
    if not -711.0 < x < 711.0:
        return infinite(x)
    high, low, power = exponential_parts(abs(x), 0.0)
    result = scaled(high, low, power - 1)
    return result if x > 0.0 else -result
