"""The backlog of a study: which run comes next, and when a condition has enough runs."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

from ..inference import half_width, is_usable
from ..plan.plan import Condition, Plan
from .share import ALL, Share

OK, FAILED, TIMEOUT, KILLED = "ok", "failed", "timeout", "killed"
RETRIED = (TIMEOUT, KILLED)  # these depend on the machine, not only on the model


@dataclass(frozen=True)
class Done:
    """What is known of a finished run: its status, and the value of the deciding metric, if there is one."""

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


class Backlog:
    """Hands out the missing runs of a plan, condition by condition.

    With ``until``, a condition gets its replications in batches and is evaluated only between batches: the runs depend
    on neither the number of workers nor their speed.
    """

    def __init__(
        self, plan: Plan, known: Mapping[str, Done], chosen: Iterable[Task] | None = None, share: Share = ALL
    ) -> None:
        """``chosen`` runs are made instead of all."""
        self.plan = plan
        self.share = share
        self.known = known
        self.there: Counter[str] = Counter()  # runs that already existed, by status
        self.made: Counter[str] = Counter()  # new runs, by status
        self.stopped_early = 0  # runs that were not needed
        # The conditions still to come, and the runs of started ones.
        self._conditions = iter(plan if chosen is None else ())
        self._open: dict[int, Iterator[Task | None]] = {} if chosen is None else {-1: iter(chosen)}
        self._running: Counter[int] = Counter()  # number of runs, by condition
        self._values: dict[int, list[float]] = {}  # values of the deciding metric, by condition
        self._again: deque[Task] = deque()

    @property
    def total(self) -> int:
        """The number of all runs, existing and possible."""
        return self.share.size(self.plan) - self.stopped_early

    @property
    def over(self) -> int:
        """The number of finished runs."""
        return self.there.total() + self.made.total()

    @property
    def failed(self) -> int:
        """How many of these are not ok."""
        return self.over - self.made[OK] - self.there[OK]

    @property
    def left(self) -> int:
        """The number of runs still to be made: some of the existing ones may not have come up yet."""
        return max(0, self.total - self.over - (self._asked_for - self.there.total()))

    @cached_property
    def _asked_for(self) -> int:
        """How many of the known runs the plan asks for; a folder may hold others, too."""
        if not self.known:
            return 0
        plan, replications = self.plan, range(self.plan.replications)
        runs = ((each, one) for each in plan for one in replications if self.share.has(plan, each.index, one))
        return sum(plan.key(*run) in self.known for run in runs)

    def next(self) -> Task | None:
        """The next run; None if there is none at present, or none left."""
        if self._again:
            return self._again.popleft()
        for runs in chain(list(self._open.values()), map(self._begin, self._conditions)):
            if (task := next(runs, None)) is not None:
                return task
        return None

    def again(self, task: Task) -> None:
        """Make a run again, because its worker has died."""
        task.attempt += 1
        self._again.append(task)

    def finished(self, task: Task, done: Done) -> None:
        """A run has finished."""
        self._running[task.condition] -= 1
        self._note(task.condition, done, self.made)

    def _begin(self, condition: Condition) -> Iterator[Task | None]:
        runs = self._open[condition.index] = self._runs(condition)
        return runs

    def _runs(self, condition: Condition) -> Iterator[Task | None]:
        """The missing runs of a condition; None while waiting for the end of a batch."""
        index, most, until = condition.index, self.plan.replications, self.plan.study.until
        values = self._values[index] = []
        batch = most if until is None else until.batch
        ours = [replication for replication in range(most) if self.share.has(self.plan, index, replication)]
        for start in range(0, len(ours), batch):
            for replication in ours[start : start + batch]:
                key = self.plan.key(condition, replication)
                if (done := self.known.get(key)) is not None:
                    self._note(index, done, self.there)
                else:
                    self._running[index] += 1
                    yield Task(index, replication, self.plan.seed(condition, replication), key)
            while self._running[index]:
                yield None
            if until is not None:
                is_share = until.metric in self.plan.shares
                if not half_width(values, is_share=is_share) >= until.half_width:
                    self.stopped_early += max(0, most - start - batch)
                    break
        del self._open[index], self._values[index], self._running[index]

    def _note(self, condition: int, done: Done, counts: Counter[str]) -> None:
        counts[done.status] += 1
        if done.status == OK and is_usable(done.value):
            self._values[condition].append(done.value)
