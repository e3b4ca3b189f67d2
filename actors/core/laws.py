# cython: binding=True
"""Laws of random numbers: each turns random bits into a value, by + - * /, square roots and ``elementary`` alone.

Where the inverse of a law's distribution function has a closed form, a value is the inverse at one uniform number: it
uses one word of the stream and increases with it.  The others draw until a value is accepted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from math import sqrt
from typing import Final, Protocol

from .elementary import acos, cos, exp, expm1, log, log1p, tan
from .elementary import pow as power_of

_STEP: Final = 1 / 2**52
_LARGEST: Final = 2**63 - 1  # the range of a 64-bit integer


class Bits(Protocol):
    """A source of random bits."""

    def word(self) -> int:
        """64 random bits."""

    def below(self, bound: int) -> int:
        """An integer of 0, 1, ..., ``bound`` - 1."""


def between(bits: Bits) -> float:
    """Uniform in the open interval (0, 1): an odd multiple of 2^-53, as likely as its distance from 1."""
    return ((bits.word() >> 12) + 0.5) * _STEP


def _not_negative(**parameters: float) -> None:
    for name, value in parameters.items():
        if not value >= 0.0:
            raise ValueError(f"{name} = {value:g} is not >= 0")


def _positive(**parameters: float) -> None:
    for name, value in parameters.items():
        if not value > 0.0:
            raise ValueError(f"{name} = {value:g} is not > 0")


def _probability(p: float) -> None:
    if not 0.0 <= p <= 1.0:
        raise ValueError(f"p = {p:g} is not between 0 and 1")


# -- closed inverses --------------------------------------------------------------------------------------------------


def uniform(bits: Bits, low: float = 0.0, high: float = 1.0) -> float:
    """Uniform in [low, high)."""
    return low + (high - low) * ((bits.word() >> 11) * (0.5 * _STEP))


def standard_normal(bits: Bits) -> float:
    """Normal with mean 0 and variance 1."""
    return normal_quantile(((bits.word() >> 12) + 0.5) * _STEP)


def normal_quantile(share: float) -> float:
    """The inverse of the standard normal distribution function in (0, 1), to about 1e-16 of its value.

    Source: M. J. Wichura, Algorithm AS 241: The Percentage Points of the Normal Distribution, Applied Statistics 37,
    1988 (PPND16).
    """
    q = share - 0.5
    if -0.425 <= q <= 0.425:
        r = 0.180625 - q * q
        above = (((((((2509.0809287301226727 * r + 33430.575583588128105) * r + 67265.770927008700853) * r
            + 45921.953931549871457) * r + 13731.693765509461125) * r + 1971.5909503065514427) * r
            + 133.14166789178437745) * r + 3.3871328727963666080)  # fmt: skip
        below = (((((((5226.4952788528545610 * r + 28729.085735721942674) * r + 39307.895800092710610) * r
            + 21213.794301586595867) * r + 5394.1960214247511077) * r + 687.18700749205790830) * r
            + 42.313330701600911252) * r + 1.0)  # fmt: skip
        return q * above / below
    r = sqrt(-log(share if q < 0.0 else 1.0 - share))
    if r <= 5.0:
        r -= 1.6
        above = (((((((7.74545014278341407640e-4 * r + 0.0227238449892691845833) * r + 0.241780725177450611770) * r
            + 1.27045825245236838258) * r + 3.64784832476320460504) * r + 5.76949722146069140550) * r
            + 4.63033784615654529590) * r + 1.42343711074968357734)  # fmt: skip
        below = (((((((1.05075007164441684324e-9 * r + 5.47593808499534494600e-4) * r + 0.0151986665636164571966) * r
            + 0.148103976427480074590) * r + 0.689767334985100004550) * r + 1.67638483018380384940) * r
            + 2.05319162663775882187) * r + 1.0)  # fmt: skip
    else:
        r -= 5.0
        above = (((((((2.01033439929228813265e-7 * r + 2.71155556874348757815e-5) * r + 0.00124266094738807843860) * r
            + 0.0265321895265761230930) * r + 0.296560571828504891230) * r + 1.78482653991729133580) * r
            + 5.46378491116411436990) * r + 6.65790464350110377720)  # fmt: skip
        below = (((((((2.04426310338993978564e-15 * r + 1.42151175831644588870e-7) * r + 1.84631831751005468180e-5) * r
            + 7.86869131145613259100e-4) * r + 0.0148753612908506148525) * r + 0.136929880922735805310) * r
            + 0.599832206555887937690) * r + 1.0)  # fmt: skip
    return above / below if q > 0.0 else -above / below


def normal(bits: Bits, loc: float = 0.0, scale: float = 1.0) -> float:
    """Normal (Gaussian) with mean ``loc`` and standard deviation ``scale``."""
    if not scale >= 0.0:
        _not_negative(scale=scale)
    return loc + scale * standard_normal(bits)


def lognormal(bits: Bits, mean: float = 0.0, sigma: float = 1.0) -> float:
    """Positive, with a normal logarithm of this mean and standard deviation."""
    return exp(normal(bits, mean, sigma))


def standard_exponential(bits: Bits) -> float:
    """Exponential with mean 1."""
    return -log(1.0 - ((bits.word() >> 12) + 0.5) * _STEP)


def exponential(bits: Bits, scale: float = 1.0) -> float:
    """Exponential with mean ``scale``."""
    if not scale >= 0.0:
        _not_negative(scale=scale)
    return scale * -log(1.0 - ((bits.word() >> 12) + 0.5) * _STEP)


def weibull(bits: Bits, a: float) -> float:
    """Weibull with shape ``a`` and scale 1."""
    _positive(a=a)
    return power_of(standard_exponential(bits), 1.0 / a)


def pareto(bits: Bits, a: float) -> float:
    """Lomax (Pareto II) over [0, inf) with shape ``a``; add 1 for the classical Pareto law over [1, inf)."""
    _positive(a=a)
    return expm1(standard_exponential(bits) / a)


def power(bits: Bits, a: float) -> float:
    """In [0, 1], with density ``a * x^(a - 1)``."""
    _positive(a=a)
    return power_of(between(bits), 1.0 / a)


def rayleigh(bits: Bits, scale: float = 1.0) -> float:
    """Rayleigh: the length of a plane vector of two normal numbers with deviation ``scale``."""
    _not_negative(scale=scale)
    return scale * sqrt(2.0 * standard_exponential(bits))


def laplace(bits: Bits, loc: float = 0.0, scale: float = 1.0) -> float:
    """Laplace (double exponential) with variance ``2 * scale^2``."""
    _not_negative(scale=scale)
    share = between(bits)
    return loc + scale * log(2.0 * share) if share < 0.5 else loc - scale * log(2.0 * (1.0 - share))


def logistic(bits: Bits, loc: float = 0.0, scale: float = 1.0) -> float:
    """Logistic."""
    _not_negative(scale=scale)
    share = between(bits)
    return loc + scale * log(share / (1.0 - share))


def gumbel(bits: Bits, loc: float = 0.0, scale: float = 1.0) -> float:
    """Gumbel's law of largest values."""
    _not_negative(scale=scale)
    return loc - scale * log(-log(between(bits)))


def standard_cauchy(bits: Bits) -> float:
    """Cauchy with mode 0."""
    return tan(math.pi * (between(bits) - 0.5))


def triangular(bits: Bits, left: float, mode: float, right: float) -> float:
    """Triangular over [left, right] with its peak at ``mode``."""
    if not left <= mode <= right:
        raise ValueError(f"left = {left:g}, mode = {mode:g} and right = {right:g} are not in ascending order")
    share, width = between(bits), right - left
    if share * width <= mode - left:
        return left + sqrt(share * width * (mode - left))
    return right - sqrt((1.0 - share) * width * (right - mode))


def geometric(bits: Bits, p: float) -> int:
    """The number of trials with probability ``p`` until one succeeds: 1, 2, ..."""
    if not 0.0 < p <= 1.0:
        raise ValueError(f"p = {p:g} is not > 0 and <= 1")
    share = between(bits)
    return 1 if p == 1.0 else min(1 + math.floor(log1p(-share) / log1p(-p)), _LARGEST)


# -- acceptance and rejection -----------------------------------------------------------------------------------------


def standard_gamma(bits: Bits, shape: float) -> float:
    """Gamma with scale 1.

    Source: Marsaglia and Tsang, A Simple Method for Generating Gamma Variables, ACM TOMS 26, 2000.
    """
    if not shape >= 0.0:
        _not_negative(shape=shape)
    if shape < 1.0:
        return standard_gamma(bits, shape + 1.0) * power_of(between(bits), 1.0 / shape) if shape else 0.0
    d = shape - 1.0 / 3.0
    c = 1.0 / sqrt(9.0 * d)
    while True:
        x = standard_normal(bits)
        v = 1.0 + c * x
        if v <= 0.0:
            continue
        v, square, share = v * v * v, x * x, between(bits)
        if share < 1.0 - 0.0331 * square * square or log(share) < 0.5 * square + d * (1.0 - v + log(v)):
            return d * v


def gamma(bits: Bits, shape: float, scale: float = 1.0) -> float:
    """Gamma with mean ``shape * scale``; Erlang's law for a whole shape."""
    if not scale >= 0.0:
        _not_negative(scale=scale)
    return scale * standard_gamma(bits, shape)


def chisquare(bits: Bits, df: float) -> float:
    """Chi-square with ``df`` degrees of freedom."""
    _positive(df=df)
    return 2.0 * standard_gamma(bits, 0.5 * df)


def beta(bits: Bits, a: float, b: float) -> float:
    """Beta over [0, 1] with mean ``a / (a + b)``.

    Source: M. D. Jöhnk, Metrika 8, 1964, for small parameters; otherwise the share of one of two gammas.
    """
    _positive(a=a, b=b)
    if a > 1.0 or b > 1.0:
        x = standard_gamma(bits, a)
        return x / (x + standard_gamma(bits, b))
    while True:
        # Logarithms, as all the powers may be too small for a float.
        x, y = log(between(bits)) / a, log(between(bits)) / b
        if exp(x) + exp(y) <= 1.0:
            top = max(x, y)
            return exp(x - top) / (exp(x - top) + exp(y - top))


def standard_t(bits: Bits, df: float) -> float:
    """Student's t with ``df`` degrees of freedom."""
    _positive(df=df)
    return standard_normal(bits) / sqrt(chisquare(bits, df) / df)


def f(bits: Bits, dfnum: float, dfden: float) -> float:
    """Fisher's F with these degrees of freedom."""
    return chisquare(bits, dfnum) / dfnum / (chisquare(bits, dfden) / dfden)


def vonmises(bits: Bits, mu: float, kappa: float) -> float:
    """An angle in [-pi, pi] with mean direction ``mu`` and concentration ``kappa``.

    Source: Best and Fisher, Efficient Simulation of the von Mises Distribution, 1979.
    """
    _not_negative(kappa=kappa)
    if kappa > 1e6:  # normal to all significant digits, while the ratios below lose theirs
        return math.remainder(mu + standard_normal(bits) / sqrt(kappa), 2.0 * math.pi)
    if kappa < 1e-8:
        return math.remainder(mu + math.pi * (2.0 * between(bits) - 1.0), 2.0 * math.pi)
    root = 1.0 + sqrt(1.0 + 4.0 * kappa * kappa)
    rho = 2.0 * kappa / (root + sqrt(2.0 * root))  # (root - sqrt(2 root)) / (2 kappa) without cancellation
    s = (1.0 + rho * rho) / (2.0 * rho)
    while True:
        z = cos(math.pi * between(bits))
        w = (1.0 + s * z) / (s + z)
        c, share = kappa * (s - w), between(bits)
        if c * (2.0 - c) > share or log(c / share) + 1.0 - c >= 0.0:
            angle = acos(min(1.0, max(-1.0, w)))
            return math.remainder(mu + (angle if bits.word() >> 63 else -angle), 2.0 * math.pi)


def wald(bits: Bits, mean: float, scale: float) -> float:
    """Wald (inverse Gaussian).  Source: Michael, Schucany and Haas, The American Statistician 30, 1976."""
    _positive(mean=mean, scale=scale)
    x = standard_normal(bits)
    t = mean * x * x / (2.0 * scale)
    small = mean / (1.0 + t + sqrt(t * (2.0 + t)))  # the smaller root; the product of both is mean^2
    return small if between(bits) * (mean + small) <= mean else mean / small * mean


def poisson(bits: Bits, lam: float = 1.0) -> int:
    """Poisson: the number of events, with mean ``lam``.

    Source for large means: W. Hörmann, Insurance: Mathematics and Economics 12, 1993 (PTRS).
    """
    if not 0.0 <= lam <= 1e18:
        raise ValueError(f"lam = {lam:g} is not between 0 and 1e18")
    if lam < 10.0:
        share, chance, k = between(bits), exp(-lam), 0
        below = chance
        while share > below and chance > 0.0:
            k += 1
            chance *= lam / k
            below += chance
        return k
    b = 0.931 + 2.53 * sqrt(lam)
    a = -0.059 + 0.02483 * b
    ceiling = 1.1239 + 1.1328 / (b - 3.4)
    while True:
        u, v = between(bits) - 0.5, between(bits)
        us = 0.5 - abs(u)
        k = math.floor((2.0 * a / us + b) * u + lam + 0.43)
        if us >= 0.07 and v <= 0.9277 - 3.6224 / (b - 2.0):
            return k
        if k >= 0 and not (us < 0.013 and v > us):
            chance = -lam if k == 0 else -_deviance(k, lam) - _stirling(k) - 0.5 * log(2.0 * math.pi * k)
            if log(v * ceiling / (a / (us * us) + b)) <= chance:
                return k


def binomial(bits: Bits, n: int, p: float) -> int:
    """Binomial: how many of ``n`` trials with probability ``p`` succeed.

    Source for large means: W. Hörmann, J. Statistical Computation and Simulation 46, 1993 (BTRS).
    """
    n = int(n)
    if not 0 <= n <= _LARGEST:
        raise ValueError(f"n = {n} is not between 0 and 2^63 - 1")
    _probability(p)
    if p > 0.5:
        return n - binomial(bits, n, 1.0 - p)
    q = 1.0 - p
    if n * p < 10.0:
        share, chance, k = between(bits), exp(n * log1p(-p)), 0
        below = chance
        while share > below and k < n and chance > 0.0:
            k += 1
            chance *= (n - k + 1) * p / (k * q)
            below += chance
        return k
    spread = sqrt(n * p * q)
    b = 1.15 + 2.53 * spread
    a = -0.0873 + 0.0248 * b + 0.01 * p
    ceiling = (2.83 + 5.1 / b) * spread
    top = _log_binomial(math.floor((n + 1) * p), n, p)
    while True:
        u, v = between(bits) - 0.5, between(bits)
        us = 0.5 - abs(u)
        k = math.floor((2.0 * a / us + b) * u + n * p + 0.5)
        if us >= 0.07 and v <= 0.92 - 4.2 / b:
            return k
        if 0 <= k <= n and log(v * ceiling / (a / (us * us) + b)) <= _log_binomial(k, n, p) - top:
            return k


def negative_binomial(bits: Bits, n: float, p: float) -> int:
    """Negative binomial: how many trials with probability ``p`` fail before the ``n``-th success."""
    _positive(n=n, p=p)
    _probability(p)
    return poisson(bits, gamma(bits, n, (1.0 - p) / p))


OF_ONE_VALUE: Final[tuple[Callable[..., float], ...]] = (
    uniform, standard_normal, normal, lognormal, standard_exponential, exponential, weibull, pareto, power, rayleigh,
    laplace, logistic, gumbel, standard_cauchy, triangular, geometric, standard_gamma, gamma, chisquare, beta,
    standard_t, f, vonmises, wald, poisson, binomial, negative_binomial,
)  # fmt: skip


def _log_binomial(k: int, n: int, p: float) -> float:
    """The logarithm of a binomial probability.

    Source: C. Loader, Fast and Accurate Computation of Binomial Probabilities, 2000.
    """
    if k in (0, n):
        return n * (log1p(-p) if k == 0 else log(p))
    return (
        _stirling(n) - _stirling(k) - _stirling(n - k) - _deviance(k, n * p) - _deviance(n - k, n * (1.0 - p))
        + 0.5 * log(n / (2.0 * math.pi * k * (n - k)))
    )  # fmt: skip


def _deviance(k: int, mean: float) -> float:
    """k log(k / mean) + mean - k."""
    gap = k - mean
    return k * log1p(gap / mean) - gap


@cache
def _few(k: int) -> float:
    return log(math.factorial(k)) - (k * log(k) - k + 0.5 * log(2.0 * math.pi * k))


def _stirling(k: int) -> float:
    """log(k!) minus Stirling's formula for it, for k > 0."""
    if k < 16:
        return _few(k)
    square = float(k) * k
    return (1 / 12 - (1 / 360 - (1 / 1260 - 1 / 1680 / square) / square) / square) / k
