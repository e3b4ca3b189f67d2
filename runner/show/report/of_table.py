"""Figures of the table of a study: means with their intervals, and distributions."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from epicycle.actors import EpicycleError, Fault, Parameter, counted, texts_parameter

from ...model.language.dimensions import Factor
from ...study.inference import Estimate, with_interval
from ...study.plan.plan import Plan
from ...support.shown import listed
from ..sheet import LIMIT, Sheet, set_log
from .data import Condition, Data, Names, is_numeric, mean_of
from .figure import Layout, Panel, RunKey, StudyFigure

BOXES, CURVES = "boxes", "curves"
_TIPS = 60  # per curve
_LETTERS = 84  # per line below a sheet


class TableFigure(StudyFigure):
    """Base class of figures drawn from the table alone."""

    lines: Parameter[str | None] = Parameter(
        str, None, doc="factor with a line or colour for each level; the next one if left out"
    )
    panels = texts_parameter((), doc="factors with a panel for each level; all remaining ones if left out")


class Means(TableFigure):
    """The mean of a metric over a factor, with 95 % intervals (Student; of shares Wilson): a line for each level of
    another factor, and a panel for each level of a third.

    Several metrics each get a row of panels, or become the lines of one panel.
    """

    metric = texts_parameter(doc="column of the table, or several")
    over: Parameter[str | None] = Parameter(str, None, doc="factor along the axis; the first numeric one if left out")
    together = Parameter(bool, False, doc="whether several metrics are the lines of one panel; they need the same unit")
    same_scale = Parameter(bool, True, doc="whether all panels have the same vertical axis")
    log_x = Parameter(bool, False, doc="whether the horizontal axis is logarithmic")
    log_y = Parameter(bool, False, doc="whether the vertical axis is logarithmic")

    def complaints(self, plan: Plan) -> Iterator[Fault]:
        yield from super().complaints(plan)
        if not self.metric:
            yield Fault("it names no metric", ("metric",), help=("name at least one",))
        units = {plan.columns[name].unit for name in self.metric if name in plan.columns}
        if self.together and len(units) > 1:
            units_of = ", ".join(f"{name} in {plan.columns[name].unit or '1'}" for name in self.metric)
            yield Fault("metrics in one panel need the same unit", ("together",), help=(units_of,))
        if self.together and self.lines:
            advice = "leave out 'lines' or 'together'"
            yield Fault("the metrics are already its lines", ("lines",), help=(advice,))

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        arranged = self.arranged(data, has_axis=True, metrics=self.metric if self.together else ())
        names, axis = arranged.names, _Axis(data, arranged)
        sheet, panels = by_metric(arranged, self.metric[:1] if self.together else self.metric, self.same_scale)
        for axes, (metric, panel) in zip(sheet.axes, panels, strict=True):
            for number, (level, conditions) in enumerate(panel.lines.items()):
                points = self._points(data, axis, conditions, str(level) if self.together else metric)
                self._line(sheet, axes, axis, arranged, panel, number, points)
            axis.dress(axes, sheet.columns, is_log=self.log_x)
            set_log(axes, x=self.log_x, y=self.log_y)
            what = f"mean ({names.unit(metric)})" if names.unit(metric) else "mean"
            sheet.call(axes, axis.name, what if self.together else mean_of(names.axis(metric)))
        shares = data.plan.shares.intersection(self.metric)
        kind = "Student" if not shares else "Wilson" if shares.issuperset(self.metric) else "Student; of shares Wilson"
        what = mean_of(listed([*map(names.words, self.metric)]))
        said = f"{what[:1].upper()}{what[1:]} with 95 % intervals ({kind})."
        return arranged.finish(sheet, paths, said, counts(arranged.chosen, self.metric, names))

    def _points(self, data: Data, axis: _Axis, conditions: Iterable[Condition], metric: str) -> list[_Point]:
        points = [_Point(axis.place(each), each, metric, data.average(each, metric)) for each in conditions]
        known = [point for point in points if point.estimate.count]
        return sorted(known, key=lambda point: point.place) if axis.is_numeric else known

    def _line(
        self, sheet: Sheet, axes: Any, axis: _Axis, arranged: Layout, panel: Panel, number: int, points: list[_Point]
    ) -> None:
        count, names = len(arranged.levels), arranged.names
        # So that intervals are side by side.
        shift = 0.0 if self.log_x else axis.step * min(0.06, 0.5 / count) * (number - (count - 1) / 2)
        places = [(point.place + shift, point.estimate.value) for point in points]
        look = arranged.look(number, marked=True)
        handle = axes.errorbar(
            [place for place, _ in places],
            [value for _, value in places],
            yerr=[[point.reach[end] for point in points] for end in (0, 1)],
            elinewidth=1.0,
            **(look if axis.is_connected else {**look, "linestyle": "none"}),
        )
        arranged.show(arranged.levels[number], handle)
        for place, point in zip(places, points, strict=True):
            value = f"{with_interval(point.estimate)} {names.unit(point.metric)}".rstrip()
            said = f"{mean_of(names.words(point.metric))}: {value} ({counted(point.estimate.count, 'run')})"
            sheet.tip(axes, [place], [f"{said}\n{names.place(point.condition.values)}"])


class _Point(NamedTuple):
    """A condition in a figure of means."""

    place: float
    condition: Condition
    metric: str
    estimate: Estimate

    @property
    def reach(self) -> list[float]:
        """How far its interval reaches below it and above it; an infinite one is not drawn."""
        ends = (self.estimate.low, self.estimate.high)
        return [abs(end - self.estimate.value) if math.isfinite(end) else 0.0 for end in ends]


def by_metric(arranged: Layout, metrics: Sequence[str], same_y: bool = True) -> tuple[Sheet, list[tuple[str, Panel]]]:
    """A sheet with all panels of each metric, in rows if there are few."""
    panels = [(metric, panel) for metric in metrics for panel in arranged.panels or [Panel("", {})]]
    across = len(arranged.panels)
    is_grid = len(metrics) > 1 and 1 < across <= 4
    sheet = arranged.sheet(
        panels=[panel.title for _, panel in panels],
        columns=across if is_grid else min(len(metrics), 3) if across <= 1 else arranged.columns,
        same_y=same_y and ("row" if is_grid else len(metrics) == 1),
    )
    sheet.are_alike = is_grid or len(metrics) == 1
    return sheet, panels


class Distributions(TableFigure):
    """How metrics are distributed over runs: boxes along a factor, or curves of the share of runs up to a value.

    A box spans the middle half of the runs, with the median as a line; the whiskers span nine tenths, and every run
    beyond them is a dot.
    """

    metrics = texts_parameter(doc="columns of the table, each with its own panels")
    style = Parameter(str, BOXES, choices=(BOXES, CURVES), doc="what is drawn")
    over: Parameter[str | None] = Parameter(
        str, None, doc="factor along the axis of boxes; the first numeric one if left out"
    )
    limit: Parameter[float | None] = Parameter(float, None, doc="a value to mark, such as a distance to keep")
    log = Parameter(bool, False, doc="whether the axis of values is logarithmic")

    def complaints(self, plan: Plan) -> Iterator[Fault]:
        yield from super().complaints(plan)
        if not self.metrics:
            yield Fault("it names no metric", ("metrics",), help=("name at least one",))

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        has_axis = self.style == BOXES
        arranged = self.arranged(data, has_axis=has_axis)
        sheet, panels = by_metric(arranged, self.metrics)
        for axes, (metric, panel) in zip(sheet.axes, panels, strict=True):
            if has_axis:
                self._boxes(sheet, axes, data, metric, panel, arranged)
            else:
                self._curves(sheet, axes, metric, panel, arranged)
            set_log(axes, x=self.log and not has_axis, y=self.log and has_axis)
        boxes = "Boxes: the middle half of the runs with the median; whiskers: nine tenths; dots: runs beyond them."
        said = [boxes if has_axis else "Share of the runs with this value or less."]
        said.append(counts(arranged.chosen, self.metrics, arranged.names))
        if self.limit is not None:
            for metric in self.metrics:
                values, names = _numbers(arranged.chosen, metric), arranged.names
                below, runs = sum(value < self.limit for value in values), counted(len(values), "run")
                said.append(f"Below {names.level(metric, self.limit)}: {names.words(metric)} of {below:,} of {runs}.")
        return arranged.finish(sheet, paths, *said)

    def _boxes(self, sheet: Sheet, axes: Any, data: Data, metric: str, panel: Panel, arranged: Layout) -> None:
        from matplotlib.patches import Patch

        names, over, lines, axis = arranged.names, arranged.roles.over, len(arranged.levels), _Axis(data, arranged)
        width = 0.8 / lines
        for number, (line, conditions) in enumerate(panel.lines.items()):
            colour = arranged.shades[number]
            groups: dict[int, list[float]] = {}
            for place, level in enumerate(axis.levels):
                here = [each for each in conditions if not over or each.values[over] == level]
                if values := _numbers(here, metric):
                    groups[place] = values
            places = {place: place + width * (number - (lines - 1) / 2) for place in groups}
            for place, values in groups.items():
                value = f"{names.words(metric)}: {_spread(values, names.unit(metric))} ({counted(len(values), 'run')})"
                at = names.place({over: axis.levels[place]}) if over else ""
                said = "\n".join(filter(None, (value, at, arranged.about(panel, line))))
                sheet.tip(axes, [(places[place], statistics.median(values))], [said])
            if groups:
                axes.boxplot(
                    list(groups.values()),
                    positions=list(places.values()),
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
        axes.set_xlim(-0.6, len(axis.levels) - 0.4)
        _texts_along(axes, range(len(axis.levels)), axis.texts, sheet.columns)
        sheet.call(axes, axis.name, names.axis(metric))
        axes.grid(axis="x", visible=False)
        if self.limit is not None:
            axes.axhline(self.limit, color=LIMIT, linewidth=1.0, zorder=1)

    def _curves(self, sheet: Sheet, axes: Any, metric: str, panel: Panel, arranged: Layout) -> None:
        for number, (line, conditions) in enumerate(panel.lines.items()):
            if values := sorted(_numbers(conditions, metric)):
                shares = [place / len(values) for place in range(len(values) + 1)]
                look = {"drawstyle": "steps-post", **arranged.look(number)}
                (curve,) = axes.plot([values[0], *values], shares, **look)
                arranged.show(line, curve)
                unit, about = arranged.names.unit(metric), arranged.about(panel, line)
                texts = [
                    f"{share:.3g} of the runs: up to {value:.4g} {unit}".rstrip() + f"\n{about}"
                    for value, share in zip(values, shares[1:], strict=True)
                ]
                sheet.tip(axes, zip(values, shares[1:], strict=True), texts, most=_TIPS)
        axes.set_ylim(0.0, 1.02)
        sheet.call(axes, arranged.names.axis(metric), "share of runs")
        if self.limit is not None:
            axes.axvline(self.limit, color=LIMIT, linewidth=1.0, zorder=1)


def _numbers(conditions: Sequence[Condition], metric: str) -> list[float]:
    return [value for condition in conditions for value in condition.numbers(metric)]


def _spread(values: Sequence[float], unit: str) -> str:
    """The numbers that a box shows, in words."""
    low, middle, high = statistics.quantiles(values, method="inclusive") if len(values) > 1 else [values[0]] * 3
    return f"median {middle:.4g} {unit}".rstrip() + f", middle half {low:.4g} to {high:.4g}"


def counts(chosen: Sequence[Condition], metrics: Sequence[str], names: Names) -> str:
    """How many runs a figure is based on, and how many it excludes."""
    runs = sum(len(condition.rows) for condition in chosen)
    bad = runs - sum(len(condition.good) for condition in chosen)
    parts = [f"{counted(runs, 'run')} in {counted(len(chosen), 'condition')}"]
    if bad:
        parts.append(f"{bad:,} of them failed")
    for metric in metrics:
        if missing := runs - bad - len(_numbers(chosen, metric)):
            parts.append(f"{missing:,} have no {names.words(metric)}")
    return f"{', '.join(parts)}."


class _Axis:
    """The positions of conditions along the horizontal axis."""

    def __init__(self, data: Data, arranged: Layout) -> None:
        self._factor = factor = arranged.roles.over
        self.name = arranged.names.axis(factor) if factor else ""
        self.levels: list[Factor] = arranged.levels_of(factor) if factor else [None]
        self.texts = [arranged.names.level("", level) if factor else "" for level in self.levels]
        self.is_numeric = factor is not None and is_numeric(data.plan, factor) and None not in self.levels
        self._places = [self._of(level) for level in self.levels]  # in the order of the levels
        places = sorted(set(self._places))
        self.step = min((after - before for before, after in pairwise(places)), default=1.0)
        dimension = next((each for each in data.plan.study.dimensions if factor in each.columns), None)
        # The points of a hypercube are not ordered.
        self.is_connected = dimension is not None and (len(dimension.columns) == 1 or places == self._places)

    def _of(self, level: Factor) -> float:
        if self.is_numeric and isinstance(level, (int, float)):
            return float(level)
        return float(self.levels.index(level))

    def place(self, condition: Condition) -> float:
        return self._of(condition.values[self._factor]) if self._factor else 0.0

    def dress(self, axes: Any, columns: int, *, is_log: bool) -> None:
        """Set ticks at the levels; for numbers, only if few and not scattered like the points of a hypercube."""
        if is_log and not self.is_numeric:
            raise EpicycleError("the levels along the axis are not numbers, so it cannot be logarithmic")
        if is_log:
            return
        if not self.is_numeric or (self.is_connected and len(self._places) <= 12):
            _texts_along(axes, self._places, self.texts, columns)
        if not self.is_numeric:
            axes.set_xlim(-0.5, len(self._places) - 0.5)


def _texts_along(axes: Any, places: Sequence[float], texts: Sequence[str], columns: int) -> None:
    """Write texts at their positions: numbers with space between them, and long words slanted."""
    longest, room = max(map(len, texts), default=0), _LETTERS // columns
    is_short = longest <= 6
    every = math.ceil(len(texts) * (longest + 2) / room) if is_short else math.ceil(len(texts) / 16)
    places, texts = places[::every], texts[::every]
    turned = not is_short and longest * len(texts) > room
    axes.set_xticks(places, texts, rotation=30 if turned else 0, ha="right" if turned else "center")
