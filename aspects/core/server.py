"""A server with a waiting line: what media and processors have in common.  All times are in ns."""

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
    """What waits for a server, or is served: a message, or a firing.  The smallest ``urgency`` goes first."""

    urgency: float
    number: int = field(init=False)  # which of all that have come: among equals, the first goes first
    passing: Any = field(compare=False)
    point: JoinPoint = field(compare=False)
    duration: int = field(compare=False)  # for which it still needs the server
    came: int = field(init=False, compare=False)

    def __post_init__(self) -> None:
        self.came = self.point.tag.time

    @abstractmethod
    def release(self, now: int) -> None:
        """It has been served: let it go on."""


T = TypeVar("T", bound=Task)


class WaitingLine(Generic[T]):
    """Tasks that wait, the most urgent first, and in the order in which they came among equals."""

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
        """Let a task wait; returns the one of the least urgent that is dropped for it, which can be itself."""
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
    """Serves one task at a time, and counts what it does; ``steps``: one that takes no time takes a microstep."""

    def __init__(self, *, steps: bool = False) -> None:
        self.steps = steps
        self.line: WaitingLine[Task] = WaitingLine()
        self.begins = 0
        self.waited = 0  # by all that have begun, until then
        self.done = 0
        self.responses = 0  # of all that are done: the times from coming to being done
        self.longest = 0  # of these
        self._come = 0
        self._served: Task | None = None
        self._begun = 0  # when the served one began, or went on
        self._busy = 0  # of all that were served before it

    def busy_until(self, end: int) -> int:
        """How long it has served before ``end``, which is not before the present."""
        return self._busy + (end - self._begun if self._served is not None else 0)

    def arrive(
        self, task: Task, capacity: int | None = None, overflow: str = NEWEST, preemptive: bool | None = None
    ) -> Task | None:
        """Take in a task, now; returns the one that is dropped for it.

        ``preemptive``: a more urgent one interrupts the served one, if false at the instant at which that began alone.
        """
        now, served = task.came, self._served
        task.number, self._come = self._come, self._come + 1
        is_in_time = served is not None and (served.duration > 0 or not self.steps)
        if served is not None and is_in_time and self._begun + served.duration <= now:
            self._finish((served, self._begun))  # it is over, though we have not been called yet
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
        """Whether a task from there is not over."""
        return any(task.point.is_at(point) for task in (self._served, *self.line.tasks) if task is not None)

    def remove(self, point: JoinPoint) -> None:
        """Drop the tasks from there, now: they will never be over."""
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
        if task.duration > 0 or self.steps:
            task.point.later(to_seconds(task.duration), self._finish, (task, now))
        else:
            self._release(task, now)

    def _finish(self, what: tuple[Task, int]) -> None:
        """A task is over, unless it was interrupted since it began or went on at that time."""
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
        """If it is idle, begin with the most urgent task."""
        while self._served is None and self.line.tasks:
            self._begin(self.line.pop(now), now)

    def _interrupt(self, task: Task, now: int) -> None:
        worked = now - self._begun
        self._stop(now)
        task.duration -= worked
        self.line.add(task, now)
        if worked > 0:  # or else it had not really begun
            task.point.act("preempted", to_seconds(task.duration))

    def _stop(self, now: int) -> None:
        self._busy += now - self._begun
        self._served = None
