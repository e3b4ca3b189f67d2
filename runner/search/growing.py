"""A study that grows: it gets points as a search chooses them, and its results folder is told of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import yaml

from ..model.language.dimensions import Level
from ..model.language.study import Study
from ..study.plan.plan import Plan, Search
from ..study.search_runs import SearchRuns
from .faults import FaultSpace
from .proposals import Point
from .space import Space, said

_GROWTH = 1.1  # of the number of points, after which the folder is told of them: each time, of all

Place = tuple[Any, ...]  # the values of a point, by which two points are the same


def place_of(level: Level) -> Place:
    """The values of a point."""
    return tuple(level.values.values())


class Growing:
    """The points of a space that were chosen, beside what a ``study`` varies of its own.

    ``keys`` are what its file says.  Raises ``ModelError`` unless the model loads at the ends of the space.
    """

    def __init__(self, study: Study, keys: Mapping[str, Any], space: Space | FaultSpace, search: Search) -> None:
        tried = Plan.made(replace(study, dimensions=(*space.ends(), *study.dimensions)))
        extra = {name: digest for each in tried.extra for more in each.values() for name, digest in more.items()}
        self.study = study
        self._keys = keys
        self._space = space
        self._base = replace(tried, study=study, sources=tried.sources | extra, search=search)
        self._levels: dict[Place, Level] = {}  # of all points, each once
        self._told = 0  # points that the folder knows

    def add(self, points: Sequence[Point]) -> tuple[list[Level], dict[Place, Level]]:
        """More points: each, and those of them that differ."""
        levels = [self._space.level(point) for point in points]
        distinct = {place_of(level): level for level in levels}
        self._levels |= distinct
        return levels, distinct

    def plan(self, levels: Sequence[Level]) -> Plan:
        """A plan of some points."""
        dimensions = (*self._space.dimensions(levels), *self.study.dimensions)
        return replace(self._base, study=replace(self.study, dimensions=dimensions), extra=[{} for _ in dimensions])

    def whole(self) -> Plan:
        """What a folder is to know: all points until now."""
        levels = list(self._levels.values())
        plan = self.plan(levels)
        return replace(plan, study=replace(plan.study, text=text_of(self._keys, levels)))

    def tell(self, made: SearchRuns, *, over: bool = False) -> None:
        """Tell the folder of the points, now and then while they grow, and when the search is over."""
        if over or len(self._levels) >= _GROWTH * self._told:
            self._told = len(self._levels)
            made.describe(self.whole())


def text_of(keys: Mapping[str, Any], levels: Sequence[Level]) -> str:
    """The study of some points, as its file would say it."""
    vary = {**said(levels), **(keys.get("vary") or {})}
    text: str = yaml.safe_dump(
        {**keys, **({"vary": vary} if vary else {})}, sort_keys=False, allow_unicode=True, width=1_000
    )
    return text
