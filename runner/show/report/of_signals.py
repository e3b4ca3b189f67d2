"""Figures of a study that show signals, for which runs are repeated."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from epicycle.actors import (
    EpicycleError,
    Fault,
    MappingParameter,
    Parameter,
    array_parameter,
    counted,
    did_you_mean,
    texts_parameter,
)
from epicycle.actors.expression import PortFormula, PortFormulaParameter

from ...execution.results import STOP_TIME, Results
from ...model.build.figures import figures_of
from ...model.build.model import Model
from ...model.catalogue.figure import Figure
from ...model.language.claims import MAX_NUMBER
from ...model.text.problems import Problems
from ...study.inference import half_width
from ...study.plan.plan import Plan
from ..canvas import FORMATS, draw
from ..samples import Floats, selected
from ..sheet import colours, set_log, width_of
from ..space import positions
from ..trajectories import arrows, every, tip_path, write_times
from .data import Condition, Data, Names
from .figure import RunKey, SignalFigure

TOKEN = "token"
MOST, LEAST = "most", "least"
_TIPS = 40  # per line
_GRID = 400  # most points of a mean over time
_FEWEST = 0.5  # share of the runs that a mean over time needs


class RepeatedFigure(SignalFigure):
    """Base class of figures that show the first runs of each condition, in lines or panels."""

    runs = Parameter(
        int, 10, min=1, max=10_000, doc="how many runs of each condition are shown, starting with the first"
    )
    panels = texts_parameter((), doc="factors with a panel for each level; all remaining ones if left out")

    def runs_of(self, data: Data) -> list[RunKey]:
        panels = self.arranged(data).panels
        return [run for panel in panels for line in panel.lines.values() for run in self.first(line)]

    def first(self, conditions: Iterable[Condition]) -> list[RunKey]:
        """The runs of these conditions that are shown."""
        return [(each.index, row["replication"]) for each in conditions for row in each.good[: self.runs]]


class Series(RepeatedFigure):
    """A number over time: its mean over runs with the 95 % interval of the mean (Student) as a band.

    Runs no longer count after their end; the mean is drawn as long as half of the runs continue.
    """

    signal_parameters = ("signal",)

    signal = Parameter(str, doc="an output port")
    value = PortFormulaParameter(
        TOKEN, given=(TOKEN,), doc="the number as an expression over its token, such as token.speed"
    )
    label = Parameter(str, "", doc="name of the number, with its unit; the expression if left out")
    lines: Parameter[str | None] = Parameter(
        str, None, doc="factor with a line for each level; the next one if left out"
    )
    log_y = Parameter(bool, False, doc="whether the vertical axis is logarithmic")

    def complaints(self, plan: Plan) -> Iterator[Fault]:
        yield from super().complaints(plan)
        if self._formula.references:
            message = f"{self._formula.references[0]!r} is not part of the token"
            yield Fault(message, ("value",), help=("write 'token.name'",))

    @property
    def _formula(self) -> PortFormula:
        assert self.value is not None
        return self.value

    def extract(self, model: Model, results: Results) -> tuple[Floats, Floats, float]:
        """Times, values, and when the run ended."""
        signal = results[self.signal]
        values = []
        for token in signal.tokens:
            value = self._formula((), token=token)
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise EpicycleError(
                    f"{self._formula.source!r} gives {value!r}, not a number, for a token of {self.signal}"
                )
            values.append(float(value))
        # The last value holds until the stop time, even if nothing else happens.
        end = results.end if results.stopped != STOP_TIME or model.stop is None else model.stop
        return signal.times, np.array(values), end

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        arranged = self.arranged(data)
        sheet = arranged.sheet(same_x=True, same_y=True)
        for axes, panel in zip(sheet.axes, arranged.panels, strict=False):
            for number, (level, conditions) in enumerate(panel.lines.items()):
                times, means, halves = over_time([extracts[run] for run in self.first(conditions)])
                if len(times):
                    look, about = arranged.look(number), arranged.about(panel, level)
                    (line,) = axes.plot(times, means, **look)
                    low, high = means - halves, means + halves
                    axes.fill_between(times, low, high, color=look["color"], alpha=0.18, linewidth=0)
                    arranged.show(level, line)
                    points = zip(times, means, halves, strict=True)
                    texts = [f"{time:.4g} s: {value:.4g} ± {half:.2g}\n{about}" for time, value, half in points]
                    sheet.tip(axes, zip(times, means, strict=True), texts, most=_TIPS)
            set_log(axes, x=False, y=self.log_y)
        sheet.call_axes("time (s)", self.label or self._formula.source.replace(TOKEN, self.signal))
        said = f"Mean over the first {counted(self.runs, 'run')} of each condition, with its 95 % interval (Student)"
        return arranged.finish(sheet, paths, f"{said}, as long as half of them continue.")


def over_time(runs: Sequence[tuple[Floats, Floats, float]]) -> tuple[Floats, Floats, Floats]:
    """Times, means and half widths of their intervals; a value of a run holds until its next token."""
    begun = [each for each in runs if len(each[0])]
    if not begun:
        return np.empty(0), np.empty(0), np.empty(0)
    times = np.unique(np.concatenate([each[0] for each in begun]))
    if len(times) > _GRID:
        times = np.linspace(times[0], times[-1], _GRID)
    columns = np.full((len(begun), len(times)), np.nan)
    for row, (at, values, end) in zip(columns, begun, strict=True):
        place = np.searchsorted(at, times, side="right") - 1
        is_known = (place >= 0) & (times <= end)
        row[is_known] = values[place[is_known]]
    columns[~(np.abs(columns) < MAX_NUMBER)] = np.nan
    known = (~np.isnan(columns)).sum(axis=0)
    kept = known >= max(1.0, _FEWEST * len(runs))
    means, halves = [], []
    for column in columns.T[kept]:
        values = column[~np.isnan(column)].tolist()
        means.append(math.fsum(values) / len(values))
        halves.append(half_width(values) if len(values) > 1 else 0.0)
    return times[kept], np.array(means), np.array(halves)


class Way(NamedTuple):
    """The positions of a thing over time."""

    signal: str
    times: Floats
    points: Floats


class Tracks(RepeatedFigure):
    """The paths of moving things, with the first runs of a condition in one panel, in the style of the paper's Fig. 6.

    Signals carry states with a ``position``.  A path starts with a circle and has arrowheads; its dots are equally
    spaced in time, and the times are written beside the first path.
    """

    signal_parameters = ("signals", "around")

    signals = texts_parameter(doc="signals of the states whose paths are shown (patterns)")
    around = texts_parameter((), doc="signals of further states, dashed and only for the first run (patterns)")
    marks: Parameter[Mapping[str, Any]] = MappingParameter(
        array_parameter((2,), unit="m"), {}, doc="places by name, such as {goal: [0, 0]}"
    )

    def extract(self, model: Model, results: Results) -> dict[str, list[Way]]:
        """Signals and paths, by their role in the figure."""
        ways = (("ways", self.signals), ("around", self.around))
        return {
            kind: [Way(name, results[name].times, positions(results[name])) for name in selected(patterns, results)]
            for kind, patterns in ways
        }

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        from matplotlib.ticker import MaxNLocator

        arranged = self.arranged(data)
        columns = arranged.columns or (1 if len(arranged.panels) == 1 else 2)
        seen = [way.points for extract in extracts.values() for ways in extract.values() for way in ways]
        points = np.concatenate([*seen, *(place[None] for place in self.marks.values())])
        low, high = points.min(axis=0), points.max(axis=0)
        room = 0.04 * max(*(high - low), 1e-9)
        width, depth = high - low + 2 * room
        ends = [way.times[-1] for each in extracts.values() for way in each["ways"] if len(way.times)]
        start, then, *_ = MaxNLocator(5, steps=(1, 2, 5, 10)).tick_values(0.0, max(ends, default=0.0) or 1.0)
        step = then - start
        height = min(6.0, min(3.8, (width_of(columns) - 0.6) / columns) * depth / width + 0.35)
        sheet = arranged.sheet(columns=columns, height=height, same_x=True, same_y=True)
        for axes, panel in zip(sheet.axes, arranged.panels, strict=False):
            runs = [run for conditions in panel.lines.values() for run in self.first(conditions)]
            axes.set_aspect("equal")
            axes.set_xlim(low[0] - room, high[0] + room)
            axes.set_ylim(low[1] - room, high[1] + room)
            shades = colours(len(runs))
            for number, run in enumerate(runs):
                for way in extracts[run]["ways"]:
                    axes.plot(*way.points.T, color=shades[number], linewidth=0.9, alpha=0.85)
                    look = {"markersize": 4.5, "color": "white", "markeredgecolor": "0.2", "zorder": 4}
                    (arranged.handles["start"],) = axes.plot(*way.points[:1].T, "o", **look)
                    arrows(axes, way.points, shades[number], size=8.0)
                    dots = every(way.times, step)
                    axes.plot(*way.points[dots].T, ".", color=shades[number], markersize=3.5)
                    if number == 0:
                        write_times(axes, way.points, way.times, dots, shades[number])
                    place = arranged.names.place(data.conditions[run[0]].values)
                    about = f"{way.signal}, replication {run[1]}\n{place}"
                    tip_path(sheet, axes, about, way.times, way.points, _TIPS)
                for way in extracts[run]["around"] if number == 0 else ():
                    (line,) = axes.plot(*way.points.T, "--", color="0.3", linewidth=1.0)
                    arrows(axes, way.points, "0.3", size=8.0)
                    arranged.handles[way.signal.rpartition(".")[0] or way.signal] = line
            for (name, place), marker in zip(self.marks.items(), cycle("*XPDv"), strict=False):
                look = {"marker": marker, "markersize": 8, "color": "black", "linestyle": "none", "zorder": 5}
                (arranged.handles[name],) = axes.plot(*place, **look)
        sheet.call_axes("x (m)", "y (m)")
        said = f"The first {counted(self.runs, 'run')} of each condition; dots are {step:g} s apart."
        return arranged.finish(sheet, paths, said)


class SingleRun(SignalFigure):
    """One run, drawn by a figure of the model: the run with the highest or the lowest value of a metric."""

    figure = Parameter(str, doc="name of a figure of the model")
    metric = Parameter(str, doc="column of the table that decides which run is chosen")
    choose = Parameter(str, MOST, choices=(MOST, LEAST), doc="whether the run has the highest or the lowest value")
    runs: Parameter[int | None] = Parameter(
        int,
        None,
        min=1,
        doc="how many runs of each condition, starting with the first, it is chosen from; all if left out",
    )

    def check_model(self, model: Model) -> Iterator[Fault]:
        if self.figure not in model.figures:
            known = list(model.figures)
            message = f"the model has no figure {self.figure!r}{did_you_mean(self.figure, known)}"
            yield Fault(message, ("figure",), help=(f"its figures: {', '.join(known) or 'none'}",))

    def _chosen(self, data: Data) -> tuple[Condition, dict[str, Any]] | None:
        rows = [
            (condition, row)
            for condition in data.where(self.where)
            for row in condition.good[: self.runs]
            if row[self.metric] is not None
        ]
        choose = max if self.choose == MOST else min
        return choose(rows, key=lambda each: each[1][self.metric], default=None)

    def runs_of(self, data: Data) -> list[RunKey]:
        chosen = self._chosen(data)
        return [] if chosen is None else [(chosen[0].index, chosen[1]["replication"])]

    def ports(self, model: Model) -> tuple[str, ...]:
        return self._drawn(model).signal_patterns()

    def _drawn(self, model: Model) -> Figure:
        problems = Problems()
        found = figures_of(model, problems, recorded=model.graph.ports)
        problems.raise_if_any()
        return found[self.figure]

    def extract(self, model: Model, results: Results) -> dict[str, bytes]:
        """The files by their endings."""
        figure, files = self._drawn(model), {}
        with tempfile.TemporaryDirectory() as folder:
            for ending in FORMATS:
                path = Path(folder) / f"run.{ending}"
                draw(self.figure, figure, results, path)
                files[ending] = path.read_bytes()
        return files

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        chosen = self._chosen(data)
        if chosen is None:
            raise EpicycleError(f"no run has a value of {self.metric}, so none can be chosen")
        condition, row = chosen
        for path in paths:
            path.write_bytes(extracts[condition.index, row["replication"]][path.suffix.removeprefix(".")])
        names = Names(data.plan, self.labels)
        value = names.level(self.metric, row[self.metric])
        among = f" among the first {self.runs}" if self.runs else ""
        return (
            f"Replication {row['replication']} ({names.place(condition.values)}, seed {row['seed']}), which has the "
            f"{self.choose} {names.words(self.metric)}{among}: {value}."
        )
