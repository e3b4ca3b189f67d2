"""asin, acos, atan and atan2."""

from __future__ import annotations

from math import copysign, frexp, inf, sqrt

from .double import quotient
from .outside import undefined
from .tables import ARC_HIGH, ARC_LOW, HALF_PI, HALF_PI_LOW, POWERS


def atan(x: float) -> float:
    """The arc tangent, in radians."""
    size = x * 1.0 if x >= 0.0 else -x
    if not 1e-8 < size < 1e17:
        if size <= 1e-8 or x != x:
            return x * 1.0
        return HALF_PI if x > 0.0 else -HALF_PI
    angle = _arc(size, 1.0, 0) if size <= 1.0 else _arc(1.0, size, 65)
    return angle if x > 0.0 else -angle


def atan2(y: float, x: float) -> float:
    """The angle of the vector (x, y), in radians, between -pi and pi."""
    above = y * 1.0 if y >= 0.0 else -y
    along = x * 1.0 if x >= 0.0 else -x
    if not (1e-150 < above < 1e150 and 1e-150 < along < 1e150):
        return copysign(_far_arc(above, along, copysign(1.0, x)), y)
    angle = _turned(above, along, x)
    return angle if y > 0.0 else -angle


def _turned(above: float, along: float, x: float) -> float:
    """The angle from the axis that x lies on to the other sides of a triangle."""
    if x >= 0.0:
        return _arc(above, along, 0) if above <= along else _arc(along, above, 65)
    return _arc(above, along, 130) if above <= along else _arc(along, above, 195)


def _far_arc(above: float, along: float, sign: float) -> float:
    """The angle from one axis to the other sides of a triangle; along the other way for a negative sign."""
    if above != above or along != along:
        return above + along
    if above == 0.0 or above < along * 1e-18 or (along == inf and above < inf):
        return above / along if sign > 0.0 and along > 0.0 else 0.0 if sign > 0.0 else 2.0 * HALF_PI
    if along < above * 1e-18 or (above == inf and along < inf):
        return HALF_PI
    if above == inf:
        above = along = 1.0
    _, e = frexp(above)
    half = e // 2
    above *= POWERS[2048 - half]
    above *= POWERS[2048 - e + half]
    along *= POWERS[2048 - half]
    along *= POWERS[2048 - e + half]
    return _turned(above, along, sign)


def _arc(side: float, base: float, table: int) -> float:
    """atan(side / base), at most pi/4, subtracted from or added to the multiple of pi/2 at the start of the table.

    With c = i / 64 next to the ratio, it is atan(c) + atan(t), t = (side - c base) / (base + c side), as a pair.
    """
    i = int(64.0 * (side / base) + 0.5)
    c = i * 0.015625
    d = base * 134217729.0
    first = d - (d - base)
    start = side - c * first
    step = c * (base - first)
    above = start - step
    above_low = (start - above) - step
    step = c * side
    below = base + step
    below_low = (base - below) + step
    t, low = quotient(above, above_low, below, below_low)
    z = t * t
    low -= t * z * (0.3333333333333333 - z * (0.2 - z * (0.14285714285714285 - z * 0.1111111111111111)))
    i += table
    if 65 <= table <= 130:
        t, low = -t, -low
    start = ARC_HIGH[i]
    total = start + t
    return total + (((start - total) + t) + (low + ARC_LOW[i]))


def asin(x: float) -> float:
    """The arc sine, in radians."""
    if -0.5 < x < 0.5:
        return x + x * _bend(x * x)
    size = x * 1.0 if x >= 0.0 else -x
    if not size <= 1.0:
        return undefined(x) if x == x else x * 1.0
    root, low = _half_angle(size)
    start = HALF_PI - 2.0 * root
    angle = start + (((HALF_PI - start) - 2.0 * root) + (HALF_PI_LOW - 2.0 * low))
    return angle if x > 0.0 else -angle


def acos(x: float) -> float:
    """The arc cosine, in radians."""
    if -0.5 < x < 0.5:
        start = HALF_PI - x
        return start + (((HALF_PI - start) - x) + (HALF_PI_LOW - x * _bend(x * x)))
    size = x * 1.0 if x >= 0.0 else -x
    if not size <= 1.0:
        return undefined(x) if x == x else x * 1.0
    root, low = _half_angle(size)
    if x > 0.0:
        return 2.0 * (root + low)
    start = 2.0 * HALF_PI - 2.0 * root
    return start + (((2.0 * HALF_PI - start) - 2.0 * root) + 2.0 * (HALF_PI_LOW - low))


def _half_angle(x: float) -> tuple[float, float]:
    """asin(sqrt((1 - x) / 2)) as a pair, for x from 1/2 to 1."""
    z = 0.5 * (1.0 - x)
    root = sqrt(z)
    if root == 0.0:
        return 0.0, 0.0
    c = root * 134217729.0
    first = c - (c - root)
    rest = root - first
    missed = 0.5 * (((z - first * first) - 2.0 * first * rest) - rest * rest) / root
    return root, missed + root * _bend(z)


def _bend(z: float) -> float:
    """asin(x) / x - 1, for z = x**2 up to 1/4."""
    p = 0.0006668203524734326 + z * (0.02486082093923592 + z * (-0.026195054108491603 + z * 0.03367073070452705))
    p = 0.011585830112268491 + z * (0.009483025287211623 + z * (0.010014255783956639 + z * p))
    p = 0.02237215164327209 + z * (0.01735294438468099 + z * (0.013961887499351249 + z * p))
    p = 0.04464285713971038 + z * (0.030381944643438512 + z * p)
    return z * (0.1666666666666666 + z * (0.07500000000002512 + z * p))
