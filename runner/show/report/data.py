"""The data of a report: the rows of a study at one moment, and the names of its columns and levels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any

from epicycle.actors import abridged, visible

from ...model.language.dimensions import Factor
from ...study.inference import Estimate, average, is_usable
from ...study.judge.study_results import StudyResults
from ...study.plan.columns import Column
from ...study.plan.plan import Plan
from ...study.run.backlog import OK
from ...support.shown import in_words

MAX_LISTED = 12  # levels in a message
MAX_LABEL, MAX_LEVEL = 80, 40  # letters of a column's name, and of a level


@dataclass
class Condition:
    """A condition with finished runs."""

    index: int
    values: dict[str, Factor]
    rows: list[dict[str, Any]]  # by replication

    @property
    def good(self) -> list[dict[str, Any]]:
        """The rows of the runs that finished without an error."""
        return [row for row in self.rows if row["status"] == OK]

    def numbers(self, metric: str) -> list[float]:
        """The values of a metric; runs that failed or have none are left out."""
        values = (row[metric] for row in self.good)
        return [value for value in values if is_usable(value)]


class Data:
    """The table of a study, read once: rows added while the report is made are not included."""

    def __init__(self, results: StudyResults) -> None:
        self.results = results.freeze()
        self.plan = results.plan
        self.names = Names(results.plan, {})
        self.rows = results.table().to_pylist()  # by condition and replication
        self.conditions: dict[int, Condition] = {}
        for index, rows in groupby(self.rows, key=itemgetter("condition")):
            self.conditions[index] = Condition(index, self.plan.condition(index).values, [*rows])

    def average(self, condition: Condition, metric: str) -> Estimate:
        """The mean of a metric with its interval; of one that is true or false, a share."""
        return average(condition.numbers(metric), is_share=metric in self.plan.shares)

    def where(self, fixed: Mapping[str, Any]) -> list[Condition]:
        """The conditions with these levels."""
        allowed = {name: levels if isinstance(levels, (list, tuple)) else (levels,) for name, levels in fixed.items()}
        return [
            each for each in self.conditions.values() if all(each.values[name] in allowed[name] for name in allowed)
        ]

    def levels(
        self, factor: str, conditions: Iterable[Condition] | None = None, fixed: Mapping[str, Any] | None = None
    ) -> list[Factor]:
        """The levels of a factor that occur in the conditions, in the order of the study, or of ``fixed``."""
        chosen = self.conditions.values() if conditions is None else conditions
        found = list(dict.fromkeys(each.values[factor] for each in chosen))
        order = (fixed or {}).get(factor)
        return sorted(found, key=order.index) if isinstance(order, list) else found


@dataclass(frozen=True)
class Names:
    """The names of columns and levels in tables and figures."""

    plan: Plan
    labels: Mapping[str, str]

    def unit(self, column: str) -> str:
        """The unit of a column; empty for a pure number."""
        unit = self.plan.columns.get(column, Column()).unit
        return "" if unit == "1" else unit

    def doc(self, column: str) -> str:
        """The description of a column."""
        return self.plan.columns.get(column, Column()).doc

    def words(self, column: str) -> str:
        """The name of a column."""
        label = self.labels.get(column) or self.plan.columns.get(column, Column()).label
        return abridged(label or column.replace("_", " "), MAX_LABEL)

    def axis(self, column: str) -> str:
        """The label of an axis: the name with its unit."""
        unit = self.unit(column)
        return f"{self.words(column)} ({unit})" if unit else self.words(column)

    def level(self, column: str, value: Factor) -> str:
        """A level with its unit: ``5 m``."""
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return f"{shown(value)} {self.unit(column)}".rstrip() if is_number else shown(value)

    def place(self, values: Mapping[str, Factor]) -> str:
        """Several levels: ``measurement range: 5 m, disturbance: 0``."""
        return ", ".join(f"{self.words(name)}: {self.level(name, value)}" for name, value in values.items())


def shown(value: Factor) -> str:
    """A level in the form that people write."""
    return abridged(visible(in_words(value)), MAX_LEVEL)


def is_numeric(plan: Plan, factor: str) -> bool:
    """Whether the levels of a factor are numbers."""
    return plan.study.factors[factor] in ("int", "float")


def mean_of(what: str) -> str:
    """The name of the mean of something; the mean of a mean is called a mean, too."""
    return what if what.startswith("mean ") else f"mean {what}"
