"""The tables of the elementary functions, made on import from whole numbers alone, so every machine has the same.

A fixed-point number is a whole number of 2**-128.  A *pair* is the double nearest to a number and the double nearest to
the difference.
"""

from __future__ import annotations

from math import isqrt, ldexp

_BITS = 128
_ONE = 1 << _BITS


def _pair(number: int, bits: int = 100) -> tuple[float, float]:
    """A fixed-point number as a pair, the first a multiple of 2**-bits."""
    high = float((number >> (_BITS - bits - 1)) + 1 >> 1) * ldexp(1.0, -bits)
    return high, (number - int(ldexp(high, 100)) * (_ONE >> 100)) / _ONE


def _pairs(numbers: list[int], bits: int = 100) -> tuple[tuple[float, ...], tuple[float, ...]]:
    high, low = zip(*(_pair(number, bits) for number in numbers), strict=True)
    return high, low


def _series(numerator: int, denominator: int, sign: int, one: int = _ONE) -> int:
    """artanh (``sign`` 1) or arctan (-1) of a small ratio, by its power series."""
    power, total, odd = one * numerator // denominator, 0, 1
    above, below = sign * numerator * numerator, denominator * denominator
    while power not in (0, -1):  # a negative number ends up at -1
        total += power // odd
        power = power * above // below
        odd += 2
    return total


def _running(start: int, steps: list[int]) -> list[int]:
    numbers = [start]
    for step in steps:
        numbers.append(numbers[-1] + step)
    return numbers


# Powers of two: 2**(k - 2048) is at k; 0 below 2**-1074.
POWERS = tuple(ldexp(1.0, k - 2048) if k > 900 else 0.0 for k in range(3072))

# The logarithm of i / 512 is at i, 256 to 512, and so is 512 / i.  The first of each pair has 42 binary places, so
# that sums of them are exact.
_growth = [2 * _series(1, 2 * i + 1, 1) for i in range(256, 512)]
_LN_2 = sum(_growth)
LOG_HIGH, LOG_LOW = _pairs([0] * 256 + _running(-_LN_2, _growth), bits=42)
INVERSES = (0.0,) * 256 + tuple(512 / i for i in range(256, 513))
LN_2_HIGH, LN_2_LOW = _pair(_LN_2, bits=42)

# 2**(j / 128) is at j.
_root = 2 * _ONE
for _ in range(7):
    _root = isqrt(_root << _BITS)
_roots = [_ONE]
for _ in range(127):
    _roots.append(_roots[-1] * _root >> _BITS)
ROOT_HIGH, ROOT_LOW = _pairs(_roots, bits=52)
STEP_HIGH, STEP_LOW = _pair(_LN_2 >> 7, bits=42)  # ln 2 / 128

# The arc tangent of i / 64 is at i, 0 to 64; then pi/2 minus it, pi minus it, and pi/2 plus it.
_arcs = _running(0, [_series(64, 4096 + i * (i + 1), -1) for i in range(64)])
_QUARTER = 2 * _arcs[-1]
ARC_HIGH, ARC_LOW = _pairs(
    _arcs
    + [_QUARTER - arc for arc in _arcs]
    + [2 * _QUARTER - arc for arc in _arcs]
    + [_QUARTER + arc for arc in _arcs]
)

# pi by Machin's formula, with enough digits to reduce angles of any size.
_LONG_BITS = 1280
_LONG = 1 << _LONG_BITS
_PI = 4 * (4 * _series(1, 5, -1, _LONG) - _series(1, 239, -1, _LONG))

# 2/pi in 52 digits of 24 bits, after 4 zeros.
_TWO_OVER_PI = 2 * _LONG * _LONG // _PI
TWO_OVER_PI = (0,) * 4 + tuple(_TWO_OVER_PI >> (_LONG_BITS - 24 * (k + 1)) & 0xFFFFFF for k in range(52))

# pi/2 as a pair, and in three parts of 33 bits and a rest: a part times a number below 2**20 is exact.
HALF_PI, HALF_PI_LOW = _pair(_PI >> (_LONG_BITS - _BITS + 1), bits=52)


def _parts(number: int) -> tuple[float, ...]:
    found = []
    for bits in (32, 65, 98):
        part = number >> (_LONG_BITS - bits)
        found.append(part * ldexp(1.0, -bits))
        number -= part << (_LONG_BITS - bits)
    return (*found, number / _LONG)


HALF_PI_1, HALF_PI_2, HALF_PI_3, HALF_PI_4 = _parts(_PI >> 1)
