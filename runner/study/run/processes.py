"""Processes that make runs for this one; some may hang, run out of memory or be killed.

This process survives runs that hang or kill their process, and can end them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from ...support.apart import DONE, LATE, Outcome, Process, UnwantedError, WorkerError, always

MAX_STILLBORN = 5  # processes in a row that end before they start work


class Worker(Protocol):
    """Makes things in a process, one after another."""

    def prepare(self, request: Any) -> None:
        """Load what is needed; has the same time limit as ``make``."""
        return  # there may be nothing to load

    def make(self, request: Any) -> Any:
        """The result, as plain data."""


def check_same(before: Mapping[str, str], now: Mapping[str, str]) -> None:
    """Raise ``WorkerError`` if a file is not as it was read before, so that a run would be that of another model."""
    if changed := sorted(name for name, digest in now.items() if before.get(name, digest) != digest):
        raise WorkerError(
            f"{', '.join(changed)} changed while runs were made, and the next ones would be of another model\n"
            "   help: finished runs are kept; undo the change and repeat the command to continue them, or repeat it "
            "with the change to make all runs again"
        )


class Processes:
    """Several processes at once, each of which makes one thing after another.

    In each, ``begin(*arguments)`` makes the worker, in at most ``patience`` seconds.
    """

    def __init__(self, begin: Callable[..., Worker], *arguments: object, patience: float | None = None) -> None:
        self._begin = begin
        self._arguments = arguments
        self._patience = patience
        self._guard = threading.Lock()
        self._idle: list[Process] = []
        self._all: set[Process] = set()
        self._is_over = False

    def start(self, number: int) -> None:
        """Start so many, which load while nothing is asked of them."""
        for process in [self._taken() for _ in range(number)]:
            self._give_back(process, is_good=True)

    def make(
        self,
        request: object,
        timeout: float | None = None,
        is_wanted: Callable[[], bool] = always,
        told: Callable[[Any], object] = always,
    ) -> Outcome:
        """The outcome of a request in one of the processes, in at most ``timeout`` seconds from its start.

        What the worker says before it is ``told``.

        Raises ``WorkerError``, what the worker has raised, and ``UnwantedError`` if it is no longer wanted.
        """
        code = None
        for _ in range(MAX_STILLBORN):
            process = self._taken()
            is_good = False
            try:
                what, answer = process.begin(self._patience, is_wanted)
                for method in ("prepare", "make") if what == DONE else ():
                    what, answer = process.call(method, request, limit=timeout, is_wanted=is_wanted, told=told)
                    if what != DONE:
                        break
                is_good = what == DONE
            finally:
                self._give_back(process, is_good)
            if process.is_ready or what == LATE:
                return what, answer
            code = answer
        raise WorkerError(f"{MAX_STILLBORN} processes in a row ended before they could start (exit code {code})")

    def hasten(self) -> None:
        """Let those come to their end that look whether something waits."""
        with self._guard:
            for each in self._all:
                each.hasten()

    def end(self) -> None:
        """End all, even in the middle of their work."""
        with self._guard:
            self._is_over = True
            there = [*self._all]
        for each in there:
            each.end()

    def __enter__(self) -> Processes:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def _taken(self) -> Process:
        with self._guard:
            if self._is_over:
                raise UnwantedError
            while self._idle:
                if not (found := self._idle.pop()).is_over:
                    return found
                self._all.discard(found)
            found = Process(self._begin, *self._arguments)
            self._all.add(found)
        return found

    def _give_back(self, process: Process, is_good: bool) -> None:
        with self._guard:
            if is_good and not self._is_over:
                self._idle.append(process)
                return
        process.end()
        self._all.discard(process)
