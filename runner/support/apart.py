"""An object in a process of its own, for what may crash or never come to an end."""

from __future__ import annotations

import os
import secrets
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, Listener
from queue import SimpleQueue
from threading import Thread
from typing import Any

from epicycle.actors import EpicycleError

_KEY = "EPICYCLE_APART"
_BEGIN_LIMIT = 30.0  # s until a process has started
_LOOK = 0.005  # s between two looks whether it has
_PROGRAM = "from epicycle.runner.support.apart import serve; serve()"


class Apart:
    """The methods of what ``make`` makes of some arguments, in another process, each within a limit of time (s).

    What they raise is raised as ``EpicycleError``, with its text after ``name``, and so is the end of the process.
    """

    def __init__(self, name: str, limit: float, make: Callable[..., Any], *given: object) -> None:
        self._name, self._limit = name, limit
        key = secrets.token_bytes(16)
        with Listener(authkey=key) as listener:
            words = [sys.executable, "-P", "-c", _PROGRAM, str(listener.address)]
            environment = {**os.environ, _KEY: key.hex(), "PYTHONPATH": os.pathsep.join(sys.path)}
            self._process = subprocess.Popen(words, env=environment)
            self._connection = self._accepted(listener)
        self._connection.send((make, given))
        self._answer("loading", _BEGIN_LIMIT)

    def _accepted(self, listener: Listener) -> Connection:
        """The connection that the process makes, unless it ends, or waits, instead: ``accept`` would wait for ever."""
        came: SimpleQueue[Connection] = SimpleQueue()

        def accept() -> None:
            with suppress(AuthenticationError, EOFError, OSError):
                came.put(listener.accept())

        Thread(target=accept, daemon=True).start()
        latest = time.monotonic() + _BEGIN_LIMIT
        while came.empty() and self._process.poll() is None and time.monotonic() < latest:
            time.sleep(_LOOK)
        if came.empty():
            self._process.kill()
            raise EpicycleError(
                f"{self._name}: its process did not start; it ended with exit code {self._process.wait()}"
            )
        return came.get()

    def __getattr__(self, method: str) -> Callable[..., Any]:
        if method.startswith("_"):
            raise AttributeError(method)

        def call(*given: object) -> Any:
            self._connection.send((method, given))
            return self._answer(method, self._limit)

        return call

    def _answer(self, doing: str, limit: float) -> Any:
        try:
            if not self._connection.poll(limit):
                self._end()
                raise EpicycleError(f"{self._name}: {doing} takes longer than {limit:g} s; its process was ended")
            is_right, answer = self._connection.recv()
        except (EOFError, OSError):
            code = self._process.wait()
            ended = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            raise EpicycleError(f"{self._name}: its process ended in {doing}, with {ended}") from None
        if not is_right:
            raise EpicycleError(answer if answer.startswith(self._name) else f"{self._name}: {answer}")
        return answer

    def close(self) -> None:
        """Let the object close itself, and end the process."""
        with suppress(Exception):
            self._connection.send(("close", ()))
            self._connection.poll(1.0)
        self._end()

    def _end(self) -> None:
        self._process.kill()
        self._process.wait()
        self._connection.close()


def serve() -> None:
    """What the process does: the methods of the object, as it is asked for them."""
    with Client(sys.argv[-1], authkey=bytes.fromhex(os.environ.pop(_KEY))) as connection:
        try:
            make, given = connection.recv()
            made = make(*given)
            connection.send((True, None))
        except Exception as error:
            connection.send((False, _told(error)))
            return
        method = ""
        while method != "close":
            try:
                method, given = connection.recv()
            except EOFError:
                made.close()
                return
            try:
                connection.send((True, getattr(made, method)(*given)))
            except Exception as error:
                connection.send((False, _told(error)))


def _told(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
