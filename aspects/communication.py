"""Disturbances of communication: they stand at input ports."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import Parameter

from .core import CommunicationAspect, JoinPoint
from .loss import loses


class PacketLoss(CommunicationAspect):
    """Drops each message with a fixed probability, independently per receiver and message (Bernoulli).

    Event: ``dropped``.  Paper: the communication error of the disturbance level, section III.A.
    """

    events: ClassVar[tuple[str, ...]] = ("dropped",)

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a message is lost")
    spare_first = Parameter(bool, False, doc="messages of the first tag at which any arrives always pass")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        if loses(point, self.probability, self.spare_first):
            point.act("dropped", token)
        else:
            point.forward(token)
