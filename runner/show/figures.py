"""Figures: what a model's ``figures`` section may ask for, drawn from the signals of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import Configurable, Parameter, array_parameter, texts_parameter

from ..engine import Results, Signal
from ..model.patterns import select


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
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure as Canvas

        canvas = Canvas()
        FigureCanvasAgg(canvas)
        axes = canvas.add_subplot()
        robots = [results.signals[name] for pattern in self.robots for name in select(pattern, results.signals)]
        if self.obstacle:
            self._obstacle(axes, results.signals[self.obstacle])
        if self.estimate:
            self._ellipses(axes, results.signals[self.estimate])
        colours = ("#0b3c8c", "#d1662a", "#2f8f4e", "#8b3fa0", "#b59b00", "#00838f", "#ad1457", "#5d4037")
        for index, signal in enumerate(robots):
            self._path(axes, signal, colours[index % len(colours)], main=index == 0, legend=index < 8)
        axes.plot(*self.goal, marker="*", markersize=15, color="#c62828", linestyle="none", label="goal", zorder=6)
        axes.set_aspect("equal")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        axes.grid(color="0.9", linewidth=0.6)
        axes.set_axisbelow(True)
        axes.set_title(f"{results.model}, seed {results.seed}, {results.end:g} s", fontsize=10)
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0, fontsize=8, frameon=False)
        # One metre is as long in x as in y; the sheet takes the shape of what is on it.
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        scale = min(6.5 / (right - left), 5.0 / (high - low))
        canvas.set_size_inches(max(1.5, scale * (right - left)) + 1.0, max(1.5, scale * (high - low)) + 0.8)
        canvas.savefig(path, dpi=200, bbox_inches="tight")

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


def positions(signal: Signal) -> NDArray[np.float64]:
    """The positions in a signal of body states, shape (n, 2)."""
    return np.array([token.position for token in signal.tokens], dtype=float).reshape(-1, 2)
