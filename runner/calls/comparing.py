"""Comparing variants of a model in pairs of runs: every variant runs with each seed, so that all have the same luck."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, counted

from ..bars import SOON, bar
from ..build import Model
from ..engine import ActorError, LoopError, Simulation
from ..results import Results
from ..study import Estimate, holm, mean, paired_difference, with_interval
from ..tables import Table, Tabled, pandas_module
from ..text import did_you_mean
from .running import Changes, loaded, seconds

if TYPE_CHECKING:
    import pandas

Variant = Model | Changes


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
    model: Model | str | Path,
    variants: Mapping[str, Variant] | Sequence[str],
    *,
    replications: int = 10,
    seed: int | None = None,
    until: float | str | None = None,
    progress: bool = True,
) -> Comparison:
    """Run variants of a model with the same seeds, and compare their metrics in pairs of runs.

    A variant is a set of changes as ``load`` takes them, or another model; a list names disturbances, where ``none`` is
    the unchanged model.  Seeds count up from ``seed`` (default: the model's).  Runs that fail are reported and left
    out.

    >>> epicycle.compare("collision_avoidance", ["none", "wifi_burst"], replications=20)
    >>> epicycle.compare("mm1", {"slow": {}, "fast": {"set": {"mean_service": 0.8}}})
    """
    if not isinstance(variants, Mapping):
        variants = {name: {} if name == "none" else {"disturb": name} for name in variants}
    if len(variants) < 2:
        raise EpicycleError("a comparison needs at least two variants")
    if replications < 1:
        raise EpicycleError(f"replications: {replications} is not a whole number of at least 1")
    models = {name: each if isinstance(each, Model) else loaded(model, each) for name, each in variants.items()}
    first, stop = next(iter(models.values())), seconds("until", until)
    seeds = range(start := first.seed if seed is None else seed, start + replications)
    units = {metric.name: metric.unit for each in models.values() for metric in each.metrics}
    found = Comparison(first.name, seeds, units, {name: {} for name in models})
    with bar(first.name, after=SOON) if progress else nullcontext() as show:
        for done, (number, name) in enumerate((number, name) for number in seeds for name in models):
            if show is not None:
                show(done, len(seeds) * len(models), f"seed {number}, {name}")
            try:
                found.runs[name][number] = Simulation(models[name], seed=number).run(until=stop)
            except (ActorError, LoopError) as error:
                found.failures[name, number] = error
    return found
