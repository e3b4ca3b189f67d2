"""Making runs: which come next, in which processes, and the folder that keeps what came of each."""

from .backlog import OK, RETRIED, Backlog, Done, Task
from .making import DASK, LOCAL, check_executor, make_runs
from .manifest import FORMAT, StoreError, read_manifest
from .processes import WorkerError
from .pulse import duration, progress
from .replays import Replay, ReplayError, repeat
from .runner import again
from .store import BEST_FIRST, Store, WriteError, is_running, lock, prepare, replace_file

__all__ = [
    "BEST_FIRST",
    "DASK",
    "FORMAT",
    "LOCAL",
    "OK",
    "RETRIED",
    "Backlog",
    "Done",
    "Replay",
    "ReplayError",
    "Store",
    "StoreError",
    "Task",
    "WorkerError",
    "WriteError",
    "again",
    "check_executor",
    "duration",
    "is_running",
    "lock",
    "make_runs",
    "prepare",
    "progress",
    "read_manifest",
    "repeat",
    "replace_file",
]
