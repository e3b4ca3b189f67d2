"""Processes that make runs for this one; some may hang, run out of memory or be killed.

This process survives runs that hang or kill their process, and can end them.  Each process reads from standard input
what it needs to make a worker, and then one request after another; it answers on its original standard output, and ends
when its input does.
"""

from __future__ import annotations

import os
import pickle
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from typing import Any, BinaryIO, Protocol

from epicycle.actors import EpicycleError

from ...support.collection import keep_for_good, seldom_collecting

MAX_STILLBORN = 5  # processes in a row that end before they start work
_LOOK = 0.5  # s between two checks whether a run is still wanted
# One thread a process: N processes of N threads each would only be in each other's way.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS")

# The answers of a process, with an exception for ``RAISED`` and the result for ``DONE``.
READY, BEGUN, DONE, RAISED = "ready", "begun", "done", "raised"
# Other outcomes of a request: it took too long, or the process ended with that exit code.
LATE, DEAD = "late", "dead"
Outcome = tuple[str, Any]


class WorkerError(EpicycleError):
    """Workers that cannot work."""


class UnwantedError(EpicycleError):
    """Nobody waits for the result any longer."""


class Worker(Protocol):
    """Makes things in a process, one after another."""

    def prepare(self, request: Any) -> None:
        """Load what is needed; has the same time limit as ``make``."""
        return  # there may be nothing to load

    def make(self, request: Any) -> Any:
        """The result, as plain data."""


class _Process:
    def __init__(self, begin: Callable[..., Worker], arguments: tuple[object, ...], folder: str) -> None:
        self._folder = folder
        environment = {**os.environ, **dict.fromkeys(_THREADS, "1"), "PYTHONPATH": os.pathsep.join(sys.path)}
        # No multiprocessing: the processes of Dask are daemons, which it allows no children. With -P they import what
        # this process would, and no module of the same name that happens to be in the working directory.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", f"from {__name__} import serve; serve()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            process_group=0,  # an interrupt from the terminal is not meant for it; it ends when its input does
        )
        self._told: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()
        self._first: object = begin, arguments
        self.is_ready = False

    def make(self, request: object, timeout: float | None, is_wanted: Callable[[], bool]) -> Outcome:
        """The outcome of a request; raises what the worker has raised, and ``UnwantedError``."""
        if self._first is not None:
            self._give(self._first)
            self._first = None
        self._give(request)
        since = time.monotonic()
        while True:
            try:
                what, told = self._told.get(timeout=_LOOK if timeout is None else min(_LOOK, timeout))
            except queue.Empty:
                if not is_wanted():
                    raise UnwantedError from None
                if timeout is not None and self.is_ready and time.monotonic() - since > timeout:
                    return LATE, None
                continue
            since = time.monotonic()
            if what == READY:
                self.is_ready = True
            elif what == RAISED:
                raise told
            elif what in (DONE, DEAD):
                return what, told

    def end(self) -> None:
        """Kill it if it still runs, and leave nothing behind."""
        self._process.kill()
        self._process.wait()
        if self._folder:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _give(self, what: object) -> None:
        assert self._process.stdin is not None
        try:
            pickle.dump(what, self._process.stdin)
            self._process.stdin.flush()
        except OSError:  # it has died, which the listener reports
            return

    def _listen(self) -> None:
        assert self._process.stdout is not None
        try:
            while True:
                self._told.put(pickle.load(self._process.stdout))
        except (EOFError, OSError, pickle.UnpicklingError):
            self._told.put((DEAD, self._process.wait()))
        except Exception as error:  # of a class that only that process knows; somebody waits for an answer
            told = f"the answer of a process cannot be read: {type(error).__name__}: {error}"
            self._told.put((RAISED, WorkerError(told)))


class Processes:
    """Several processes at once, each of which makes one thing after another.

    In each, ``begin(*arguments)`` makes the worker.  ``place``, if given, is where each gets a temporary folder, which
    becomes the last argument.
    """

    def __init__(self, begin: Callable[..., Worker], *arguments: object, place: str = "") -> None:
        self._begin = begin
        self._arguments = arguments
        self._place = place
        self._guard = threading.Lock()
        self._idle: list[_Process] = []
        self._busy: set[_Process] = set()
        self._is_over = False

    def make(
        self, request: object, timeout: float | None = None, is_wanted: Callable[[], bool] = lambda: True
    ) -> Outcome:
        """The outcome of a request in one of the processes, in at most ``timeout`` seconds from its start.

        Raises ``WorkerError``, what the worker has raised, and ``UnwantedError`` if it is no longer wanted.
        """
        code = None
        for _ in range(MAX_STILLBORN):
            process = self._taken()
            is_good = False
            try:
                what, told = process.make(request, timeout, is_wanted)
                is_good = what == DONE
            finally:
                self._give_back(process, is_good)
            if process.is_ready:
                return what, told
            code = told
        raise WorkerError(f"{MAX_STILLBORN} processes in a row ended before they could start (exit code {code})")

    def end(self) -> None:
        """End all, even in the middle of their work."""
        with self._guard:
            self._is_over = True
            there = [*self._idle, *self._busy]
        for each in there:
            each.end()

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def _taken(self) -> _Process:
        with self._guard:
            if self._is_over:
                raise UnwantedError
            if self._idle:
                found = self._idle.pop()
            else:
                folder = tempfile.mkdtemp(prefix="epicycle-", dir=self._place) if self._place else ""
                found = _Process(self._begin, (*self._arguments, folder) if folder else self._arguments, folder)
            self._busy.add(found)
        return found

    def _give_back(self, process: _Process, is_good: bool) -> None:
        with self._guard:
            self._busy.remove(process)
            if is_good and not self._is_over:
                self._idle.append(process)
                return
        process.end()


# -- inside such a process --------------------------------------------------------------------------------------------


def serve() -> None:
    """Serve the process that started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the waiting process decides what an interrupt means
    requests, replies = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for each in (0, 1):  # an actor that prints would corrupt the answers
        os.dup2(nothing, each)
    given: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, given), daemon=True).start()

    def tell(what: str, told: object = None) -> None:
        replies.write(pickle.dumps((what, told)))
        replies.flush()

    def taken() -> Any:
        if isinstance(found := given.get(), Exception):
            raise found
        return found

    try:
        with seldom_collecting():
            begin, arguments = taken()
            worker: Worker = begin(*arguments)
            tell(READY)
            is_settled = False
            while True:
                request = taken()
                worker.prepare(request)
                tell(BEGUN)
                tell(DONE, worker.make(request))
                if not is_settled:  # what the first run has loaded need not be scanned in later ones
                    keep_for_good()
                    is_settled = True
    except BrokenPipeError:
        os._exit(1)
    except EpicycleError as error:
        tell(RAISED, error)
    except Exception as error:
        tell(RAISED, EpicycleError(f"{type(error).__name__}: {error}"))


def _listen(requests: BinaryIO, given: queue.SimpleQueue[Any]) -> None:
    """Read the requests; if the process that sends them ends in any way, end even in the middle of a run."""
    try:
        while True:
            given.put(pickle.load(requests))
    except (EOFError, OSError):
        os._exit(1)
    except Exception as error:  # what it is made of is not there
        given.put(error)
