"""Sensors that fail: a measurement that nobody receives, or the same one again and again."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import EpicycleError, Parameter

from ..core import JoinPoint, MeasurementAspect, RandomLoss, is_bad, stamped_as


class MeasurementFailure(RandomLoss, MeasurementAspect):
    """Suppresses measurements with a fixed probability, before anybody receives them.

    Without ``burst`` each fails independently (Bernoulli), as messages are lost by ``PacketLoss``.  With it, failures
    come in runs of that mean length: a sensor that fails and works like the channel of ``GilbertElliott`` with
    r = 1 / burst and p = r * probability / (1 - probability).
    Event: ``failed``.  Paper: the sensor error of the disturbance level, section III.A.
    """

    events: ClassVar[tuple[str, ...]] = ("failed",)

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a measurement fails")
    burst: Parameter[float | None] = Parameter(
        float, None, unit="1", min=1.0, doc="mean number of failures in a row; none: independent failures"
    )

    def __init__(self, **values: object) -> None:
        super().__init__(**values)
        if self.burst is not None and self.probability > self.burst / (self.burst + 1.0):
            raise EpicycleError(
                f"a failure probability of {self.probability:g} cannot come in runs of {self.burst:g} in the mean: "
                f"a working sensor works for one measurement at least; burst must be "
                + ("infinite" if self.probability == 1.0 else f">= {self.probability / (1.0 - self.probability):g}")
            )

    def draw(self, point: JoinPoint) -> bool:
        if self.burst is None:
            return bool(point.random.random() < self.probability)
        recovers = 1.0 / self.burst
        return is_bad(point, recovers * self.probability / (1.0 - self.probability), recovers)


class StuckAt(MeasurementAspect):
    """Repeats the last good measurement while the sensor is stuck, with the time of the one that it should be.

    From measurement to measurement a working sensor gets stuck with probability ``p`` and a stuck one comes free with
    probability ``r``, as the channel of ``GilbertElliott`` turns bad and recovers; the first measurement is always
    good.  Event: ``replaced``, with the old measurement.
    """

    events: ClassVar[tuple[str, ...]] = ("replaced",)

    p = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability of getting stuck, per measurement")
    r = Parameter(float, 0.0, min=0.0, max=1.0, unit="1", doc="probability of coming free, per measurement")

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
