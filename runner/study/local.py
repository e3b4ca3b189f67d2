"""The local executor: runs in processes of this machine, some of which may hang, run out of memory or be killed."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from . import worker
from .executor import ATTEMPTS, MAX_STILLBORN, THREADS, WorkerError, died, given_up, stillborn, too_long
from .plan import Plan
from .schedule import KILLED, TIMEOUT, Done, Schedule, Task
from .store import Store, WriteError, Writer, cannot_write, writing

# Once, for all workers; pyarrow asks for pandas wherever it is installed.
_IMPORTED = [worker.__name__, "pyarrow.parquet", "numpy.random", "pandas"]
_LOOK = 0.5  # s between two looks at the clock


class _Worker:
    """One process, and what it is at."""

    def __init__(self, context: Any, folder: str) -> None:
        self.connection, theirs = context.Pipe()
        theirs_alive, self._lifeline = context.Pipe(duplex=False)
        self.process: BaseProcess = context.Process(
            target=worker.work, args=(folder, theirs, theirs_alive), daemon=True
        )
        self.process.start()
        theirs.close()
        theirs_alive.close()
        self.task: Task | None = None
        self.is_ready = False
        self.since = time.monotonic()

    def give(self, task: Task | None) -> bool:
        """Hand over a task, or None to end; false if the process is gone."""
        self.task, self.since = task, time.monotonic()
        try:
            self.connection.send(task)
        except OSError:
            return False
        return True

    def end(self) -> int | None:
        """Kill it, if it is still there; its exit code."""
        self.process.kill()
        self.process.join()
        self.connection.close()
        self._lifeline.close()
        return self.process.exitcode


class LocalExecutor:
    """Makes the runs of a schedule in ``jobs`` processes, each of them in at most ``timeout`` seconds."""

    def __init__(self, store: Store, plan: Plan, jobs: int, timeout: float | None = None) -> None:
        self._store = store
        self._plan = plan
        self._jobs = jobs
        self._timeout = timeout
        self._writer = Writer(store)
        self._context = process_context()
        self._workers: list[_Worker] = []
        self._stillborn = 0

    def run(self, schedule: Schedule, tell: Callable[[], None]) -> None:
        """Make all runs; ``tell`` is called now and then.  Raises ``WriteError`` and ``WorkerError``."""
        try:
            with one_thread():
                self._run(schedule, tell)
            with writing(self._store.folder):
                self._writer.flush()
        finally:
            for each in self._workers:
                each.end()

    def _run(self, schedule: Schedule, tell: Callable[[], None]) -> None:
        waiting: Task | None = schedule.next()
        while True:
            idle = [each for each in self._workers if each.is_ready and each.task is None]
            while waiting is not None and idle:
                self._give(idle.pop(), waiting, schedule)
                waiting = schedule.next()
            is_over = waiting is None and all(each.task is None for each in self._workers)
            if is_over:
                break
            while waiting is not None and len(self._workers) < min(self._jobs, schedule.total - schedule.over):
                self._workers.append(_Worker(self._context, str(self._store.folder)))
            self._listen(schedule)
            self._end_late_ones(schedule)
            if waiting is None:
                waiting = schedule.next()
            tell()
        self._dismiss()

    def _give(self, to: _Worker, task: Task, schedule: Schedule) -> None:
        if not to.give(task):
            self._bury(to, schedule)

    def _listen(self, schedule: Schedule) -> None:
        """Wait for news of the workers."""
        by_channel: dict[Any, _Worker] = {}
        for each in self._workers:
            by_channel[each.connection] = each
            by_channel[each.process.sentinel] = each
        for channel in wait(list(by_channel), _LOOK):
            each = by_channel[channel]
            if each not in self._workers:
                continue
            try:
                # What it said before it died comes first.
                while each.connection.poll():
                    self._hear(each, each.connection.recv(), schedule)
            except (EOFError, OSError):
                self._bury(each, schedule)
                continue
            if not isinstance(channel, Connection) and not each.process.is_alive():
                self._bury(each, schedule)

    def _hear(self, each: _Worker, news: tuple[str, Any], schedule: Schedule) -> None:
        what, told = news
        each.since = time.monotonic()
        if what == worker.READY:
            each.is_ready = True
            self._stillborn = 0
        elif what == worker.OVER:
            assert each.task is not None
            schedule.finished(each.task, told)
            each.task = None
        elif what == worker.CANNOT_WRITE:
            raise WriteError(cannot_write(self._store.folder, told))

    def _bury(self, dead: _Worker, schedule: Schedule) -> None:
        """A worker has died; its run is made again, or given up."""
        self._workers.remove(dead)
        code = dead.end()
        if not dead.is_ready:
            self._stillborn += 1
            if self._stillborn >= MAX_STILLBORN:
                raise WorkerError(stillborn(code))
        if dead.task is None:
            return
        if dead.task.attempt < ATTEMPTS:
            schedule.again(dead.task)
        else:
            self._give_up(dead.task, KILLED, died(code), schedule)

    def _end_late_ones(self, schedule: Schedule) -> None:
        if self._timeout is None:
            return
        for each in list(self._workers):
            if each.task is not None and time.monotonic() - each.since > self._timeout:
                self._workers.remove(each)
                each.end()
                self._give_up(each.task, TIMEOUT, too_long(self._timeout), schedule)

    def _give_up(self, task: Task, status: str, error: str, schedule: Schedule) -> None:
        with writing(self._store.folder):
            self._writer.add(given_up(self._plan, task, status, error))
        schedule.finished(task, Done(status))

    def _dismiss(self) -> None:
        """Let the workers make parts of what they have in their journals, and end."""
        for each in self._workers:
            each.give(None)
        for each in self._workers:
            try:
                while True:
                    what, told = each.connection.recv()
                    if what == worker.CANNOT_WRITE:
                        raise WriteError(cannot_write(self._store.folder, told))
            except (EOFError, OSError):  # it has ended
                each.process.join()


def process_context() -> Any:
    """How processes of this machine are started, so that each begins with what all need."""
    method = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
    context: Any = multiprocessing.get_context(method)
    if method == "forkserver":
        context.set_forkserver_preload(_IMPORTED)
    return context


@contextmanager
def one_thread() -> Iterator[None]:
    """Pin what the workers inherit."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
