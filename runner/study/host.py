"""What a Dask worker does for a study: it hands runs to processes of its own, and ends those that hang."""

from __future__ import annotations

import json
import os
import pickle
import queue
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from typing import Any

from . import child
from .executor import MAX_STILLBORN, THREADS, WorkerError, stillborn
from .schedule import Task

_LOOK = 0.5  # s between two looks whether a run is still wanted
_SOON = 0.05  # s
_IDLE = 20.0  # s after which a process without work is ended: its study is over

# What becomes of a run: its row, and why its model could not be loaded; or that it took too long, or the exit code of
# its process.  Plain values, which a scheduler that knows nothing of Epicycle passes on.
ROW, LATE, DEAD = "row", "late", "dead"
Outcome = tuple[str, Any]

_idle: dict[str, list[_Child]] = {}  # by study
_guard = threading.Lock()


class _Unwanted(Exception):  # noqa: N818  it is no error
    """The study that wanted a run has ended."""


class _Child:
    """A process that makes one run after the other."""

    def __init__(self, parcel: bytes, folder: str) -> None:
        self._folder = tempfile.mkdtemp(prefix="epicycle-", dir=folder)
        environment = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": os.pathsep.join(sys.path)}
        # No multiprocessing: the processes of Dask are daemons, which may have no children by it.
        self._process = subprocess.Popen(
            [sys.executable, "-m", child.__name__, self._folder],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            process_group=0,  # an interrupt from the terminal is not meant for it; it ends with its input
        )
        self._told: queue.SimpleQueue[Any] = queue.SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()
        self._timer: threading.Timer | None = None
        self.is_ready = False
        self._give(parcel)

    def run(self, task: Task, timeout: float | None, is_wanted: Callable[[], bool]) -> Outcome:
        """Make a run; raises ``WorkerError`` if this machine cannot, and ``_Unwanted``."""
        self._give(task)
        since = time.monotonic()
        while True:
            try:
                what, told = self._told.get(timeout=_LOOK if timeout is None else min(_LOOK, timeout))
            except queue.Empty:
                if not is_wanted():
                    raise _Unwanted from None
                if timeout is not None and self.is_ready and time.monotonic() - since > timeout:
                    return LATE, None
                continue
            since = time.monotonic()
            if what == child.READY:
                self.is_ready = True
            elif what == child.UNFIT:
                raise WorkerError(told)
            elif what == child.OVER:
                return ROW, told
            elif what == DEAD:
                return DEAD, told

    def rest(self, study: str) -> None:
        """Wait for more work, for a while."""
        self._timer = threading.Timer(_IDLE, self._leave, (study,))
        self._timer.daemon = True
        with _guard:
            _idle.setdefault(study, []).append(self)
            self._timer.start()

    def rise(self) -> None:
        """Rest no longer."""
        if self._timer is not None:
            self._timer.cancel()

    def end(self) -> None:
        """Kill the process, if it is still there, and leave nothing behind."""
        self._process.kill()
        self._process.wait()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _leave(self, study: str) -> None:
        with _guard:
            if self not in _idle.get(study, ()):
                return  # it has just been taken
            _idle[study].remove(self)
            if not _idle[study]:
                del _idle[study]
        self.end()

    def _give(self, what: object) -> None:
        assert self._process.stdin is not None
        try:
            pickle.dump(what, self._process.stdin)
            self._process.stdin.flush()
        except OSError:  # it has died, which the listener tells
            return

    def _listen(self) -> None:
        assert self._process.stdout is not None
        try:
            while True:
                self._told.put(pickle.load(self._process.stdout))
        except (EOFError, OSError, pickle.UnpicklingError):
            self._told.put((DEAD, self._process.wait()))


def parcel_key(study: str, address: str) -> str:
    """The name under which the worker at an address has the parcel of a study."""
    return f"{study}-parcel-{address}"


def make(batch: str) -> list[Outcome]:
    """Make runs, on a Dask worker; raises ``WorkerError`` if it cannot."""
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def is_wanted() -> bool:
        state = worker.state.tasks.get(key)
        return state is not None and state.state not in ("cancelled", "released")

    given = json.loads(batch)
    study = given["study"]
    outcomes: list[Outcome] = []
    busy: _Child | None = None
    try:
        for task in (Task(*each) for each in given["tasks"]):
            for _ in range(MAX_STILLBORN):
                busy = busy or _taken(study) or _Child(_parcel(worker, study, is_wanted), worker.local_directory)
                outcome = busy.run(task, given["timeout"], is_wanted)
                if busy.is_ready:
                    break
                busy.end()
                busy = None
            else:
                raise WorkerError(stillborn(outcome[1]))
            outcomes.append(outcome)
            if outcome[0] != ROW:
                busy.end()
                busy = None
        if busy is not None:
            busy.rest(study)
            busy = None
    except _Unwanted:
        outcomes.clear()  # nobody will look at them
    except WorkerError as error:
        raise WorkerError(f"the Dask worker {worker.address} {error}") from None
    finally:
        if busy is not None:
            busy.end()
    return outcomes


def _parcel(worker: Any, study: str, is_wanted: Callable[[], bool]) -> bytes:
    """The parcel, which comes soon after a worker that has just come; raises ``_Unwanted``."""
    while (found := worker.data.get(parcel_key(study, worker.address))) is None:
        if not is_wanted():
            raise _Unwanted
        time.sleep(_SOON)
    parcel: bytes = found
    return parcel


def _taken(study: str) -> _Child | None:
    """A process that is waiting for work."""
    with _guard:
        waiting = _idle.get(study)
        if not waiting:
            return None
        found = waiting.pop()
    found.rise()
    return found
