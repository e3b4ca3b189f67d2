"""A server with a queue: the common part of media and processors.  All times are in ns."""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from epicycle.actors import to_seconds

from .join_point import JoinPoint

NEWEST, OLDEST = "newest", "oldest"


@dataclass(order=True)
class Task(ABC):
    """A task that waits or is served: a message, or a firing.  The smallest ``urgency`` goes first."""

    urgency: float
    number: int = field(init=False)  # number in order of arrival: among equals, the first goes first
    passing: Any = field(compare=False)
    point: JoinPoint = field(compare=False)
    duration: int = field(compare=False)  # time for which it still needs the server
    came: int = field(init=False, compare=False)

    def __post_init__(self) -> None:
        self.came = self.point.tag.time

    @abstractmethod
    def release(self, now: int) -> None:
        """It has been served: let it continue."""


T = TypeVar("T", bound=Task)


class WaitingLine(Generic[T]):
    """Waiting tasks, the most urgent first, and in order of arrival among equals."""

    def __init__(self) -> None:
        self.tasks: list[T] = []  # a heap
        self._area = 0  # the integral of their number over time
        self._since = 0

    def area(self, now: int) -> int:
        """The integral of the number of tasks from time 0 to the present."""
        self._area += len(self.tasks) * (now - self._since)
        self._since = now
        return self._area

    def add(self, task: T, now: int, capacity: int | None = None, overflow: str = NEWEST) -> T | None:
        """Let a task wait; returns the one of the least urgent tasks that is dropped for it, possibly the task
        itself."""
        self.area(now)
        heapq.heappush(self.tasks, task)
        if capacity is None or len(self.tasks) <= capacity:
            return None
        least = max(each.urgency for each in self.tasks)
        choose = max if overflow == NEWEST else min
        dropped = choose((each for each in self.tasks if each.urgency == least), key=lambda each: each.number)
        self.tasks.remove(dropped)
        heapq.heapify(self.tasks)
        return dropped

    def pop(self, now: int) -> T:
        """The task whose turn it is."""
        self.area(now)
        return heapq.heappop(self.tasks)


class Server:
    """Serves one task at a time, and keeps statistics."""

    def __init__(self) -> None:
        self.line: WaitingLine[Task] = WaitingLine()
        self.begins = 0
        self.waited = 0  # of all tasks that have begun, until then
        self.done = 0
        self.responses = 0  # of all finished tasks: the times from arrival to completion
        self.longest = 0  # of these
        self._come = 0
        self._served: Task | None = None
        self._begun = 0  # when the served task began or resumed
        self._busy = 0  # of all tasks served before it

    def busy_until(self, end: int) -> int:
        """The time for which it has served before ``end``, which is not before the present."""
        return self._busy + (end - self._begun if self._served is not None else 0)

    def arrive(
        self, task: Task, capacity: int | None = None, overflow: str = NEWEST, preemptive: bool | None = None
    ) -> Task | None:
        """Accept a task now; returns the one that is dropped for it.

        ``preemptive``: a more urgent task interrupts the served one; if false, only at the instant at which that began.
        """
        now, served = task.came, self._served
        task.number, self._come = self._come, self._come + 1
        if served is not None and served.duration > 0 and self._begun + served.duration <= now:
            self._finish((served, self._begun))  # it is over, although this has not been called yet
            served = self._served
        can_interrupt = preemptive or (preemptive is not None and self._begun == now)
        if served is not None and can_interrupt and task.urgency < served.urgency:
            self._interrupt(served, now)
        elif served is not None or self.line.tasks:
            return self.line.add(task, now, capacity, overflow)
        self._begin(task, now)
        self._go_on(now)
        return None

    def has_any(self, point: JoinPoint) -> bool:
        """Whether a task from there is unfinished."""
        return any(task.point.is_at(point) for task in (self._served, *self.line.tasks) if task is not None)

    def remove(self, point: JoinPoint) -> None:
        """Drop the tasks from there now: they will never be finished."""
        now = point.tag.time
        self.line.tasks = [task for task in self.line.tasks if not task.point.is_at(point)]
        heapq.heapify(self.line.tasks)
        if self._served is not None and self._served.point.is_at(point):
            self._stop(now)
            self._go_on(now)

    def _begin(self, task: Task, now: int) -> None:
        self._served, self._begun = task, now
        self.begins += 1
        self.waited += now - task.came
        if self.is_instant(task):
            self._release(task, now)
        else:
            task.point.later(to_seconds(task.duration), self._finish, (task, now))

    def is_instant(self, task: Task) -> bool:
        """Whether a task is over as soon as it begins."""
        return task.duration == 0

    def _finish(self, what: tuple[Task, int]) -> None:
        """End a task, unless it was interrupted after it began or resumed at that time."""
        task, begun = what
        if task is self._served and begun == self._begun:
            now = begun + task.duration
            self._release(task, now)
            self._go_on(now)

    def _release(self, task: Task, now: int) -> None:
        self._stop(now)
        self.done += 1
        self.responses += now - task.came
        self.longest = max(self.longest, now - task.came)
        task.release(now)

    def _go_on(self, now: int) -> None:
        """If idle, begin the most urgent task."""
        while self._served is None and self.line.tasks:
            self._begin(self.line.pop(now), now)

    def _interrupt(self, task: Task, now: int) -> None:
        worked = now - self._begun
        self._stop(now)
        task.duration -= worked
        self.line.add(task, now)
        if worked > 0:  # otherwise it had not really begun
            task.point.act("preempted", to_seconds(task.duration))

    def _stop(self, now: int) -> None:
        self._busy += now - self._begun
        self._served = None
