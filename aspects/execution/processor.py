"""Processors that actors share: their firings take time, and only one goes on at a time."""

from __future__ import annotations

import heapq
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
            task = self._task(job, point, to_nanoseconds(seconds))
            self._core(point).arrive(task, preemptive=self.preemptive)

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

    def _task(self, job: Job, point: ActorPoint, duration: int) -> _Task:
        now, limit = point.tag.time, self._of(self.deadlines, "deadlines", point)
        deadline = float("inf") if limit is None else now + to_nanoseconds(limit)
        urgency = 0.0
        if self.policy == PRIORITY:
            priority = self._of(self.priorities, "priorities", point)
            urgency = float("inf") if priority is None else priority
        elif self.policy == EDF:
            urgency = deadline
        return _Task(urgency, 0, job, point, now, duration, deadline)

    @staticmethod
    def _of(value: Mapping[str, Any], name: str, point: ActorPoint) -> Any:
        known = point.memory.setdefault(name, {})
        if "value" not in known:
            known["value"] = ByActorParameter.of(value, point.selected(name), point.owner)
        return known["value"]


@dataclass(order=True)
class _Task:
    """A firing that needs the processor; times in ns."""

    urgency: float
    number: int  # which of all that have come
    job: Job = field(compare=False)
    point: ActorPoint = field(compare=False)
    released: int = field(compare=False)
    left: int = field(compare=False)  # time that it still needs
    deadline: float = field(compare=False)


class _Core:
    """What is on a processor, and what has been; times in ns."""

    def __init__(self) -> None:
        self.done = 0  # firings
        self.responses = 0  # of all of them
        self.longest = 0
        self._waiting: list[_Task] = []
        self._running: _Task | None = None
        self._begun = 0  # when the running one began, or went on
        self._busy = 0  # of all that ran before it
        self._come = 0

    def has_any(self, point: ActorPoint) -> bool:
        """Whether a firing of this actor is not over."""
        return any(task.point is point for task in (*self._waiting, *([self._running] if self._running else ())))

    def busy_until(self, end: int) -> int:
        """How long it has worked before ``end``, which is not before the present."""
        return self._busy + (end - self._begun if self._running is not None else 0)

    def remove(self, point: ActorPoint) -> None:
        """Drop the firings of an actor that will never be over, now."""
        now = point.tag.time
        self._waiting = [task for task in self._waiting if task.point is not point]
        heapq.heapify(self._waiting)
        if self._running is not None and self._running.point is point:
            self._busy += now - self._begun
            self._running = None
            self._go_on(now)

    def arrive(self, task: _Task, *, preemptive: bool) -> None:
        """Take in a firing, now."""
        now, running = task.released, self._running
        task.number, self._come = self._come, self._come + 1
        if running is not None and self._begun + running.left <= now:
            self._finish((running, self._begun))  # it is over, though we have not been called yet
            running = self._running
        if running is not None and task.urgency < running.urgency and (preemptive or self._begun == now):
            self._put_back(running, now)
        heapq.heappush(self._waiting, task)
        self._go_on(now)

    def _put_back(self, task: _Task, now: int) -> None:
        worked = now - self._begun
        self._busy += worked
        task.left -= worked
        self._running = None
        heapq.heappush(self._waiting, task)
        if worked > 0:  # or else it had not really begun
            task.point.act("preempted", to_seconds(task.left))

    def _go_on(self, now: int) -> None:
        """If it is idle, let it work on the most urgent firing."""
        while self._running is None and self._waiting:
            task = self._running = heapq.heappop(self._waiting)
            self._begun = now
            if task.left > 0:
                task.point.later(to_seconds(task.left), self._finish, (task, now))
            else:
                self._fire(task, now)

    def _finish(self, what: tuple[_Task, int]) -> None:
        """A firing is over, unless it was preempted since it began or went on at that time."""
        task, begun = what
        if task is self._running and begun == self._begun:
            now = begun + task.left
            self._fire(task, now)
            self._go_on(now)

    def _fire(self, task: _Task, now: int) -> None:
        self._busy += now - self._begun
        self._running = None
        response = now - task.released
        self.done += 1
        self.responses += response
        self.longest = max(self.longest, response)
        if response > 0:
            task.point.act("delayed", to_seconds(response))
        if now > task.deadline:
            task.point.act("missed", to_seconds(now - round(task.deadline)))
        task.point.forward(task.job)
