"""Firings that take time, and firings that do not happen."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from epicycle.actors import EpicycleError, Parameter, to_nanoseconds, to_seconds

from ..core import ActorPoint, ExecutionAspect, FiringTimeParameter, Job, time_needed
from .measured_times import MeasuredTimes

WAIT, SKIP = "wait", "skip"


class ExecutionTime(ExecutionAspect):
    """Lets the firings of an actor take time: it fires when that is over, with the tokens that came at the beginning.

    A firing takes ``scale`` * (``time`` + the next of the measured ``times``), if there is something to do in it: at
    ports that do not trigger an actor it only takes note of tokens, which costs nothing.  With a ``time`` for each port
    that costs something, ``{trigger: 60 ms, peer_plans: 1 ms}``, a firing takes the longest of those of the ports at
    which tokens came.  An actor does one thing after the other: what falls due meanwhile waits for its turn, or is
    skipped; a firing for a wake-up, or in which nothing takes time, always waits, for an actor that misses a wake-up
    may never ask for the next.

    With ``measure`` nothing is delayed.  Instead the time that each firing takes to compute here and now is recorded as
    the signal ``NAME@ACTOR``, and the ``signals.parquet`` of that run can be given as ``times`` from then on: the run
    that measures has the log of a run without the aspect, and each that takes the times from a file is reproducible.
    The times of an actor are taken in their order, and again from the first one when they are used up.
    Events: ``delayed``, with the seconds from when the firing fell due, and ``skipped``.
    """

    events: ClassVar[tuple[str, ...]] = ("delayed", "skipped")

    time = FiringTimeParameter(
        0.0, doc="execution time of a firing, or a distribution of it; or {port: time} for each input port that costs"
    )
    times: Parameter[Path | None] = Parameter(
        Path,
        None,
        doc="file of measured times, .csv or .parquet: column value (s), and signal (NAME@ACTOR) if not for all actors",
    )
    measure = Parameter(bool, False, doc="whether to measure and record execution times, and delay nothing")
    scale = Parameter(float, 1.0, min=0.0, unit="1", doc="how many times slower the processor is than what was given")
    busy = Parameter(str, WAIT, choices=(WAIT, SKIP), doc="what becomes of a firing while another takes its time")

    def check(self) -> None:
        if self.measure and (self.time != 0.0 or self.times is not None):
            raise EpicycleError("it cannot measure execution times where they are given: leave one or the other out")
        self._measured = None if self.times is None else MeasuredTimes(self.times)

    def schedule(self, job: Job, point: ActorPoint) -> None:
        seconds = time_needed(self.time, job, point.random)
        if seconds is None:
            self._occupy(job, point, 0)
            return
        if self.measure:
            job.watch = point.record
            point.forward(job)
            return
        if self._measured is not None:
            number = point.memory["number"] = point.memory.get("number", -1) + 1
            seconds += self._measured.of(point.owner, number)
        self._occupy(job, point, to_nanoseconds(self.scale * seconds))

    def pass_by(self, job: Job, point: ActorPoint) -> None:
        self._occupy(job, point, 0)  # though it still waits for those before it

    def forget(self, point: ActorPoint) -> None:
        point.memory.pop("free", None)

    def _occupy(self, job: Job, point: ActorPoint, duration: int) -> None:
        now = point.tag.time
        free = max(now, point.memory.get("free", now))
        if free > now and duration > 0 and self.busy == SKIP and not job.wakes:
            point.act("skipped", None)
            return
        point.memory["free"] = free + duration
        if free + duration == now:
            point.forward(job)
            return
        delay = to_seconds(free + duration - now)
        point.act("delayed", delay)
        point.forward(job, delay)


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
