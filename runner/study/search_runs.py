"""Runs of a search, which chooses batch by batch what it runs, in the results folder of a study."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from .judge.study_results import StudyResults
from .plan.plan import Plan
from .run.backlog import Backlog, Task
from .run.locking import lock
from .run.making import Recorder, make_in, recording
from .run.manifest import manifest_text
from .run.processes import Processes
from .run.runner import Runner
from .run.store import BEST_FIRST, Row, prepare, write
from .session import manifest_of


@dataclass(kw_only=True)
class _SearchTask(Task):
    """A run of a plan that the process which makes it may not know yet."""

    batch: int
    plan: Plan


class _Worker:
    """Makes the runs of one plan after the other."""

    def __init__(self) -> None:
        self._batch = 0
        self._runner: Runner | None = None

    def prepare(self, task: _SearchTask) -> None:
        """Load the model of the run's condition, unless it is there."""
        self._of(task).prepare(task)

    def make(self, task: _SearchTask) -> Row:
        """The row of a run."""
        return self._of(task).make(task)

    def _of(self, task: _SearchTask) -> Runner:
        if self._runner is None or task.batch != self._batch:
            self._runner, self._batch = Runner(task.plan), task.batch
        return self._runner


class SearchRuns:
    """A results folder that a search writes to; ``open_search_runs`` opens one."""

    def __init__(self, recorder: Recorder, processes: Processes, jobs: int, known: dict[str, Row]) -> None:
        self._recorder = recorder
        self._processes = processes
        self._jobs = jobs
        self._known = known
        self._batches = 0
        recorder.tell = self._keep

    def made(self, plan: Plan, numbers: Sequence[tuple[int, int]], tell: Callable[[], None]) -> list[Row]:
        """The rows of these runs, each a condition of the plan and a replication; those that are not there are made."""
        self._batches += 1
        sent, tasks = replace(plan, texts={}, files=()), []
        keys = [plan.key(plan.condition(index), replication) for index, replication in numbers]
        for (index, replication), key in zip(numbers, keys, strict=True):
            if key not in self._known:
                seed = plan.seed(plan.condition(index), replication)
                tasks.append(_SearchTask(index, replication, seed, key, batch=self._batches, plan=sent))
        self._recorder.backlog = Backlog(plan, {}, tasks)
        make_in(self._processes, self._recorder, self._jobs, tell)
        return [self._known[key] for key in keys]

    def describe(self, plan: Plan) -> None:
        """Say in the folder's manifest which runs it has: those of a plan."""
        store = self._recorder.store
        write(store.folder / "manifest.json", manifest_text({**store.manifest, **plan.manifest()}))

    def _keep(self, row: Row) -> None:
        self._known[row["run"]] = row


@contextmanager
def open_search_runs(plan: Plan, folder: Path, jobs: int, timeout: float | None) -> Iterator[SearchRuns]:
    """Open a folder for a search whose first conditions are those of a plan; raises ``StoreError``.

    At the end, the table of the runs is written that were described last.
    """
    with lock(folder):
        store = prepare(folder, manifest_of(plan))
        rows: list[Row] = [row for batch in store.rows() for row in batch.to_pylist()]
        rows.sort(key=lambda row: BEST_FIRST.index(row["status"]), reverse=True)  # the best of a run last
        known = {row["run"]: row for row in rows}
        with recording(store, Backlog(plan, {}, ()), timeout) as recorder, Processes(_Worker) as processes:
            yield SearchRuns(recorder, processes, jobs, known)
        StudyResults(folder).write_table()
