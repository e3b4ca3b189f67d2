"""What a search for the best parameters has found: all points, the best of them, and what came of it with new seeds."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import counted

from ..model.language.dimensions import Level, split_number
from ..model.text.document import plain
from ..study.inference import Estimate, with_interval
from ..support.tables import Table
from .answer import StudyAnswer
from .space import Interval, Space, as_set
from .spec import Maximise, Minimise

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
