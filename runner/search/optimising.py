"""Optimise: look for the parameters with the best mean, and keep all runs in the results folder of a study."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, did_you_mean
from epicycle.actors.expression import ExpressionError, Formula

from ..model.catalogue.packaged import is_path, packaged_files
from ..model.language.study import is_study, read_study
from ..model.text.document import parse, plain
from ..model.text.files import COMMAND_LINE
from ..model.text.problems import Position, Problems
from ..study.inference import mean, with_interval
from ..study.judge.samples import value_in
from ..study.plan.plan import Plan
from ..study.run.backlog import OK
from ..support.bars import Show, unseen
from .growing import Growing, study_of
from .optimum import Optimum, Outcome, Tested
from .proposals import Point, proposals
from .space import SearchSpec, read_space
from .spec import Maximise, Minimise, results_folder

FILE = Path("optimise")  # the file of the study of a search over a model: paths are relative to the working directory
_SHARED = 0.05  # of the runs may be without a number
_TOGETHER = 8  # points that are chosen together when the search is guided; more are quicker only on many cores


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
    chosen = proposals(found.space.widths, work.seed, found.guided, _TOGETHER)
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
            if number is None or not math.isfinite(number):
                missing += 1
            else:
                by_replication.setdefault(row["replication"], []).append(number)
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
