"""Figures: what a model's ``figures`` section may ask for, drawn from the signals of a run."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import Configurable, Parameter, array_parameter, shortened, texts_parameter
from epicycle.aspects import STAMP

from ..engine import Results, Signal, cell, leaves
from ..tables import short
from ..text import select

MAX_TEXT = 200  # characters of a label
COLOURS = ("#0b3c8c", "#d1662a", "#2f8f4e", "#8b3fa0", "#b59b00", "#00838f", "#ad1457", "#5d4037")
MAX_STATES = 24  # in a legend

Columns: TypeAlias = dict[str, tuple[list[float], list[Any]]]  # times and values


class Figure(Configurable):
    """Base of the figures: declare parameters, write ``draw``."""

    reserved: ClassVar[frozenset[str]] = frozenset({"type"})

    def signal_patterns(self) -> tuple[str, ...]:
        """The signals that the figure reads, as patterns; each must be recorded."""
        raise NotImplementedError

    def draw(self, results: Results, path: Path) -> None:
        """Draw the figure into a file, whose ending decides the format."""
        raise NotImplementedError


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

    def signal_patterns(self) -> tuple[str, ...]:
        return tuple(pattern for pattern in (*self.robots, self.obstacle, self.estimate) if pattern)

    def draw(self, results: Results, path: Path) -> None:
        canvas, axes = _sheet(results, 6.4, 4.8)
        robots = [results.signals[name] for pattern in self.robots for name in select(pattern, results.signals)]
        if self.obstacle:
            self._obstacle(axes, results.signals[self.obstacle])
        if self.estimate:
            self._ellipses(axes, results.signals[self.estimate])
        for index, signal in enumerate(robots):
            self._path(axes, signal, COLOURS[index % len(COLOURS)], main=index == 0, legend=index < 8)
        axes.plot(*self.goal, marker="*", markersize=15, color="#c62828", linestyle="none", label="goal", zorder=6)
        axes.set_aspect("equal")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0, fontsize=8, frameon=False)
        # One metre is as long in x as in y; the sheet takes the shape of what is on it.
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        scale = min(6.5 / (right - left), 5.0 / (high - low))
        canvas.set_size_inches(max(1.5, scale * (right - left)) + 1.0, max(1.5, scale * (high - low)) + 0.8)
        save(canvas, path)

    def _path(self, axes: Any, signal: Signal, colour: str, *, main: bool, legend: bool) -> None:
        points = positions(signal)
        if len(points) == 0:
            return
        label = signal.name.rpartition(".")[0] if legend else None
        width, order = (2.4, 5) if main else (1.3, 4)
        axes.plot(points[:, 0], points[:, 1], color=colour, linewidth=width, label=label, zorder=order)
        marks = points[self._every(signal)]
        axes.plot(marks[:, 0], marks[:, 1], ".", color=colour, markersize=4 + width, zorder=order)
        axes.plot(*points[0], "o", markersize=8, markerfacecolor="white", markeredgecolor=colour, zorder=order)

    def _obstacle(self, axes: Any, signal: Signal) -> None:
        from matplotlib.patches import Circle

        points = positions(signal)
        if len(points) == 0:
            return
        axes.plot(points[:, 0], points[:, 1], "--", color="0.25", linewidth=1.2, label="obstacle", zorder=3)
        marks = self._every(signal)
        for place, index in enumerate(marks):
            strength = 0.05 + 0.13 * (place + 1) / len(marks)
            label = f"{self.safe_distance:g} m around it" if place == len(marks) - 1 else None
            axes.add_patch(
                Circle(points[index], self.safe_distance, color="0.3", alpha=strength, linewidth=0, label=label)
            )

    def _ellipses(self, axes: Any, signal: Signal) -> None:
        from matplotlib.patches import Ellipse

        label: str | None = "estimate, 2 std. dev."
        for index in self._every(signal):
            estimate = signal.tokens[index]
            spread, axis = np.linalg.eigh(np.asarray(estimate.covariance)[:2, :2])
            width, height = 4.0 * np.sqrt(np.maximum(spread[::-1], 0.0))  # two deviations to each side
            angle = float(np.degrees(np.arctan2(axis[1, 1], axis[0, 1])))
            axes.add_patch(
                Ellipse(
                    estimate.mean[:2],
                    width,
                    height,
                    angle=angle,
                    fill=False,
                    edgecolor="#c62828",
                    linewidth=0.8,
                    alpha=0.8,
                    zorder=3,
                    label=label,
                )
            )
            label = None

    def _every(self, signal: Signal) -> list[int]:
        """Indices of the tokens that come at multiples of the interval."""
        marks, upcoming = [], 0.0
        for index, time in enumerate(signal.times):
            if time >= upcoming - 1e-9:
                marks.append(index)
                upcoming = (np.floor(time / self.interval + 1e-9) + 1) * self.interval
        return marks


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
        lines = _numbers(self.signals, results)
        strips = _states(self.signals, results)
        canvas, axes = _sheet(results, 7.0, 3.4)
        if strips:
            axes = self._strips(canvas, axes, strips, results.end, is_alone=not lines)
        look = {"steps": {"drawstyle": "steps-post"}, "line": {}, "points": {"linestyle": "none", "marker": "."}}
        for index, (name, (times, values)) in enumerate(lines.items()):
            if self.style == "steps" and times:
                # What is over at the moment at which it comes is not seen; the last value holds to the run's end.
                latest = dict(zip(times, values, strict=True)) | {max(results.end, times[-1]): values[-1]}
                times, values = array("d", latest), array("d", latest.values())
            colour = COLOURS[index % len(COLOURS)]
            axes.plot(times, values, color=colour, linewidth=1.2, markersize=4, label=name, **look[self.style])
        axes.set_xlabel("" if strips and lines else "time (s)")
        axes.set_ylabel(self.label or (next(iter(lines)) if len(lines) == 1 else ""))
        axes.set_xlim(0.0 if self.start is None and self.end is not None else self.start, self.end)
        if len(lines) > 1:
            axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0, fontsize=8, frameon=False)
        save(canvas, path)

    def _strips(self, canvas: Any, axes: Any, strips: Columns, end: float, *, is_alone: bool) -> Any:
        """Draw strips of states on a part of the sheet of their own, below the lines if there are any.

        Returns where lines are to be drawn.
        """
        from matplotlib.patches import Patch

        height = 0.3 + 0.3 * len(strips)  # inches
        below = axes
        if is_alone:
            canvas.set_figheight(height + 0.7)
        else:
            canvas.set_figheight(3.4 + height)
            title = axes.get_title()
            axes.remove()
            axes, below = canvas.subplots(2, sharex=True, height_ratios=(3.0, height))
            axes.set_title(title, fontsize=10)
            axes.grid(color="0.9", linewidth=0.6)
            below.set_xlabel("time (s)")
        spans: dict[str, dict[int, list[tuple[float, float]]]] = {}
        for row, (times, found) in enumerate(strips.values()):
            # What is over at the moment at which it comes is not seen.
            for begin, until, state in zip(times, [*times[1:], max(end, times[-1])], found, strict=True):
                if state is not None:
                    spans.setdefault(state, {}).setdefault(row, []).append((begin, until - begin))
        for index, rows in enumerate(spans.values()):
            for row, ranges in rows.items():
                below.broken_barh(ranges, (row - 0.4, 0.8), color=COLOURS[index % len(COLOURS)], linewidth=0)
        below.set_yticks(range(len(strips)), list(strips), fontsize=8, parse_math=False)
        below.set_ylim(len(strips) - 0.5, -0.5)
        below.grid(visible=False, axis="y")
        handles = [
            Patch(color=COLOURS[index % len(COLOURS)], label=_legible(state))
            for index, state in enumerate(islice(spans, MAX_STATES))
        ]
        if len(spans) > MAX_STATES:
            handles.append(Patch(visible=False, label=f"and {len(spans) - MAX_STATES:,} more"))
        legend = below.legend(
            handles=handles, loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0, fontsize=8, frameon=False
        )
        for text in legend.get_texts():
            text.set_parse_math(False)
        return axes


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
        columns = {
            name: np.array(values)[np.isfinite(values)] for name, (_, values) in _numbers(self.signals, results).items()
        }
        canvas, axes = _sheet(results, 6.0, 3.4)
        if not columns and (strips := _states(self.signals, results)):
            counts = Counter(_legible(state) for _, found in strips.values() for state in found if state is not None)
            often = counts.most_common(MAX_STATES)
            axes.barh(range(len(often)), [count for _, count in often], color=COLOURS[0], alpha=0.55)
            axes.set_yticks(range(len(often)), [state for state, _ in often], fontsize=8, parse_math=False)
            axes.invert_yaxis()
            more = f"; {len(counts) - MAX_STATES:,} rarer states are left out" if len(counts) > MAX_STATES else ""
            axes.set_xlabel(f"{self.label or ', '.join(strips)}: how often{more}")
            save(canvas, path)
            return
        ends = [end for values in columns.values() if len(values) for end in (values.min(), values.max())]
        edges = np.histogram_bin_edges(ends or [0.0], self.bins)
        for index, (name, values) in enumerate(columns.items()):
            label = f"{name}, mean {np.mean(values):.4g}" if len(values) else f"{name}, no values"
            colour = COLOURS[index % len(COLOURS)]
            heights, _ = np.histogram(values, edges)
            axes.hist(
                edges[:-1], edges, weights=heights, density=bool(len(values)), color=colour, alpha=0.55, label=label
            )
        axes.set_xlabel(self.label or (next(iter(columns)) if len(columns) == 1 else ""))
        axes.set_ylabel("share per unit")
        axes.legend(fontsize=8, frameon=False)
        save(canvas, path)


def _selected(patterns: tuple[str, ...], results: Results) -> list[str]:
    """The signals that patterns select, each once."""
    return list(dict.fromkeys(name for pattern in patterns for name in select(pattern, results.signals)))


def _leaves(patterns: tuple[str, ...], results: Results) -> Iterator[tuple[str, float, Any]]:
    """The place, time and value of each leaf of the tokens, but for those that say of when a token is."""
    for name in _selected(patterns, results):
        signal = results.signals[name]
        for tag, token in zip(signal.tags, signal.tokens, strict=True):
            for place, leaf in leaves(token):
                if place.rpartition(".")[2] != STAMP:
                    yield f"{name}.{place}" if place else name, tag.seconds, leaf


def _numbers(patterns: tuple[str, ...], results: Results) -> dict[str, tuple[array[float], array[float]]]:
    """Times and values of all numbers, by signal and place in the tokens."""
    found: dict[str, tuple[array[float], array[float]]] = {}
    for place, time, leaf in _leaves(patterns, results):
        kind, value, _ = cell(leaf)
        if kind in ("int", "float") and value is not None:
            times, values = found.setdefault(place, (array("d"), array("d")))  # 16 bytes a number, not 100
            times.append(time)
            values.append(value)
    return found


def _states(patterns: tuple[str, ...], results: Results) -> Columns:
    """Times and names of states, by signal and place in the tokens; None where there is something else."""
    found: Columns = {}
    for place, time, leaf in _leaves(patterns, results):
        kind, value, text = cell(leaf)
        is_state = kind not in ("int", "float", "none") and (isinstance(leaf, str) or not hasattr(leaf, "__len__"))
        times, states = found.setdefault(place, ([], []))
        times.append(time)
        states.append((text if kind != "bool" else "true" if value else "false") if is_state else None)
    return {place: column for place, column in found.items() if any(state is not None for state in column[1])}


def _legible(state: str) -> str:
    """A state in a legend, which leaves out what is empty or begins with an underscore."""
    return short(state) if state.strip() and not state.startswith("_") else repr(state)


def _sheet(results: Results, width: float, height: float) -> tuple[Any, Any]:
    """An empty figure of a run, sizes in inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    canvas = Canvas(figsize=(width, height))
    FigureCanvasAgg(canvas)
    axes = canvas.add_subplot()
    axes.grid(color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_title(f"{results.model}, seed {results.seed}, {results.end:g} s", fontsize=10)
    return canvas, axes


def save(canvas: Any, path: Path) -> None:
    """Write a matplotlib figure so that the same one gives the same file."""
    import matplotlib
    from matplotlib.text import Text

    for text in canvas.findobj(Text):  # whatever a model is called: a sheet grows with the texts on it
        if len(text.get_text()) > MAX_TEXT:
            text.set_text(shortened(text.get_text(), MAX_TEXT))
    with matplotlib.rc_context({"svg.hashsalt": "epicycle"}):
        metadata = {"Date": None} if path.suffix == ".svg" else {}
        canvas.savefig(path, dpi=200, bbox_inches="tight", metadata=metadata)


def positions(signal: Signal) -> NDArray[np.float64]:
    """The positions in a signal of body states, shape (n, 2)."""
    return np.array([token.position for token in signal.tokens], dtype=float).reshape(-1, 2)
