"""An evaluator of points: in this process, or in several, which work ahead in the order that a search expects.

A search asks for one outcome after another, and all it finds follows from these, so that its answer is the same however
many processes there are.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from epicycle.actors import EpicycleError

from ..model.build.model import Model
from ..study.run.processes import Processes, Worker, check_same
from ..study.run_spec import RunSpec, opened, spec_of
from ..study.session import available_cores
from ..support.apart import DONE, Outcome, WorkerError
from .monitored import with_monitors

PATIENCE = 1.0  # s before processes are started, which takes as long; the work here goes on meanwhile
GRACE = 0.02  # s that a process rests after what a search waits for, which may expect something else then


class Evaluator:
    """Makes things with a worker, which each of ``jobs`` processes makes for itself by ``begin(*arguments)``."""

    def __init__(
        self, worker: Worker, jobs: int, begin: Callable[..., Worker], *arguments: object, patience: float = PATIENCE
    ) -> None:
        self._worker, self._jobs, self._patience = worker, jobs, patience
        self._processes = Processes(begin, *arguments)
        self._threads: ThreadPoolExecutor | None = None  # which wait for the processes, once these are started
        self._timer = threading.Timer(patience, self._start)
        self._timer.daemon = True
        self._guard = threading.RLock()
        self._is_heard = threading.Event()  # whether the search has taken what it waited for
        self._awaited: Future[Outcome] | None = None
        self._expected: Iterator[tuple[Hashable, object]] = iter(())
        self._begun: dict[Hashable, Future[Outcome]] = {}
        self._made: set[Hashable] = set()  # of what is expected, here

    @classmethod
    def of_model(cls, kind: Callable[..., Worker], model: Model, *others: object, jobs: int | None) -> Evaluator:
        """One whose workers are ``kind(model, *others)``, with the same model in each process."""
        return cls(kind(model, *others), jobs_for(model, jobs), _worker_of, Recipe.of(model), kind, *others)

    def __enter__(self) -> Evaluator:
        if self._jobs > 1 and self._patience > 0.0:
            self._timer.start()
        elif self._jobs > 1:
            self._start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()
        self._is_heard.set()
        with self._guard:
            self._processes.end()  # first: no thread waits for one that nobody ends
            threads, self._threads = self._threads, None
        if threads is not None:
            threads.shutdown(cancel_futures=True)

    def expect(self, requests: Iterable[tuple[Hashable, object]]) -> None:
        """Say what will probably be asked for next, in this order, in place of what was said before."""
        with self._guard:
            self._expected = iter(requests)
            self._made.clear()
            for key in [key for key, future in self._begun.items() if future.cancel()]:  # what no process has begun
                del self._begun[key]
            self._is_heard.set()
            self._go_ahead()

    def make(self, key: Hashable, request: object) -> Any:
        """What the worker makes of a request; raises what it raises, and ``WorkerError``."""
        with self._guard:
            self._made.add(key)
            if (threads := self._threads) is not None:
                self._begin_with(threads, key, request)
                self._is_heard.set()
                self._go_ahead()
                self._awaited = self._begun[key]
                self._is_heard.clear()
        if threads is None:
            self._worker.prepare(request)
            return self._worker.make(request)
        what, made = self._begun[key].result()
        del self._begun[key]
        if what != DONE:
            raise WorkerError("a process that was making runs died; is there enough memory?")
        return made

    def _start(self) -> None:
        """Start the processes, even in the middle of what is made here."""
        with self._guard:
            if not self._timer.finished.is_set():  # as it is once nobody waits for anything
                self._processes.start(self._jobs)
                self._threads = ThreadPoolExecutor(self._jobs)
                self._go_ahead()

    def _begin_with(self, threads: ThreadPoolExecutor, key: Hashable, request: object) -> None:
        if key not in self._begun:
            self._begun[key] = future = threads.submit(self._processes.make, request)
            future.add_done_callback(self._is_over)

    def _is_over(self, future: Future[Outcome]) -> None:
        """Let the process that has made something make what is expected next."""
        if future is self._awaited:  # it may change what is expected
            self._is_heard.wait(GRACE)
        if not future.cancelled():
            with self._guard:
                self._go_ahead()

    def _go_ahead(self) -> None:
        while (threads := self._threads) is not None:
            waiting = [each for each in self._begun.values() if not each.done()]
            if len(waiting) >= self._jobs or (following := next(self._expected, None)) is None:
                return
            if following[0] not in self._made:
                self._begin_with(threads, *following)


def _worker_of(recipe: Recipe, kind: Callable[..., Worker], *others: object) -> Worker:
    """The same in another process."""
    return kind(recipe.model(), *others)


@dataclass(frozen=True)
class Recipe:
    """How another process makes the same model: as it was named, with the monitors that it has now.

    ``files`` are those that were read for it, by their SHA-256.
    """

    spec: RunSpec
    monitors: Mapping[str, str]
    files: Mapping[str, str]

    @classmethod
    def of(cls, model: Model) -> Recipe | None:
        """That of a model; None for one that only this program knows."""
        if (spec := spec_of(model, None, None)) is None:
            return None
        return cls(spec, {each.name: each.requirement.property for each in model.output.monitors}, files_of(model))

    def model(self) -> Model:
        """The model; raises ``WorkerError`` if its files have changed."""
        model = opened(self.spec).model
        check_same(self.files, files_of(model))
        return with_monitors(model, self.monitors)


def files_of(model: Model) -> Mapping[str, str]:
    """The files that were read for a model, by their SHA-256."""
    return {} if model.origin is None else model.origin.noted.files


def jobs_for(model: Model, jobs: int | None, what: str = "") -> int:
    """How many processes make runs of a model: one per core, or this one alone for what no other process can load."""
    is_named = Recipe.of(model) is not None
    if jobs is None:
        return available_cores() if is_named else 1
    if jobs > 1 and not is_named:
        raise EpicycleError(
            f"{what or model.name} cannot be made in other processes, which do not know the models and classes of this "
            "program\n   help: leave out jobs"
        )
    return jobs
