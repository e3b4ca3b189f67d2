"""Making the runs of a backlog in processes on this machine, and keeping the results of runs made anywhere."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from ...support.apart import DEAD, DONE, Outcome
from .backlog import KILLED, TIMEOUT, Backlog, Done, Task
from .processes import Processes
from .runner import Runner, empty_row
from .store import Row, Store, Writer, writing

_LOOK = 0.5  # s between two checks of the clock
ATTEMPTS = 3  # for a run whose process dies; others may have used up the memory


@dataclass
class Recorder:
    """Keeps the rows of finished runs, whoever made them, and has the others made again."""

    store: Store
    backlog: Backlog
    timeout: float | None
    _writer: Writer
    tell: Callable[[Row], None] = lambda row: None  # of each row that is kept

    def settle(self, task: Task, outcome: Outcome) -> None:
        """Handle the outcome of a run."""
        what, told = outcome
        if what == DONE:
            self._keep(task, told)
        elif what == DEAD:
            self.again(task, f"its process ended {ATTEMPTS} times (exit code {told})")
        else:
            self._give_up(task, TIMEOUT, f"it took longer than {self.timeout:g} s")

    def again(self, task: Task, error: str) -> None:
        """Make a run whose process died again, or give it up with this ``error``."""
        if task.attempt < ATTEMPTS:
            self.backlog.again(task)
        else:
            self._give_up(task, KILLED, error)

    def _give_up(self, task: Task, status: str, error: str) -> None:
        plan = self.backlog.plan
        self._keep(task, empty_row(plan, plan.condition(task.condition), task) | {"status": status, "error": error})

    def _keep(self, task: Task, row: Row) -> None:
        with writing(self.store.folder):
            self._writer.add(row)
        decides = self.backlog.plan.decides
        self.backlog.finished(task, Done(row["status"], row[decides] if decides else None))
        self.tell(row)


@contextmanager
def recording(store: Store, backlog: Backlog, timeout: float | None) -> Iterator[Recorder]:
    """An interrupted session leaves its journal, which the next one to open the folder turns into a part."""
    writer = Writer(store, backlog.share)
    try:
        yield Recorder(store, backlog, timeout, writer)
        with writing(store.folder):
            writer.flush()
    finally:
        writer.close()


def make_here(recorder: Recorder, jobs: int, tell: Callable[[], None]) -> None:
    """Make the runs in processes on this machine."""
    with Processes(Runner.of_manifest, recorder.store.manifest, recorder.backlog.plan.files) as processes:
        make_in(processes, recorder, jobs, tell)


def make_in(processes: Processes, recorder: Recorder, jobs: int, tell: Callable[[], None]) -> None:
    """Make the runs in these processes."""
    backlog, tasks = recorder.backlog, dict[Future[Outcome], Task]()
    over: queue.SimpleQueue[Future[Outcome]] = queue.SimpleQueue()
    with ThreadPoolExecutor(jobs) as threads, ExitStack() as stack:
        # If anything goes wrong, processes end: threads that wait for their runs could wait for ever.
        stack.push(lambda kind, *_: None if kind is None else processes.end())
        while True:
            # More than there are processes: each starts its next run before the last one is written.
            while len(tasks) < 2 * jobs and (task := backlog.next()) is not None:
                future = threads.submit(_make, processes, task, recorder.timeout)
                tasks[future] = task
                future.add_done_callback(over.put)
            if not tasks:
                return
            try:
                future = over.get(timeout=_LOOK)
                recorder.settle(tasks.pop(future), future.result())
            except queue.Empty:
                pass
            tell()


def _make(processes: Processes, task: Task, timeout: float | None) -> Outcome:
    """Make a run, and again at once if its process dies."""
    while (outcome := processes.make(task, timeout))[0] == DEAD and task.attempt < ATTEMPTS:
        task.attempt += 1
    return outcome
