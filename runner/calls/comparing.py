"""Comparing variants of a model in pairs of runs: every variant runs with each seed, so that all have the same luck."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, counted, did_you_mean

from ..bars import SOON, bar
from ..build.model import Model
from ..catalogue.types import types_of_file
from ..engine import ActorError, LoopError, Simulation
from ..results import EventLog, Results
from ..study import (
    DONE,
    Estimate,
    Processes,
    WorkerError,
    holm,
    mean,
    paired_difference,
    with_interval,
)
from ..tables import Table, Tabled, pandas_module
from .run_spec import Changes, seconds
from .running import loaded

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
    jobs: int = 1,
    progress: bool = True,
) -> Comparison:
    """Run variants of a model with the same seeds, and compare their metrics in pairs of runs.

    A variant is a set of changes as ``load`` takes them, or another model; a list names disturbances, where ``none`` is
    the unchanged model.  Seeds count up from ``seed`` (default: the model's).  Runs that fail are reported and left
    out.  With several ``jobs``, that many processes make runs, and ``runs`` have neither signals nor figures; the
    numbers are the same.

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
    if jobs == 1:
        return compared(models, replications, seed, until, progress=progress)
    if jobs < 1:
        raise EpicycleError(f"jobs: {jobs} is not a whole number of at least 1")
    changes: dict[str, Changes] = {}
    for name, each in variants.items():
        if isinstance(model, Model) or isinstance(each, Model) or each.get("types"):
            raise EpicycleError(
                f"variant {name} cannot be made in other processes, which do not know the models and classes of this "
                "program\n   help: leave out jobs"
            )
        changes[name] = each
    away = Away(str(model), changes, jobs)
    return compared(models, replications, seed, until, away=away, progress=progress)


@dataclass(frozen=True)
class Away:
    """How other processes load the variants: the model, its changes, and the files with their own types."""

    model: str
    variants: Mapping[str, Changes]
    jobs: int
    types: Sequence[Path] = ()


def compared(
    models: Mapping[str, Model],
    replications: int,
    seed: int | None,
    until: float | str | None,
    *,
    away: Away | None = None,
    progress: bool = True,
) -> Comparison:
    """The same for models that were loaded, here or in other processes."""
    if len(models) < 2:
        raise EpicycleError("a comparison needs at least two variants")
    first, stop = next(iter(models.values())), seconds("until", until)
    seeds = range(start := first.output.seed if seed is None else seed, start + replications)
    units = {metric.name: metric.unit for each in models.values() for metric in each.output.metrics}
    found = Comparison(first.name, seeds, units, {name: {} for name in models})
    asked = [(name, number) for number in seeds for name in models]
    outcomes = _made(models, asked, stop) if away is None else _made_away(away, asked, stop)
    with bar(first.name, after=SOON) if progress else nullcontext() as show:
        for done, (name, number) in enumerate(asked):
            if show is not None:
                show(done, len(asked), f"seed {number}, {name}")
            outcome = next(outcomes)
            if isinstance(outcome, Results):
                found.runs[name][number] = outcome
            else:
                found.failures[name, number] = outcome
    return found


_Asked = tuple[str, int]  # a variant and a seed


def _outcome(model: Model, seed: int, until: float | None) -> Results | EpicycleError:
    try:
        return Simulation(model, seed=seed).run(until=until)
    except (ActorError, LoopError) as error:
        return error


def _made(
    models: Mapping[str, Model], asked: Sequence[_Asked], until: float | None
) -> Iterator[Results | EpicycleError]:
    for name, seed in asked:
        yield _outcome(models[name], seed, until)


def _made_away(away: Away, asked: Sequence[_Asked], until: float | None) -> Iterator[Results | EpicycleError]:
    """The outcomes of runs in other processes, in the order in which they are asked for."""
    with ThreadPoolExecutor(away.jobs) as threads, Processes(_Bench, away, until) as processes:
        for what, outcome in threads.map(processes.make, asked):
            if what != DONE:
                raise WorkerError("a process that was making runs died; is there enough memory?")
            yield outcome


class _Bench:
    """Makes runs of the variants in a process."""

    def __init__(self, away: Away, until: float | None) -> None:
        self._away = away
        self._until = until
        self._types = [each for file in away.types for each in types_of_file(file)]
        self._models: dict[str, Model] = {}

    def prepare(self, asked: _Asked) -> None:
        """Load the variant, unless it is there."""
        name, _ = asked
        if name not in self._models:
            changes = self._away.variants[name]
            model = loaded(self._away.model, {**changes, "types": self._types} if self._types else changes)
            model.output.recorded = []
            self._models[name] = model

    def make(self, asked: _Asked) -> Results | EpicycleError:
        """The outcome of a run, without what may be large, or cannot leave this process."""
        name, seed = asked
        outcome = _outcome(self._models[name], seed, self._until)
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
