"""Optimise: look for the parameters with the best mean, and keep all runs in the results folder of a study."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, counted, did_you_mean
from epicycle.actors.expression import ExpressionError, Formula

from ..model.catalogue.packaged import is_path, packaged_files
from ..model.language.dimensions import Level, split_number
from ..model.language.study import is_study, read_study
from ..model.text.document import parse, plain
from ..model.text.files import COMMAND_LINE
from ..model.text.problems import Position, Problems
from ..study.inference import Estimate, is_usable, mean, with_interval
from ..study.judge.samples import value_in
from ..study.plan.plan import Plan
from ..study.run.backlog import OK
from ..support.bars import Show, unseen
from ..support.tables import Table
from .answer import StudyAnswer
from .growing import Growing, study_of
from .proposals import Point
from .space import Interval, SearchSpec, Space, as_set, read_space
from .spec import Maximise, Minimise, results_folder

FILE = Path("optimise")  # the file of the study of a search over a model: paths are relative to the working directory
_SHARED = 0.05  # of the runs may be without a number
_TOGETHER = 8  # points that are chosen together when the search is guided; more are quicker only on many cores
SHOWN = 5  # points in the table
_FORBIDDEN = math.ldexp(1.0, 1_000)  # what a point that breaks a condition counts as, more than any number


@dataclass(frozen=True)
class Outcome:
    """What came of the runs of a point: the mean of the objective, and how many runs broke which condition."""

    value: Estimate | None  # None: too many runs have no number
    runs: int
    broken: dict[str, int]

    @property
    def is_feasible(self) -> bool:
        """Whether all runs meet all conditions, and the mean is known."""
        return self.value is not None and not any(self.broken.values())


@dataclass(frozen=True)
class Tested:
    """A point that was tried, by its number from 1."""

    number: int
    level: Level
    outcome: Outcome


@dataclass(repr=False)
class Optimum(StudyAnswer):
    """What a search for the best parameters has found.

    ``best`` are the parameters of the best point that was tried and meets all conditions, by their paths, or None;
    ``value`` is the mean of the objective there, and ``checked`` the same with new seeds.  ``sentence`` says it all,
    and ``results`` has all runs as a study has them.
    """

    NAME = "optimisation"

    goal: Minimise
    space: Space
    guided: bool
    tested: list[Tested] = field(default_factory=list)
    check: Outcome | None = None

    @property
    def best(self) -> dict[str, object] | None:
        """The best parameters, by their paths."""
        return None if self.point is None else {each.path: plain(each.node) for each in self.point.level.settings}

    @property
    def value(self) -> Estimate | None:
        """The mean of the objective there."""
        return None if self.point is None else self.point.outcome.value

    @property
    def checked(self) -> Estimate | None:
        """The same with new seeds."""
        return None if self.check is None else self.check.value

    @property
    def greatest(self) -> bool:
        """Whether the mean is to be large."""
        return isinstance(self.goal, Maximise)

    @property
    def point(self) -> Tested | None:
        """The first of the points with the best mean that meet all conditions."""
        return next(iter(self.ranked), None)

    @property
    def ranked(self) -> list[Tested]:
        """The points that meet all conditions, the best first."""
        feasible = (each for each in self.tested if each.outcome.is_feasible)
        return sorted(feasible, key=lambda each: self.cost(each.outcome))

    def cost(self, outcome: Outcome) -> float:
        """What is to be small: a condition that is broken counts more than any number, and no number most of all."""
        if outcome.value is None:
            return math.inf
        if not outcome.is_feasible:
            return _FORBIDDEN * (1.0 + math.fsum(outcome.broken.values()) / outcome.runs)
        return -outcome.value.value if self.greatest else outcome.value.value

    @property
    def command(self) -> list[str]:
        """What sets the best parameters."""
        found = self.point
        said = () if found is None else as_set(found.level)
        return [word for path, text in said for word in ("--set", f"{path}={text}")]

    def _sentences(self) -> Iterator[str]:
        goal, found = self.goal, self.point
        what = f"{'greatest' if self.greatest else 'least'} {goal.objective}"
        tried = counted(len(self.tested), "point")
        if found is None or self.value is None:
            yield f"None of {tried} has a mean of {goal.objective}" + (
                " and meets all conditions." if goal.conditions else "."
            )
        else:
            where = ", ".join(f"{path}={text}" for path, text in as_set(found.level))
            yield f"The {what} of {tried} is {with_interval(self.value)}, at {where} (point {found.number})."
            yield from self._checked()
            for at in _at_ends(self, found):
                yield f"{at} is at the end of its range: the best may lie beyond."
        if broken := sum(any(each.outcome.broken.values()) for each in self.tested):
            yield f"{counted(broken, 'point')} break{'s' if broken == 1 else ''} a condition."
        if unknown := sum(each.outcome.value is None for each in self.tested):
            have = "has" if unknown == 1 else "have"
            yield f"{counted(unknown, 'point')} {have} no mean: runs failed or have no number."
        if not self.guided and self.space.has_ranges:
            yield (
                "All points were spread evenly: the library that guides a search is not installed "
                "(pip install 'epicycle[falsify]')."
            )
        if found is not None:
            yield "There may be a better point that was not tried."

    def _checked(self) -> Iterator[str]:
        check = self.check
        if check is None:
            return
        value = "no mean" if check.value is None else with_interval(check.value)
        broken = [f"{text} is broken in {number} of {check.runs}" for text, number in check.broken.items() if number]
        told = "; ".join([value, *broken])
        yield f"In {counted(check.runs, 'run')} with new seeds it is {told}."

    def _facts(self) -> dict[str, Any]:
        goal, found = self.goal, self.point

        def estimate(outcome: Outcome | None) -> dict[str, Any] | None:
            if outcome is None or outcome.value is None:
                return None
            said, value = {"runs": outcome.runs, "broken": outcome.broken}, outcome.value
            return {"value": value.value, "low": value.low, "high": value.high, **said}

        return {
            "objective": goal.objective,
            "greatest": self.greatest,
            "subject_to": list(goal.conditions),
            "best": self.best,
            "point": None if found is None else found.number,
            "mean": estimate(None if found is None else found.outcome),
            "checked": estimate(self.check),
            "points": len(self.tested),
            "command": self.command,
            "folder": str(self.folder),
        }

    def _tables(self) -> list[Table]:
        distinct = {tuple(as_set(each.level)): each for each in reversed(self.ranked)}
        first = sorted(distinct.values(), key=lambda each: (self.cost(each.outcome), each.number))[:SHOWN]
        head = ("point", *(axis.path for axis in self.space.axes), self.goal.objective)
        rows = [
            (str(each.number), *(text for _, text in as_set(each.level)), with_interval(each.outcome.value))
            for each in first
            if each.outcome.value is not None
        ]
        return [Table(("set it by",), [(shlex.join(self.command),)] if rows else []), Table(head, rows)]


def _at_ends(optimum: Optimum, point: Tested) -> Iterator[str]:
    """The ranges that a point is at an end of, within a hundredth of their width."""
    for axis, setting in zip(optimum.space.axes, point.level.settings, strict=True):
        number = split_number(setting.node)
        if isinstance(axis, Interval) and number is not None:
            near = (axis.high - axis.low) / 100
            if min(number[0] - axis.low, axis.high - number[0]) < near:
                yield axis.path


# -- the search -------------------------------------------------------------------------------------------------------


def optimise(
    spec: SearchSpec,
    goal: Minimise,
    out: Path | None = None,
    *,
    jobs: int | None = None,
    timeout: float | None = None,
    show: Show = unseen,
) -> Optimum:
    """Try points until there are as many as are asked for, and then the best of them with new seeds.

    Runs that are in the folder already are not made again, so that a search that was killed continues.  Raises
    ``EpicycleError``.
    """
    work = _Optimising(spec, goal)
    found = work.found
    found.folder = folder = out or results_folder(work.name, "optimisation")
    chosen = found.space.proposals(work.seed, _TOGETHER)
    points = next(chosen)[: goal.points]
    with work.growing.opened(points, folder, jobs, timeout):
        while True:
            tested = work.test(points)
            known = "" if found.value is None else f", best {with_interval(found.value)}"
            show(len(found.tested), goal.points, f"{len(found.tested):,} points{known}")
            if len(found.tested) >= goal.points:
                break
            points = chosen.send([found.cost(each.outcome) for each in tested])[: goal.points - len(found.tested)]
        if found.point is not None:
            found.check = work.check(found.point)
    return found


class _Optimising:
    def __init__(self, spec: SearchSpec, goal: Minimise) -> None:
        keys, path = _keys_of(spec)
        study = study_of(spec, keys, path, goal.replications, spec.seed)
        base = Plan.made(study)
        metrics = [metric.name for metric in base.metrics]
        model = base.load(base.condition(0))
        self.name = model.name if path == FILE else study.name
        space = read_space(spec, model, (*metrics, *study.factors))
        if not space.axes:
            raise EpicycleError("there is nothing to vary\n   help: add --vary load=0.5..0.9")
        names, problems = [*metrics, *space.columns], Problems()
        flag = "--maximise" if isinstance(goal, Maximise) else "--minimise"
        self._objective = _formula(flag, goal.objective, names, problems, is_condition=False)
        conditions = {
            text: _formula("--subject-to", text, names, problems, is_condition=True) for text in goal.conditions
        }
        problems.raise_if_any()
        self._conditions = {text: each for text, each in conditions.items() if each is not None}
        runs = (goal.points + 1) * base.conditions * study.replications
        self.growing = Growing(study, keys, space, runs=runs, command=spec.continued_by)
        self.found = Optimum(goal, space, space.is_guided)

    @property
    def seed(self) -> int:
        """The seed of the study, which is that of the search."""
        return self.growing.study.seed

    def test(self, points: Sequence[Point]) -> list[Tested]:
        """Make the runs of some points, and judge them."""
        levels, replications = self.growing.levels(points), range(self.growing.study.replications)
        tested = []
        for level, rows in zip(levels, self.growing.runs(levels, lambda at: replications, lambda: None), strict=True):
            tested.append(Tested(len(self.found.tested) + 1, level, self._outcome(rows)))
            self.found.tested.append(tested[-1])
        return tested

    def check(self, best: Tested) -> Outcome:
        """What comes of a point with as many seeds again, which had no part in its choice."""
        count = self.growing.study.replications
        [rows] = self.growing.runs([best.level], lambda at: range(count, 2 * count), lambda: None)
        return self._outcome(rows)

    def _outcome(self, rows: Sequence[Mapping[str, Any]]) -> Outcome:
        """Conditions must hold in each run; the objective is a mean over runs, all conditions of a study alike."""
        by_replication: dict[int, list[float]] = {}
        missing = 0
        for row in rows:
            number = _value(self._objective, row)
            if is_usable(number):
                by_replication.setdefault(row["replication"], []).append(number)
            else:
                missing += 1
        means = [mean(each).value for each in by_replication.values()]
        broken = {
            text: len([row for row in rows if not _value(formula, row)]) for text, formula in self._conditions.items()
        }
        return Outcome(mean(means) if means and missing <= _SHARED * len(rows) else None, len(rows), broken)


def _keys_of(spec: SearchSpec) -> tuple[dict[str, Any], Path]:
    """The study that a search adds points to, as a mapping, and its file."""
    target = Path(spec.model)
    if not (is_study(target) if is_path(spec.model) else spec.model in packaged_files("study")):
        return spec.keys_of_study("optimisation"), FILE
    told = {"--disturb": spec.disturb, "--aspect": spec.aspects, "--without": spec.without_aspects}
    for flag, given in (told | {"--until": () if spec.until is None else (spec.until,)}).items():
        if given:
            raise EpicycleError(f"{flag} is for models: a study declares its own")
    study = read_study(spec.model)
    node = parse(study.text, str(study.path), Problems())
    whole: Any = plain(node) if node is not None else {}
    if "point" in (whole.get("vary") or {}):
        raise EpicycleError(f"{study.name} varies 'point', which is the name of what a search varies: rename it")
    left_out = ("claims", "guideline", "figures", "until")
    return {key: value for key, value in whole.items() if key not in left_out}, study.path


def _formula(flag: str, text: str, names: Sequence[str], problems: Problems, *, is_condition: bool) -> Formula | None:
    """An expression over columns of the table; what is wrong with it is added to the problems."""
    option = f"{flag} {text}"

    def at(offset: int, length: int) -> Position:
        return Position(COMMAND_LINE, 1, len(flag) + 2 + offset, max(length, 1), option)

    try:
        formula = Formula(text)
    except ExpressionError as error:
        problems.add(str(error), at(error.offset, error.length))
        return None
    for name in formula.names:
        if name not in names:
            message = f"there is no metric or varied parameter {name!r}{did_you_mean(name, names)}"
            problems.add(message, at(text.find(name), len(name)), f"known: {', '.join(names)}")
    if is_condition and not formula.is_condition:
        problems.add(f"{text!r} is not a condition", at(0, len(text)), "write a comparison such as 'longest_wait < 30'")
    return formula


def _value(formula: Formula | None, row: Mapping[str, Any]) -> Any:
    """An expression for one run; None if it failed or lacks a number."""
    assert formula is not None
    return value_in(formula, row) if row["status"] == OK else None
