"""Probability distributions as values of parameters: ``distribution: {type: Exponential, mean: 2}``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from .core import (
    Configurable,
    EpicycleError,
    Parameter,
    ParameterError,
    Stream,
    any_parameter,
    array_parameter,
    counted,
    declared_parameters,
    elementary,
    token_type,
)
from .core.choices import cumulated


class Distribution(Configurable):
    """Base of the distributions, from which single values are drawn.

    Their parameters have the unit of the drawn value: for a time, they are times.
    """

    token_type: Any = float

    def _configure(self, values: Mapping[str, object]) -> None:
        super()._configure(values)
        for name, parameter in declared_parameters(type(self)).items():
            value = getattr(self, name)
            # Draws would be infinite, or NaN; a law of your own may have such a default.
            if isinstance(value, float) and math.isinf(value) and value != parameter.default:
                raise ParameterError(f"{type(self).__name__}.{name}: {value:g} is not a finite number", (name,))

    def draw(self, random: Stream) -> Any:
        """A value drawn from the given stream."""
        raise NotImplementedError(f"{type(self).__name__} has no draw()")

    def draw_time(self, random: Stream, what: str = "a time") -> float:
        """A duration in s; raises ``EpicycleError`` if the value cannot be one."""
        time = self.draw(random)
        if type(time) is float and time >= 0.0:  # nearly always
            return time
        if isinstance(time, bool) or not isinstance(time, (int, float)) or not time >= 0:
            raise EpicycleError(f"{time!r} drawn from {self!r} is not {what} in s: it must be a number >= 0")
        return float(time)


class Constant(Distribution):
    """Always the same value; an actor that sends it is ``Const``."""

    value = Parameter(float, doc="the value")

    def draw(self, random: Stream) -> float:
        return self.value


class Uniform(Distribution):
    """All numbers of an interval with equal probability."""

    low = Parameter(float, 0.0, doc="the lowest number")
    high = Parameter(float, 1.0, doc="the upper bound, never drawn itself")

    def check(self) -> None:
        _check_order("low", self.low, "high", self.high)

    def draw(self, random: Stream) -> float:
        return random.uniform(self.low, self.high)


class Normal(Distribution):
    """The normal (Gaussian) distribution."""

    mean = Parameter(float, 0.0, doc="the mean")
    standard_deviation = Parameter(float, 1.0, min=0, doc="the square root of the variance")

    def draw(self, random: Stream) -> float:
        return random.normal(self.mean, self.standard_deviation)


class LogNormal(Distribution):
    """A positive number whose logarithm is normally distributed."""

    median = Parameter(float, 1.0, min=0, doc="the median, exp of the mean of the logarithm")
    sigma = Parameter(float, 1.0, unit="1", min=0, doc="standard deviation of the logarithm")

    def draw(self, random: Stream) -> float:
        return self.median * random.lognormal(0.0, self.sigma)


class Exponential(Distribution):
    """The exponential distribution: waiting times without memory."""

    refused: ClassVar[Mapping[str, str]] = {
        "rate": "Exponential has no parameter 'rate': give 'mean', which is 1 / rate"
    }

    mean = Parameter(float, 1.0, min=0, doc="the mean, 1 / rate")

    def draw(self, random: Stream) -> float:
        return random.exponential(self.mean)


class Gamma(Distribution):
    """The gamma distribution; with a whole ``shape`` the Erlang distribution."""

    shape = Parameter(float, 1.0, unit="1", above=0, doc="the shape k; k = 1 is the exponential distribution")
    mean = Parameter(float, 1.0, min=0, doc="the mean, shape * scale")

    def draw(self, random: Stream) -> float:
        return random.gamma(self.shape, self.mean / self.shape)


class ChiSquare(Distribution):
    """The chi-square distribution: the sum of squares of standard normal numbers."""

    freedom = Parameter(float, unit="1", min=1, doc="degrees of freedom, the number of squares")

    def draw(self, random: Stream) -> float:
        return random.chisquare(self.freedom)


class StudentT(Distribution):
    """Student's t distribution."""

    # Below this, the sum of squares in the denominator is now and then too small for a float.
    freedom = Parameter(float, unit="1", min=0.1, doc="degrees of freedom")

    def draw(self, random: Stream) -> float:
        return random.standard_t(self.freedom)


class Cauchy(Distribution):
    """The Cauchy distribution, which has no mean; in physics, the Breit-Wigner distribution."""

    median = Parameter(float, 0.0, doc="the median")
    scale = Parameter(float, 1.0, above=0, doc="half the width at half the height")
    cut = Parameter(
        float, None, above=0, doc="distance from the median at which it is truncated; not truncated if left out"
    )

    def draw(self, random: Stream) -> float:
        if self.cut is None:
            return self.median + self.scale * random.standard_cauchy()
        angle = random.uniform(-1.0, 1.0) * elementary.atan(self.cut / self.scale)
        return self.median + self.scale * elementary.tan(angle)


class VonMises(Distribution):
    """The von Mises distribution of angles, in rad."""

    mean = Parameter(float, 0.0, unit="rad", doc="the most likely angle")
    concentration = Parameter(float, 1.0, unit="1", above=0, doc="kappa; if large, about 1 / variance")

    def draw(self, random: Stream) -> float:
        return random.vonmises(self.mean, self.concentration)


class Poisson(Distribution):
    """The Poisson distribution: the number of rare events."""

    token_type: Any = int

    mean = Parameter(float, 1.0, unit="1", above=0, max=1e18, doc="the mean")

    def draw(self, random: Stream) -> int:
        return random.poisson(self.mean)


class Binomial(Distribution):
    """The binomial distribution: the number of successful trials."""

    token_type: Any = int

    trials = Parameter(int, 1, min=0, max=2**63 - 1, doc="the number of trials")
    probability = Parameter(float, 0.5, unit="1", min=0, max=1, doc="probability of success in each trial")

    def draw(self, random: Stream) -> int:
        return random.binomial(self.trials, self.probability)


class NegativeBinomial(Distribution):
    """The negative binomial distribution: the number of failures before a number of successes."""

    token_type: Any = int

    successes = Parameter(float, 1.0, unit="1", above=0, doc="the number of successes")
    probability = Parameter(float, 0.5, unit="1", above=0, max=1, doc="probability of success in each trial")

    def draw(self, random: Stream) -> int:
        return random.negative_binomial(self.successes, self.probability)


class Triangular(Distribution):
    """The triangular distribution between a lowest and a highest number, with a most likely one."""

    low = Parameter(float, 0.0, doc="the lowest number")
    mode = Parameter(float, 0.5, doc="the most likely number")
    high = Parameter(float, 1.0, doc="the highest number")

    def check(self) -> None:
        _check_order("low", self.low, "mode", self.mode)
        _check_order("mode", self.mode, "high", self.high)

    def draw(self, random: Stream) -> float:
        return random.triangular(self.low, self.mode, self.high)


class Bernoulli(Distribution):
    """True with a given probability, otherwise false."""

    token_type: Any = bool

    probability = Parameter(float, 0.5, unit="1", min=0, max=1, doc="of true")

    def draw(self, random: Stream) -> bool:
        return random.random() < self.probability


class RandomInteger(Distribution):
    """All integers from ``low`` to ``high`` with equal probability, both included."""

    token_type: Any = int

    low = Parameter(int, 0, doc="the lowest integer")
    high = Parameter(int, 1, doc="the highest integer")

    def check(self) -> None:
        _check_order("low", self.low, "high", self.high)

    def draw(self, random: Stream) -> int:
        return self.low + random.below(self.high - self.low + 1)


class Choice(Distribution):
    """One of several values of any kind, with equal probability or by weight."""

    values = any_parameter(shape=(None,), doc="the values to choose from")
    weights = array_parameter(
        (None,), None, unit="1", min=0, doc="relative probability of each value; all equal if left out"
    )

    def check(self) -> None:
        if not self.values:
            raise ParameterError("Choice.values: the list is empty; give at least one value")
        self.token_type = token_type(self.values)
        weights = [1.0] * len(self.values) if self.weights is None else self.weights.tolist()
        try:
            self._sums = cumulated(weights)
        except ValueError:
            self._sums = []
        if len(self._sums) != len(self.values):
            raise ParameterError(
                f"Choice.weights: {weights} must have one weight for each of {counted(len(self.values), 'value')}"
            )

    def draw(self, random: Stream) -> Any:
        return self.values[random.weighted(self._sums)]


def _check_order(low_name: str, low: float, high_name: str, high: float) -> None:
    if low > high:
        raise ParameterError(
            f"{low_name} is {low:g} and {high_name} is {high:g}: {low_name} must not be above {high_name}"
        )
