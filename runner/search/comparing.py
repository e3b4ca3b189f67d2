"""Comparing variants of a model in pairs of runs: every variant runs with each seed, so that all have the same luck."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from epicycle.actors import EpicycleError, counted, did_you_mean

from ..execution.engine import ActorError, LoopError, Simulation
from ..model.build.model import Model
from ..study.inference import Estimate, average, holm, is_usable, paired_difference, with_interval
from ..study.run.processes import Worker
from ..support.tables import Table, pandas_module
from .answer import Answer
from .cache import EvaluationCache
from .evaluator import Evaluator, Recipe, jobs_for

if TYPE_CHECKING:
    import pandas

    from ..show.view.pages import Page


@dataclass(frozen=True)
class Difference:
    """How much greater a metric is in a variant than in the first one, over the seeds for which both have it.

    ``p`` is the p-value of Student's paired test for a difference of zero, corrected by Holm's method for all
    differences of the comparison; ``metric`` is the metric's mean in the variant itself.
    """

    name: str
    variant: str
    metric: Estimate
    difference: Estimate | None  # None for the first variant
    p: float


@dataclass(frozen=True)
class ComparedRun:
    """What is kept of a run: its metrics, what its aspects counted, the records in its event log, and their digest."""

    metrics: dict[str, Any]
    aspects: dict[str, dict[str, float | None]]
    events: int
    digest: str


_VALUE = (int, float, bool, str, type(None))
_SHAPE = [{str: _VALUE}, {str: {str: _VALUE}}, int, str]  # of a run in a folder


@dataclass(repr=False)
class Comparison(Answer):
    """Runs of variants of a model with the same seeds; the others are compared with the first variant.

    ``runs`` has what is kept of each run by variant and seed, ``failures`` the errors of failed runs.
    """

    NAME: ClassVar[str] = "comparison"

    model: str
    seeds: range
    units: dict[str, str]  # of the metrics
    runs: dict[str, dict[int, ComparedRun]]
    failures: dict[tuple[str, int], EpicycleError] = field(default_factory=dict)
    models: Mapping[str, Model] = field(default_factory=dict)
    until: float | None = None  # s

    @property
    def metrics(self) -> list[str]:
        """The metrics that have a number in some run of every variant."""
        return [name for name in self.units if all(self.values(each, name) for each in self.runs)]

    def values(self, variant: str, metric: str) -> dict[int, float]:
        """The values of a metric by seed, where it has one of which statistics can be made."""
        if metric not in self.units:
            raise EpicycleError(f"{self.model} has no metric {metric!r}{did_you_mean(metric, list(self.units))}")
        found = {seed: results.metrics.get(metric) for seed, results in self.runs[variant].items()}
        return {seed: float(each) for seed, each in found.items() if isinstance(each, (int, float)) and is_usable(each)}

    def _average(self, variant: str, metric: str) -> Estimate:
        found = [results.metrics.get(metric) for results in self.runs[variant].values()]
        is_share = all(each is None or isinstance(each, bool) for each in found)
        return average(list(self.values(variant, metric).values()), is_share=is_share)

    def differences(self) -> list[Difference]:
        """Each metric in each variant, and its difference from the first variant."""
        first, *others = self.runs
        tested = {
            (metric, variant): paired_difference(self.values(first, metric), self.values(variant, metric))
            for metric in self.metrics
            for variant in others
        }
        corrected = dict(zip(tested, holm([each.p for each in tested.values()]), strict=True))
        found = []
        for metric in self.metrics:
            for variant in self.runs:
                test, own = tested.get((metric, variant)), self._average(variant, metric)
                p = corrected.get((metric, variant), math.nan)
                found.append(Difference(metric, variant, own, None if test is None else test.estimate, p))
        return found

    def rows(self) -> list[dict[str, Any]]:
        """The metrics of every run: a row for each seed and variant."""
        return [
            {"variant": variant, "seed": seed, **{name: results.metrics.get(name) for name in self.units}}
            for seed in self.seeds
            for variant, runs in self.runs.items()
            if (results := runs.get(seed)) is not None
        ]

    def to_pandas(self) -> pandas.DataFrame:
        """The same as a data frame."""
        frame: pandas.DataFrame = pandas_module().DataFrame(self.rows())
        return frame

    def page(self, progress: bool = True) -> Page:
        """The first runs of the first two variants side by side."""
        from ..show.view.pages import recorded
        from ..study.run_spec import OpenedRun

        names = [*self.models][:2]
        runs = [OpenedRun(self.models[name], self.seeds[0], self.until) for name in names]
        return recorded(runs, names=names, progress=progress)

    def save(self, folder: str | Path | None = None, *, page: bool = False) -> list[Path]:
        """Write the facts as JSON, the metrics of every run as CSV and, if asked for, ``page`` as HTML.

        To a file (.csv), the metrics alone.
        """
        if folder is not None and Path(folder).suffix == ".csv":
            return [self._save_rows(Path(folder))]
        [facts] = super().save(folder)
        written = [facts, self._save_rows(facts.with_suffix(".csv"))]
        return [*written, *([self.page().save(facts.with_suffix(".html"))] if page else [])]

    def _save_rows(self, path: Path) -> Path:
        rows = self.rows()
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]) if rows else ["variant", "seed"])
            writer.writeheader()
            writer.writerows(rows)
        return path

    def _facts(self) -> dict[str, Any]:
        told = {"model": self.model, "seeds": list(self.seeds), "units": self.units}
        return {**told, "differences": [asdict(each) for each in self.differences()]}

    def _sentences(self) -> Iterable[str]:
        failed = f"; {counted(len(self.failures), 'run')} failed" if self.failures else ""
        seeds = f"seed {self.seeds[0]}" if len(self.seeds) == 1 else f"seeds {self.seeds[0]} to {self.seeds[-1]}"
        yield f"{self.model}: {', '.join(self.runs)}; {seeds}{failed}"

    def _tables(self) -> list[Table]:
        rows = []
        for each in self.differences():
            unit = "" if self.units[each.name] == "1" else self.units[each.name]
            told = (each.name, each.variant, with_interval(each.metric), unit)
            gap = "" if each.difference is None else with_interval(each.difference)
            rows.append((*told, gap, "" if math.isnan(each.p) else f"{each.p:.2g}", str(each.metric.count)))
        first = next(iter(self.runs))
        failed = [(variant, str(seed), str(error)) for (variant, seed), error in self.failures.items()]
        return [
            Table(("metric", "variant", "mean", "unit", f"difference from {first}", "p (Holm)", "runs"), rows),
            Table(("failed", "seed", "error"), failed),
        ]


def compare(
    models: Mapping[str, Model],
    *,
    replications: int,
    seed: int | None,
    until: float | None,
    folder: Path | None = None,
    jobs: int | None = None,
    tell: Callable[[int, int, str], None] = lambda done, runs, what: None,
) -> Comparison:
    """Run models with the same seeds, and compare their metrics.

    In a ``folder``, each run that did not fail is noted: a comparison that was interrupted continues there, and one
    with more runs or variants makes those that are missing.  ``tell`` is called before each run.  Raises
    ``EpicycleError``.
    """
    if len(models) < 2:
        raise EpicycleError("a comparison needs at least two variants")
    first, recipes = next(iter(models.values())), {name: Recipe.of(model) for name, model in models.items()}
    jobs = min(jobs_for(model, jobs, f"variant {name}") for name, model in models.items())
    seeds = range(start := first.output.seed if seed is None else seed, start + replications)
    units = {metric.name: metric.unit for each in models.values() for metric in each.output.metrics}
    found = Comparison(first.name, seeds, units, {name: {} for name in models}, models=models, until=until)
    caches = {
        name: EvaluationCache(model, {"variant": name, "until": until}, _SHAPE, folder)
        for name, model in models.items()
    }
    asked = [(name, number) for number in seeds for name in models]
    with Evaluator(_Worker(models, until), jobs, _Worker, recipes, until) as evaluator:
        evaluator.expect((each, each) for each in asked if str(each[1]) not in caches[each[0]])
        for done, (name, number) in enumerate(asked):
            tell(done, len(asked), f"seed {number}, {name}")
            try:
                kept = caches[name].outcome(str(number), partial(_made, evaluator, (name, number)))
            except (ActorError, LoopError) as error:
                found.failures[name, number] = error
            else:
                found.runs[name][number] = ComparedRun(*kept)
    return found


def _made(evaluator: Evaluator, run: tuple[str, int]) -> list[Any]:
    """What is kept of a run; raises what it raises."""
    made: list[Any] | EpicycleError = evaluator.make(run, run)
    if isinstance(made, EpicycleError):
        raise made
    return made


class _Worker(Worker):
    """Makes runs of the variants, which it loads where they are recipes."""

    def __init__(self, models: Mapping[str, Model | Recipe | None], until: float | None) -> None:
        self._models = dict(models)
        self._until = until

    def make(self, asked: tuple[str, int]) -> list[Any] | EpicycleError:
        """What is kept of a run of a variant with a seed, or the error that it ends with."""
        name, seed = asked
        if isinstance(found := self._models[name], Recipe):
            self._models[name] = found = found.model()
            found.output.recorded = []
        assert found is not None
        try:
            results = Simulation(found, seed=seed).run(until=self._until)
        except (ActorError, LoopError) as error:
            return error
        return [results.metrics, results.aspects, results.events, results.digest]
