"""Figures of a run's signals: over time, and histograms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from epicycle.actors import EpicycleError, Parameter, abridged, counted, texts_parameter

from ..execution.results import Results
from ..model.catalogue.figure import Figure
from ..support.shown import short
from .samples import Floats, Numbers, Span, States, envelope, longest_spans, read, spans_of
from .sheet import (
    MAX_PANELS,
    MAX_TIPS,
    PALETTE,
    Sheet,
    colours,
    in_common,
    legend_beside,
    set_log,
)

MAX_STATES = 24  # per legend
_LETTERS = 30  # per line at a vertical axis


class TimeSeries(Figure):
    """Signals over time: a line for each number in their tokens, a strip for each text, truth value or enumeration.

    The colour of a strip shows the current state; None leaves a gap, as does any value that is not a state.  If there
    are more values than a line can show, a band spans all of them, and the line is their mean.
    """

    signals = texts_parameter(doc="which signals (patterns)")
    style = Parameter(
        str,
        "steps",
        choices=("steps", "line", "points"),
        doc="whether a value holds until the next one, leads straight to it, or is only valid at its time",
    )
    label = Parameter(str, "", doc="label of the vertical axis, with its unit; the signal's name if left out")
    start: Parameter[float | None] = Parameter(float, None, unit="s", doc="start of the time axis")
    end: Parameter[float | None] = Parameter(float, None, unit="s", doc="end of the time axis")
    separate = Parameter(bool, False, doc="whether each line has its own panel")
    log_y = Parameter(bool, False, doc="whether the vertical axis is logarithmic")

    def signal_patterns(self) -> tuple[str, ...]:
        return self.signals

    def draw(self, results: Results, path: Path) -> None:
        lines, strips = read(self.signals, results)
        groups = [[name] for name in [*lines][:MAX_PANELS]] if self.separate and lines else [[*lines]]
        if strips and not lines:
            groups = []
        # Strips have their own part of the sheet, below any lines.
        heights = [3.0 if len(groups) == 1 else 1.6] * len(groups)
        heights += [0.3 + 0.3 * len(strips)] if strips else []
        sheet = Sheet(["" for _ in heights], heights=heights, same_x=True)
        begin, end = self._view(lines, strips, results.end)
        panels = zip(sheet.axes, groups, strict=False)
        said = [self._lines(sheet, axes, group, lines, begin, end) for axes, group in panels]
        if strips:
            _strips(sheet, strips, begin, end, results.end)
        left_out = len(lines) - MAX_PANELS if self.separate else 0
        said += [f"{left_out:,} more are left out"] if left_out > 0 else []
        sheet.axes[0].set_title("\n".join([title_of(results), *dict.fromkeys(filter(None, said))]), loc="left")
        sheet.axes[-1].set_xlabel("time (s)")
        sheet.axes[0].set_xlim(0.0 if self.start is None and self.end is not None else self.start, self.end)
        sheet.save([path])

    def _view(self, lines: Numbers, strips: States, over: float) -> tuple[float, float]:
        """The start and end of the visible time."""
        columns = [times for times, _ in (*lines.values(), *strips.values()) if len(times)]
        first = min((times[0] for times in columns), default=0.0)
        last = max((times[-1] for times in columns), default=0.0)
        begin = self.start if self.start is not None else 0.0 if self.end is not None else first
        return begin, max(over, last) if self.end is None else self.end

    def _lines(self, sheet: Sheet, axes: Any, names: list[str], lines: Numbers, begin: float, end: float) -> str:
        """Draw the lines of a panel; returns a note on how they are drawn."""
        look = {"steps": {"drawstyle": "steps-post"}, "line": {}, "points": {"linestyle": "none", "marker": "."}}
        shades, handles, said, gaps = colours(len(names)), [], "", 0
        for shade, name in zip(shades, names, strict=True):
            times, values = (np.frombuffer(column) for column in lines[name])
            gaps += int(np.count_nonzero(~np.isfinite(values)))
            if self.style == "steps":
                # A value that ends when it starts is not visible; the last value holds until the end of the run.
                is_last = np.append(times[1:] != times[:-1], True)
                times, values = times[is_last], values[is_last]
            found = envelope(times, values, begin, end, holds=self.style == "steps")
            if found is None:
                if self.style == "steps" and times[-1] < end:
                    times, values = np.append(times, end), np.append(values, values[-1])
                handles += axes.plot(times, values, color=shade, label=name, **look[self.style])
                places = [*zip(times, values, strict=True)]
                texts = [f"{name}\n{time:.6g} s: {value:.5g}" for time, value in places]
            else:
                axes.fill_between(found.times, found.low, found.high, color=shade, alpha=0.3, linewidth=0)
                handles += axes.plot(found.times, found.mean, color=shade, linewidth=0.9, label=name)
                said = f"Band: least to greatest in each {found.width:.3g} s; line: mean"
                places = [*zip(found.times, found.mean, strict=True)]
                texts = [
                    f"{name}\n{time - found.width / 2:.6g} to {time + found.width / 2:.6g} s: "
                    f"{low:.5g} to {high:.5g}, mean {mean:.5g}"
                    for time, low, high, mean in zip(*found[:4], strict=True)
                ]
            sheet.tip(axes, places, texts, most=MAX_TIPS // len(lines) or 1)
        if len(names) > 1:
            sheet.key(axes, names, handles, shades)
        axes.set_ylabel(fill(self.label or _shared(names), _LETTERS))
        set_log(axes, x=False, y=self.log_y)
        return "; ".join(filter(None, (said, f"Gaps: {counted(gaps, 'value')} not finite" if gaps else "")))


def _strips(sheet: Sheet, strips: States, begin: float, end: float, over: float) -> None:
    """Draw rows of states; each state has the same colour in all of them."""
    from matplotlib.patches import Patch

    axes = sheet.axes[-1]
    whole: list[list[Span]] = [[*spans_of(times, found, max(over, times[-1]))] for times, found in strips.values()]
    states = list(dict.fromkeys(state for row in whole for _, _, state in row))
    rows = [longest_spans(row, begin, end) for row in whole]
    shades = dict(zip(states, colours(len(states)), strict=True))
    for state, shade in shades.items():
        for number, row in enumerate(rows):
            ranges = [(since, until - since) for since, until, each in row if each == state]
            axes.broken_barh(ranges, (number - 0.4, 0.8), color=shade, linewidth=0)
    for number, (name, row) in enumerate(zip(strips, rows, strict=True)):
        texts = (f"{name}\n{since:.6g} to {until:.6g} s: {_legible(state)}" for since, until, state in row)
        sheet.tip(axes, (((since + until) / 2, number) for since, until, _ in row), texts)
    handles = [Patch(color=shade, label=_legible(state)) for state, shade in shades.items()]
    if len(handles) > MAX_STATES:
        handles[MAX_STATES:] = [Patch(visible=False, label=f"and {len(handles) - MAX_STATES:,} more")]
    axes.set_yticks(range(len(strips)), [abridged(name, _LETTERS) for name in strips])
    axes.set_ylim(len(strips) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    legend_beside(axes, handles=handles)


class Histogram(Figure):
    """How often values of a signal occur, in bins of equal width; several signals are drawn over each other.

    If there are no numbers but states (texts, truth values, enumerations), how often each of them occurs.
    """

    signals = texts_parameter(doc="which signals (patterns)")
    bins = Parameter(int, 40, min=1, max=10_000, doc="number of bins")
    label = Parameter(str, "", doc="name of the values, with their unit; the signal's name if left out")
    log_x = Parameter(bool, False, doc="whether the horizontal axis is logarithmic, with bins of equal width on it")
    log_y = Parameter(bool, False, doc="whether the vertical axis is logarithmic")

    def signal_patterns(self) -> tuple[str, ...]:
        return self.signals

    def draw(self, results: Results, path: Path) -> None:
        numbers, states = read(self.signals, results)
        sheet = Sheet([title_of(results)], heights=[3.0])
        if numbers or not states:
            self._bins(sheet, {name: np.array(values) for name, (_, values) in numbers.items()})
        else:
            self._counts(sheet, states)
        sheet.save([path])

    def _bins(self, sheet: Sheet, columns: Mapping[str, Floats]) -> None:
        (axes,) = sheet.axes
        every = sum(map(len, columns.values()))
        columns = {name: values[np.isfinite(values)] for name, values in columns.items()}
        count = sum(map(len, columns.values()))
        if self.log_x:
            columns = {name: values[values > 0.0] for name, values in columns.items()}
        ends = [end for values in columns.values() if len(values) for end in (values.min(), values.max())]
        if self.log_x and not ends:
            raise EpicycleError("no value is positive, so the horizontal axis cannot be logarithmic")
        low, high = min(ends, default=0.0), max(ends, default=0.0)
        if high - low <= 1e-14 * self.bins * max(abs(low), abs(high)):  # equal but for rounding: no room for bins
            around = max(0.5, 1e-9 * abs(low))
            low, high = (low, 2.0 * low) if self.log_x else (low - around, low + around)
        edges = (np.geomspace if self.log_x else np.linspace)(low, high, self.bins + 1)
        handles, shades = [], colours(len(columns))
        for shade, (name, values) in zip(shades, columns.items(), strict=True):
            shares = np.histogram(values, edges)[0] / max(len(values), 1)
            ground = shares[shares > 0.0].min(initial=1.0) / 2 if self.log_y else 0.0
            handles.append(axes.stairs(shares, edges, baseline=ground, fill=True, color=shade, alpha=0.35))
            axes.stairs(shares, edges, baseline=ground, color=shade, linewidth=1.2)
            middles = np.sqrt(edges[:-1] * edges[1:]) if self.log_x else (edges[:-1] + edges[1:]) / 2
            texts = (
                f"{name}\n{low:.4g} to {high:.4g}: {share:.2%} of {len(values):,} values"
                for low, high, share in zip(edges, edges[1:], shares, strict=False)
            )
            sheet.tip(axes, zip(middles, shares, strict=True), texts)
        set_log(axes, x=self.log_x, y=self.log_y)
        axes.set_xlabel(self.label or _shared([*columns]))
        axes.set_ylabel("share of the values in a bin")
        axes.yaxis.set_major_formatter(lambda share, _: f"{100 * share:g} %")
        said = [f"mean {np.mean(values):.4g}" if len(values) else "no values" for values in columns.values()]
        if len(columns) > 1:
            sheet.key(axes, [*columns], handles, shades, said)
        left_out = count - sum(map(len, columns.values()))
        title = [axes.get_title("left"), *(said if len(said) == 1 else [])]
        title += [f"{left_out:,} values that are not positive are left out"] if left_out else []
        title += [f"{every - count:,} values that are not finite are left out"] if every > count else []
        axes.set_title(", ".join(title), loc="left")

    def _counts(self, sheet: Sheet, states: States) -> None:
        (axes,) = sheet.axes
        counts = Counter(_legible(state) for _, found in states.values() for state in found if state is not None)
        often = dict(counts.most_common(MAX_STATES))
        axes.barh(range(len(often)), list(often.values()), color=PALETTE[0], alpha=0.55)
        axes.set_yticks(range(len(often)), [abridged(state, _LETTERS) for state in often])
        axes.invert_yaxis()
        axes.grid(visible=False, axis="y")
        texts = (f"{state}: {count:,} of {counts.total():,}" for state, count in often.items())
        sheet.tip(axes, ((count, row) for row, count in enumerate(often.values())), texts)
        set_log(axes, x=self.log_y, y=False)
        more = f"; {len(counts) - len(often):,} rarer states are left out" if len(counts) > len(often) else ""
        axes.set_ylabel(fill(self.label or abridged(", ".join(states), 80), _LETTERS))
        axes.set_xlabel(f"how often{more}")


def _shared(names: Sequence[str]) -> str:
    """The axis label for signals without a ``label``."""
    return abridged(names[0] if len(names) == 1 else in_common(names)[0], 80)


def _legible(state: str) -> str:
    """A state in a form that the legend shows: it leaves out texts that are empty or start with an underscore."""
    return short(state) if state.strip() and not state.startswith("_") else repr(state)


def title_of(results: Results) -> str:
    """The title of a run's figure."""
    return f"{abridged(results.model, 60)}, seed {results.seed}, {results.end:g} s"
