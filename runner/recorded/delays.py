"""Laws fitted to measured delays by maximum likelihood, and how well they fit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .losses import Goodness

Delays = NDArray[np.float64]  # in s

_ENOUGH = 20  # delays for a test
_SHIFTS = 40  # that are tried before the best is refined


@dataclass(frozen=True)
class DelayLaw:
    """A fixed part and a gamma distributed rest, of which the exponential (``shape`` 1) and the constant are cases.

    ``spread`` is the Kolmogorov-Smirnov test of every second delay against the law fitted to the others: a law that is
    tested by the data that it was fitted to would seem to fit too well.
    """

    name: str
    shift: float
    mean: float  # of the rest
    shape: float
    log_likelihood: float
    bic: float
    spread: Goodness | None = None


Law = tuple[float, float, float]  # shift, mean, shape


def delay_laws(delays: Delays) -> list[DelayLaw]:
    """The laws that can be fitted to the delays (s), in order of freedom."""
    if not np.ptp(delays) > 0.0:
        return [DelayLaw("constant", float(delays[0]), 0.0, 1.0, math.inf, -math.inf)]
    found = []
    for name, free, fit in _LAWS:
        law = fit(delays)
        if law is None:
            continue
        likelihood = _likelihood(delays, law)
        found.append(
            DelayLaw(name, *law, likelihood, free * math.log(len(delays)) - 2.0 * likelihood, _tested(delays, fit))
        )
    return found


def autocorrelation(delays: Delays) -> float:
    """The correlation of successive delays."""
    rest = delays - np.mean(delays)
    whole = float(np.mean(rest**2))
    return float(np.mean(rest[1:] * rest[:-1])) / whole if whole > 0.0 and len(delays) > 2 else 0.0


def _shifted_exponential(delays: Delays) -> Law | None:
    """The least delay is 1/n of the mean above the shift on average: without that, the estimate is biased."""
    shift = _highest_shift(delays)
    return (shift, float(np.mean(delays)) - shift, 1.0) if shift > 0.0 else None


def _shifted_gamma(delays: Delays) -> Law | None:
    """The shift with the highest likelihood, at most that of the exponential: towards the least delay, the likelihood
    of shapes below 1 grows without bound.
    """
    from scipy.optimize import minimize_scalar

    highest = _highest_shift(delays)
    if highest == 0.0:
        return None

    def cost(shift: float) -> float:
        law = _gamma_above(delays, shift)
        return math.inf if law is None else -_likelihood(delays, law)

    shifts = [highest * index / _SHIFTS for index in range(_SHIFTS + 1)]
    best = min(range(len(shifts)), key=lambda index: cost(shifts[index]))
    low, high = shifts[max(best - 1, 0)], shifts[min(best + 1, _SHIFTS)]
    refined = float(minimize_scalar(cost, bounds=(low, high), method="bounded").x) if high > low else low
    return _gamma_above(delays, min((shifts[best], refined), key=cost))


def _gamma_above(delays: Delays, shift: float) -> Law | None:
    """The gamma law of what exceeds a shift; None if some delay does not, or they hardly differ."""
    from scipy.stats import gamma

    with np.errstate(all="ignore"):
        try:
            shape, _, scale = map(float, gamma.fit(delays, floc=shift))
        except ValueError:
            return None
    return shift, shape * scale, shape


def _highest_shift(delays: Delays) -> float:
    least, number = float(np.min(delays)), len(delays)
    return max(0.0, least - (float(np.mean(delays)) - least) / max(number - 1, 1))


_LAWS: tuple[tuple[str, int, Callable[[Delays], Law | None]], ...] = (
    ("exponential", 1, lambda delays: (0.0, float(np.mean(delays)), 1.0)),
    ("shifted exponential", 2, _shifted_exponential),
    ("gamma", 2, lambda delays: _gamma_above(delays, 0.0)),
    ("shifted gamma", 3, _shifted_gamma),
)


def _distribution(law: Law) -> Any:
    from scipy.stats import gamma

    shift, mean, shape = law
    return gamma(shape, shift, mean / shape)


def _likelihood(delays: Delays, law: Law) -> float:
    return float(np.sum(_distribution(law).logpdf(delays)))


def _tested(delays: Delays, fit: Callable[[Delays], Law | None]) -> Goodness | None:
    from scipy.stats import kstest

    half, other = delays[0::2], delays[1::2]
    law = fit(half) if len(other) >= _ENOUGH and np.ptp(half) > 0.0 else None
    if law is None:
        return None
    found: Any = kstest(other, _distribution(law).cdf)
    return Goodness("Kolmogorov-Smirnov", float(found.statistic), None, float(found.pvalue))
