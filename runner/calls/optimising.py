"""A search for the best parameters: what ``epicycle.optimise`` and the command do."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from epicycle.actors import abridged, counted

from ..bars import bar
from ..language.dimensions import split_number
from ..search import Goal, Interval, Optimum, Outcome, Tested
from ..search import optimise as search
from ..study import StudyResults, open_study, with_interval
from ..tables import Table, Tabled
from ..text.document import Scalar, plain
from .falsifying import as_ranges
from .studying import as_settings

SHOWN = 5  # points in the table


class Optimised(Tabled):
    """What a search for the best parameters has found.

    ``best`` are the parameters of the best point that was tried and meets all conditions, by their paths, or None;
    ``value`` is the mean of the objective there, and ``checked`` the same with new seeds.  ``sentence`` says it all,
    and ``results`` has all runs as a study has them.
    """

    def __init__(self, optimum: Optimum, folder: Path) -> None:
        self.optimum = optimum
        self.folder = folder
        found = optimum.best
        self.best = None if found is None else {each.path: plain(each.node) for each in found.level.settings}
        self.value = None if found is None or found.outcome.value is None else found.outcome.value
        self.checked = None if optimum.check is None else optimum.check.value

    @property
    def results(self) -> StudyResults:
        """All runs, by what was set."""
        return open_study(self.folder)

    @property
    def command(self) -> list[str]:
        """What sets the best parameters."""
        found = self.optimum.best
        return [] if found is None else [word for path, text in _set(found) for word in ("--set", f"{path}={text}")]

    @property
    def sentence(self) -> str:
        """What came of the search, in words."""
        return " ".join(self._sentences())

    def _sentences(self) -> Iterator[str]:
        optimum, goal = self.optimum, self.optimum.goal
        what, found = f"{'greatest' if goal.greatest else 'least'} {goal.objective}", optimum.best
        tried = counted(len(optimum.tested), "point")
        if found is None or self.value is None:
            yield f"None of {tried} has a mean of {goal.objective}" + (
                " and meets all conditions." if goal.subject_to else "."
            )
        else:
            where = ", ".join(f"{path}={text}" for path, text in _set(found))
            yield f"The {what} of {tried} is {with_interval(self.value)}, at {where} (point {found.number})."
            yield from self._check(optimum.check)
            for at in _at_ends(optimum, found):
                yield f"{at} is at the end of its range: the best may lie beyond."
        if broken := sum(any(each.outcome.broken.values()) for each in optimum.tested):
            yield f"{counted(broken, 'point')} break{'s' if broken == 1 else ''} a condition."
        if unknown := sum(each.outcome.value is None for each in optimum.tested):
            have = "has" if unknown == 1 else "have"
            yield f"{counted(unknown, 'point')} {have} no mean: runs failed or have no number."
        if not optimum.guided and any(isinstance(each, Interval) for each in optimum.space.axes):
            yield (
                "All points were spread evenly: the library that guides a search is not installed "
                "(pip install 'epicycle[falsify]')."
            )
        if found is not None:
            yield "There may be a better point that was not tried."

    def _check(self, check: Outcome | None) -> Iterator[str]:
        if check is None:
            return
        value = "no mean" if check.value is None else with_interval(check.value)
        broken = [f"{text} is broken in {number} of {check.runs}" for text, number in check.broken.items() if number]
        told = "; ".join([value, *broken])
        yield f"In {counted(check.runs, 'run')} with new seeds it is {told}."

    def facts(self) -> dict[str, Any]:
        """Everything that was found, for programs."""
        goal, found = self.optimum.goal, self.optimum.best

        def estimate(outcome: Outcome | None) -> dict[str, Any] | None:
            if outcome is None or outcome.value is None:
                return None
            value = outcome.value
            ends = [end if value.count > 1 else None for end in (value.low, value.high)]
            return {
                "value": value.value,
                "low": ends[0],
                "high": ends[1],
                "runs": outcome.runs,
                "broken": outcome.broken,
            }

        return {
            "objective": goal.objective,
            "greatest": goal.greatest,
            "subject_to": list(goal.subject_to),
            "best": self.best,
            "point": None if found is None else found.number,
            "mean": estimate(None if found is None else found.outcome),
            "checked": estimate(self.optimum.check),
            "points": len(self.optimum.tested),
            "command": self.command,
            "folder": str(self.folder),
        }

    def __repr__(self) -> str:
        return f"<Optimised: {self.sentence}>"

    def _caption(self) -> str:
        return self.sentence

    def _tables(self) -> list[Table]:
        distinct = {tuple(_set(each)): each for each in reversed(self.optimum.ranked)}
        first = sorted(distinct.values(), key=lambda each: (self.optimum.cost(each.outcome), each.number))[:SHOWN]
        head = ("point", *(axis.path for axis in self.optimum.space.axes), self.optimum.goal.objective)
        rows = [
            (str(each.number), *(text for _, text in _set(each)), with_interval(each.outcome.value))
            for each in first
            if each.outcome.value is not None
        ]
        return [Table(("set it by",), [(shlex.join(self.command),)] if rows else []), Table(head, rows)]


def optimise(
    target: str | Path,
    *,
    minimise: str = "",
    maximise: str = "",
    vary: Iterable[str] | Mapping[str, object] = (),
    subject_to: str | Iterable[str] = (),
    points: int = 200,
    replications: int | None = None,
    seed: int | None = None,
    out: str | Path | None = None,
    jobs: int | None = None,
    run_timeout: float | None = None,
    set: Iterable[str] | Mapping[str, object] = (),
    disturb: str | Path | Iterable[str | Path] = (),
    types: Iterable[str | Path] = (),
) -> Optimised:
    """Look for the parameters of a model or study for which the mean of a metric, or of an expression, is best.

    What is in ``vary`` is searched: ``{"load": "0.5..0.9", "policy": ["fifo", "lifo"]}``; all runs must meet the
    conditions ``subject_to``.  All runs are kept in a folder (default: results/NAME/optimisation), where a search that
    was killed continues.  The best point is run once more with new seeds, because its own runs chose it.

    >>> epicycle.optimise("mm1", minimise="mean_wait + 2 / mean_service", vary={"mean_service": "0.5 s..0.9 s"}).best
    """
    ranges = as_ranges(vary) if isinstance(vary, Mapping) else vary
    goal = Goal(
        str(target),
        minimise or maximise,
        bool(maximise),
        (subject_to,) if isinstance(subject_to, str) else tuple(subject_to),
        tuple(ranges),
        points,
        replications,
        seed,
        tuple(as_settings(set)),
        tuple(map(str, [disturb] if isinstance(disturb, (str, Path)) else disturb)),
        tuple(map(Path, types)),
    )
    return optimised(goal, out, jobs=jobs, timeout=run_timeout)


def optimised(
    goal: Goal, out: str | Path | None, *, jobs: int | None = None, timeout: float | None = None
) -> Optimised:
    """The same for what a command asks for."""
    folder = Path("results") / abridged(Path(goal.target).stem, 60) / "optimisation" if out is None else Path(out)
    with bar("optimise") as show:

        def tell(found: Optimum) -> None:
            if show is not None:
                best = found.best
                known = (
                    "" if best is None or best.outcome.value is None else f", best {with_interval(best.outcome.value)}"
                )
                show(float(len(found.tested)), float(goal.points), f"{len(found.tested):,} points{known}")

        return Optimised(search(goal, folder, jobs=jobs, timeout=timeout, tell=tell), folder)


def _set(point: Tested) -> Iterator[tuple[str, str]]:
    """What a point sets, as ``--set`` takes it."""
    for each in point.level.settings:
        yield each.path, each.node.text if isinstance(each.node, Scalar) else json.dumps(plain(each.node))


def _at_ends(optimum: Optimum, point: Tested) -> Iterator[str]:
    """The ranges that a point is at an end of, within a hundredth of their width."""
    for axis, setting in zip(optimum.space.axes, point.level.settings, strict=True):
        number = split_number(setting.node)
        if isinstance(axis, Interval) and number is not None:
            near = (axis.high - axis.low) / 100
            if min(number[0] - axis.low, axis.high - number[0]) < near:
                yield axis.path
