"""Falsify: look for a run that breaks a property, and keep all runs in the results folder of a study."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError

from ..build.load import load_model
from ..build.model import Model
from ..catalogue.types import types_of_file
from ..engine import Interventions, Simulation
from ..language.dimensions import Level
from ..language.settings import Setting
from ..language.study import study_of_text
from ..study import OK, Search, Trials, available_cores, open_trials
from ..text.problems import Problems
from .faults import FaultSpace
from .growing import Growing, place_of, text_of
from .monitored import AD_HOC, monitors_named, property_of
from .proposals import BATCH, SPREAD, Point, is_guided, proposals
from .space import Interval, Space, read_space

FILE = Path("falsify")  # what the study of a search has for a file, so that paths are relative to the working directory
MAX_RUNS = 1_000_000
MAX_POINTS = 150_000  # numbers in the text of a study, which is read with limits


@dataclass(frozen=True)
class Asked:
    """What is to be searched: the words of the command, and as many runs at most; no ``monitor`` means all."""

    model: str
    monitor: str | None = None
    vary: Sequence[str] = ()
    runs: int = 500
    seed: int = 0
    set: Sequence[str] = ()
    disturb: Sequence[str] = ()
    types: Sequence[Path] = ()
    command: Sequence[str] = ()
    acts: int = 0  # the largest number of acts of aspects in a run; 0: all that happen
    aspects: Sequence[str] = ()
    without: Sequence[str] = ()
    until: float | None = None  # s

    def load(self, settings: Sequence[Setting] = ()) -> Model:
        """The model, with further settings."""
        model = load_model(
            self.model,
            set=[*self.set, *settings],
            disturb=self.disturb,
            aspects=self.aspects,
            without_aspects=self.without,
            types=[each for file in self.types for each in types_of_file(file)],
        )
        if self.until is not None:
            model.stop = self.until
        return model


@dataclass(frozen=True)
class Run:
    """A run of a search: its number from 1, what was set, its seed, and what came of it.

    Of several monitors, ``broken`` are those that do not hold, and ``robustness`` is the least.
    """

    number: int
    level: Level
    seed: int
    status: str
    holds: bool | None
    robustness: float | None
    error: str | None
    digest: str | None
    key: str
    broken: tuple[str, ...] = ()


@dataclass
class Findings:
    """What a search has found: all its runs, in order, and the first that is broken."""

    model: str
    monitors: dict[str, str]  # the property of each
    space: Space | FaultSpace
    guided: bool
    runs: list[Run] = field(default_factory=list)
    broken: Run | None = None  # the first run that breaks the property
    least: Run | None = None  # the first run of least robustness
    margin: float | None = None  # its robustness

    @property
    def failed(self) -> list[Run]:
        """The runs of which nothing is known, as they raised an error or took too long."""
        return [each for each in self.runs if each.status != OK]

    @property
    def not_judged(self) -> list[Run]:
        """The runs of which nobody can tell whether they have the property."""
        return [each for each in self.runs if each.status == OK and each.holds is None]

    @property
    def unguided(self) -> bool:
        """Whether it would have been guided by now, were the library there."""
        has_ranges = any(isinstance(axis, Interval) for axis in self.space.axes)
        return has_ranges and not self.guided and len(self.runs) > SPREAD * BATCH

    def add(self, run: Run) -> None:
        """Another run is over."""
        self.runs.append(run)
        if self.broken is None and run.holds is False:
            self.broken = run
        margin = run.robustness
        if margin is not None and not math.isnan(margin) and (self.margin is None or margin < self.margin):
            self.least, self.margin = run, margin


def falsify(
    asked: Asked,
    folder: Path,
    *,
    jobs: int | None = None,
    timeout: float | None = None,
    tell: Callable[[int, Run | None], None] = lambda runs, least: None,
) -> Findings:
    """Make runs until one breaks the property, or there are as many as are asked for.

    Runs that are in the folder already are not made again, so that a search that was killed continues.  ``tell`` is
    called with how many there are, and the one of least robustness.  Raises ``EpicycleError``.
    """
    searching = _Searching(asked)
    found, growing = searching.findings, searching.growing
    points = searching.next()
    growing.add(points)
    with open_trials(growing.whole(), folder, jobs or available_cores(), timeout) as made:
        try:
            while points:
                searching.make(points, made, lambda: tell(len(found.runs), found.least))
                points = [] if found.broken else searching.next()
        finally:
            growing.tell(made, over=True)
    return found


class _Searching:
    """What is chosen, batch by batch, and what came of it."""

    def __init__(self, asked: Asked) -> None:
        self._asked = asked
        if not 0 < asked.runs <= MAX_RUNS:
            raise EpicycleError(f"runs {asked.runs:,}: expected a whole number from 1 to {MAX_RUNS:,}")
        model = asked.load()
        names = monitors_named(model, asked.monitor, flag="--monitor" if asked.command else "")
        monitors = {name: property_of(model, name) for name in names}
        metrics = [metric for name in names for metric in (name, f"{name}_robustness")]
        problems = Problems()
        space = read_space(asked.vary, model, metrics, asked.set, problems)
        problems.raise_if_any()
        searched = space if not asked.acts else self._faults(model)
        if asked.runs * searched.width > MAX_POINTS:
            most = MAX_POINTS // searched.width
            raise EpicycleError(
                f"{asked.runs:,} runs are too many for one folder, where {searched.content} may take {most:,} values "
                f"each\n   help: search with --runs {most} and several seeds, in a folder each"
            )
        keys = self._keys(model.name, metrics)
        study = replace(
            study_of_text(text_of(keys, []), FILE, asked.set, asked.types),
            aspects=tuple(asked.aspects),
            without_aspects=tuple(asked.without),
            stop=asked.until,
        )
        self.growing = Growing(study, keys, searched, Search(runs=asked.runs, command=list(asked.command)))
        guided = is_guided() and any(isinstance(axis, Interval) for axis in space.axes)
        self.findings = Findings(model.name, monitors, searched, guided)
        self._proposals = (
            searched.proposals(asked.seed)
            if isinstance(searched, FaultSpace)
            else proposals(len(space.axes), asked.seed, guided)
        )
        self._latest: list[float | None] | None = None

    def _faults(self, model: Model) -> FaultSpace:
        """The acts that happen in the run of the seed."""
        asked = self._asked
        if asked.vary:
            raise EpicycleError(
                "acts are searched in one run, in which nothing varies\n   help: leave out --vary or --acts"
            )
        acts = Simulation(model, seed=asked.seed, acts=Interventions(model.exactly)).run().acts
        if not acts:
            raise EpicycleError(
                f"no aspect does anything in the run of {model.name} with seed {asked.seed}\n   help: add --disturb"
            )
        return FaultSpace([act.name for act in acts], asked.acts)

    def next(self) -> list[Point]:
        """The points of the next batch; none if there are as many runs as were asked for, or no others."""
        left = self._asked.runs - len(self.findings.runs)
        if left <= 0:
            return []
        try:
            points = next(self._proposals) if self._latest is None else self._proposals.send(self._latest)
        except StopIteration:
            return []
        return points[:left]

    def make(self, points: Sequence[Point], made: Trials, tell: Callable[[], None]) -> None:
        """Make the runs of a batch."""
        found = self.findings
        levels, distinct = self.growing.add(points)
        self.growing.tell(made)
        order = list(distinct)
        start = len(found.runs)
        # Acts are those of one run, which has the first seed.
        step = 0 if self._asked.acts else 1
        numbers = [(order.index(place_of(level)), step * (start + at)) for at, level in enumerate(levels)]
        rows = made.made(self.growing.plan(list(distinct.values())), numbers, tell)
        for at, (level, row) in enumerate(zip(levels, rows, strict=True), start=1):
            states = [row[name] for name in found.monitors]
            margins = [row[f"{name}_robustness"] for name in found.monitors]
            broken = tuple(
                name for name, state in zip(found.monitors, states, strict=True) if state is not None and not state
            )
            holds = False if broken else None if None in states else True
            margin = min((each for each in margins if each is not None), key=_least, default=None)
            ended = (row["status"], holds, margin, row["error"], row["digest"], row["run"], broken)
            found.add(Run(start + at, level, row["seed"], *ended))
        self._latest = [each.robustness for each in found.runs[start:]]

    def _keys(self, model: str, metrics: list[str]) -> dict[str, Any]:
        """What the file of the study says beside the points."""
        asked = self._asked
        keys: dict[str, Any] = {"study": f"falsify_{model}", "model": asked.model}
        if asked.disturb:
            keys["disturb"] = {"given": list(asked.disturb)}
        keys["seed"] = asked.seed
        if AD_HOC in metrics and asked.monitor is not None:
            keys["monitors"] = {AD_HOC: asked.monitor}
        keys["metrics"] = metrics
        return keys


def _least(margin: float) -> float:
    """The order of robustness: what is not a number is no break."""
    return math.inf if math.isnan(margin) else margin
