"""Figures of the table of a study: means with their intervals, and distributions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from textwrap import fill
from typing import Any

from epicycle.actors import Parameter, counted, texts_parameter

from ...language import Factor
from ...study import Plan, mean
from .data import Condition, Data, Names, is_numeric
from .figure import Complaint, Layout, Panel, Roles, RunKey, StudyFigure, layout, roles, unknown
from .style import DASHES, LIMIT, MARKERS, PALETTE, Sheet

BOXES, CURVES = "boxes", "curves"


class TableFigure(StudyFigure):
    """Base of the figures that are drawn from the table alone."""

    lines: Parameter[str | None] = Parameter(
        str, None, doc="factor with a line or colour for each level; the next one if left out"
    )
    panels = texts_parameter((), doc="factors with a panel for each level; all that are left, if left out")

    def complaints(self, plan: Plan) -> Iterator[Complaint]:
        yield from super().complaints(plan)
        factors = list(plan.study.factors)
        yield from unknown("lines", [self.lines] if self.lines else [], factors, "factor")
        yield from unknown("panels", self.panels, factors, "factor")


class Means(TableFigure):
    """The mean of a metric over a factor, with 95 % intervals (Student): a line for each level of another factor, and
    a panel for each level of a third."""

    metric = Parameter(str, doc="column of the table")
    over: Parameter[str | None] = Parameter(
        str, None, doc="factor along the axis; the first one that is a number, if left out"
    )
    same_scale = Parameter(bool, True, doc="whether all panels have the same vertical axis")

    def complaints(self, plan: Plan) -> Iterator[Complaint]:
        yield from super().complaints(plan)
        yield from unknown("metric", [self.metric], [metric.name for metric in plan.metrics], "metric")
        yield from unknown("over", [self.over] if self.over else [], list(plan.study.factors), "factor")

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        names, chosen = self.names(data), self.conditions(data)
        found = roles(data.plan, self.where, self.over, self.lines, self.panels, has_axis=True)
        arranged = layout(data, self, found)
        sheet = Sheet(
            [panel.title for panel in arranged.panels] or [""], columns=arranged.columns, same_y=self.same_scale
        )
        axis = _Axis(data, names, found.over, chosen)
        handles: dict[str, Any] = {}
        for axes, panel in zip(sheet.axes, arranged.panels, strict=False):
            for number, (level, conditions) in enumerate(panel.lines.items()):
                line = self._line(axes, axis, conditions, number, len(arranged.levels))
                if found.lines:
                    handles.setdefault(names.level(found.lines, level), line)
            axis.dress(axes)
        sheet.call_axes(names.axis(found.over) if found.over else "", mean_of(names.axis(self.metric)))
        sheet.legend(list(handles.values()), list(handles), names.words(found.lines) if found.lines else "")
        sheet.save(paths)
        return " ".join(
            part
            for part in (
                f"{mean_of(names.words(self.metric)).capitalize()} with its 95 % interval (Student).",
                counts(chosen, [self.metric]),
                arranged.omitted,
            )
            if part
        )

    def _line(self, axes: Any, axis: _Axis, conditions: list[Condition], number: int, lines: int) -> Any:
        points = []
        for condition in conditions:
            estimate = mean(numbers(condition, self.metric))
            if estimate.count:
                half = estimate.high - estimate.value
                points.append((axis.place(condition), estimate.value, half if math.isfinite(half) else 0.0))
        if axis.is_numeric:
            points.sort()
        shift = axis.step * 0.06 * (number - (lines - 1) / 2)  # so that intervals stand beside each other
        where = [place + shift for place, _, _ in points]
        return axes.errorbar(
            where,
            [value for _, value, _ in points],
            yerr=[half for _, _, half in points],
            color=PALETTE[number],
            marker=MARKERS[number],
            linestyle=DASHES[number] if axis.is_connected else "none",
            capsize=2.2,
            elinewidth=1.0,
        )


class Distributions(TableFigure):
    """How metrics are distributed over runs: boxes along a factor, or curves of the share of runs up to a value.

    A box holds the middle half of the runs, with the median as a line; the whiskers hold nine tenths, and every run
    beyond them is a dot.
    """

    metrics = texts_parameter(doc="columns of the table, each with panels of its own")
    style = Parameter(str, BOXES, choices=(BOXES, CURVES), doc="what is drawn")
    over: Parameter[str | None] = Parameter(
        str, None, doc="factor along the axis of boxes; the first one that is a number, if left out"
    )
    limit: Parameter[float | None] = Parameter(float, None, doc="a value with a line, such as a distance to be kept")

    def complaints(self, plan: Plan) -> Iterator[Complaint]:
        yield from super().complaints(plan)
        yield from unknown("metrics", self.metrics, [metric.name for metric in plan.metrics], "metric")
        yield from unknown("over", [self.over] if self.over else [], list(plan.study.factors), "factor")
        if not self.metrics:
            yield Complaint("metrics", "there is no metric in it", "name one at least")

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        names, chosen = self.names(data), self.conditions(data)
        has_axis = self.style == BOXES
        found = roles(
            data.plan, self.where, self.over if has_axis else None, self.lines, self.panels, has_axis=has_axis
        )
        arranged = layout(data, self, found)
        panels = [(metric, panel) for metric in self.metrics for panel in arranged.panels] or [("", Panel("", {}))]
        across = len(arranged.panels)
        is_grid = len(self.metrics) > 1 and 1 < across <= 4  # a row for each metric
        sheet = Sheet(
            [panel.title for _, panel in panels],
            columns=across if is_grid else min(len(self.metrics), 3) if across == 1 else arranged.columns,
            same_y="row" if is_grid else len(self.metrics) == 1,
        )
        handles: dict[str, Any] = {}
        draw = self._boxes if has_axis else self._curves
        for axes, (metric, panel) in zip(sheet.axes, panels, strict=True):
            for label, handle in draw(axes, data, names, metric, panel, found, arranged).items():
                handles.setdefault(label, handle)
        if is_grid or len(self.metrics) == 1:  # the panels of a row have one axis
            for axes in sheet.axes:
                axes.label_outer(remove_inner_ticks=False)
        sheet.legend(list(handles.values()), list(handles), names.words(found.lines) if found.lines else "")
        sheet.save(paths)
        parts = [
            "Boxes: the middle half of the runs with the median; whiskers: nine tenths; dots: the runs beyond."
            if has_axis
            else "Share of the runs whose value is no greater.",
            counts(chosen, self.metrics),
            *(self._beyond(chosen, names, metric) for metric in self.metrics),
            arranged.omitted,
        ]
        return " ".join(part for part in parts if part)

    def _beyond(self, chosen: list[Condition], names: Names, metric: str) -> str:
        if self.limit is None:
            return ""
        values = [value for condition in chosen for value in numbers(condition, metric)]
        below = sum(value < self.limit for value in values)
        unit = names.unit(metric)
        limit = f"{self.limit:g}{f' {unit}' if unit else ''}"
        return f"Below {limit}: {names.words(metric)} of {below:,} of {counted(len(values), 'run')}."

    def _boxes(
        self, axes: Any, data: Data, names: Names, metric: str, panel: Panel, found: Roles, arranged: Layout
    ) -> dict[str, Any]:
        from matplotlib.patches import Patch

        levels = data.levels(found.over, self.conditions(data), self.where) if found.over else [None]
        lines = len(arranged.levels)
        width = 0.8 / lines
        handles: dict[str, Any] = {}
        for number, (line, conditions) in enumerate(panel.lines.items()):
            colour = PALETTE[number]
            groups = {
                place: [
                    value
                    for condition in conditions
                    if not found.over or condition.values[found.over] == level
                    for value in numbers(condition, metric)
                ]
                for place, level in enumerate(levels)
            }
            groups = {place: values for place, values in groups.items() if values}
            if groups:
                axes.boxplot(
                    list(groups.values()),
                    positions=[place + width * (number - (lines - 1) / 2) for place in groups],
                    widths=0.8 * width,
                    whis=(5, 95),
                    manage_ticks=False,
                    patch_artist=True,
                    boxprops={"facecolor": colour, "alpha": 0.35, "edgecolor": colour, "linewidth": 0.8},
                    medianprops={"color": colour, "linewidth": 1.6},
                    whiskerprops={"color": colour, "linewidth": 0.9},
                    capprops={"color": colour, "linewidth": 0.9},
                    flierprops={"marker": ".", "markersize": 3.5, "markerfacecolor": colour, "markeredgewidth": 0},
                )
            if found.lines:
                handles[names.level(found.lines, line)] = Patch(facecolor=colour, alpha=0.5, edgecolor=colour)
        axes.set_xlim(-0.6, len(levels) - 0.4)
        every = -(-len(levels) // 16)
        texts = [names.level("", level) if found.over else "" for level in levels[::every]]
        _texts_along(axes, range(0, len(levels), every), texts)
        axes.set_xlabel(names.axis(found.over) if found.over else "")
        axes.set_ylabel(fill(names.axis(metric), 30))
        axes.grid(axis="x", visible=False)
        if self.limit is not None:
            axes.axhline(self.limit, color=LIMIT, linewidth=1.0, zorder=1)
        return handles

    def _curves(
        self, axes: Any, data: Data, names: Names, metric: str, panel: Panel, found: Roles, arranged: Layout
    ) -> dict[str, Any]:
        handles: dict[str, Any] = {}
        for number, (line, conditions) in enumerate(panel.lines.items()):
            values = sorted(value for condition in conditions for value in numbers(condition, metric))
            if not values:
                continue
            shares = [(place + 1) / len(values) for place in range(len(values))]
            (curve,) = axes.plot(
                [values[0], *values],
                [0.0, *shares],
                drawstyle="steps-post",
                color=PALETTE[number],
                linestyle=DASHES[number],
            )
            if found.lines:
                handles[names.level(found.lines, line)] = curve
        axes.set_ylim(0.0, 1.02)
        axes.set_xlabel(names.axis(metric))
        axes.set_ylabel("share of runs")
        if self.limit is not None:
            axes.axvline(self.limit, color=LIMIT, linewidth=1.0, zorder=1)
        return handles


def mean_of(what: str) -> str:
    """What the mean of something is called; that of a mean is one, too."""
    return what if what.startswith("mean ") else f"mean {what}"


def numbers(condition: Condition, metric: str) -> list[float]:
    """The numbers of a metric in a condition; runs that failed or have none are left out."""
    values = (row[metric] for row in condition.good)
    return [value for value in values if value is not None and math.isfinite(value)]


def counts(chosen: Sequence[Condition], metrics: Sequence[str]) -> str:
    """How many runs stand behind a figure, and how many are in none of its numbers."""
    runs = sum(len(condition.rows) for condition in chosen)
    bad = runs - sum(len(condition.good) for condition in chosen)
    parts = [f"{counted(runs, 'run')} in {counted(len(chosen), 'condition')}"]
    if bad:
        parts.append(f"{bad:,} of them failed")
    for metric in metrics:
        missing = runs - bad - sum(len(numbers(condition, metric)) for condition in chosen)
        if missing:
            parts.append(f"{missing:,} have no {metric}")
    return f"{', '.join(parts)}."


class _Axis:
    """Where conditions stand along the horizontal axis."""

    def __init__(self, data: Data, names: Names, factor: str | None, chosen: Sequence[Condition]) -> None:
        self._factor = factor
        self._levels: list[Factor] = data.levels(factor, chosen) if factor else [None]
        self._texts = [names.level("", level) if factor else "" for level in self._levels]
        self.is_numeric = bool(factor) and is_numeric(data.plan, str(factor)) and None not in self._levels
        places = sorted({self.of(level) for level in self._levels})
        gaps = [after - before for before, after in pairwise(places)]
        self.step = min(gaps, default=1.0)
        dimension = next((each for each in data.plan.study.dimensions if factor in each.columns), None)
        # The points of a hypercube come in no order.
        self.is_connected = dimension is not None and (len(dimension.columns) == 1 or places == self.given())

    def given(self) -> list[float]:
        """The places in the order of the study."""
        return [self.of(level) for level in self._levels]

    def of(self, level: Factor) -> float:
        """The place of a level."""
        if self.is_numeric and isinstance(level, (int, float)):
            return float(level)
        return float(self._levels.index(level))

    def place(self, condition: Condition) -> float:
        """The place of a condition."""
        return self.of(condition.values[self._factor]) if self._factor else 0.0

    def dress(self, axes: Any) -> None:
        """Ticks where levels are, if they are few."""
        places = self.given()
        if len(places) <= 12:
            _texts_along(axes, places, self._texts)
        if not self.is_numeric:
            axes.set_xlim(-0.5, len(places) - 0.5)


def _texts_along(axes: Any, places: Sequence[float], texts: Sequence[str]) -> None:
    turned = max(map(len, texts), default=0) * len(texts) > 60
    axes.set_xticks(places, texts, rotation=30 if turned else 0, ha="right" if turned else "center")
