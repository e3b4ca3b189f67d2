"""What figures and tables of a report are made of: the rows of a study at one moment, and how they are called."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import abridged, visible

from ...language import Factor
from ...shown import in_words, rounded
from ...study import OK, Estimate, Plan, StudyResults

MAX_LISTED = 12  # levels in a message
MAX_LABEL, MAX_LEVEL = 80, 40  # letters of a column's name, and of a level


@dataclass
class Condition:
    """A condition of which runs are over."""

    index: int
    values: dict[str, Factor]
    rows: list[dict[str, Any]] = field(default_factory=list)  # by replication

    @property
    def good(self) -> list[dict[str, Any]]:
        """The rows of the runs that came to their end."""
        return [row for row in self.rows if row["status"] == OK]

    def numbers(self, metric: str) -> list[float]:
        """The numbers of a metric; runs that failed or have none are left out."""
        values = (row[metric] for row in self.good)
        return [value for value in values if value is not None and math.isfinite(value)]


class Data:
    """The table of a study, read once: what is added while a report is made is in none of it."""

    def __init__(self, results: StudyResults) -> None:
        self.results = results.freeze()
        self.plan = results.plan
        self.names = Names(results.plan)
        self.conditions: dict[int, Condition] = {}
        for row in results.table().to_pylist():
            index = row["condition"]
            if index not in self.conditions:
                self.conditions[index] = Condition(index, self.plan.condition(index).values)
            self.conditions[index].rows.append(row)

    @property
    def rows(self) -> Iterable[dict[str, Any]]:
        """All runs, by condition and replication."""
        return (row for condition in self.conditions.values() for row in condition.rows)

    def where(self, fixed: Mapping[str, object]) -> list[Condition]:
        """The conditions that have these levels."""
        return [
            each for each in self.conditions.values() if all(_is_in(each.values[name], fixed[name]) for name in fixed)
        ]

    def levels(
        self, factor: str, conditions: Iterable[Condition] | None = None, fixed: Mapping[str, Any] | None = None
    ) -> list[Factor]:
        """The levels of a factor that occur in the conditions, in the order of the study, or of ``fixed``."""
        chosen = self.conditions.values() if conditions is None else conditions
        found = list(dict.fromkeys(each.values[factor] for each in chosen))
        order = (fixed or {}).get(factor)
        return sorted(found, key=order.index) if isinstance(order, list) else found


def _is_in(value: Factor, levels: object) -> bool:
    return value in levels if isinstance(levels, (list, tuple)) else value == levels


class Names:
    """How columns and levels are called in tables and figures."""

    def __init__(self, plan: Plan, labels: Mapping[str, str] | None = None) -> None:
        self._plan = plan
        self._labels = dict(labels or {})

    def called(self, labels: Mapping[str, str]) -> Names:
        """The same with further names for some columns."""
        return Names(self._plan, {**self._labels, **labels})

    def unit(self, column: str) -> str:
        """What a column counts in; nothing for a pure number."""
        found = self._plan.columns.get(column)
        return "" if found is None or found.unit == "1" else found.unit

    def doc(self, column: str) -> str:
        """What a column is."""
        found = self._plan.columns.get(column)
        return "" if found is None else found.doc

    def words(self, column: str) -> str:
        """A column's name, to be read."""
        return abridged(self._labels.get(column) or column.replace("_", " "), MAX_LABEL)

    def axis(self, column: str) -> str:
        """What stands at an axis: the name with its unit."""
        unit = self.unit(column)
        return f"{self.words(column)} ({unit})" if unit else self.words(column)

    def level(self, column: str, value: Factor) -> str:
        """A level with its unit: ``5 m``."""
        text = shown(value)
        unit = self.unit(column)
        return f"{text} {unit}" if unit and _is_number(value) else text

    def place(self, values: Mapping[str, Factor]) -> str:
        """Some levels: ``measurement range: 5 m, disturbance: 0``."""
        return ", ".join(f"{self.words(name)}: {self.level(name, value)}" for name, value in values.items())


def shown(value: Factor) -> str:
    """A level as people write it."""
    return abridged(visible(in_words(value)), MAX_LEVEL)


def estimated(estimate: Estimate) -> str:
    """A number with its interval, to two digits of that: ``4.81 ± 0.06``."""
    width = estimate.high - estimate.low
    if estimate.count == 0 or not math.isfinite(width) or width == 0:
        return rounded(estimate.value, width)
    return f"{rounded(estimate.value, width)} ± {rounded(width / 2, width)}"


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def is_numeric(plan: Plan, factor: str) -> bool:
    """Whether the levels of a factor are numbers."""
    return plan.study.factors[factor] in ("int", "float")


def mean_of(what: str) -> str:
    """What the mean of something is called; that of a mean is one, too."""
    return what if what.startswith("mean ") else f"mean {what}"
