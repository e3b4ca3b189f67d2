"""Making the runs of a backlog, in processes of this machine or on a cluster."""

from __future__ import annotations

import queue
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from .backlog import Backlog, Task
from .keeper import ATTEMPTS, Keeper
from .processes import DEAD, Outcome, Processes
from .runner import Runner
from .store import Store

LOCAL, DASK = "local", "dask"  # executors
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
            # Here, and not with this package, which several threads of a Dask worker may import at once: whoever asks
            # for `parcel` or `host` first must not find that the package waits for it.
            from .cluster import Cluster

            Cluster(keeper, jobs, scheduler).run(tell)
        else:
            _make_here(keeper, jobs, tell)


def check_executor(name: str) -> None:
    """Raise ``EpicycleError`` if what an executor needs is not installed."""
    if name == DASK:
        from .cluster import distributed_module

        distributed_module()


def _make(processes: Processes, task: Task, timeout: float | None) -> Outcome:
    """Make a run, and at once again if its process dies: who kills processes when rows come would hit it each time."""
    while (outcome := processes.make(task, timeout))[0] == DEAD and task.attempt < ATTEMPTS:
        task.attempt += 1
    return outcome


def _make_here(keeper: Keeper, jobs: int, tell: Callable[[], None]) -> None:
    """Make the runs in processes of this machine."""
    backlog, tasks = keeper.backlog, dict[Future[Outcome], Task]()
    over: queue.SimpleQueue[Future[Outcome]] = queue.SimpleQueue()
    with ThreadPoolExecutor(jobs) as threads, Processes(Runner.of_manifest, keeper.store.manifest) as processes:
        while True:
            # More than there are processes: who has made one begins with the next before this one is written.
            while len(tasks) < 2 * jobs and (task := backlog.next()) is not None:
                future = threads.submit(_make, processes, task, keeper.timeout)
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
