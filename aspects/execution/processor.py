"""Processors that actors share: their firings take time, and only one goes on at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from epicycle.actors import Parameter, to_nanoseconds, to_seconds

from ..core import (
    ActorPoint,
    ByActorParameter,
    ExecutionAspect,
    FiringTime,
    FiringTimeParameter,
    Job,
    Server,
    Task,
    time_needed,
)

FCFS, PRIORITY, EDF = "fcfs", "priority", "edf"


class Processor(ExecutionAspect):
    """One processor for all the actors at which it stands: each of their firings needs it for some time.

    An actor fires when the time that its firing needs has been worked off, with the tokens that came at the beginning.
    As in ``ExecutionTime``, tokens of which it only takes note cost nothing, and times may be given by input port.
    fcfs: firings go in the order in which they fell due.  priority: the actor with the smallest number goes first; an
    actor without one, last.  edf: the firing goes first whose deadline comes first.  Among equals it is again the
    order in which they fell due, by the tag and within a tag by the firing order of the model.  With ``preemptive``, a
    more urgent firing interrupts the one that goes on, which later continues where it was; what falls due at the
    instant at which a firing begins is asked first in any case.  Times are those of the model, whatever clocks the
    actors have.

    Events: ``delayed``, when it fires, with the seconds since it fell due (its response time); ``preempted``, with the
    seconds that it still needs; ``missed``, when it fires after its deadline, with the seconds that it is late.
    Reported: ``utilisation``, the share of the time from 0 to the end in which it works; ``mean_response`` and
    ``max_response`` over the firings that took place.

    For periodic tasks with fixed priorities the longest response R of a task is the least solution of
    R = C + sum over the more urgent ones of ceil(R / T_j) C_j (Joseph and Pandya, The Computer Journal 29, 1986); with
    edf no deadline is missed as long as the utilisation is at most 1 and deadlines are periods (Liu and Layland,
    Journal of the ACM 20, 1973).  Ptolemy: ``FCFSScheduler``, ``FixedPriorityScheduler``, ``EDFScheduler``.
    """

    events: ClassVar[tuple[str, ...]] = ("delayed", "preempted", "missed")
    reports: ClassVar[dict[str, str]] = {"utilisation": "1", "mean_response": "s", "max_response": "s"}
    in_model_time: ClassVar[bool] = True
    is_processor: ClassVar[bool] = True

    policy = Parameter(str, FCFS, choices=(FCFS, PRIORITY, EDF), doc="which of the firings that are due goes first")
    preemptive = Parameter(bool, True, doc="whether a more urgent firing interrupts the one that goes on")
    time = FiringTimeParameter(
        0.0, doc="time that a firing needs, or a distribution, or {port: time}, for actors not named in times"
    )
    times = ByActorParameter(
        FiringTimeParameter(),
        words="times or distributions",
        doc="time that a firing needs (s), by actor: {pattern: time, distribution, or {port: time}}",
    )
    priorities = ByActorParameter(
        Parameter(float, unit="1"), doc="priority by actor, the smallest most urgent: {pattern: number}"
    )
    deadlines = ByActorParameter(
        Parameter(float, min=0.0, unit="s"),
        words="times",
        doc="deadline by actor, from when a firing falls due (s): {pattern: time}",
    )

    def schedule(self, job: Job, point: ActorPoint) -> None:
        given: FiringTime | None = self._of(self.times, "times", point)
        seconds = time_needed(self.time if given is None else given, job, point.random)
        if seconds is None:
            self.pass_by(job, point)
        else:
            self._core(point).arrive(self._task(job, point, to_nanoseconds(seconds)), preemptive=self.preemptive)

    def pass_by(self, job: Job, point: ActorPoint) -> None:
        # It takes no time, but has to stay behind the earlier ones of its actor.
        core = self._core(point)
        if core.has_any(point):
            core.arrive(self._task(job, point, 0), preemptive=self.preemptive)
        else:
            point.forward(job)

    def forget(self, point: ActorPoint) -> None:
        self._core(point).remove(point)

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        core: _Core = shared.get("core", _Core())
        return {
            "utilisation": core.busy_until(end) / end if end else None,
            "mean_response": to_seconds(core.responses) / core.done if core.done else None,
            "max_response": to_seconds(core.longest) if core.done else None,
        }

    @staticmethod
    def _core(point: ActorPoint) -> _Core:
        core: _Core = point.shared.setdefault("core", _Core())
        return core

    def _task(self, job: Job, point: ActorPoint, duration: int) -> _Firing:
        now, limit = point.tag.time, self._of(self.deadlines, "deadlines", point)
        deadline = float("inf") if limit is None else now + to_nanoseconds(limit)
        urgency = 0.0
        if self.policy == PRIORITY:
            priority = self._of(self.priorities, "priorities", point)
            urgency = float("inf") if priority is None else priority
        elif self.policy == EDF:
            urgency = deadline
        return _Firing(urgency, job, point, duration, deadline)

    @staticmethod
    def _of(value: Mapping[str, Any], name: str, point: ActorPoint) -> Any:
        known = point.memory.setdefault(name, {})
        if "value" not in known:
            known["value"] = ByActorParameter.of(value, point.selected(name), point.owner)
        return known["value"]


@dataclass(order=True)
class _Firing(Task):
    """A firing that needs the processor."""

    deadline: float = field(compare=False)


class _Core(Server[_Firing]):
    """What is on a processor, and what has been; times in ns."""

    def __init__(self) -> None:
        super().__init__()
        self.done = 0  # firings
        self.responses = 0  # of all of them
        self.longest = 0

    def release(self, task: _Firing, now: int) -> None:
        response = now - task.came
        self.done += 1
        self.responses += response
        self.longest = max(self.longest, response)
        if response > 0:
            task.point.act("delayed", to_seconds(response))
        if now > task.deadline:
            task.point.act("missed", to_seconds(now - round(task.deadline)))
        task.point.forward(task.passing)
