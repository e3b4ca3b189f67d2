"""Keeping what comes of each run: its row, or another attempt."""

from __future__ import annotations

from .backlog import KILLED, TIMEOUT, Backlog, Done, Task
from .processes import DEAD, DONE, Outcome
from .runner import empty_row
from .store import Row, Store, Writer, writing

ATTEMPTS = 3  # of a run whose process dies; memory runs out for what others take, too


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
