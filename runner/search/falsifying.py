"""Falsify: look for a run that breaks a property, and keep all runs in the results folder of a study."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from epicycle.actors import EpicycleError, counted

from ..build import Model, load_model
from ..catalogue import types_of_file
from ..language import Dimension, Level, parse_setting, study_of_text
from ..study import OK, Plan, Search, Trials, available_cores, open_trials
from ..text import COMMAND_LINE, ModelError, Position, Problems
from .explaining import property_of
from .proposals import BATCH, SPREAD, Point, is_guided, proposals
from .space import Interval, Space, read_space, said

AD_HOC = "property"  # the name of a monitor that is made of a text
FILE = Path("falsify")  # what the study of a search has for a file, so that paths are relative to the working directory
MAX_RUNS = 1_000_000
MAX_POINTS = 150_000  # numbers in the text of a study, which is read with limits
_GROWTH = 1.1  # of the number of runs, after which the folder is told of them


@dataclass(frozen=True)
class Asked:
    """What is to be searched: the words of the command, and as many runs at most."""

    model: str
    monitor: str
    vary: Sequence[str] = ()
    runs: int = 500
    seed: int = 0
    set: Sequence[str] = ()
    disturb: Sequence[str] = ()
    types: Sequence[Path] = ()
    command: Sequence[str] = ()


@dataclass(frozen=True)
class Run:
    """A run of a search: its number from 1, what was set, its seed, and what came of it."""

    number: int
    level: Level
    seed: int
    status: str
    holds: bool | None
    robustness: float | None
    error: str | None
    digest: str | None
    key: str


@dataclass
class Findings:
    """What a search has found: all its runs, in order, and the first that is broken."""

    model: str
    monitor: str
    source: str  # its property
    space: Space
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
    found = searching.findings
    points = searching.next()
    with open_trials(searching.plan(points), folder, jobs or available_cores(), timeout) as made:
        told = 0
        try:
            while points:
                if len(found.runs) + len(points) >= _GROWTH * told:
                    told = len(found.runs) + len(points)
                    made.describe(searching.whole(points))
                searching.make(points, made, lambda: tell(len(found.runs), found.least))
                points = [] if found.broken else searching.next()
        finally:
            made.describe(searching.whole(points))
    return found


class _Searching:
    """What is chosen, batch by batch, and what came of it."""

    def __init__(self, asked: Asked) -> None:
        self._asked = asked
        if not 0 < asked.runs <= MAX_RUNS:
            raise EpicycleError(f"runs {asked.runs:,}: expected a whole number from 1 to {MAX_RUNS:,}")
        types = [each for file in asked.types for each in types_of_file(file)]
        model = load_model(asked.model, set=asked.set, disturb=asked.disturb, types=types)
        self._monitor = asked.monitor
        if " " in asked.monitor.strip():
            self._watch(model)
            self._monitor = AD_HOC
        source = property_of(model, self._monitor)
        metrics = self._monitor, f"{self._monitor}_robustness"
        problems = Problems()
        space = read_space(asked.vary, model, metrics, problems)
        for each in [parse_setting(text, problems) for text in asked.set]:
            if each is not None and each.path in space.columns:
                problems.add(f"{each.path!r} is set and varied", each.position, "leave out --set or --vary")
        problems.raise_if_any()
        if asked.runs * len(space.axes) > MAX_POINTS:
            most = MAX_POINTS // len(space.axes)
            raise EpicycleError(
                f"{asked.runs:,} runs are too many for one folder, where {counted(len(space.axes), 'parameter')} "
                f"may take {most:,} values each\n   help: search with --runs {most} and several seeds, in a folder each"
            )
        study = study_of_text(self._text(model.name, []), FILE, asked.set, asked.types)
        self._others: tuple[Dimension, ...] = study.dimensions  # the disturbances
        base = Plan.made(replace(study, dimensions=(*space.ends(), *self._others)))
        extra = {name: digest for each in base.extra for more in each.values() for name, digest in more.items()}
        command = Search(runs=asked.runs, command=list(asked.command))
        self._base = replace(base, sources=base.sources | extra, search=command)
        self._levels: dict[tuple[Any, ...], Level] = {}  # of all runs, each once
        guided = is_guided() and any(isinstance(axis, Interval) for axis in space.axes)
        self.findings = Findings(model.name, self._monitor, source, space, guided)
        self._proposals = proposals(len(space.axes), asked.seed, guided)
        self._latest: list[float | None] | None = None

    def _watch(self, model: Model) -> None:
        """Add the property that is given as a text."""
        try:
            model.monitor(AD_HOC, self._asked.monitor)
        except ModelError as error:
            if not self._asked.command:
                raise
            option = f"--monitor {self._asked.monitor}"
            at = Position(COMMAND_LINE, 1, 11, max(1, len(option) - 10), option)
            raise ModelError(replace(each, position=at) for each in error.problems) from None

    def next(self) -> list[Point]:
        """The points of the next batch; none if there are as many runs as were asked for."""
        left = self._asked.runs - len(self.findings.runs)
        if left <= 0:
            return []
        points = next(self._proposals) if self._latest is None else self._proposals.send(self._latest)
        return points[:left]

    def make(self, points: Sequence[Point], made: Trials, tell: Callable[[], None]) -> None:
        """Make the runs of a batch."""
        found, levels = self.findings, [self.findings.space.level(point) for point in points]
        places = self._distinct(levels)
        order = list(places)
        start = len(found.runs)
        numbers = [(order.index(_place(level)), start + at) for at, level in enumerate(levels)]
        rows = made.made(self._plan(list(places.values())), numbers, tell)
        for at, (level, row) in enumerate(zip(levels, rows, strict=True), start=1):
            holds = row[found.monitor]
            margin = row[f"{found.monitor}_robustness"]
            known = None if holds is None else bool(holds)
            ended = (row["status"], known, margin, row["error"], row["digest"], row["run"])
            found.add(Run(start + at, level, row["seed"], *ended))
        self._levels |= places
        self._latest = [each.robustness for each in found.runs[start:]]

    def plan(self, points: Sequence[Point]) -> Plan:
        """What a folder is to know of a batch before there is any other."""
        return self._told(self._distinct([self.findings.space.level(each) for each in points]))

    def whole(self, points: Sequence[Point]) -> Plan:
        """What it is to know of all batches, and of one that is made now."""
        return self._told(self._levels | self._distinct([self.findings.space.level(each) for each in points]))

    def _told(self, levels: dict[tuple[Any, ...], Level]) -> Plan:
        plan = self._plan(list(levels.values()))
        text = self._text(self.findings.model, list(levels.values()))
        return replace(plan, study=replace(plan.study, text=text))

    def _plan(self, levels: list[Level]) -> Plan:
        dimensions = (*self.findings.space.dimensions(levels), *self._others)
        study = replace(self._base.study, dimensions=dimensions)
        return replace(self._base, study=study, extra=[{} for _ in dimensions])

    def _distinct(self, levels: Sequence[Level]) -> dict[tuple[Any, ...], Level]:
        return {_place(level): level for level in levels}

    def _text(self, model: str, levels: list[Level]) -> str:
        """The study of these points, as its file would say it."""
        asked = self._asked
        said_of: dict[str, Any] = {"study": f"falsify_{model}", "model": asked.model}
        if vary := said(levels):
            said_of["vary"] = vary
        if asked.disturb:
            said_of["disturb"] = {"given": list(asked.disturb)}
        said_of["seed"] = asked.seed
        if self._monitor == AD_HOC:
            said_of["monitors"] = {AD_HOC: asked.monitor}
        said_of["metrics"] = [self._monitor, f"{self._monitor}_robustness"]
        text: str = yaml.safe_dump(said_of, sort_keys=False, allow_unicode=True, width=1_000)
        return text


def _place(level: Level) -> tuple[Any, ...]:
    return tuple(level.values.values())
