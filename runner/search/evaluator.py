"""An evaluator of points: in this process, or in several, which work ahead in the order that a search expects.

A search asks for one outcome after another, and all it finds follows from these, so that its answer is the same however
many processes there are.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from epicycle.actors import EpicycleError

from ..model.build.model import Model
from ..study.run.processes import Processes, Worker
from ..study.run_spec import RunSpec, opened, spec_of
from ..study.session import available_cores
from ..support.apart import DONE, Outcome, WorkerError
from .monitored import with_monitors

PATIENCE = 1.0  # s of work before processes are started, which takes as long


class Evaluator:
    """Makes things with a worker, which each of ``jobs`` processes makes for itself by ``begin(*arguments)``."""

    def __init__(
        self, worker: Worker, jobs: int, begin: Callable[..., Worker], *arguments: object, patience: float = PATIENCE
    ) -> None:
        self._worker, self._jobs, self._patience = worker, jobs, patience
        self._begin, self._arguments = begin, arguments
        self._open = ExitStack()
        self._processes: Processes | None = None
        self._threads: ThreadPoolExecutor | None = None
        self._spent = 0.0
        self._expected: Iterator[tuple[Hashable, object]] = iter(())
        self._begun: dict[Hashable, Future[Outcome]] = {}
        self._made: set[Hashable] = set()  # of what is expected, here

    def __enter__(self) -> Evaluator:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def expect(self, requests: Iterable[tuple[Hashable, object]]) -> None:
        """Say what will probably be asked for next, in this order, in place of what was said before."""
        self._expected = iter(requests)
        self._made.clear()
        for key in [key for key, future in self._begun.items() if future.cancel()]:  # what no process has begun
            del self._begun[key]
        self._go_ahead()

    def make(self, key: Hashable, request: object) -> Any:
        """What the worker makes of a request; raises what it raises, and ``WorkerError``."""
        if self._threads is None and (self._jobs == 1 or self._spent < self._patience):
            since = time.monotonic()
            self._worker.prepare(request)
            made = self._worker.make(request)
            self._spent += time.monotonic() - since
            self._made.add(key)
            return made
        if self._threads is None:
            # Threads are left before processes are ended: none of them waits for one that nobody ends.
            self._processes = Processes(self._begin, *self._arguments)
            self._threads = ThreadPoolExecutor(self._jobs)
            self._open.callback(self._threads.shutdown, cancel_futures=True)
            self._open.callback(self._processes.end)
        self._begin_with(key, request)
        self._go_ahead()
        what, made = self._begun[key].result()
        del self._begun[key]
        if what != DONE:
            raise WorkerError("a process that was making runs died; is there enough memory?")
        return made

    def _begin_with(self, key: Hashable, request: object) -> None:
        if key not in self._begun:
            assert self._threads is not None
            assert self._processes is not None
            self._begun[key] = self._threads.submit(self._processes.make, request)

    def _go_ahead(self) -> None:
        if self._threads is None:
            return
        # More than there are processes: each goes on at once, before anybody asks for the next.
        while len([each for each in self._begun.values() if not each.done()]) < 2 * self._jobs:
            if (following := next(self._expected, None)) is None:
                return
            if following[0] not in self._made:
                self._begin_with(*following)


@dataclass(frozen=True)
class Recipe:
    """How another process makes the same model: as it was named, with the monitors that it has now."""

    spec: RunSpec
    monitors: Mapping[str, str]

    @classmethod
    def of(cls, model: Model) -> Recipe | None:
        """That of a model; None for one that only this program knows."""
        if (spec := spec_of(model, None, None)) is None:
            return None
        return cls(spec, {each.name: each.requirement.property for each in model.output.monitors})

    def model(self) -> Model:
        """The model."""
        return with_monitors(opened(self.spec).model, self.monitors)


def jobs_for(model: Model, jobs: int | None, what: str = "") -> int:
    """How many processes make runs of a model: one per core, or this one alone for what no other process can load."""
    is_named = Recipe.of(model) is not None
    if jobs is None:
        return available_cores() if is_named else 1
    if jobs < 1:
        raise EpicycleError(f"jobs: {jobs} is not a whole number of at least 1")
    if jobs > 1 and not is_named:
        raise EpicycleError(
            f"{what or model.name} cannot be made in other processes, which do not know the models and classes of this "
            "program\n   help: leave out jobs"
        )
    return jobs
