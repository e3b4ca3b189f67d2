"""Statistics of replications: intervals of means and rates, and comparisons of conditions in pairs.

Callers count runs that failed or have no number separately; they never enter an average.
Source: A. M. Law, *Simulation Modeling and Analysis*, chapters 4, 9 and 10.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeGuard

from epicycle.actors import normal_quantile, random_stream

from ..model.language.claims import MAX_NUMBER
from ..support.shown import rounded
from ..support.student import student_quantile, student_tail

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LEVEL = 0.95
_EXPONENT = 400  # of 2: what is between 2^-400 and 2^400 can be squared and added up


def is_usable(value: float | None) -> TypeGuard[float]:
    """Whether statistics can be made of a value: all others count as missing."""
    return value is not None and abs(value) < MAX_NUMBER


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error and confidence interval, from ``count`` values."""

    value: float
    error: float
    low: float
    high: float
    count: int


def half_width(values: Sequence[float], level: float = LEVEL, *, is_share: bool = False) -> float:
    """Half the width of the interval of ``average``; infinite for fewer than two values."""
    if len(values) < 2:
        return math.inf
    if is_share:
        found = average(values, level, is_share=True)
        return (found.high - found.low) / 2
    return student_quantile((1 + level) / 2, len(values) - 1) * _standard_error(values)


def _standard_error(values: Sequence[float]) -> float:
    return deviation(values) / math.sqrt(len(values)) if len(values) > 1 else math.nan


def deviation(values: Sequence[float]) -> float:
    """The standard deviation of a sample, of two values or more."""
    scaled, exponent = in_range(values)
    mean = math.fsum(scaled) / len(scaled)
    gaps = [value - mean for value in scaled]
    return math.ldexp(math.sqrt(math.fsum(gap * gap for gap in gaps) / (len(values) - 1)), exponent)


def in_range(values: Sequence[float]) -> tuple[Sequence[float], int]:
    """Values, divided by a power of 2 where their squares would be too large or too small; and its exponent."""
    exponent = math.frexp(max(map(abs, values), default=0.0))[1]
    if abs(exponent) <= _EXPONENT:
        return values, 0
    return [math.ldexp(value, -exponent) for value in values], exponent


def mean(values: Sequence[float], level: float = LEVEL) -> Estimate:
    """The mean with Student's interval; NaN where there are no values, an infinite interval for one."""
    count = len(values)
    if count == 0:
        return Estimate(math.nan, math.nan, -math.inf, math.inf, 0)
    scaled, exponent = in_range(values)
    value, half = math.ldexp(math.fsum(scaled) / count, exponent), half_width(values, level)
    return Estimate(value, _standard_error(values), value - half, value + half, count)


def average(values: Sequence[float], level: float = LEVEL, *, is_share: bool = False) -> Estimate:
    """The mean with Student's interval; of what is true or false (1 or 0), the share that is true with Wilson's."""
    return rate(round(math.fsum(values)), len(values), level) if is_share else mean(values, level)


def with_interval(estimate: Estimate) -> str:
    """A mean with its interval, rounded to two digits of that: ``4.81 ± 0.06``; a share: ``0.02 (0.01 to 0.07)``."""
    width, value = estimate.high - estimate.low, rounded(estimate.value, estimate.high - estimate.low)
    if estimate.count == 0 or not math.isfinite(width) or width == 0:
        return value
    if math.isclose(estimate.high - estimate.value, estimate.value - estimate.low):
        return f"{value} ± {rounded(width / 2, width)}"
    return f"{value} ({rounded(estimate.low, width)} to {rounded(estimate.high, width)})"


def resampled_sums(series: Sequence[Sequence[float]], number: int) -> NDArray[np.float64]:
    """Sums of bootstrap samples of each series, drawn alike for all, and in every call for equally long ones."""
    import numpy as np

    known, sums = np.asarray(series, float), np.zeros((len(series), number))
    count = known.shape[1]
    stream, most = random_stream(0, "resampling"), max(1, 1_000_000 // count)  # that are drawn at a time
    for start in range(0, number, most):
        part = sums[:, start : start + most]
        for chosen in stream.integers(count, size=(part.shape[1], count)).T:
            part += known[:, chosen]
    return sums


def rate(successes: int, count: int, level: float = LEVEL) -> Estimate:
    """A share with Wilson's interval, which is valid for rare events and few runs, too."""
    if count == 0:
        return Estimate(math.nan, math.nan, 0.0, 1.0, 0)
    share, z = successes / count, normal_quantile((1.0 + level) / 2.0)
    error = share * (1.0 - share) / count
    scale = 1.0 + z * z / count
    middle = (share + z * z / (2.0 * count)) / scale
    half = z * math.sqrt(error + z * z / (4.0 * count * count)) / scale
    low, high = max(0.0, middle - half) if successes else 0.0, min(1.0, middle + half) if successes < count else 1.0
    return Estimate(share, math.sqrt(error), low, high, count)


@dataclass(frozen=True)
class Difference:
    """The mean of ``second`` less ``first`` over common replications, and the p-value for a mean of zero."""

    estimate: Estimate
    p: float


def paired_difference(first: dict[int, float], second: dict[int, float], level: float = LEVEL) -> Difference:
    """How much greater the numbers of one condition are than another's, by replication, with Student's paired test.

    Replications that only one of them has are left out. If all differences are equal, they have no spread for Student's
    test, and the p-value is that of the sign test.
    """
    common = sorted(first.keys() & second.keys())
    scale = max((max(abs(first[each]), abs(second[each])) for each in common), default=0.0)
    gaps = without_rounding((second[each] - first[each] for each in common), scale)
    estimate = mean(gaps, level)
    if len(gaps) < 2:
        return Difference(estimate, math.nan)
    if min(gaps) == max(gaps):
        return Difference(estimate, 1.0 if gaps[0] == 0 else math.ldexp(1.0, 1 - len(gaps)))
    return Difference(estimate, 2.0 * student_tail(abs(estimate.value) / estimate.error, len(gaps) - 1))


def share_above(limit: float, values: Sequence[float], level: float = LEVEL) -> Difference:
    """How much greater the share of ones is than a limit, with the test that Wilson's interval belongs to.

    Student's variable is normal, to seven digits, with so many degrees of freedom.
    """
    found = average(values, level, is_share=True)
    shifted = replace(found, value=found.value - limit, low=found.low - limit, high=found.high - limit)
    if found.count == 0:
        return Difference(shifted, math.nan)
    if not 0.0 < limit < 1.0:
        return Difference(shifted, 1.0 if found.value == limit else 0.0)
    error = math.sqrt(limit * (1.0 - limit) / found.count)
    return Difference(shifted, 2.0 * student_tail(abs(shifted.value) / error, 10**9))


def without_rounding(values: Iterable[float], scale: float) -> list[float]:
    """Differences of numbers of some size, cleaned of rounding errors: 4.8 - 4.7 and 5.0 - 4.9 are equal."""
    quantum = math.ldexp(1.0, math.frexp(scale)[1] - 42)
    return [round(value / quantum) * quantum for value in values] if quantum else list(values)


def holm(p_values: Sequence[float]) -> list[float]:
    """The p-values of tests made together, corrected for their number; NaNs do not count.

    Source: S. Holm, *A simple sequentially rejective multiple test procedure*, Scand. J. Statist. 6 (1979).
    """
    corrected = list(p_values)
    order = sorted((p, place) for place, p in enumerate(p_values) if not math.isnan(p))
    greatest = 0.0
    for rank, (p, place) in enumerate(order):
        greatest = max(greatest, min(1.0, (len(order) - rank) * p))
        corrected[place] = greatest
    return corrected
