"""An object in a process of its own: for what may crash, hang or run out of memory, or is to have a core for itself."""

from __future__ import annotations

import gc
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, BinaryIO

from epicycle.actors import EpicycleError

from .collection import keep_for_good, seldom_collecting

_PROGRAM = f"from {__name__} import serve; serve()"
_BEGIN_LIMIT = 30.0  # s until a process has started
_LOOK = 0.5  # s between two checks whether an answer is still wanted
_GRACE = 1.0  # s for an object to close itself
_REST = 0.1  # s without a request
_SETTLED = 2  # calls after which everything is loaded
# One thread a process: N processes of N threads each would only be in each other's way.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS")

# What comes of a call: its result, it took too long, or the process ended with that exit code.
DONE, LATE, DEAD = "done", "late", "dead"
_RAISED, _SAID = "raised", "said"
Outcome = tuple[str, Any]


class RaisedError(EpicycleError):
    """An exception in another process that is not Epicycle's own; ``text`` is its message."""

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(f"{kind}: {text}")
        self.text = " ".join(text.split()) or kind


class WorkerError(EpicycleError):
    """Processes that cannot work."""


class UnwantedError(EpicycleError):
    """Nobody waits for the result any longer."""


def always(*_: object) -> bool:
    return True


class Process:
    """A process that makes an object by ``make(*given)``, and then calls its methods, one after another.

    It reads from standard input what it is to do, and answers on its original standard output.  It ends when its input
    does: at once, or in the middle of a call, unless the object can be closed before.
    """

    def __init__(self, make: Callable[..., Any], *given: object) -> None:
        environment = {**os.environ, **dict.fromkeys(_THREADS, "1"), "PYTHONPATH": os.pathsep.join(sys.path)}
        # No multiprocessing: the processes of Dask are daemons, which it allows no children. With -P they import what
        # this process would, and no module of the same name that happens to be in the working directory.
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            process_group=0,  # an interrupt from the terminal is not meant for it; it ends when its input does
        )
        self._told: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()
        self._give((make, given))
        self.has_started = self.is_ready = False

    @property
    def is_over(self) -> bool:
        return self._process.poll() is not None

    def begin(self, limit: float | None = None, is_wanted: Callable[[], bool] = always) -> Outcome:
        """Wait until the object is there; raises as ``call``."""
        outcome: Outcome = DONE, None
        if not self.has_started and (outcome := self._answer(limit, is_wanted))[0] == DONE:
            self.has_started = True
        if self.has_started and not self.is_ready and (outcome := self._answer(limit, is_wanted))[0] == DONE:
            self.is_ready = True
        return outcome

    def call(
        self,
        method: str,
        *given: object,
        limit: float | None = None,
        is_wanted: Callable[[], bool] = always,
        told: Callable[[Any], object] = always,
    ) -> Outcome:
        """The outcome of a call, in at most ``limit`` s; what the object says before it is ``told``.

        Raises what the object raises, ``RaisedError`` where that is of another package, and ``UnwantedError``.
        """
        self._give((method, given))
        return self._answer(limit, is_wanted, told)

    def hasten(self) -> None:
        """Let a call come to its end that looks whether something waits."""
        self._give(())

    def _answer(
        self, limit: float | None, is_wanted: Callable[[], bool], told: Callable[[Any], object] = always
    ) -> Outcome:
        since = time.monotonic()
        while True:
            try:
                what, found = self._told.get(timeout=_LOOK if limit is None else min(_LOOK, limit))
            except queue.Empty:
                what, found = "", None
            if what == _SAID:
                told(found)
            if what in ("", _SAID):
                if not is_wanted():
                    raise UnwantedError
                if limit is not None and time.monotonic() - since > limit:
                    return LATE, None
                continue
            if what == _RAISED:
                raise found if isinstance(found, Exception) else RaisedError(*found)
            if what == DEAD:
                self._told.put((what, found))  # as of every later call
            return what, found

    def end(self) -> int:
        """Kill it if it still runs; its exit code."""
        self._process.kill()
        return self._process.wait()

    def _give(self, what: object) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(pickle.dumps(what))  # in one piece, as threads may do it at once
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
            self._told.put((_RAISED, WorkerError(told)))


class Apart:
    """The methods of what ``make`` makes of some arguments, in another process, each within a limit of time (s).

    What they raise is raised as ``EpicycleError``, with its text after ``name``, and so is the end of the process.
    """

    def __init__(self, name: str, limit: float, make: Callable[..., Any], *given: object) -> None:
        self._name, self._limit = name, limit
        self._process = Process(make, *given)
        self._asked("loading", _BEGIN_LIMIT, self._process.begin)

    def __getattr__(self, method: str) -> Callable[..., Any]:
        if method.startswith("_"):
            raise AttributeError(method)
        return lambda *given: self._asked(method, self._limit, self._process.call, method, *given)

    def _asked(self, doing: str, limit: float, ask: Callable[..., Outcome], *given: object) -> Any:
        try:
            what, told = ask(*given, limit=limit)
        except EpicycleError as error:
            text = error.text if isinstance(error, RaisedError) else str(error)
            raise EpicycleError(text if text.startswith(self._name) else f"{self._name}: {text}") from None
        if what == DONE:
            return told
        code = self._process.end()
        if not self._process.has_started:
            raise EpicycleError(f"{self._name}: its process did not start; it ended with exit code {code}")
        if what == LATE:
            raise EpicycleError(f"{self._name}: {doing} takes longer than {limit:g} s; its process was ended")
        ended = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        raise EpicycleError(f"{self._name}: its process ended in {doing}, with {ended}")

    def close(self) -> None:
        """Let the object close itself, and end the process."""
        with suppress(EpicycleError):
            self._process.call("close", limit=_GRACE)
        self._process.end()


# -- inside such a process --------------------------------------------------------------------------------------------

_given: queue.SimpleQueue[Any] = queue.SimpleQueue()  # what it is to do
_replies: list[BinaryIO] = []  # where it answers, once it serves


def say(message: object) -> None:
    """Report something to the one who waits for the outcome of a call, before it."""
    _reply(pickle.dumps((_SAID, message)))


def bound(memory: int, file: int | None = None) -> None:
    """Let this process take only so much memory, and write no larger files (bytes), where the system sees to that.

    What is too large then fails here, not on the whole machine.
    """
    with suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
        if file is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (file, file))


def is_hastened() -> bool:
    """Whether something waits, such as another call."""
    return not _given.empty()


def serve() -> None:
    """Serve the process that started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the waiting process decides what an interrupt means
    requests = os.fdopen(os.dup(0), "rb")
    _replies.append(os.fdopen(os.dup(1), "wb"))
    nothing = os.open(os.devnull, os.O_RDWR)
    for each in (0, 1):  # an object that prints would corrupt the answers
        os.dup2(nothing, each)
    threading.Thread(target=_listen, args=(requests,), daemon=True).start()

    it: list[Any] = []  # the object, once it is there
    try:
        with seldom_collecting():
            _reply(_answer_to(it, None))
            for number, request in enumerate(filter(None, iter(_next, None))):
                _reply(_answer_to(it, request))
                if number == _SETTLED:  # what has been loaded until now need not be searched for garbage again
                    keep_for_good()
        if it and hasattr(it[0], "close"):
            it[0].close()
    except BrokenPipeError:
        os._exit(1)


def _next() -> Any:
    """The next request; what the ones before have left is cleared away when nobody waits."""
    with suppress(queue.Empty):
        return _given.get(timeout=_REST)
    gc.collect()
    return _given.get()


def _reply(what: bytes) -> None:
    for each in _replies:
        each.write(what)
        each.flush()


def _answer_to(it: list[Any], request: Any) -> bytes:
    """The answer to a request: nothing, a function that makes the object, or a method of this."""
    try:
        if isinstance(request, Exception):
            raise request
        made = None
        if request is not None:
            what, given = request
            if it:
                made = getattr(it[0], what)(*given)
            else:
                it.append(what(*given))
        return pickle.dumps((DONE, made))
    except EpicycleError as error:
        return pickle.dumps((_RAISED, error))
    except Exception as error:
        return pickle.dumps((_RAISED, (type(error).__name__, str(error))))


def _listen(requests: BinaryIO) -> None:
    """Read the requests; if the process that sends them ends in any way, end even in the middle of a call."""
    try:
        while True:
            _given.put(pickle.load(requests))
    except (EOFError, OSError):
        _given.put(None)
        time.sleep(_GRACE)
        os._exit(1)
    except Exception as error:  # what it is made of is not there
        _given.put(error)
