"""What executors share: their face, and what becomes of runs whose process hangs or dies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from epicycle.actors import EpicycleError

from .one_run import empty_row
from .plan import Plan
from .schedule import Schedule, Task
from .store import Row

ATTEMPTS = 3  # of a run whose process dies; memory runs out for what others take, too
MAX_STILLBORN = 5  # processes in a row that die before they can do anything
# One thread a process: N processes of N threads each would only be in each other's way.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS")
SENT = (
    "   help: files are sent along if they are named by a path from the study or the model; packages have to be "
    "installed there"
)


class WorkerError(EpicycleError):
    """Workers that cannot work."""


class Executor(Protocol):
    """Makes the runs of a schedule, somewhere.

    A run that raises gets a row with the status ``failed``, one that takes longer than it may a row ``timeout``.  One
    whose process dies is tried again, and after three times gets a row ``killed``.
    """

    def run(self, schedule: Schedule, tell: Callable[[], None]) -> None:
        """Make all runs; ``tell`` is called now and then.  Raises ``WriteError`` and ``WorkerError``."""


def given_up(plan: Plan, task: Task, status: str, error: str) -> Row:
    """The row of a run that never came to its end."""
    return empty_row(plan, plan.condition(task.condition), task) | {"status": status, "error": error}


def too_long(timeout: float) -> str:
    """What is said of a run that takes longer than it may."""
    return f"it took longer than {timeout:g} s"


def died(code: int | None) -> str:
    """What is said of a run that has killed its process once too often."""
    return f"its process ended {ATTEMPTS} times (exit code {code})"


def stillborn(code: int | None) -> str:
    """What is said of processes that never come to a run."""
    return f"{MAX_STILLBORN} processes in a row ended before they could begin (exit code {code})"
