"""One run of a study: from a task to its row."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from epicycle.actors import EpicycleError, readable

from ...build import Model
from ...engine import LogFilter, Results, Simulation
from ..plan import Condition, Plan, value_of
from .backlog import FAILED, OK, Task
from .manifest import columns_of_rows
from .store import Row

_MODELS_KEPT = 4


class Runner:
    """Makes runs of a plan, and keeps the models of the last conditions."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._model = lru_cache(_MODELS_KEPT)(self._load)

    @classmethod
    def of_manifest(cls, manifest: Mapping[str, Any]) -> Runner:
        """That of a results folder."""
        return cls(Plan.of_manifest(manifest))

    def prepare(self, task: Task) -> None:
        """Load the model of the task's condition, unless it is there."""
        self._model(task.condition)

    def why_not(self, task: Task) -> str | None:
        """Why the model of the task's condition cannot be loaded; None if it can."""
        model = self._model(task.condition)
        return model if isinstance(model, str) else None

    def make(self, task: Task) -> Row:
        """The row of a run; whatever it raises is told there."""
        model = self._model(task.condition)
        row = empty_row(self.plan, task)
        started = time.perf_counter()
        try:
            if isinstance(model, str):
                raise EpicycleError(model)
            results = Simulation(model, seed=task.seed).run()
            row |= {metric.name: value_of(metric, results) for metric in self.plan.metrics}
            row |= {"status": OK, "events": results.events, "digest": results.digest}
        except Exception as error:
            told = str(error) if isinstance(error, EpicycleError) else f"{type(error).__name__}: {error}"
            row |= dict.fromkeys((metric.name for metric in self.plan.metrics), None)
            row |= {"status": FAILED, "error": readable(told)}
        row["wall_time"] = time.perf_counter() - started
        return row

    def _load(self, index: int) -> Model | str:
        try:
            model = self.plan.load(self.plan.condition(index))
        except EpicycleError as error:
            return str(error)
        # Recording costs time and memory, and most studies need none of it.
        wanted = {signal for metric in self.plan.metrics for signal in metric.signals}
        model.recorded = [name for name in model.recorded if name in wanted]
        return model


def empty_row(plan: Plan, task: Task) -> Row:
    """What a row holds before the run."""
    condition = plan.condition(task.condition)
    known = {"run": task.key, "condition": condition.key, "replication": task.replication, "seed": task.seed}
    columns = columns_of_rows(plan.study.factors, (metric.name for metric in plan.metrics))
    return dict.fromkeys(columns) | known | condition.values


def again(plan: Plan, condition: Condition, seed: int) -> tuple[Model, Results, Simulation, EpicycleError | None]:
    """A run once more, alone, with all that the model records and the whole event log; and what it raised."""
    model = plan.load(condition)
    simulation = Simulation(model, seed=seed, keep_log=LogFilter({}))
    try:
        return model, simulation.run(), simulation, None
    except EpicycleError as error:
        return model, simulation.results("failed"), simulation, error
