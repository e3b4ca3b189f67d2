"""Figures: what a model's ``figures`` section may ask for, drawn from the signals of a run."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import Parameter, array_parameter, texts_parameter
from epicycle.aspects import STAMP

from ..catalogue import Figure, Mark, Shape
from ..results import Results, Signal, cell, leaves
from ..shown import short
from ..text import select
from .pen import LIMIT, PALETTE, Sheet, legend_beside
from .space import ellipses, positions, sights, tubes

MAX_STATES = 24  # in a legend

Numbers: TypeAlias = dict[str, tuple["array[float]", "array[float]"]]  # times and values
States: TypeAlias = dict[str, tuple["array[float]", list[str | None]]]  # times and names


class Trajectories(Figure):
    """The paths of all robots around an obstacle, in the manner of the paper's Figs. 6 and 8.

    A dot on a path marks every second.  The ellipses are where the estimate puts the obstacle, at two standard
    deviations; the discs are the obstacle with the distance to keep, once a second.
    """

    robots = texts_parameter(doc="signals of the robots' states (patterns); the first robot is drawn strongest")
    obstacle = Parameter(str, "", doc="signal of the obstacle's state")
    estimate = Parameter(str, "", doc="signal of an estimate of the obstacle")
    goal = array_parameter((2,), (0.0, 0.0), unit="m", doc="where the first robot is to arrive")
    safe_distance = Parameter(float, 2.0, unit="m", min=0.0, doc="radius of the obstacle's disc")
    interval = Parameter(float, 1.0, unit="s", min=1e-3, doc="time between dots, discs and ellipses")
    plans = texts_parameter((), doc="signals of the robots' plans (patterns), which the page of a run shows as tubes")
    sights = texts_parameter((), doc="signals of measurements (patterns), which the page shows as lines of sight")
    period = Parameter(float, 0.1, unit="s", min=1e-9, doc="time for which each control of a plan acts")
    tube_initial = Parameter(float, 0.0, unit="m", min=0.0, doc="radius of a plan's tube where it begins")
    tube_growth = Parameter(float, 0.0, unit="m", min=0.0, doc="by how much the radius grows in a period")

    def signal_patterns(self) -> tuple[str, ...]:
        return tuple(pattern for pattern in (*self.robots, self.obstacle, self.estimate) if pattern)

    def mark_patterns(self) -> tuple[str, ...]:
        return (*self.plans, *self.sights)

    def marks(self, results: Results) -> Iterator[Mark]:
        owners: dict[str, int] = {}  # the colour of what a robot sends is its own
        for name in selected(self.robots, results):
            owners[name.rpartition(".")[0]] = len(owners)

        def made(names: Iterable[str], shape: Shape, colour: int | None, **look: float) -> Iterator[Mark]:
            for name in names:
                signal, path = results.signals[name], name.rpartition(".")[0]
                times = signal.times
                if shape == "tube":
                    rows = tubes(signal, self.period, self.tube_initial, self.tube_growth)
                elif shape == "line":
                    seen, rows = sights(signal)
                    times = times[seen]
                else:
                    rows = ellipses(signal) if shape == "ellipse" else positions(signal)
                yield Mark(name, shape, times.tolist(), rows, colour=owners.get(path, colour), **look)

        yield from made(selected(self.sights, results), "line", None)
        yield from made(selected(self.plans, results), "tube", None)
        yield from made([self.estimate] if self.estimate else [], "ellipse", None)
        yield from made([self.obstacle] if self.obstacle else [], "body", None, radius=self.safe_distance)
        yield from made(selected(self.robots, results), "body", 0)
        yield Mark("goal", "goal", [0.0], np.array([self.goal], dtype=float))

    def draw(self, results: Results, path: Path) -> None:
        sheet = Sheet([_title(results)], heights=[4.4])
        (axes,) = sheet.axes
        if self.obstacle:
            self._obstacle(axes, results.signals[self.obstacle])
        if self.estimate:
            self._ellipses(axes, results.signals[self.estimate])
        for index, name in enumerate(selected(self.robots, results)):
            self._path(axes, results.signals[name], index)
        axes.plot(*self.goal, marker="*", markersize=15, color=LIMIT, linestyle="none", label="goal", zorder=6)
        sheet.call_axes("x (m)", "y (m)")
        legend_beside(axes)
        # One metre is as long in x as in y; the sheet takes the shape of what is on it.
        axes.set_aspect("equal")
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        scale = min(6.5 / (right - left), 5.0 / (high - low))
        sheet.canvas.set_size_inches(max(1.5, scale * (right - left)) + 1.0, max(1.5, scale * (high - low)) + 0.8)
        sheet.save([path])

    def _path(self, axes: Any, signal: Signal, index: int) -> None:
        points = positions(signal)
        if len(points) == 0:
            return
        colour, label = PALETTE[index % len(PALETTE)], signal.name.rpartition(".")[0] if index < 8 else None
        width, order = (1.3, 4) if index else (2.4, 5)
        axes.plot(*points.T, color=colour, linewidth=width, label=label, zorder=order)
        axes.plot(*points[self._every(signal)].T, ".", color=colour, markersize=4 + width, zorder=order)
        axes.plot(*points[0], "o", markersize=8, markerfacecolor="white", markeredgecolor=colour, zorder=order)

    def _obstacle(self, axes: Any, signal: Signal) -> None:
        from matplotlib.patches import Circle

        points = positions(signal)
        axes.plot(*points.T, "--", color="0.25", linewidth=1.2, label="obstacle" if len(points) else None, zorder=3)
        marks = self._every(signal)
        for number, index in enumerate(marks, start=1):
            label = f"{self.safe_distance:g} m around it" if number == len(marks) else None
            look = {"color": "0.3", "alpha": 0.05 + 0.13 * number / len(marks), "linewidth": 0}
            axes.add_patch(Circle(points[index], self.safe_distance, label=label, **look))

    def _ellipses(self, axes: Any, signal: Signal) -> None:
        from matplotlib.patches import Ellipse

        label: str | None = "estimate, 2 std. dev."
        rows = ellipses(signal)
        for index in self._every(signal):
            x, y, along, across, angle = map(float, rows[index])
            look: Any = {"fill": False, "edgecolor": LIMIT, "linewidth": 0.8, "alpha": 0.8, "zorder": 3}
            place, turned = (x, y), float(np.degrees(angle))
            axes.add_patch(Ellipse(place, 2.0 * along, 2.0 * across, angle=turned, label=label, **look))
            label = None

    def _every(self, signal: Signal) -> list[int]:
        """Indices of the tokens that come at multiples of the interval."""
        steps = np.floor(np.asarray(signal.times) / self.interval + 1e-9)
        return [int(index) for index in np.unique(steps, return_index=True)[1]]


class TimeSeries(Figure):
    """Signals over time: each number in their tokens a line, each text, truth value or enumeration a strip of states.

    A strip has the colour of the state of the moment; None leaves a gap, and so does what is no state of anything.
    """

    signals = texts_parameter(doc="which signals (patterns)")
    style = Parameter(
        str,
        "steps",
        choices=("steps", "line", "points"),
        doc="whether a value stays until the next one, leads straight to it, or stands for its moment only",
    )
    label = Parameter(str, "", doc="what the vertical axis shows, with its unit; the signal's name if left out")
    start: Parameter[float | None] = Parameter(float, None, unit="s", doc="where the time axis begins")
    end: Parameter[float | None] = Parameter(float, None, unit="s", doc="where the time axis ends")

    def signal_patterns(self) -> tuple[str, ...]:
        return self.signals

    def draw(self, results: Results, path: Path) -> None:
        lines, strips = read(self.signals, results)
        # Strips have a part of the sheet of their own, below the lines if there are any.
        heights = ([3.0] if lines or not strips else []) + ([0.3 + 0.3 * len(strips)] if strips else [])
        sheet = Sheet([_title(results), ""][: len(heights)], heights=heights, same_x=True)
        if lines or not strips:
            self._lines(sheet.axes[0], lines, results.end)
        if strips:
            _strips(sheet.axes[-1], strips, results.end)
        sheet.axes[-1].set_xlabel("time (s)")
        sheet.axes[0].set_xlim(0.0 if self.start is None and self.end is not None else self.start, self.end)
        sheet.axes[0].set_ylabel(self.label or (next(iter(lines)) if len(lines) == 1 else ""))
        sheet.save([path])

    def _lines(self, axes: Any, lines: Numbers, end: float) -> None:
        look = {"steps": {"drawstyle": "steps-post"}, "line": {}, "points": {"linestyle": "none", "marker": "."}}
        for index, (name, (times, values)) in enumerate(lines.items()):
            if self.style == "steps":
                # What is over at the moment at which it comes is not seen; the last value holds to the run's end.
                latest = dict(zip(times, values, strict=True)) | {max(end, times[-1]): values[-1]}
                times, values = array("d", latest), array("d", latest.values())
            axes.plot(times, values, color=PALETTE[index % len(PALETTE)], label=name, **look[self.style])
        if len(lines) > 1:
            legend_beside(axes)


def _strips(axes: Any, strips: States, end: float) -> None:
    """Draw rows of states, each state in the same colour in all of them."""
    from matplotlib.patches import Patch

    spans: dict[str, dict[int, list[tuple[float, float]]]] = {}
    for row, (times, found) in enumerate(strips.values()):
        for begin, until, state in zip(times, [*times[1:], max(end, times[-1])], found, strict=True):
            if state is not None:
                spans.setdefault(state, {}).setdefault(row, []).append((begin, until - begin))
    handles = []
    for index, (state, rows) in enumerate(spans.items()):
        colour = PALETTE[index % len(PALETTE)]
        handles.append(Patch(color=colour, label=_legible(state)))
        for row, ranges in rows.items():
            axes.broken_barh(ranges, (row - 0.4, 0.8), color=colour, linewidth=0)
    if len(handles) > MAX_STATES:
        handles[MAX_STATES:] = [Patch(visible=False, label=f"and {len(handles) - MAX_STATES:,} more")]
    axes.set_yticks(range(len(strips)), list(strips))
    axes.set_ylim(len(strips) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    legend_beside(axes, handles=handles)


class Histogram(Figure):
    """How often values of a signal come, in bins of equal width; of several signals, one over the other.

    Where there are no numbers, but states (texts, truth values, enumerations), how often each of them comes.
    """

    signals = texts_parameter(doc="which signals (patterns)")
    bins = Parameter(int, 40, min=1, max=10_000, doc="how many bins there are")
    label = Parameter(str, "", doc="what the values are, with their unit; the signal's name if left out")

    def signal_patterns(self) -> tuple[str, ...]:
        return self.signals

    def draw(self, results: Results, path: Path) -> None:
        numbers, states = read(self.signals, results)
        sheet = Sheet([_title(results)], heights=[3.0])
        if numbers or not states:
            self._bins(sheet.axes[0], {name: np.array(values) for name, (_, values) in numbers.items()})
        else:
            self._counts(sheet.axes[0], states)
        sheet.save([path])

    def _bins(self, axes: Any, columns: dict[str, NDArray[np.float64]]) -> None:
        columns = {name: values[np.isfinite(values)] for name, values in columns.items()}
        ends = [end for values in columns.values() if len(values) for end in (values.min(), values.max())]
        edges = np.histogram_bin_edges(ends or [0.0], self.bins)
        for index, (name, values) in enumerate(columns.items()):
            label = f"{name}, mean {np.mean(values):.4g}" if len(values) else f"{name}, no values"
            look = {"color": PALETTE[index % len(PALETTE)], "alpha": 0.55, "label": label}
            heights, _ = np.histogram(values, edges)
            axes.hist(edges[:-1], edges, weights=heights, density=bool(len(values)), **look)
        axes.set_xlabel(self.label or (next(iter(columns)) if len(columns) == 1 else ""))
        axes.set_ylabel("share per unit")
        if columns:
            axes.legend()

    def _counts(self, axes: Any, states: States) -> None:
        counts = Counter(_legible(state) for _, found in states.values() for state in found if state is not None)
        often = dict(counts.most_common(MAX_STATES))
        axes.barh(range(len(often)), list(often.values()), color=PALETTE[0], alpha=0.55)
        axes.set_yticks(range(len(often)), list(often))
        axes.invert_yaxis()
        more = f"; {len(counts) - len(often):,} rarer states are left out" if len(counts) > len(often) else ""
        axes.set_xlabel(f"{self.label or ', '.join(states)}: how often{more}")


def selected(patterns: tuple[str, ...], results: Results) -> list[str]:
    """The signals that patterns select, each once."""
    return list(dict.fromkeys(name for pattern in patterns for name in select(pattern, results.signals)))


def read(patterns: tuple[str, ...], results: Results) -> tuple[Numbers, States]:
    """All numbers and all states in tokens, by signal and place in them, but for what says of when a token is.

    A state is None where there is something else; what never is one is left out.
    """
    numbers: Numbers = {}
    states: States = {}
    for name in selected(patterns, results):
        signal = results.signals[name]
        for tag, token in zip(signal.tags, signal.tokens, strict=True):
            for place, leaf in leaves(token):
                if place.rpartition(".")[2] == STAMP:
                    continue
                kind, value, text = cell(leaf)
                where, state = f"{name}.{place}" if place else name, None
                if kind in ("int", "float"):
                    if value is not None:
                        times, values = numbers.setdefault(where, (array("d"), array("d")))  # 16 bytes a number
                        times.append(tag.seconds)
                        values.append(value)
                elif kind != "none" and (isinstance(leaf, str) or not hasattr(leaf, "__len__")):
                    state = text if kind != "bool" else "true" if value else "false"
                moments, found = states.setdefault(where, (array("d"), []))
                moments.append(tag.seconds)
                found.append(state)
    return numbers, {where: column for where, column in states.items() if any(each is not None for each in column[1])}


def _legible(state: str) -> str:
    """A state in a legend, which leaves out what is empty or begins with an underscore."""
    return short(state) if state.strip() and not state.startswith("_") else repr(state)


def _title(results: Results) -> str:
    return f"{results.model}, seed {results.seed}, {results.end:g} s"
