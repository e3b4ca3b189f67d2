"""Figures of the table of a study: means with their intervals, and distributions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from textwrap import fill
from typing import Any

from epicycle.actors import Parameter, counted, texts_parameter

from ...build import Complaint
from ...language import Factor
from ...study import Plan, mean
from ..sheet import DASHES, LIMIT, MARKERS, PALETTE
from .data import Condition, Data, is_numeric, mean_of
from .figure import Layout, Panel, RunKey, StudyFigure

BOXES, CURVES = "boxes", "curves"


class TableFigure(StudyFigure):
    """Base of the figures that are drawn from the table alone."""

    lines: Parameter[str | None] = Parameter(
        str, None, doc="factor with a line or colour for each level; the next one if left out"
    )
    panels = texts_parameter((), doc="factors with a panel for each level; all that are left, if left out")


class Means(TableFigure):
    """The mean of a metric over a factor, with 95 % intervals (Student): a line for each level of another factor, and
    a panel for each level of a third."""

    metric = Parameter(str, doc="column of the table")
    over: Parameter[str | None] = Parameter(
        str, None, doc="factor along the axis; the first one that is a number, if left out"
    )
    same_scale = Parameter(bool, True, doc="whether all panels have the same vertical axis")

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        arranged = self.arranged(data, has_axis=True)
        names, over = arranged.names, arranged.roles.over
        sheet = arranged.sheet(same_y=self.same_scale)
        axis = _Axis(data, arranged)
        for axes, panel in zip(sheet.axes, arranged.panels, strict=False):
            for number, (level, conditions) in enumerate(panel.lines.items()):
                arranged.show(level, self._line(axes, axis, conditions, number, len(arranged.levels)))
            axis.dress(axes)
        sheet.call_axes(names.axis(over) if over else "", mean_of(names.axis(self.metric)))
        what = f"{mean_of(names.words(self.metric)).capitalize()} with its 95 % interval (Student)."
        return arranged.finish(sheet, paths, what, counts(arranged.chosen, [self.metric]))

    def _line(self, axes: Any, axis: _Axis, conditions: list[Condition], number: int, lines: int) -> Any:
        points = []
        for condition in conditions:
            estimate = mean(condition.numbers(self.metric))
            if estimate.count:
                half = estimate.high - estimate.value
                points.append((axis.place(condition), estimate.value, half if math.isfinite(half) else 0.0))
        if axis.is_numeric:
            points.sort()
        shift = axis.step * 0.06 * (number - (lines - 1) / 2)  # so that intervals stand beside each other
        return axes.errorbar(
            [place + shift for place, _, _ in points],
            [value for _, value, _ in points],
            yerr=[half for _, _, half in points],
            color=PALETTE[number],
            marker=MARKERS[number],
            linestyle=DASHES[number] if axis.is_connected else "none",
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
        if not self.metrics:
            yield Complaint("metrics", "there is no metric in it", "name one at least")

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        has_axis = self.style == BOXES
        arranged = self.arranged(data, has_axis=has_axis)
        panels = [(metric, panel) for metric in self.metrics for panel in arranged.panels] or [("", Panel("", {}))]
        across = len(arranged.panels)
        is_grid = len(self.metrics) > 1 and 1 < across <= 4  # a row for each metric
        sheet = arranged.sheet(
            panels=[panel.title for _, panel in panels],
            columns=across if is_grid else min(len(self.metrics), 3) if across == 1 else arranged.columns,
            same_y="row" if is_grid else len(self.metrics) == 1,
        )
        for axes, (metric, panel) in zip(sheet.axes, panels, strict=True):
            if has_axis:
                self._boxes(axes, data, metric, panel, arranged)
            else:
                self._curves(axes, metric, panel, arranged)
        if is_grid or len(self.metrics) == 1:  # the panels of a row have one axis
            for axes in sheet.axes:
                axes.label_outer(remove_inner_ticks=False)
        boxes = "Boxes: the middle half of the runs with the median; whiskers: nine tenths; dots: the runs beyond."
        said = [boxes if has_axis else "Share of the runs whose value is no greater."]
        said.append(counts(arranged.chosen, self.metrics))
        if self.limit is not None:
            for metric in self.metrics:
                values, names = _numbers(arranged.chosen, metric), arranged.names
                below, runs = sum(value < self.limit for value in values), counted(len(values), "run")
                said.append(f"Below {names.level(metric, self.limit)}: {names.words(metric)} of {below:,} of {runs}.")
        return arranged.finish(sheet, paths, *said)

    def _boxes(self, axes: Any, data: Data, metric: str, panel: Panel, arranged: Layout) -> None:
        from matplotlib.patches import Patch

        names, over, lines = arranged.names, arranged.roles.over, len(arranged.levels)
        levels = data.levels(over, arranged.chosen, self.where) if over else [None]
        width = 0.8 / lines
        for number, (line, conditions) in enumerate(panel.lines.items()):
            colour = PALETTE[number]
            groups: dict[int, list[float]] = {}
            for place, level in enumerate(levels):
                here = [each for each in conditions if not over or each.values[over] == level]
                if values := _numbers(here, metric):
                    groups[place] = values
            if groups:
                axes.boxplot(
                    list(groups.values()),
                    positions=[place + width * (number - (lines - 1) / 2) for place in groups],
                    widths=0.8 * width,
                    manage_ticks=False,
                    patch_artist=True,
                    boxprops={"facecolor": colour, "alpha": 0.35, "edgecolor": colour},
                    medianprops={"color": colour},
                    whiskerprops={"color": colour},
                    capprops={"color": colour},
                    flierprops={"markerfacecolor": colour},
                )
            arranged.show(line, Patch(facecolor=colour, alpha=0.5, edgecolor=colour))
        axes.set_xlim(-0.6, len(levels) - 0.4)
        _texts_along(axes, range(len(levels)), [names.level("", level) if over else "" for level in levels])
        axes.set_xlabel(names.axis(over) if over else "")
        axes.set_ylabel(fill(names.axis(metric), 30))
        axes.grid(axis="x", visible=False)
        if self.limit is not None:
            axes.axhline(self.limit, color=LIMIT, linewidth=1.0, zorder=1)

    def _curves(self, axes: Any, metric: str, panel: Panel, arranged: Layout) -> None:
        for number, (line, conditions) in enumerate(panel.lines.items()):
            if values := sorted(_numbers(conditions, metric)):
                shares = [place / len(values) for place in range(len(values) + 1)]
                look = {"drawstyle": "steps-post", "color": PALETTE[number], "linestyle": DASHES[number]}
                (curve,) = axes.plot([values[0], *values], shares, **look)
                arranged.show(line, curve)
        axes.set_ylim(0.0, 1.02)
        axes.set_xlabel(arranged.names.axis(metric))
        axes.set_ylabel("share of runs")
        if self.limit is not None:
            axes.axvline(self.limit, color=LIMIT, linewidth=1.0, zorder=1)


def _numbers(conditions: Sequence[Condition], metric: str) -> list[float]:
    return [value for condition in conditions for value in condition.numbers(metric)]


def counts(chosen: Sequence[Condition], metrics: Sequence[str]) -> str:
    """How many runs stand behind a figure, and how many are in none of its numbers."""
    runs = sum(len(condition.rows) for condition in chosen)
    bad = runs - sum(len(condition.good) for condition in chosen)
    parts = [f"{counted(runs, 'run')} in {counted(len(chosen), 'condition')}"]
    if bad:
        parts.append(f"{bad:,} of them failed")
    for metric in metrics:
        if missing := runs - bad - len(_numbers(chosen, metric)):
            parts.append(f"{missing:,} have no {metric}")
    return f"{', '.join(parts)}."


class _Axis:
    """Where conditions stand along the horizontal axis."""

    def __init__(self, data: Data, arranged: Layout) -> None:
        self._factor = factor = arranged.roles.over
        self._levels: list[Factor] = data.levels(factor, arranged.chosen) if factor else [None]
        self._texts = [arranged.names.level("", level) if factor else "" for level in self._levels]
        self.is_numeric = factor is not None and is_numeric(data.plan, factor) and None not in self._levels
        self._places = [self._of(level) for level in self._levels]  # in the order of the study
        places = sorted(set(self._places))
        self.step = min((after - before for before, after in pairwise(places)), default=1.0)
        dimension = next((each for each in data.plan.study.dimensions if factor in each.columns), None)
        # The points of a hypercube come in no order.
        self.is_connected = dimension is not None and (len(dimension.columns) == 1 or places == self._places)

    def _of(self, level: Factor) -> float:
        if self.is_numeric and isinstance(level, (int, float)):
            return float(level)
        return float(self._levels.index(level))

    def place(self, condition: Condition) -> float:
        return self._of(condition.values[self._factor]) if self._factor else 0.0

    def dress(self, axes: Any) -> None:
        """Ticks where levels are: numbers only if they are few, and not strewn like the points of a hypercube."""
        if not self.is_numeric or (self.is_connected and len(self._places) <= 12):
            _texts_along(axes, self._places, self._texts)
        if not self.is_numeric:
            axes.set_xlim(-0.5, len(self._places) - 0.5)


def _texts_along(axes: Any, places: Sequence[float], texts: Sequence[str]) -> None:
    """Write texts at their places, of many only some, and aslant where they are long."""
    every = -(-len(texts) // 16)
    places, texts = places[::every], texts[::every]
    turned = max(map(len, texts), default=0) * len(texts) > 60
    axes.set_xticks(places, texts, rotation=30 if turned else 0, ha="right" if turned else "center")
