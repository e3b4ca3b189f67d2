"""Disturbances of measurement: they stand at output ports."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import Parameter

from .core import JoinPoint, MeasurementAspect
from .loss import loses


class MeasurementFailure(MeasurementAspect):
    """Suppresses each measurement with a fixed probability, before anybody receives it (Bernoulli).

    Event: ``failed``.  Paper: the sensor error of the disturbance level, section III.A.
    """

    events: ClassVar[tuple[str, ...]] = ("failed",)

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a measurement fails")
    spare_first = Parameter(bool, False, doc="measurements of the first tag always pass")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        if loses(point, self.probability, self.spare_first):
            point.act("failed", token)
        else:
            point.forward(token)
