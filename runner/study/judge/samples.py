"""The numbers of a study by condition and replication, and its conditions by their levels."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache, cached_property
from itertools import product
from typing import TYPE_CHECKING, Any, TypeAlias

from epicycle.actors import EpicycleError
from epicycle.actors.expression import Formula

from ...model.language.claims import Selection
from ...model.language.dimensions import Factor
from ...model.language.study import Study
from ...model.language.study_metric import asks_for_none
from ..inference import LEVEL, Estimate, average, is_usable
from ..plan.plan import index_of
from ..run.backlog import OK

if TYPE_CHECKING:
    import pyarrow as pa

Levels: TypeAlias = dict[str, Factor]  # by factor
Place: TypeAlias = tuple[int, ...]  # a level of each dimension
MISSING = 0.05  # share of replications that may lack a number; beyond it, a mean is meaningless


class Samples:
    """The contents of a table, run by run, with failed runs and missing numbers marked."""

    def __init__(self, study: Study, table: pa.Table, shares: Collection[str] = ()) -> None:
        """``shares`` are the metrics that are true or false."""
        self.study = study
        self.shares = shares
        self.dimensions = study.dimensions
        self._column = cache(lambda name: table[name].to_pylist())
        self.runs: dict[int, dict[int, int | None]] = {}  # rows, by condition and replication
        statuses = zip(*(table[name].to_pylist() for name in ("condition", "replication", "status")), strict=True)
        for row, (condition, replication, status) in enumerate(statuses):
            self.runs.setdefault(condition, {})[replication] = row if status == OK else None

    @cached_property
    def _levels(self) -> list[list[Levels]]:
        return [[each.level(index).values for index in range(each.size)] for each in self.dimensions]

    # -- conditions -----------------------------------------------------------------------------------------------

    def choices(self, where: Selection) -> list[list[int]]:
        """The levels of each dimension that a selection allows."""

        def fits(values: Levels) -> bool:
            return all(values[factor] in levels for factor, levels in where.items() if factor in values)

        return [[index for index, values in enumerate(levels) if fits(values)] for levels in self._levels]

    def homes(self, factors: Iterable[str]) -> list[int]:
        """The dimensions by which factors are varied, in the order of the study."""
        wanted = set(factors)
        return [home for home, each in enumerate(self.dimensions) if wanted & each.columns.keys()]

    def places(self, choices: Sequence[Sequence[int]], fixed: Iterable[int] = ()) -> list[Place]:
        """All combinations of levels, with the first level of ``fixed`` dimensions."""
        held = set(fixed)
        return list(product(*((0,) if home in held else levels for home, levels in enumerate(choices))))

    def values(self, place: Place, homes: Iterable[int] | None = None) -> Levels:
        """The values of a combination of levels, or those that these dimensions set."""
        wanted = range(len(place)) if homes is None else homes
        return {name: value for home in wanted for name, value in self._levels[home][place[home]].items()}

    def levels(self, factors: Iterable[str]) -> list[Levels]:
        """All existing combinations of the values of some factors; an empty one, if there are no factors."""
        wanted = list(factors)
        lists = []
        for home in self.homes(wanted):
            names = [name for name in wanted if name in self.dimensions[home].columns]
            distinct = dict.fromkeys(tuple(values[name] for name in names) for values in self._levels[home])
            lists.append([dict(zip(names, each, strict=True)) for each in distinct])
        return [{name: value for part in parts for name, value in part.items()} for parts in product(*lists)]

    def level(self, home: int, index: int, factor: str) -> Factor:
        """The value of a factor at a level of its dimension."""
        return self._levels[home][index][factor]

    # -- numbers --------------------------------------------------------------------------------------------------

    def at(self, place: Place) -> int:
        """The condition with these levels, by its number."""
        return index_of(place, self.dimensions)

    def over(self, condition: int) -> dict[int, int | None]:
        """The rows of a condition's finished runs, by replication; None for failed ones."""
        return self.runs.get(condition, {})

    def numbers(self, condition: int, metric: str) -> dict[int, float]:
        """The numbers of a metric of which statistics can be made, by replication."""
        column = self._column(metric)
        values = {one: None if row is None else column[row] for one, row in self.over(condition).items()}
        return {one: value for one, value in values.items() if is_usable(value)}

    def average(self, condition: int, metric: str, level: float = LEVEL) -> Estimate:
        """The mean of a metric with its interval; of one that is true or false, a share."""
        return average([*self.numbers(condition, metric).values()], level, is_share=metric in self.shares)

    def rows(self, condition: int, metrics: Iterable[str]) -> list[dict[str, float | None] | None]:
        """The metrics of each finished run, None where there is no number; None for a failed run."""
        columns = {name: self._column(name) for name in metrics}

        def number(value: float | None) -> float | None:
            return None if value is None or math.isnan(value) else value

        return [
            None if row is None else {name: number(column[row]) for name, column in columns.items()}
            for row in self.over(condition).values()
        ]


def value_in(formula: Formula, row: Mapping[str, Any]) -> Any:
    """An expression over the columns of a run; None if it lacks a number, or cannot be evaluated for this run."""
    known = {name: row[name] for name in formula.names}
    if None in known.values() and not asks_for_none(formula.source):
        return None
    try:
        return formula(known)
    except EpicycleError:
        return None


def has_enough(count: int, missing: int) -> bool:
    """Whether few enough numbers are missing for their mean to be meaningful."""
    return count > 1 and missing <= MISSING * (count + missing)
