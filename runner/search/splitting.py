"""Rare events: how probable it is that a run breaks a property, by importance splitting.

A run is on its way to the break when the robustness of the property falls.  Of the runs that get to a level, many go on
from there, each with random numbers of its own; then the same from the next level.  With a fixed number of runs for
each level, the product of the shares that get to the next one has the probability as its mean, whatever the levels
are.  They are found beforehand, by runs that the estimate does not use.  The interval comes from repetitions that have
nothing in common but the levels.

Source: Garvels, The Splitting Method in Rare Event Simulation, 2000 (fixed effort); Amrein and Kunsch, A Variant of
Importance Splitting for Rare Event Estimation, ACM TOMACS 21, 2011 (why its mean is right).
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from epicycle.actors import EpicycleError, Process, counted, elementary, random_stream

from ..execution.engine import Simulation
from ..model.build.model import Model
from ..model.temporal import TINY
from ..study.run.processes import Worker
from ..support.shown import short
from ..support.student import student_quantile
from ..support.tables import Table
from .answer import Answer
from .cache import NUMBER, EvaluationCache
from .evaluator import Evaluator

SHARE = 0.2  # of the runs that should get from one level to the next: few levels, and yet many runs at each
ENOUGH = 0.1  # of the runs from a level that break the property: it needs no further level
MOST = 100  # levels
CONFIDENCE = 0.95
_WHOLE, _LEVELS = "whole", "levels"  # what is asked for besides repetitions
_PARTS = 20  # in which whole runs are made


@dataclass(repr=False)
class RareEvent(Answer):
    """The probability that a run of a model breaks a monitor, and what its estimate is made of.

    ``levels`` are what the robustness of ``guide`` falls to, and ``shares``, in each repetition, how many of the
    ``runs`` from one level get to the next, and from the last to the break; it ends where none does.  ``runs_made`` and
    ``tags``, of which there are ``tags_of_run`` in a whole run, count the search for levels, too.
    """

    NAME = "rare"

    model: str
    seed: int
    until: float | None
    monitor: str
    source: str  # its property
    guide: str
    levels: list[float]
    runs: int
    shares: list[list[float]]
    runs_made: int
    tags: int
    tags_of_run: float

    @property
    def estimates(self) -> list[float]:
        """What each repetition comes to."""
        return [math.prod(each) for each in self.shares]

    @property
    def probability(self) -> float:
        """The mean of the estimates, whose own mean over all seeds is the probability."""
        return math.fsum(self.estimates) / len(self.estimates)

    @property
    def error(self) -> float:
        """Its standard error, relative to it; NaN if no run has broken the property."""
        number, mean = len(self.estimates), self.probability
        if mean == 0.0:
            return math.nan
        square = math.fsum((each - mean) * (each - mean) for each in self.estimates) / (number - 1)
        return math.sqrt(square / number) / mean

    @property
    def interval(self) -> tuple[float, float] | None:
        """The probability lies in it in 95 % of all estimates; None if no run has broken the property.

        Each estimate is a product of many shares, so that its logarithm is nearly normal: the interval is that of the
        mean of a log-normal law (Cox's method, with Student's quantile; Zhou and Gao, Statistics in Medicine 16, 1997).
        A repetition that broke nothing has no logarithm; then it is Student's of the estimates, which is too narrow.
        """
        number, mean = len(self.estimates), self.probability
        if mean == 0.0:
            return None
        quantile = student_quantile(0.5 + CONFIDENCE / 2, number - 1)
        if min(self.estimates) == 0.0:
            return max(mean - quantile * self.error * mean, 0.0), min(mean + quantile * self.error * mean, 1.0)
        logarithms = [elementary.log(each) for each in self.estimates]
        middle = math.fsum(logarithms) / number
        square = math.fsum((each - middle) * (each - middle) for each in logarithms) / (number - 1)
        middle += square / 2.0
        width = quantile * math.sqrt(square / number + square * square / (2.0 * (number - 1)))
        return elementary.exp(min(middle - width, 0.0)), elementary.exp(min(middle + width, 0.0))

    @property
    def plain_runs(self) -> float:
        """How many whole runs it would take for the same standard error; NaN if that is not known."""
        if not self.error > 0.0:
            return math.nan
        return (1.0 - self.probability) / self.probability / (self.error * self.error)

    def _sentences(self) -> Iterator[str]:
        number = len(self.shares)
        done = (
            f"{number} repetitions with {self.runs:,} runs from each of {counted(len(self.levels) + 1, 'level')}, the "
            f"beginning included; {self.runs_made:,} runs in all"
        )
        if self.interval is None:
            yield f"No run broke {self.monitor} ({self.source}): {done}. That does not bound the probability."
            return
        low, high = self.interval
        yield (
            f"A run of {self.model} breaks {self.monitor} ({self.source}) with a probability of {self.probability:.2g} "
            f"(95 % interval: {low:.2g} to {high:.2g}): {done}."
        )
        if not math.isnan(self.plain_runs):
            events = self.plain_runs * self.tags_of_run / self.tags
            yield (
                f"Plain sampling needs {self.plain_runs / self.runs_made:.2g} times as many runs, and {events:.2g} "
                "times as many tags, for the same standard error."
            )
        if empty := self.estimates.count(0.0):
            yield f"{counted(empty, 'repetition')} broke nothing, so the interval is too narrow: use more runs."
        if not self.levels:
            yield "There was no level on the way, so this is plain sampling."

    def _facts(self) -> dict[str, Any]:
        own = {"probability": self.probability, "interval": self.interval, "error": self.error}
        return {**own, "estimates": self.estimates, "plain_runs": self.plain_runs, **asdict(self)}

    def _tables(self) -> list[Table]:
        rows = []
        levels = [0.0 if abs(level) == TINY else level for level in self.levels]
        for place, name in enumerate([*map(short, levels), "broken"]):
            tried = [each[place] for each in self.shares if place < len(each)]
            mean = math.fsum(tried) / len(tried) if tried else math.nan
            rows.append((name, "" if math.isnan(mean) else f"{mean:.3f}", f"{len(tried)}"))
        return [Table((f"robustness of {self.guide}", "share that gets there", "repetitions that tried"), rows)]


class _Branch(NamedTuple):
    """A run from a level on: the least robustness that it came to, and itself if it can go on from there."""

    reached: float  # -infinity once the property is broken
    simulation: Simulation | None
    tags: int


class _Branches(Worker):
    """Branches of a model, from level to level."""

    def __init__(self, model: Model, monitor: str, guide: str, seed: int, until: float | None, runs: int) -> None:
        self.model = model
        self.monitor = monitor
        self.guide = guide
        self.seed = seed
        self.until = until
        self.runs = runs
        self.made = self.tags = 0
        self._has_processes = any(isinstance(actor, Process) for actor in model.graph.actors.values())

    def from_level(self, before: Sequence[_Branch] | None, level: float | None, key: str) -> list[_Branch]:
        """Branches that begin where others got to, or with None at the beginning, and go on to a level or to the end.

        Those with the same ``key`` are the same branches.
        """
        if before is None:
            return [self._branch(None, level, f"{key} {number}") for number in range(self.runs)]
        each, more = divmod(self.runs, len(before))
        chosen = random_stream(self.seed, key).permutation(len(before))[:more].tolist()
        origins = [branch for branch in before for _ in range(each)] + [before[place] for place in chosen]
        return [self._branch(origin, level, f"{key} {number}") for number, origin in enumerate(origins)]

    def _branch(self, origin: _Branch | None, level: float | None, key: str) -> _Branch:
        seed = int.from_bytes(hashlib.sha256(f"{self.seed} {key}".encode()).digest()[:7], "little")
        before = 0
        if origin is None:
            simulation = Simulation(self.model, seed=seed)
        elif origin.simulation is None:
            return _Branch(-math.inf, None, 0)
        else:
            simulation = origin.simulation.fork(reseed=seed)
            # Where there are processes, the fork has come there from the beginning.
            before = 0 if self._has_processes else simulation.director.steps
        awaited = {self.monitor: 0.0}
        if level is not None:
            awaited[self.guide] = max(level, awaited.get(self.guide, level))
        is_there = simulation.reach(awaited, until=self.until)
        tags = simulation.director.steps - before
        self.made += 1
        self.tags += tags
        if simulation.robustness(self.monitor) <= 0.0:
            return _Branch(-math.inf, None, tags)
        if is_there:
            return _Branch(simulation.robustness(self.guide), simulation, tags)
        verdict = simulation.verdict(self.monitor)
        if verdict.holds is None:
            raise EpicycleError(
                f"monitor {self.monitor} cannot be judged in a run of {self.model.name}, because {verdict.missing}"
            )
        return _Branch(simulation.robustness(self.guide) if verdict.holds else -math.inf, None, tags)

    def levels(self, first: Sequence[float]) -> list[float]:
        """Levels of which each is reached by about a fifth of the branches from the one before.

        ``first`` is how far whole runs come.
        """
        levels: list[float] = []
        origins: list[_Branch] | None = None
        while len(levels) < MOST:
            key = f"levels {len(levels)}"
            reached = sorted(
                first if origins is None else (branch.reached for branch in self.from_level(origins, None, key))
            )
            level = reached[math.ceil(SHARE * self.runs) - 1]
            if level == reached[-1]:  # which all of them reach: the next one that some do
                level = max((each for each in reached if each < level), default=-math.inf)
            if level == -math.inf or reached.count(-math.inf) >= ENOUGH * self.runs:
                break
            levels.append(level)
            origins = [branch for branch in self.from_level(origins, level, key) if branch.reached <= level]
        return levels

    def whole(self, numbers: Sequence[int]) -> list[float]:
        """How far some of the runs come that the levels are found by."""
        return [self._branch(None, None, f"levels 0 {number}").reached for number in numbers]

    def spent(self) -> tuple[int, int]:
        """How many runs have been made since this was asked last, and how many tags they took."""
        made, tags = self.made, self.tags
        self.made = self.tags = 0
        return made, tags

    def shares(self, levels: Sequence[float], key: str) -> list[float]:
        """The shares that get from level to level, and then to the break; the last one is 0 where none does."""
        shares: list[float] = []
        origins = None
        for place, level in enumerate([*levels, None]):
            branches = self.from_level(origins, level, f"{key} {place}")
            origins = [branch for branch in branches if branch.reached <= (-math.inf if level is None else level)]
            shares.append(len(origins) / self.runs)
            if not origins:
                break
        return shares

    def make(self, request: tuple[str, Sequence[Any]]) -> list[Any]:
        """What the request is for, some whole runs, the levels or a repetition; and the runs and tags that it took."""
        key, given = request
        made: Sequence[float]
        if key == _WHOLE:
            made = self.whole(given)
        else:
            made = self.levels(given) if key == _LEVELS else self.shares(given, key)
        return [made, *self.spent()]


def rare(
    model: Model,
    monitor: str,
    *,
    guide: str | None = None,
    runs: int = 200,
    repetitions: int = 10,
    seed: int | None = None,
    until: float | None = None,
    folder: Path | None = None,
    jobs: int | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> RareEvent:
    """Estimate the probability that a run of a model breaks a monitor.

    ``guide`` is the monitor whose robustness says how far a run has come: by default this one.  In a ``folder``, each
    repetition is noted, and an estimate that was killed continues there.  ``jobs`` processes make them.  ``tell`` is
    called with how many runs were made, and how many repetitions are done.
    """
    guide = guide or monitor
    known = {each.name: each.requirement.property for each in model.output.monitors}
    seed = model.output.seed if seed is None else seed
    first = Simulation(model, seed=seed)
    for name in (monitor, guide):
        first.robustness(name)  # which there must be
    if repetitions < 2 or runs < 2:
        raise EpicycleError(f"an interval takes 2 runs and 2 repetitions or more, not {runs} and {repetitions}")
    about = {
        "model": model.name, "seed": seed, "until": until, "property": known[monitor], "guide": known[guide],
        "runs": runs,
        "digest": "" if folder is None else first.run(until=until).digest,
    }  # fmt: skip
    cache = EvaluationCache(model, about, [[NUMBER], NUMBER, int, int], folder)
    found: list[list[float]] = []
    with Evaluator.of_model(_Branches, model, monitor, guide, seed, until, runs, jobs=jobs) as evaluator:

        def levels_found() -> list[Any]:
            """The levels, and what they took; whole runs, which are half of it, are made in parts."""
            size = -(-runs // _PARTS)
            parts = [range(start, min(start + size, runs)) for start in range(0, runs, size)]
            evaluator.expect((part[0], (_WHOLE, part)) for part in parts)
            first: list[float] = []
            tags_of_whole = 0
            for part in parts:
                reached, _, took = evaluator.make(part[0], (_WHOLE, part))
                first += reached
                tags_of_whole += took
            levels, made, tags = evaluator.make(_LEVELS, (_LEVELS, first))
            return [levels, tags_of_whole / runs, runs + made, tags_of_whole + tags]

        levels, tags_of_run, made, tags = cache.outcome(_LEVELS, levels_found)
        keys = [f"repetition {number}" for number in range(repetitions)]
        evaluator.expect((key, (key, levels)) for key in keys if key not in cache)

        def repetition(key: str) -> list[Any]:
            shares, made, tags = evaluator.make(key, (key, levels))
            return [shares, 0, made, tags]

        for key in keys:
            if tell is not None:
                tell(made, len(found))
            shares, _, more, tags_more = cache.outcome(key, partial(repetition, key))
            found.append(shares)
            made, tags = made + more, tags + tags_more
    source = known[monitor]
    return RareEvent(model.name, seed, until, monitor, source, guide, levels, runs, found, made, tags, tags_of_run)
