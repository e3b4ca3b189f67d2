"""sin, cos and tan.

x = n pi/2 + r + low with |r| <= pi/4, where low is the rounding error of r; polynomials give the sine and the cosine of
r.
"""

from __future__ import annotations

from math import frexp

from .double import product, quotient
from .outside import undefined
from .tables import HALF_PI, HALF_PI_1, HALF_PI_2, HALF_PI_3, HALF_PI_4, HALF_PI_LOW, POWERS, TWO_OVER_PI


def sin(x: float) -> float:
    """The sine of an angle in radians."""
    return _wave(x, 0) if x != 0.0 else x * 1.0


def cos(x: float) -> float:
    """The cosine of an angle in radians."""
    return _wave(x, 1)


def _wave(x: float, quarters: int) -> float:
    """The sine of x plus a number of quarter turns."""
    if -0.7853981633974483 <= x <= 0.7853981633974483:
        n, r, low = quarters, x * 1.0, 0.0
    else:
        n, r, low = _reduced(x)
        n += quarters
    z = r * r
    if n & 1:
        p = -2.7557314148611675e-07 + z * (2.0875696570502526e-09 - z * 1.1358310367104587e-11)
        p = 0.041666666666666595 + z * (-0.0013888888888872895 + z * (2.4801587288748162e-05 + z * p))
        first = (r + 100663296.0) - 100663296.0  # a multiple of 2**-26: 1 minus half its square is exact
        rest = r - first
        result = (1.0 - 0.5 * first * first) - ((rest * (0.5 * (r + first)) + r * low) - z * z * p)
    else:
        p = 2.755731358762415e-06 + z * (-2.505074230739275e-08 + z * 1.5895904666065958e-10)
        p = -0.1666666666666663 + z * (0.008333333333322005 + z * (-0.0001984126982949555 + z * p))
        result = r + (low * (1.0 - 0.5 * z) + r * z * p)
    return -result if n & 2 else result


def _reduced(x: float) -> tuple[int, float, float]:
    """n, r and low of an angle beyond pi/4."""
    if not -1e6 < x < 1e6:
        return _far_reduced(x)
    n = int(x * 0.6366197723675814 + 1048576.5) - 1048576
    start = x - n * HALF_PI_1
    step = n * HALF_PI_2
    middle = start - step
    if -0.001 < middle < 0.001:
        return _nearly_whole(n, start, step)
    step = n * (HALF_PI_3 + HALF_PI_4) - ((start - middle) - step)
    r = middle - step
    return n, r, (middle - r) - step


def _nearly_whole(n: int, start: float, step: float) -> tuple[int, float, float]:
    """Near a multiple of pi/2, where nearly all digits cancel."""
    middle = start - step
    part = middle - start
    missed = (start - (middle - part)) - (step + part)
    step = n * HALF_PI_3
    end = middle - step
    part = end - middle
    missed += (middle - (end - part)) - (step + part)
    missed -= n * HALF_PI_4
    r = end + missed
    return n, r, (end - r) + missed


def _far_reduced(x: float) -> tuple[int, float, float]:
    """By the digits of x times those of 2/pi: first without, and then with the sign of the rest."""
    if x - x != 0.0:
        return 0, undefined(x) if x == x else x * 1.0, 0.0
    _, e = frexp(x)
    place = (e - 1) // 24  # the first digit of x counts multiples of 2**(24 place)
    digits = abs(x) * POWERS[2048 - 24 * place]
    a = int(digits)
    digits = (digits - a) * 16777216.0
    b = int(digits)
    digits = (digits - b) * 16777216.0
    c = int(digits)
    d = int((digits - c) * 16777216.0)
    mask, n, high, low = 0, 0, 0.0, 0.0
    for _ in range(2):
        carry, high, low = 0, 0.0, 0.0
        for k in range(place + 12, place + 2, -1):  # a column counts multiples of 2**(24 (place + 3 - k))
            carry += a * TWO_OVER_PI[k] + b * TWO_OVER_PI[k - 1] + c * TWO_OVER_PI[k - 2] + d * TWO_OVER_PI[k - 3]
            n = carry & 16777215
            carry >>= 24
            if k > place + 3:
                term = (n ^ mask) * POWERS[2048 - 24 * (k - place - 3)]
                before = high
                high += term
                low += (term - high) + before
        if high < 0.5:
            break
        mask = 16777215
    r, low = product(high, low, HALF_PI, HALF_PI_LOW)
    if mask:
        n, r, low = n + 1, -r, -low
    return (n, r, low) if x > 0.0 else (-n, -r, -low)


def tan(x: float) -> float:
    """The tangent of an angle in radians."""
    if -0.7853981633974483 <= x <= 0.7853981633974483:
        n, r, low = 0, x * 1.0, 0.0
        if -1e-8 < r < 1e-8:
            return r
    else:
        n, r, low = _reduced(x)
    z = r * r
    p = 2.755731358762415e-06 + z * (-2.505074230739275e-08 + z * 1.5895904666065958e-10)
    p = -0.1666666666666663 + z * (0.008333333333322005 + z * (-0.0001984126982949555 + z * p))
    bent = low * (1.0 - 0.5 * z) + r * z * p
    sine = r + bent
    sine_low = (r - sine) + bent
    first = (r + 100663296.0) - 100663296.0
    rest = r - first
    start = 1.0 - 0.5 * first * first
    p = -2.7557314148611675e-07 + z * (2.0875696570502526e-09 - z * 1.1358310367104587e-11)
    p = 0.041666666666666595 + z * (-0.0013888888888872895 + z * (2.4801587288748162e-05 + z * p))
    bent = z * z * p - (rest * (0.5 * (r + first)) + r * low)
    cosine = start + bent
    cosine_low = (start - cosine) + bent
    if n & 1:
        high, low = quotient(cosine, cosine_low, sine, sine_low)
        return -(high + low)
    high, low = quotient(sine, sine_low, cosine, cosine_low)
    return high + low
