"""The numbers of a study by condition and replication, and its conditions by the levels that they have."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, TypeAlias

from ..language import Factor, Selection
from .schedule import OK

if TYPE_CHECKING:
    from .results import StudyResults

Place: TypeAlias = tuple[int, ...]  # a level of each dimension
MISSING = 0.05  # of the replications may be without a number, or else a mean says nothing


class Samples:
    """What a table holds, run by run; those that failed or have no number are known as such."""

    def __init__(self, results: StudyResults) -> None:
        self.dimensions = results.plan.study.dimensions
        self._levels = [[each.level(index).values for index in range(each.size)] for each in self.dimensions]
        table = results.table()
        self._columns = {name: [_number(each) for each in table[name].to_pylist()] for name in results.metrics}
        self._rows: dict[int, dict[int, int | None]] = {}
        for row, (condition, replication, status) in enumerate(
            zip(*(table[name].to_pylist() for name in ("condition", "replication", "status")), strict=True)
        ):
            self._rows.setdefault(condition, {})[replication] = row if status == OK else None

    # -- conditions -----------------------------------------------------------------------------------------------

    def choices(self, where: Selection) -> list[list[int]]:
        """The levels of each dimension that a selection allows."""
        return [[index for index, values in enumerate(levels) if _fits(values, where)] for levels in self._levels]

    def homes(self, factors: Iterable[str]) -> list[int]:
        """The dimensions by which factors are varied, in the order of the study."""
        wanted = set(factors)
        return [home for home, each in enumerate(self.dimensions) if wanted & each.columns.keys()]

    def places(self, choices: Sequence[Sequence[int]], fixed: Mapping[int, int] | None = None) -> list[Place]:
        """All combinations of levels, with those of ``fixed`` dimensions as given."""
        given = fixed or {}
        return list(product(*([given[home]] if home in given else levels for home, levels in enumerate(choices))))

    def values(self, place: Place, homes: Iterable[int] | None = None) -> dict[str, Factor]:
        """What a combination of levels is, or as much of it as these dimensions say."""
        wanted = range(len(place)) if homes is None else homes
        return {name: value for home in wanted for name, value in self._levels[home][place[home]].items()}

    def levels(self, factors: Iterable[str]) -> list[dict[str, Factor]]:
        """All combinations of the values of some factors that there are; one without any, if there are no factors."""
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

    def condition(self, place: Place) -> int:
        """The number of a condition; the last dimension changes fastest."""
        found = 0
        for dimension, index in zip(self.dimensions, place, strict=True):
            found = found * dimension.size + index
        return found

    # -- numbers --------------------------------------------------------------------------------------------------

    def over(self, place: Place) -> set[int]:
        """The replications that are over, whatever came of them."""
        return set(self._rows.get(self.condition(place), ()))

    def numbers(self, place: Place, metric: str) -> dict[int, float]:
        """The finite numbers of a metric by replication."""
        column = self._columns[metric]
        found = {}
        for replication, row in self._rows.get(self.condition(place), {}).items():
            value = None if row is None else column[row]
            if value is not None and math.isfinite(value):
                found[replication] = value
        return found

    def rows(self, place: Place, metrics: Iterable[str]) -> list[dict[str, float | None] | None]:
        """The metrics of each run that is over; None for one that failed."""
        wanted = list(metrics)
        rows = self._rows.get(self.condition(place), {}).values()
        return [None if row is None else {name: self._columns[name][row] for name in wanted} for row in rows]


def _number(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else value


def _fits(values: Mapping[str, Factor], where: Selection) -> bool:
    return all(values[factor] in levels for factor, levels in where.items() if factor in values)
