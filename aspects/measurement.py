"""Disturbances of measurement: they attach to output ports, and decide what a sensor seems to have measured."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import Distribution, EpicycleError, Normal, Parameter, Stream, Uniform, texts_parameter
from epicycle.actors.expression import PortFormulaParameter, operand

from .core import JoinPoint, LawParameter, MeasurementAspect, RandomLoss, altered, is_bad, law, stamped_as


class _Laplace(Distribution):
    """Exponential on both sides, with mean 0 and variance 1."""

    def draw(self, random: Stream) -> float:
        return random.laplace(scale=math.sqrt(0.5))


LAWS = {  # with mean 0 and variance 1
    "normal": Normal(),
    "uniform": Uniform(low=-math.sqrt(3.0), high=math.sqrt(3.0)),
    "laplace": _Laplace(),
}
Numbers = NDArray[np.float64]


class MeasurementFailure(RandomLoss, MeasurementAspect):
    """Suppresses measurements with a fixed probability, before any receiver.

    Without ``burst`` each fails independently (Bernoulli), as messages are lost by ``PacketLoss``.  With it, failures
    come in runs of that mean length: the sensor behaves like the channel of ``GilbertElliott`` with r = 1 / burst and p
    = r * probability / (1 - probability).
    Event: ``failed``.  Paper: the sensor error of the disturbance level, section III.A.
    """

    events: ClassVar[tuple[str, ...]] = ("failed",)

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a measurement fails")
    burst = Parameter(
        float, None, unit="1", min=1.0, doc="mean number of failures in a row; independent failures if left out"
    )

    def check(self) -> None:
        if self.burst is None:
            return
        if self.burst == math.inf:
            raise EpicycleError("burst: the mean of runs must be finite")
        if self.probability > self.burst / (self.burst + 1.0):
            least = math.inf if self.probability == 1.0 else self.probability / (1.0 - self.probability)
            raise EpicycleError(
                f"failures with probability {self.probability:g} cannot come in runs of {self.burst:g} on average: "
                f"a working sensor works for at least one measurement; "
                + (f"burst must be >= {least:g}" if least < math.inf else "leave out 'burst'")
            )

    def draw(self, point: JoinPoint) -> bool:
        if self.burst is None:
            return bool(point.random.random() < self.probability)
        recovers = 1.0 / self.burst
        return is_bad(point, recovers * self.probability / (1.0 - self.probability), recovers)


class StuckAt(MeasurementAspect):
    """Repeats the last good measurement while the sensor is stuck, with the time of the one that it replaces.

    At each measurement, a working sensor gets stuck with probability ``p`` and a stuck one recovers with probability
    ``r``, like the channel of ``GilbertElliott``; the first measurement is always good, also each time that the aspect
    becomes active.  Event: ``replaced``, with the old measurement.
    """

    events: ClassVar[tuple[str, ...]] = ("replaced",)

    p = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability of getting stuck, per measurement")
    r = Parameter(float, 0.0, min=0.0, max=1.0, unit="1", doc="probability of recovering, per measurement")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        stuck = point.memory.setdefault("bad", False)
        if "good" in point.memory:
            stuck = is_bad(point, self.p, self.r)
        if stuck:
            old = stamped_as(point.memory["good"], token)
            point.act("replaced", token, old)
            point.forward(old)
        else:
            point.memory["good"] = token
            point.forward(token)

    def pass_by(self, token: Any, point: JoinPoint) -> None:
        point.memory.clear()  # what was good before is long out of date when the sensor gets stuck again
        point.forward(token)


class Alteration(MeasurementAspect):
    """Base of the aspects that replace the numbers in a measurement, or a parameter: write ``alter``.

    Event: ``replaced``, with the new measurement.  A measurement that does not change leaves no trace.
    """

    events: ClassVar[tuple[str, ...]] = ("replaced",)
    alters_parameters: ClassVar[bool] = True

    fields = texts_parameter((), doc="fields of the measurement to alter; if left out, all numbers except its time")

    @abstractmethod
    def alter(self, numbers: Numbers, point: JoinPoint) -> Numbers:
        """The new numbers of one field (flat); called once per field, in order."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        changed = False

        def change(numbers: Numbers) -> Numbers:
            nonlocal changed
            new = self.alter(numbers, point)
            changed = changed or not np.array_equal(new, numbers, equal_nan=True)
            return new

        new = altered(token, self.fields, change)
        if not changed:
            point.forward(token)
            return
        point.act("replaced", token, new)
        point.forward(new)


class Noise(Alteration):
    """Adds independent random errors: ``deviation`` times a value drawn from the distribution.

    normal, uniform and laplace are laws with mean 0 and variance 1, so ``deviation`` is the standard deviation.
    """

    deviation = Parameter(float, min=0.0, doc="standard deviation, in the number's own unit")
    distribution = LawParameter(LAWS, "normal", doc="law of the error, in units of the deviation")

    def alter(self, numbers: Numbers, point: JoinPoint) -> Numbers:
        errors = law(self.distribution, LAWS)
        return numbers + self.deviation * np.array([errors.draw(point.random) for _ in numbers])


class Bias(Alteration):
    """Adds a constant error: a ``Transform`` to value + ``by``."""

    by = Parameter(float, doc="what is added to each number, in its own unit")

    def alter(self, numbers: Numbers, point: JoinPoint) -> Numbers:
        return numbers + self.by


class Drift(Alteration):
    """Adds an error that grows: ``rate`` * t + ``walk`` * W(t), with an independent Wiener process W for each number.

    t is counted from the first measurement; the variance of the random part is ``walk``^2 * t.
    """

    rate = Parameter(float, 0.0, doc="steady growth, in the number's own unit per second")
    walk = Parameter(float, 0.0, min=0.0, doc="random growth, in the number's own unit per square root of a second")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.memory["field"] = 0
        super().pass_token(token, point)
        point.memory["last"] = point.now

    def alter(self, numbers: Numbers, point: JoinPoint) -> Numbers:
        field = point.memory["field"]
        start: float = point.memory.setdefault("start", point.now)
        step: float = point.now - point.memory.get("last", point.now)
        point.memory["field"] = field + 1
        place = (field, numbers.size)  # tokens of another size have separate errors
        walked: Numbers = point.memory.get(place, np.zeros(numbers.shape))
        walked = walked + math.sqrt(step) * point.random.normal(size=numbers.shape)
        point.memory[place] = walked
        return numbers + self.rate * (point.now - start) + self.walk * walked


class Transform(Alteration):
    """Replaces each number by an expression over it, the time and the latest tokens of ports.

    NaN is not changed, nor is any number until all the ports have sent a token.  What replaces a whole number is
    rounded to one, as in all aspects that alter numbers.
    """

    to = PortFormulaParameter(
        given=("value", "time"),
        doc="expression over the number (value), the time in s (time) and ports, such as value * (1 + 0.01 * time)",
    )

    def alter(self, numbers: Numbers, point: JoinPoint) -> Numbers:
        assert self.to is not None
        known = ~np.isnan(numbers)
        new = [point.value_of(self.to, value=float(number), time=point.now) for number in numbers[known]]
        for each in new:
            if each is None:  # a port that has sent nothing
                return numbers
            if isinstance(each, bool) or not isinstance(each, (int, float)):
                raise EpicycleError(f"{self.to.source!r} gives {each!r}, which is not a number")
        result = numbers.copy()
        result[known] = new
        return result


class Replace(MeasurementAspect):
    """Replaces tokens of any kind by an expression over the token, the time and the latest tokens of ports.

    At a parameter, it can give it the value of a variable of the model: ``to: limit.value + 1``.  Nothing is replaced
    until all the ports have sent a token, and NaN is not changed.  Event: ``replaced``, with the new value.
    """

    events: ClassVar[tuple[str, ...]] = ("replaced",)
    alters_parameters: ClassVar[bool] = True
    alters_numbers: ClassVar[bool] = False

    to = PortFormulaParameter(
        given=("value", "time"),
        doc="expression over the token (value), the time in s (time) and ports, such as value and switch.output",
    )

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        assert self.to is not None
        given = operand(token)
        is_nan = isinstance(given, float) and math.isnan(given)
        new = None if is_nan else point.value_of(self.to, value=given, time=point.now)
        if new is not None and (type(new) is not type(given) or new != given):
            point.act("replaced", token, new)
            token = new
        point.forward(token)


class Outlier(Alteration):
    """Adds an occasional gross error N(0, deviation^2), independently to each number."""

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a number is an outlier")
    deviation = Parameter(float, min=0.0, doc="standard deviation of the gross error, in the number's own unit")

    def alter(self, numbers: Numbers, point: JoinPoint) -> Numbers:
        hit = point.random.random(numbers.shape) < self.probability
        return numbers + np.where(hit, self.deviation * point.random.normal(size=numbers.shape), 0.0)


class Quantise(Alteration):
    """Rounds to the nearest multiple of a step, ties to the even one; with 0, nothing is rounded."""

    step = Parameter(float, min=0.0, doc="size of the step, in the number's own unit")

    def alter(self, numbers: Numbers, point: JoinPoint) -> Numbers:
        if self.step == 0.0:
            return numbers
        with np.errstate(over="ignore"):
            steps = numbers / self.step
        # A number with so many steps is a multiple to all its digits.
        return np.where(np.isinf(steps), numbers, self.step * np.rint(steps))


class Saturate(Alteration):
    """Limits numbers to what the sensor can show."""

    low = Parameter(float, -math.inf, doc="smallest number, in its own unit")
    high = Parameter(float, math.inf, doc="largest number, in its own unit")

    def check(self) -> None:
        if self.low > self.high:
            raise EpicycleError(f"low is {self.low:g} and high is {self.high:g}: low must not be above high")

    def alter(self, numbers: Numbers, point: JoinPoint) -> Numbers:
        return np.clip(numbers, self.low, self.high)
