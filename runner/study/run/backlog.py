"""The backlog of a study: which run comes next, and when a condition has had enough."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from ..inference import half_width
from ..plan.plan import Condition, Plan

OK, FAILED, TIMEOUT, KILLED = "ok", "failed", "timeout", "killed"
RETRIED = (TIMEOUT, KILLED)  # what hangs on the machine, not on the model alone


@dataclass(frozen=True)
class Done:
    """What is known of a run that is over: its status, and the value of the metric that decides, if one does."""

    status: str
    value: float | None = None


@dataclass
class Task:
    """One run to be made."""

    condition: int
    replication: int
    seed: int
    key: str
    attempt: int = 1


@dataclass(eq=False)
class _Open:
    """A condition whose runs are being made."""

    condition: Condition
    limit: int  # replications that are wanted so far
    next: int = 0
    running: int = 0
    values: dict[int, float] = field(default_factory=dict)


class Backlog:
    """Hands out the runs of a plan that are not there yet, condition by condition.

    With ``until``, a condition gets its replications in batches, and is looked at only between batches: what is run
    hangs on neither the number of workers nor their speed.
    """

    def __init__(self, plan: Plan, known: Mapping[str, Done]) -> None:
        self.plan = plan
        self.known = known
        self.until = plan.study.until
        self.there: Counter[str] = Counter()  # the runs that were there already, by status
        self.made: Counter[str] = Counter()  # and those that were made
        self.stopped_early = 0  # runs that were not needed
        self._open: deque[_Open] = deque()
        self._again: deque[Task] = deque()
        self._running: dict[tuple[int, int], _Open] = {}
        self._next = 0

    @property
    def total(self) -> int:
        """All runs, those that were there and those that may come."""
        return self.plan.size - self.stopped_early

    @property
    def over(self) -> int:
        """The runs that are over."""
        return self.there.total() + self.made.total()

    @property
    def failed(self) -> int:
        """How many of those are not ok."""
        return self.over - self.made[OK] - self.there[OK]

    @property
    def left(self) -> int:
        """The runs that are still to be made: of those that were there, some may not have come up yet."""
        return max(0, self.total - self.over - (self._asked_for - self.there.total()))

    @cached_property
    def _asked_for(self) -> int:
        """How many of the runs that are known the plan asks for; in a folder there may be others, too."""
        if not self.known:
            return 0
        conditions = map(self.plan.condition, range(self.plan.conditions))
        return sum(
            self.plan.key(each, one) in self.known for each in conditions for one in range(self.plan.replications)
        )

    def next(self) -> Task | None:
        """The next run; None if there is none now, or ever."""
        if self._again:
            return self._again.popleft()
        for opened in list(self._open):
            if (task := self._next_of(opened)) is not None:
                return task
        while self._next < self.plan.conditions:
            limit = self.plan.replications if self.until is None else self.until.batch
            opened = _Open(self.plan.condition(self._next), min(limit, self.plan.replications))
            self._next += 1
            self._open.append(opened)
            if (task := self._next_of(opened)) is not None:
                return task
        return None

    def again(self, task: Task) -> None:
        """A run is to be made once more, as its worker has died."""
        task.attempt += 1
        self._again.append(task)

    def finished(self, task: Task, done: Done) -> None:
        """A run is over."""
        opened = self._running.pop((task.condition, task.replication))
        opened.running -= 1
        self._note(opened, task.replication, done, self.made)
        self._has_more(opened)

    def _next_of(self, opened: _Open) -> Task | None:
        """The next run of a condition; None if it waits for others, or is closed."""
        index = opened.condition.index
        while self._has_more(opened):
            replication = opened.next
            opened.next += 1
            key = self.plan.key(opened.condition, replication)
            if (done := self.known.get(key)) is None:
                opened.running += 1
                self._running[index, replication] = opened
                return Task(index, replication, self.plan.seed(opened.condition, replication), key)
            self._note(opened, replication, done, self.there)
        return None

    def _note(self, opened: _Open, replication: int, done: Done, counts: Counter[str]) -> None:
        counts[done.status] += 1
        if self.until is not None and done.status == OK and done.value is not None and math.isfinite(done.value):
            opened.values[replication] = done.value

    def _has_more(self, opened: _Open) -> bool:
        """Whether there is a run to be made; if all of a batch is over, the next begins, or the condition is closed."""
        if opened.next < opened.limit or opened.running:
            return opened.next < opened.limit
        most = self.plan.replications
        if self.until is not None and opened.limit < most:
            values = [opened.values[each] for each in sorted(opened.values)]
            if half_width(values) >= self.until.half_width:
                opened.limit = min(opened.limit + self.until.batch, most)
                return True
            self.stopped_early += most - opened.limit
        self._open.remove(opened)
        return False
