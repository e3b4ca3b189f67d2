"""Runs of a study: from a task to its row; and repeated for their signals, which a study need not keep."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import Any, Protocol

from epicycle.actors import EpicycleError, readable

from ...execution.engine import Results, Simulation
from ...model.build.model import Model
from ...model.catalogue.code import code_of
from ...model.text.files import digest_of, noting
from ...support.apart import DONE
from ..plan.columns import value_of
from ..plan.plan import Condition, Plan
from .backlog import FAILED, OK, Task
from .manifest import columns_of_rows
from .processes import Processes, check_same
from .store import Row

_MODELS_KEPT = 4


class Runner:
    """Makes runs of a plan, and keeps the models of the latest conditions."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._loaded = lru_cache(_MODELS_KEPT)(self._load)

    @classmethod
    def of_manifest(cls, manifest: Mapping[str, Any], files: Mapping[str, str] = MappingProxyType({})) -> Runner:
        """That of a results folder, for which these ``files`` were read."""
        return cls(replace(Plan.of_manifest(manifest).allowed(), files=files))

    def prepare(self, task: Task) -> None:
        """Load the model of the task's condition, unless it is loaded; raises ``WorkerError`` if it has changed."""
        self._loaded(task.condition)

    def why_not(self, task: Task) -> str | None:
        """Why the model of the task's condition cannot be loaded; None if it can."""
        _, model = self._loaded(task.condition)
        return model if isinstance(model, str) else None

    def make(self, task: Task) -> Row:
        """The row of a run, which also reports what it raises."""
        condition, model = self._loaded(task.condition)
        row = empty_row(self.plan, condition, task)
        started = time.perf_counter()
        try:
            if isinstance(model, str):
                raise EpicycleError(model)
            results = Simulation(model, seed=task.seed).run()
            row |= {metric.name: value_of(metric, results) for metric in self.plan.metrics}
            row |= {"status": OK, "events": results.events, "digest": results.digest}
        except Exception as error:
            told = str(error) if isinstance(error, EpicycleError) else f"{type(error).__name__}: {error}"
            row = empty_row(self.plan, condition, task) | {"status": FAILED, "error": readable(told)}
        row["wall_time"] = time.perf_counter() - started
        return row

    def _load(self, index: int) -> tuple[Condition, Model | str]:
        condition, files = self.plan.condition(index), self.plan.files
        with noting() as noted:
            try:
                model = self.plan.load(condition)
            except EpicycleError as error:
                check_same(files, {name: digest_of(name) for name in files})  # it may have failed before it read them
                return condition, str(error)
        check_same(files, {**noted.files, **self._code})
        # Recording costs time and memory, and most studies need none of it.
        wanted = {signal for metric in self.plan.metrics for signal in metric.signals}
        model.output.recorded = [name for name in model.output.recorded if name in wanted]
        self._watch_only_what_counts(model)
        return condition, model

    @cached_property
    def _code(self) -> dict[str, str]:
        """The code of types as it is when the first model is loaded, which is the one that runs."""
        return code_of(self.plan.study.types) if self.plan.files else {}

    def _watch_only_what_counts(self, model: Model) -> None:
        """Leave out monitors of which nobody asks for the verdict, and which end no run."""
        output = model.output
        asked = {name for metric in self.plan.metrics for name in metric.formula.names}
        asked |= {name for metric in output.metrics if metric.formula for name in metric.formula.names}
        kept = {
            each.name
            for each in output.monitors
            if each.requirement.stop or not asked.isdisjoint(metric.name for metric in each.metrics)
        }
        output.monitors = [each for each in output.monitors if each.name in kept]
        output.metrics = [each for each in output.metrics if not each.monitor or each.monitor in kept]


def empty_row(plan: Plan, condition: Condition, task: Task) -> Row:
    """The row before the run."""
    known = {"run": task.key, "condition": condition.key, "replication": task.replication, "seed": task.seed}
    columns = columns_of_rows(plan.study.factors, (metric.name for metric in plan.metrics))
    return dict.fromkeys(columns) | known | condition.values


# -- repeated runs ----------------------------------------------------------------------------------------------------


def error_of(plan: Plan, condition: Condition, seed: int) -> EpicycleError | None:
    """What makes a run fail, which is repeated for that."""
    try:
        return error_of_metrics(plan, Simulation(plan.load(condition), seed=seed).run())
    except EpicycleError as error:
        return error


def error_of_metrics(plan: Plan, results: Results) -> EpicycleError | None:
    """What is wrong with a metric of a study in a run."""
    try:
        for metric in plan.metrics:
            value_of(metric, results)
    except EpicycleError as error:
        return error
    return None


class ReplayError(EpicycleError):
    """A run that cannot be repeated, or gives a different result."""


class Reader(Protocol):
    """What to extract from a repeated run; must be picklable."""

    def ports(self, model: Model) -> tuple[str, ...]:
        """The output ports to be recorded, as patterns."""

    def extract(self, model: Model, results: Results) -> Any:
        """The extract, as plain data."""


@dataclass(frozen=True)
class Replay:
    """A run to repeat, and its readers by name."""

    condition: int
    replication: int
    seed: int
    digest: str
    readers: tuple[tuple[str, Reader], ...]


def repeat(
    plan: Plan, replays: Sequence[Replay], jobs: int, tell: Callable[[int], None] = lambda done: None
) -> Iterator[tuple[Replay, dict[str, Any]]]:
    """Repeat runs in ``jobs`` processes, in any order; yields each with what its readers extracted.

    What a reader raises replaces its extract, as an ``EpicycleError``.  Raises ``ReplayError``.
    """
    # Runs of a condition follow each other, so that a process loads few models.
    ordered = sorted(replays, key=lambda each: (each.condition, each.replication))
    with ThreadPoolExecutor(jobs) as threads, Processes(_Repeater, plan.manifest()) as processes:
        futures = {threads.submit(processes.make, each): each for each in ordered}
        for done, future in enumerate(as_completed(futures), start=1):
            what, found = future.result()
            if what != DONE:
                raise ReplayError("a process that was repeating runs died; is there enough memory?")
            yield futures[future], found
            tell(done)


class _Repeater:
    """Repeats runs of a plan."""

    def __init__(self, manifest: Mapping[str, Any]) -> None:
        self._plan = Plan.of_manifest(manifest).allowed()
        self._model = lru_cache(1)(lambda index: self._plan.load(self._plan.condition(index)))

    def prepare(self, replay: Replay) -> None:
        """Load the model."""
        self._model(replay.condition)

    def make(self, replay: Replay) -> dict[str, Any]:
        """The extracts of the readers from the run."""
        model = self._model(replay.condition)
        model.output.recorded = []
        for _, reader in replay.readers:
            model.record(*reader.ports(model))
        results = Simulation(model, seed=replay.seed).run()
        if results.digest != replay.digest:
            raise ReplayError(
                f"run {replay.replication} of condition {replay.condition} (seed {replay.seed}) gave a different "
                f"result: its digest is {results.digest[:16]}..., but was {replay.digest[:16]}...; something has "
                "changed since"
            )
        found: dict[str, Any] = {}
        for name, reader in replay.readers:
            try:
                found[name] = reader.extract(model, results)
            except EpicycleError as error:
                found[name] = EpicycleError(str(error))
        return found
