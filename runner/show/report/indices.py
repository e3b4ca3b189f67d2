"""The section of a report on sensitivity: how much each parameter matters for each metric."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ...model.language.sampling import SOBOL
from ...support.html import Content, Html, note, tag, wide_table
from ...support.shown import rounded
from .data import Data, shown

_NOTES = {
    True: "Shares of the variance of the mean over the box, with 95 % intervals (bootstrap over the blocks of the "
    "design). first order: what the parameter causes alone. total: what it takes part in, alone or with others.",
    False: "Changes of the mean over the whole range of a parameter, with 95 % intervals (Student). mu star: the mean "
    "size. mu: the mean, in which rises and falls cancel. sigma: the deviation, which is large where the effect is not "
    "linear or depends on other parameters.",
}


def indices(data: Data) -> Iterable[Html]:
    """For each metric, a row for each parameter and a column for each index."""
    designs = [each.design for each in data.plan.study.dimensions if each.design is not None]
    if not designs or not data.conditions:
        return
    beside = [name for name in data.results.factors if all(name not in each.paths for each in designs)]
    for metric in data.results.metrics:
        heads: dict[str, None] = {}
        rows: dict[tuple[str, ...], list[Content]] = {}
        for row in data.results.sensitivity(metric):
            heads[row["index"].replace("_", " ")] = None
            place = (*(shown(row[name]) for name in beside), data.names.words(row["factor"]))
            rows.setdefault(place, [f"{row['count']:,}" + (f" ({row['missing']:,} missing)" if row["missing"] else "")])
            rows[place].insert(-1, _value(row["value"], row["low"], row["high"]))
        yield tag("h3", data.names.axis(metric))
        head = [*map(data.names.axis, beside), "varied", *heads, "blocks"]
        yield wide_table(head, [[*place, *cells] for place, cells in rows.items()], names=len(beside) + 1)
    for is_sobol in dict.fromkeys(each.form == SOBOL for each in designs):
        yield note(_NOTES[is_sobol])


def _value(value: float, low: float, high: float) -> Content:
    if math.isnan(value):
        return "–"
    if not math.isfinite(high - low):
        return f"{value:.3g}"
    ends = " to ".join(rounded(end, high - low) for end in (low, high))
    return [rounded(value, high - low), " ", tag("small", ends)]
