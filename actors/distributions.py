"""Probability distributions that a parameter may be given: ``distribution: {type: Exponential, mean: 2}``."""

from __future__ import annotations

from typing import Any

from .core import (
    Configurable,
    EpicycleError,
    Parameter,
    ParameterError,
    Stream,
    array_parameter,
    counted,
    elementary,
    token_type,
)
from .core.choices import cumulated, weighted
from .generators import Numbers


class Distribution(Configurable):
    """Base of the distributions: what single values are drawn from.

    Their parameters count in what is drawn: where that is a time, they are times.
    """

    token_type: Any = float

    def draw(self, random: Stream) -> Any:
        """A value, from the stream given."""
        raise NotImplementedError(f"{type(self).__name__} has no draw()")

    def draw_time(self, random: Stream, what: str = "a time") -> float:
        """A value that is how long something takes, in s; raises ``EpicycleError`` if it cannot be that."""
        time = self.draw(random)
        if isinstance(time, bool) or not isinstance(time, (int, float)) or not time >= 0:
            raise EpicycleError(f"{time!r} drawn from {self!r} is not {what} in s, a number >= 0")
        return float(time)


class Constant(Distribution):
    """Always the same value; the actor that sends one is ``Const``."""

    value = Parameter(float, doc="the value")

    def draw(self, random: Stream) -> float:
        return self.value


class Uniform(Distribution):
    """All numbers of an interval alike."""

    low = Parameter(float, 0.0, doc="the least number")
    high = Parameter(float, 1.0, doc="the bound above, not drawn itself")

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

    median = Parameter(float, 1.0, min=0, doc="the median, e to the mean of the logarithm")
    sigma = Parameter(float, 1.0, unit="1", min=0, doc="standard deviation of the logarithm")

    def draw(self, random: Stream) -> float:
        return self.median * random.lognormal(0.0, self.sigma)


class Exponential(Distribution):
    """The exponential distribution: waiting times without memory."""

    mean = Parameter(float, 1.0, min=0, doc="the mean, one over the rate")

    def draw(self, random: Stream) -> float:
        return random.exponential(self.mean)


class Gamma(Distribution):
    """The gamma distribution; with a whole ``shape`` the Erlang distribution."""

    shape = Parameter(float, 1.0, unit="1", above=0, doc="the shape k; k = 1 is the exponential distribution")
    mean = Parameter(float, 1.0, min=0, doc="the mean, shape times scale")

    def draw(self, random: Stream) -> float:
        return random.gamma(self.shape, self.mean / self.shape)


class ChiSquare(Distribution):
    """The chi-square distribution: the sum of squares of standard normal numbers."""

    freedom = Parameter(float, unit="1", min=1, doc="degrees of freedom, how many squares")

    def draw(self, random: Stream) -> float:
        return random.chisquare(self.freedom)


class StudentT(Distribution):
    """Student's t distribution."""

    # Below, the sum of squares that it divides by is too small for a float every now and then.
    freedom = Parameter(float, unit="1", min=0.1, doc="degrees of freedom")

    def draw(self, random: Stream) -> float:
        return random.standard_t(self.freedom)


class Cauchy(Distribution):
    """The Cauchy distribution, which has no mean; in physics that of Breit and Wigner."""

    median = Parameter(float, 0.0, doc="the median")
    scale = Parameter(float, 1.0, above=0, doc="half the width at half the height")
    cut: Parameter[float | None] = Parameter(float, None, above=0, doc="how far from the median it ends, if it does")

    def draw(self, random: Stream) -> float:
        if self.cut is None:
            return self.median + self.scale * random.standard_cauchy()
        angle = random.uniform(-1.0, 1.0) * elementary.atan(self.cut / self.scale)
        return self.median + self.scale * elementary.tan(angle)


class VonMises(Distribution):
    """The von Mises distribution of angles, in rad."""

    mean = Parameter(float, 0.0, unit="rad", doc="the likeliest angle")
    concentration = Parameter(float, 1.0, unit="1", above=0, doc="kappa, for large ones 1 / variance")

    def draw(self, random: Stream) -> float:
        return random.vonmises(self.mean, self.concentration)


class Poisson(Distribution):
    """The Poisson distribution: how many of many rare things happen."""

    token_type: Any = int

    mean = Parameter(float, 1.0, unit="1", above=0, max=1e18, doc="the mean")

    def draw(self, random: Stream) -> int:
        return random.poisson(self.mean)


class Binomial(Distribution):
    """The binomial distribution: how many of several trials succeed."""

    token_type: Any = int

    trials = Parameter(int, 1, min=0, max=2**63 - 1, doc="how many trials")
    probability = Parameter(float, 0.5, unit="1", min=0, max=1, doc="of success in each")

    def draw(self, random: Stream) -> int:
        return random.binomial(self.trials, self.probability)


class NegativeBinomial(Distribution):
    """The negative binomial distribution: how many trials fail before some have succeeded."""

    token_type: Any = int

    successes = Parameter(float, 1.0, unit="1", above=0, doc="how many successes")
    probability = Parameter(float, 0.5, unit="1", above=0, max=1, doc="of success in each trial")

    def draw(self, random: Stream) -> int:
        return random.negative_binomial(self.successes, self.probability)


class Triangular(Distribution):
    """The triangular distribution: a least, a likeliest and a greatest number."""

    low = Parameter(float, 0.0, doc="the least number")
    mode = Parameter(float, 0.5, doc="the likeliest number")
    high = Parameter(float, 1.0, doc="the greatest number")

    def check(self) -> None:
        _check_order("low", self.low, "mode", self.mode)
        _check_order("mode", self.mode, "high", self.high)

    def draw(self, random: Stream) -> float:
        return random.triangular(self.low, self.mode, self.high)


class Bernoulli(Distribution):
    """True with a probability, otherwise false."""

    token_type: Any = bool

    probability = Parameter(float, 0.5, unit="1", min=0, max=1, doc="of true")

    def draw(self, random: Stream) -> bool:
        return random.random() < self.probability


class RandomInteger(Distribution):
    """All integers from ``low`` to ``high`` alike, both included."""

    token_type: Any = int

    low = Parameter(int, 0, doc="the least integer")
    high = Parameter(int, 1, doc="the greatest integer")

    def check(self) -> None:
        _check_order("low", self.low, "high", self.high)

    def draw(self, random: Stream) -> int:
        return self.low + random.below(self.high - self.low + 1)


class Choice(Distribution):
    """One of several values of any kind, all alike or by weight."""

    values: Parameter[Any] = Parameter(object, shape=(None,), doc="what is chosen from")
    weights: Parameter[Any] = array_parameter(
        (None,), None, unit="1", min=0, doc="how likely each is, relative to the others; all alike if left out"
    )

    def check(self) -> None:
        if not self.values:
            raise ParameterError("Choice.values: the list is empty, there is nothing to choose from")
        self.token_type = token_type(self.values)
        weights = [1.0] * len(self.values) if self.weights is None else self.weights.tolist()
        try:
            self._sums = cumulated(weights)
        except ValueError:
            self._sums = []
        if len(self._sums) != len(self.values):
            raise ParameterError(
                f"Choice.weights: {weights} does not give a weight to each of {counted(len(self.values), 'value')}"
            )

    def draw(self, random: Stream) -> Any:
        numbers: Any = random
        if isinstance(numbers, Numbers):
            return self.values[numbers.weighted(self._sums)]
        return self.values[weighted(random, self._sums)]


def _check_order(low_name: str, low: float, high_name: str, high: float) -> None:
    if low > high:
        raise ParameterError(
            f"{low_name} is {low:g} and {high_name} is {high:g}: {low_name} may not be above {high_name}"
        )
