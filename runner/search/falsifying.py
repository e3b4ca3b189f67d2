"""Falsify: look for a run that breaks a property, and keep all runs in the results folder of a study."""

from __future__ import annotations

import math
import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, counted

from ..execution.engine import Interventions, Simulation
from ..execution.results import Results, Verdict
from ..model.build.model import Model
from ..model.graph.acts import ActName
from ..model.language.dimensions import Level, split_number
from ..model.language.disturbance import EXACTLY
from ..model.language.settings import Setting
from ..model.text.document import plain
from ..study.run.backlog import OK
from ..support.bars import Show, unseen
from ..support.shown import short
from ..support.tables import Table
from .answer import StudyAnswer, listed
from .growing import Growing, study_of
from .monitored import AD_HOC, monitors_named, property_of, with_monitors
from .proposals import BATCH, SPREAD, Point
from .space import FaultSpace, Interval, SearchSpec, Space, as_set, read_space, text_of
from .spec import Break, results_folder

FILE = Path("falsify")  # what the study of a search has for a file, so that paths are relative to the working directory
MAX_POINTS = 150_000  # numbers in the text of a study, which is read with limits
SHOWN = 5  # runs in the table
_VALUES = 10  # of a list, in a sentence


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


@dataclass(repr=False)
class Falsification(StudyAnswer):
    """What a search for a run that breaks a property has found: all its runs, in order, and the first that is broken.

    ``broken`` is that run, or None, which does not show that there is none.  ``verdict`` is its verdict, for which the
    run is made once more, ``command`` makes it again, and ``explain`` asks which faults broke it, if there were any.
    ``sentence`` says it all, ``covered`` what was tried, and ``results`` has all runs as a study has them.
    """

    NAME = "falsification"

    spec: SearchSpec
    goal: Break
    model: str
    monitors: dict[str, str]  # the property of each
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
        return self.space.has_ranges and not self.guided and len(self.runs) > SPREAD * BATCH

    def add(self, run: Run) -> None:
        """Another run is over."""
        self.runs.append(run)
        if self.broken is None and run.holds is False:
            self.broken = run
        margin = run.robustness
        if margin is not None and not math.isnan(margin) and (self.margin is None or margin < self.margin):
            self.least, self.margin = run, margin

    @property
    def command(self) -> list[str]:
        """The command that makes the broken run again."""
        return [] if self.broken is None else self.command_of(self.broken)

    def command_of(self, run: Run) -> list[str]:
        """The command that makes one of the runs again."""
        own = [f"{path}={value}" for path, value in as_set(run.level)]
        return replace(self.spec, seed=run.seed, set=(*self.spec.set, *own)).command()

    @property
    def verdict(self) -> Verdict | None:
        """The verdict of the broken run; raises ``EpicycleError`` if that cannot be repeated."""
        return None if self.broken is None else self._again.monitors[self.broken.broken[0]]

    @property
    def explain(self) -> list[str]:
        """The command that asks which faults broke the run, if there were any."""
        if self.broken is None or not self._again.acts:
            return []
        return ["epicycle", "explain", *self.command[2:], "--monitor", self.goal.monitor or self.broken.broken[0]]

    @cached_property
    def _again(self) -> Results:
        """The broken run once more, for what its row does not tell; made when that is asked for."""
        run = self.broken
        assert run is not None
        model = with_monitors(self.spec.load(run.level.settings), self.monitors)
        results = Simulation(model, seed=run.seed, acts=Interventions(model.exactly)).run()
        if results.digest != run.digest:
            raise EpicycleError(
                f"run {run.number} (seed {run.seed}) does not repeat: its digest is {results.digest[:16]}..., but was "
                f"{(run.digest or '')[:16]}...; something has changed since"
            )
        return results

    @property
    def covered(self) -> str:
        """What was tried."""
        return ", ".join(_covered(self))

    def _sentences(self) -> Iterator[str]:
        names = self.broken.broken if self.broken is not None else tuple(self.monitors)
        what = listed([f"{name} ({self.monitors[name]})" for name in names], "or" if self.broken is None else "and")
        if self.broken is None:
            always = "it always holds" if len(names) == 1 else "they always hold"
            yield f"No run broke {what}, which does not prove that {always}."
        else:
            remark = "" if self.verdict is None else self.verdict.remark
            yield f"Run {self.broken.number}, with {_said(self.broken)}, breaks {what}{remark and ': '}{remark}."
        yield f"Tried: {self.covered}."
        runs = self.runs
        if failed := self.failed:
            yield (
                f"{counted(len(failed), 'run')} failed, and nothing is known of the property there: 'epicycle status "
                f"{self.folder}' shows them."
            )
        if self.unguided:
            yield (
                "All values were chosen at random: the library that guides a search is not installed "
                "(pip install 'epicycle[falsify]')."
            )
        if missing := self.not_judged:
            yield f"In {counted(len(missing), 'run')} the property could not be judged."
        if len(runs) > 1 and len({each.digest for each in runs if each.status == OK}) == 1:
            yield "All runs were the same: nothing in the model depends on the seed or on what was varied."

    def _facts(self) -> dict[str, Any]:
        names = self.broken.broken if self.broken is not None else tuple(self.monitors)
        monitor = names[0] if self.broken is not None or len(names) == 1 else None
        return {
            "model": self.model,
            "monitor": monitor,
            "property": None if monitor is None else self.monitors[monitor],
            "monitors": self.monitors,
            "broken": [] if self.broken is None else list(self.broken.broken),
            "found": self.broken is not None,
            "run": None if self.broken is None else _facts(self.broken),
            "verdict": None if self.verdict is None else asdict(self.verdict),
            "command": self.command,
            "explain": self.explain,
            "runs": len(self.runs),
            "failed": len(self.failed),
            "not_judged": len(self.not_judged),
            "least": None if self.least is None else _facts(self.least),
            "guided": self.guided,
            "covered": self.covered,
            "folder": str(self.folder),
        }

    def _tables(self) -> list[Table]:
        commands = [("repeat it", shlex.join(self.command)), ("explain it", shlex.join(self.explain))]
        known = [each for each in self.runs if each.robustness is not None]
        least = sorted(known, key=lambda each: (each.robustness or 0.0, each.number))[:SHOWN]
        head = ("run", *self.space.columns, "seed", "robustness")
        runs = [
            (str(each.number), *(value for _, value in _words(each)), str(each.seed), short(each.robustness))
            for each in least
        ]
        return [Table(("to", "command"), [each for each in commands if each[1]]), Table(head, runs)]


def _acts(setting: Setting) -> list[ActName]:
    """The acts that a setting lets happen."""
    said: Any = plain(setting.node)
    return [ActName(each["aspect"], each["at"], each["token"]) for each in said]


def _words(run: Run) -> Iterator[tuple[str, str]]:
    """What a run was given, for people."""
    for setting in run.level.settings:
        if setting.path == EXACTLY:
            yield setting.path, "; ".join(map(str, _acts(setting))) or "no fault"
        else:
            yield setting.path, text_of(setting.node)


def _said(run: Run) -> str:
    given = ", ".join(f"exactly {value}" if path == EXACTLY else f"{path}={value}" for path, value in _words(run))
    return f"{given} and seed {run.seed}" if given else f"seed {run.seed}"


def _facts(run: Run) -> dict[str, Any]:
    said = {"number": run.number, "set": {each.path: plain(each.node) for each in run.level.settings}}
    return {**said, "seed": run.seed, "robustness": run.robustness, "run": run.key}


def _covered(found: Falsification) -> Iterator[str]:
    runs = found.runs
    yield counted(len(runs), "run")
    if not runs:
        return
    yield f"seeds {runs[0].seed} to {runs[-1].seed}" if runs[-1].seed > runs[0].seed else f"seed {runs[0].seed}"
    if isinstance(found.space, FaultSpace):
        made = Counter(len(_acts(each.level.settings[0])) for each in runs)
        for size, of_size in enumerate(found.space.sizes()):
            if made[size]:
                yield f"{made[size]:,} of {of_size:,} sets of {counted(size, 'fault')}" if size else "no fault at all"
    for at, axis in enumerate(found.space.axes):
        nodes = [each.level.settings[at].node for each in runs]
        if isinstance(axis, Interval) and axis.length:
            ends = f"from {axis.low:f} to {axis.high:f} {axis.unit}".rstrip()
            yield f"{axis.path} with {counted(axis.length, 'number')} {ends}"
        elif isinstance(axis, Interval):
            numbers = [number[0] for each in nodes if (number := split_number(each)) is not None]
            yield f"{axis.path} {min(numbers):f} to {max(numbers):f} {axis.unit}".rstrip()
        else:
            tried = {each.level.values[axis.path] for each in runs}
            texts = [text_of(node) for node in axis.nodes if axis.factor(node) in tried]
            shown = texts[:_VALUES]
            more = f" and {len(texts) - len(shown):,} more" if len(texts) > len(shown) else ""
            yield f"{axis.path} {' or '.join(shown)}{more}"


# -- the search -------------------------------------------------------------------------------------------------------


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
        self.found = Falsification(spec, goal, model.name, monitors, searched, searched.is_guided)
        self._proposals = searched.proposals(self._seed)
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
