"""Firings that do not happen."""

from __future__ import annotations

from typing import ClassVar

from epicycle.actors import Parameter

from ..core import ActorPoint, ExecutionAspect, Job


class SkipFiring(ExecutionAspect):
    """Skips each firing with a fixed probability, independently: what came for it is lost.

    An actor that asks for its next wake-up whenever it wakes up would sleep for ever after one that is skipped; so
    a firing for which a wake-up is due always happens, unless ``wakes`` says that it may be skipped as well.
    Event: ``skipped``.
    """

    events: ClassVar[tuple[str, ...]] = ("skipped",)

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a firing is skipped")
    wakes = Parameter(bool, False, doc="whether firings for a wake-up may be skipped, too")

    def schedule(self, job: Job, point: ActorPoint) -> None:
        skipped = point.random.random() < self.probability
        if skipped and (self.wakes or not job.wakes):
            point.act("skipped", None)
        else:
            point.forward(job)
