"""Comparing variants of a model in pairs of runs: every variant runs with each seed, so that all have the same luck."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, counted, did_you_mean

from ..bars import SOON, bar
from ..build.model import Model
from ..engine import ActorError, LoopError, Simulation
from ..results import EventLog, Results
from ..shown import finite
from ..study.inference import Estimate, holm, mean, paired_difference, with_interval
from ..tables import Table, Tabled, pandas_module
from .evaluator import Evaluator, Recipe, jobs_for

if TYPE_CHECKING:
    import pandas


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


@dataclass(repr=False)
class Comparison(Tabled):
    """Runs of variants of a model with the same seeds; the others are compared with the first variant.

    ``runs`` has the results of each variant by seed, ``failures`` the errors of failed runs.
    """

    model: str
    seeds: range
    units: dict[str, str]  # of the metrics
    runs: dict[str, dict[int, Results]]
    failures: dict[tuple[str, int], EpicycleError] = field(default_factory=dict)

    @property
    def metrics(self) -> list[str]:
        """The metrics that have a number in some run of every variant."""
        return [name for name in self.units if all(self.values(each, name) for each in self.runs)]

    def values(self, variant: str, metric: str) -> dict[int, float]:
        """The values of a metric by seed, where it has a number."""
        if metric not in self.units:
            raise EpicycleError(f"{self.model} has no metric {metric!r}{did_you_mean(metric, list(self.units))}")
        found = {seed: results.metrics.get(metric) for seed, results in self.runs[variant].items()}
        return {seed: float(each) for seed, each in found.items() if isinstance(each, (int, float))}

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
                test, own = tested.get((metric, variant)), mean(list(self.values(variant, metric).values()))
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

    def save(self, path: str | Path) -> list[Path]:
        """Write the metrics of every run to a file (.csv)."""
        rows = self.rows()
        with Path(path).open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]) if rows else ["variant", "seed"])
            writer.writeheader()
            writer.writerows(rows)
        return [Path(path)]

    def facts(self) -> dict[str, Any]:
        """Everything that was found, for programs."""
        told = {"model": self.model, "seeds": list(self.seeds), "units": self.units}
        found = finite({**told, "differences": [asdict(each) for each in self.differences()]})
        assert isinstance(found, dict)
        return found

    def __repr__(self) -> str:
        return f"<Comparison of {self._caption()}>"

    def _caption(self) -> str:
        failed = f"; {counted(len(self.failures), 'run')} failed" if self.failures else ""
        seeds = f"seed {self.seeds[0]}" if len(self.seeds) == 1 else f"seeds {self.seeds[0]} to {self.seeds[-1]}"
        return f"{self.model}: {', '.join(self.runs)}; {seeds}{failed}"

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
    jobs: int = 1,
    progress: bool = True,
) -> Comparison:
    """Run models with the same seeds, one after the other or in so many processes.  Raises ``EpicycleError``."""
    if len(models) < 2:
        raise EpicycleError("a comparison needs at least two variants")
    if replications < 1:
        raise EpicycleError(f"replications: {replications} is not a whole number of at least 1")
    first, recipes = next(iter(models.values())), {}
    for name, model in models.items():
        if jobs_for(model, jobs, f"variant {name}") > 1:
            recipes[name] = Recipe.of(model)
    seeds = range(start := first.output.seed if seed is None else seed, start + replications)
    units = {metric.name: metric.unit for each in models.values() for metric in each.output.metrics}
    found = Comparison(first.name, seeds, units, {name: {} for name in models})
    asked = [(name, number) for number in seeds for name in models]
    here, shown = _Worker(models, until), bar(first.name, after=SOON) if progress else nullcontext()
    with shown as show, Evaluator(here, jobs, _Away, recipes, until, patience=0.0) as evaluator:
        evaluator.expect((each, each) for each in asked)
        for done, (name, number) in enumerate(asked):
            if show is not None:
                show(done, len(asked), f"seed {number}, {name}")
            outcome = evaluator.make((name, number), (name, number))
            if isinstance(outcome, Results):
                found.runs[name][number] = outcome
            else:
                found.failures[name, number] = outcome
    return found


class _Worker:
    """Makes runs of the variants."""

    def __init__(self, models: Mapping[str, Model], until: float | None) -> None:
        self._models = models
        self._until = until

    def prepare(self, asked: tuple[str, int]) -> None:
        """There is nothing to load."""

    def make(self, asked: tuple[str, int]) -> Results | EpicycleError:
        """The outcome of a run of a variant with a seed."""
        name, seed = asked
        try:
            return Simulation(self._models[name], seed=seed).run(until=self._until)
        except (ActorError, LoopError) as error:
            return error


class _Away(_Worker):
    """The same in another process, without what may be large, or cannot leave it."""

    def __init__(self, recipes: Mapping[str, Recipe], until: float | None) -> None:
        self._recipes = recipes
        super().__init__({}, until)

    def prepare(self, asked: tuple[str, int]) -> None:
        """Load the variant, unless it is there."""
        name, _ = asked
        if name not in self._models:
            model = self._recipes[name].model()
            model.output.recorded = []
            self._models = {**self._models, name: model}

    def make(self, asked: tuple[str, int]) -> Results | EpicycleError:
        """The outcome of a run."""
        outcome = super().make(asked)
        if isinstance(outcome, EpicycleError):
            return outcome
        log = _Summary(outcome.events, outcome.digest)
        return replace(outcome, log=log, signals={}, figures={}, parameters=dict(outcome.parameters))


class _Summary(EventLog):
    """What is known of the event log of a run in another process."""

    def __init__(self, count: int, digest: str) -> None:
        super().__init__()
        self._known = count, digest

    def __reduce__(self) -> tuple[type[_Summary], tuple[int, str]]:
        return _Summary, self._known

    @property
    def count(self) -> int:
        """The number of records."""
        return self._known[0]

    @property
    def digest(self) -> str:
        """SHA-256 over all records."""
        return self._known[1]
