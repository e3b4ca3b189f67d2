"""Falsify: look for a run that breaks a property, and keep all runs in the results folder of a study."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from epicycle.actors import EpicycleError

from ..execution.engine import Interventions, Simulation
from ..model.build.model import Model
from ..support.bars import Show, unseen
from ..support.shown import short
from .falsification import Falsification, Run
from .faults import FaultSpace
from .growing import Growing, study_of
from .monitored import AD_HOC, monitors_named, property_of
from .proposals import Point, proposals
from .space import SearchSpec, read_space
from .spec import MAX_RUNS, Break, results_folder

FILE = Path("falsify")  # what the study of a search has for a file, so that paths are relative to the working directory
MAX_POINTS = 150_000  # numbers in the text of a study, which is read with limits


def falsify(
    spec: SearchSpec,
    goal: Break,
    out: Path | None = None,
    *,
    jobs: int | None = None,
    timeout: float | None = None,
    show: Show = unseen,
) -> Falsification:
    """Make runs until one breaks the property, or there are as many as are asked for.

    Runs that are in the folder already are not made again, so that a search that was killed continues.  Raises
    ``EpicycleError``.
    """
    searching = _Searching(spec, goal)
    found, growing = searching.found, searching.growing
    found.folder = folder = out or results_folder(found.model, "falsification")

    def told() -> None:
        known = "" if found.least is None else f", least robustness {short(found.least.robustness)}"
        show(len(found.runs), goal.runs, f"{len(found.runs):,} runs{known}")

    points = searching.next()
    with growing.opened(points, folder, jobs, timeout):
        while points:
            searching.make(points, told)
            points = [] if found.broken else searching.next()
    return found


class _Searching:
    """What is chosen, batch by batch, and what came of it."""

    def __init__(self, spec: SearchSpec, goal: Break) -> None:
        self._spec, self._goal, self._seed = spec, goal, spec.seed or 0
        if not 0 < goal.runs <= MAX_RUNS:
            raise EpicycleError(f"runs {goal.runs:,}: expected a whole number from 1 to {MAX_RUNS:,}")
        model = spec.load()
        names = monitors_named(model, goal.monitor or None, flag="--break" if spec.continued_by else "")
        monitors = {name: property_of(model, name) for name in names}
        metrics = [metric for name in names for metric in (name, f"{name}_robustness")]
        space = read_space(spec, model, metrics)
        searched = space if not goal.max_faults else self._faults(model)
        if goal.runs * searched.width > MAX_POINTS:
            most = MAX_POINTS // searched.width
            raise EpicycleError(
                f"{goal.runs:,} runs are too many for one folder, where {searched.content} may take {most:,} values "
                f"each\n   help: search with --runs {most} and several seeds, in a folder each"
            )
        keys = spec.keys_of_study(f"falsify_{model.name}") | {"seed": self._seed}
        if AD_HOC in names and goal.monitor:
            keys["monitors"] = {AD_HOC: goal.monitor}
        keys["metrics"] = metrics
        self.growing = Growing(study_of(spec, keys, FILE), keys, searched, runs=goal.runs, command=spec.continued_by)
        self.found = Falsification(spec, goal, model.name, monitors, searched, space.is_guided)
        self._proposals = (
            searched.proposals(self._seed)
            if isinstance(searched, FaultSpace)
            else proposals(space.widths, self._seed, space.is_guided)
        )
        self._latest: list[float | None] | None = None

    def _faults(self, model: Model) -> FaultSpace:
        """The faults that happen in the run of the seed."""
        if self._spec.vary:
            raise EpicycleError(
                "faults are searched in one run, in which nothing varies\n   help: leave out --vary or --max-faults"
            )
        acts = Simulation(model, seed=self._seed, acts=Interventions(model.exactly)).run().acts
        if not acts:
            raise EpicycleError(
                f"no aspect does anything in the run of {model.name} with seed {self._seed}\n   help: add --disturb"
            )
        return FaultSpace([act.name for act in acts], self._goal.max_faults)

    def next(self) -> list[Point]:
        """The points of the next batch; none if there are as many runs as were asked for, or no others."""
        left = self._goal.runs - len(self.found.runs)
        if left <= 0:
            return []
        try:
            points = next(self._proposals) if self._latest is None else self._proposals.send(self._latest)
        except StopIteration:
            return []
        return points[:left]

    def make(self, points: Sequence[Point], tell: Callable[[], None]) -> None:
        """Make the runs of a batch."""
        found = self.found
        levels = self.growing.levels(points)
        start = len(found.runs)
        # Acts are those of one run, which has the first seed.
        step = 0 if self._goal.max_faults else 1
        rows = self.growing.runs(levels, lambda at: [step * (start + at)], tell)
        for at, (level, [row]) in enumerate(zip(levels, rows, strict=True), start=1):
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


def _least(margin: float) -> float:
    """The order of robustness: what is not a number is no break."""
    return math.inf if math.isnan(margin) else margin
