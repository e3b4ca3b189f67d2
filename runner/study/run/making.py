"""Making the runs of a backlog, in processes of this machine or on a cluster, and keeping what comes of each."""

from __future__ import annotations

import queue
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from .backlog import KILLED, TIMEOUT, Backlog, Done, Task
from .processes import DEAD, DONE, Outcome, Processes
from .runner import Runner, empty_row
from .store import Row, Store, Writer, writing

LOCAL, DASK = "local", "dask"  # executors
ATTEMPTS = 3  # of a run whose process dies; memory runs out for what others take, too
_LOOK = 0.5  # s between two looks at the clock


def make_runs(
    store: Store,
    backlog: Backlog,
    tell: Callable[[], None],
    *,
    jobs: int,
    timeout: float | None = None,
    executor: str = LOCAL,
    scheduler: str | None = None,
) -> None:
    """Make all runs of a backlog, in ``jobs`` processes at a time or on the workers of a Dask scheduler.

    A run that raises gets a row with the status ``failed``, one that takes longer than ``timeout`` seconds a row
    ``timeout``.  One whose process dies is tried again, and after three times gets a row ``killed``.  ``tell`` is
    called now and then.  Raises ``WriteError`` and ``WorkerError``.
    """
    with Keeper(store, backlog, timeout) as keeper:
        if executor == DASK:
            from .cluster import Cluster

            Cluster(keeper, jobs, scheduler).run(tell)
        else:
            _make_here(keeper, jobs, tell)


def check_executor(name: str) -> None:
    """Raise ``EpicycleError`` if what an executor needs is not installed."""
    if name == DASK:
        from .cluster import distributed_module

        distributed_module()


class Keeper:
    """Keeps the rows of runs that are over, whoever has made them, and sees to it that the others are made again."""

    def __init__(self, store: Store, backlog: Backlog, timeout: float | None) -> None:
        self.store = store
        self.plan = backlog.plan
        self.backlog = backlog
        self.timeout = timeout
        self._writer = Writer(store)

    def __enter__(self) -> Keeper:
        return self

    def __exit__(self, kind: object, error: BaseException | None, at: object) -> None:
        """What was interrupted leaves its journal, which the next to open the folder makes a part of."""
        try:
            if error is None:
                with writing(self.store.folder):
                    self._writer.flush()
        finally:
            self._writer.close()

    def settle(self, task: Task, outcome: Outcome) -> None:
        """See what has become of a run."""
        what, told = outcome
        if what == DONE:
            self.keep(task, told)
        elif what == DEAD:
            self.again(task, f"its process ended {ATTEMPTS} times (exit code {told})")
        else:
            self._give_up(task, TIMEOUT, f"it took longer than {self.timeout:g} s")

    def again(self, task: Task, error: str) -> None:
        """A run whose process has died is made again, or given up with this ``error``."""
        if task.attempt < ATTEMPTS:
            self.backlog.again(task)
        else:
            self._give_up(task, KILLED, error)

    def keep(self, task: Task, row: Row) -> None:
        """Write a row."""
        with writing(self.store.folder):
            self._writer.add(row)
        decides = self.plan.decides
        self.backlog.finished(task, Done(row["status"], row[decides] if decides else None))

    def _give_up(self, task: Task, status: str, error: str) -> None:
        self.keep(task, empty_row(self.plan, task) | {"status": status, "error": error})


def _make_here(keeper: Keeper, jobs: int, tell: Callable[[], None]) -> None:
    """Make the runs in processes of this machine."""
    backlog, tasks = keeper.backlog, dict[Future[Outcome], Task]()
    over: queue.SimpleQueue[Future[Outcome]] = queue.SimpleQueue()
    with ThreadPoolExecutor(jobs) as threads, Processes(Runner.of_manifest, keeper.store.manifest) as processes:
        while True:
            # More than there are processes: who has made one begins with the next before this one is written.
            while len(tasks) < 2 * jobs and (task := backlog.next()) is not None:
                future = threads.submit(processes.make, task, keeper.timeout)
                tasks[future] = task
                future.add_done_callback(over.put)
            if not tasks:
                return
            try:
                future = over.get(timeout=_LOOK)
                keeper.settle(tasks.pop(future), future.result())
            except queue.Empty:
                pass
            tell()
