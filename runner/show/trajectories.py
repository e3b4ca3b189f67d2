"""Trajectories: paths in the plane, drawn from the signals of a run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from epicycle.actors import Parameter, array_parameter, texts_parameter

from ..execution.results import Results, Signal
from ..model.catalogue.figure import Figure, Mark, Shape
from .figures import title_of
from .samples import Floats, selected
from .sheet import FEW, LIMIT, Sheet, colours, in_common, legend_beside
from .space import ellipse, ellipses, has_tracks, positions, sights, tracked, tubes

TIMES = 8  # written beside a path
_APART = 34.0  # pixels between times


class Trajectories(Figure):
    """The paths of all robots around obstacles, in the style of the paper's Figs. 6 and 8.

    A path starts with a circle and ends with an arrowhead; dots mark every second, and times are written beside the
    first path.  Ellipses show the estimates of the obstacles at two standard deviations; discs show the obstacles with
    the distance to keep, once a second.
    """

    robots = texts_parameter(doc="signals of the robots' states (patterns); the first robot is emphasized")
    obstacle = texts_parameter((), doc="signals of the obstacles' states (patterns)")
    estimate = Parameter(str, "", doc="signal of an estimate of the obstacle, or of tracks of several")
    goal = array_parameter((2,), (0.0, 0.0), unit="m", doc="destination of the first robot")
    safe_distance = Parameter(float, 2.0, unit="m", min=0.0, doc="radius of the obstacle's disc")
    occluders = array_parameter((None, 4), (), doc="what stands in the way: x, y, radius and height of each, in m")
    interval = Parameter(float, 1.0, unit="s", min=1e-3, doc="time between dots, discs and ellipses")
    plans = texts_parameter((), doc="signals of the robots' plans (patterns), which the page of a run shows as tubes")
    sights = texts_parameter((), doc="signals of measurements (patterns), which the page shows as lines of sight")
    period = Parameter(float, 0.1, unit="s", min=1e-9, doc="duration of each control of a plan")
    tube_initial = Parameter(float, 0.0, unit="m", min=0.0, doc="radius of a plan's tube at its start")
    tube_growth = Parameter(float, 0.0, unit="m", min=0.0, doc="growth of the radius per period")

    def signal_patterns(self) -> tuple[str, ...]:
        return tuple(pattern for pattern in (*self.robots, *self.obstacle, self.estimate) if pattern)

    def mark_patterns(self) -> tuple[str, ...]:
        return (*self.plans, *self.sights)

    def marks(self, results: Results) -> Iterator[Mark]:
        owners: dict[str, int] = {}  # what a robot sends has the robot's colour
        for name in selected(self.robots, results):
            owners[name.rpartition(".")[0]] = len(owners)

        def made(names: Iterable[str], shape: Shape, colour: int | None, **look: float) -> Iterator[Mark]:
            for name in names:
                signal, path = results.signals[name], name.rpartition(".")[0]
                whole: Any = slice(None)
                if shape == "tube":
                    found = {name: (whole, tubes(signal, self.period, self.tube_initial, self.tube_growth))}
                elif shape == "line":
                    found = sights(signal)
                elif shape == "ellipse":
                    found = tracked(signal) if has_tracks(signal) else {name: (whole, ellipses(signal))}
                else:
                    found = {name: (whole, positions(signal))}
                for part, (seen, rows) in found.items():
                    times = signal.times[seen].tolist()
                    if shape == "body" and (end := self._leaves(signal, results)) is not None:
                        times, rows = [*times, end], np.vstack([rows, np.full((1, 2), np.nan)])
                    yield Mark(part, shape, times, rows, colour=owners.get(path, colour), **look)

        yield from made(selected(self.sights, results), "line", None)
        yield from made(selected(self.plans, results), "tube", None)
        yield from made([self.estimate] if self.estimate else [], "ellipse", None)
        yield from made(selected(self.obstacle, results), "body", None, radius=self.safe_distance)
        yield from made(selected(self.robots, results), "body", 0)
        for number, (x, y, radius, _) in enumerate(self.occluders.tolist()):
            yield Mark(f"occluder[{number}]", "body", [0.0], np.array([[x, y]]), radius=radius)
        yield Mark("goal", "goal", [0.0], np.array([self.goal], dtype=float))

    def draw(self, results: Results, path: Path) -> None:
        sheet = Sheet([title_of(results)], heights=[4.4])
        (axes,) = sheet.axes
        for number, name in enumerate(selected(self.obstacle, results)):
            self._obstacle(sheet, results.signals[name], is_named=number == 0)
        if self.estimate:
            self._ellipses(axes, results.signals[self.estimate])
        robots = selected(self.robots, results)
        shades = colours(len(robots))
        for index, (name, shade) in enumerate(zip(robots, shades, strict=True)):
            self._path(sheet, results.signals[name], shade, is_first=index == 0, named=len(robots) <= FEW)
        from matplotlib.patches import Circle

        for x, y, radius, height in self.occluders.tolist():
            axes.add_patch(Circle((x, y), radius, facecolor="0.75", edgecolor="0.4", zorder=1))
            axes.annotate(f"{height:g} m", (x, y), ha="center", va="center", fontsize=7, zorder=2)
        axes.plot(*self.goal, marker="*", markersize=15, color=LIMIT, linestyle="none", label="goal", zorder=6)
        sheet.call_axes("x (m)", "y (m)")
        # One metre is as long in x as in y; the shape of the sheet follows its content.
        axes.set_aspect("equal")
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        sheet.canvas.set_size_inches(7.0, max(2.4, min(6.5, 4.8 * (high - low) / (right - left)) + 0.8))
        if len(robots) <= FEW:
            legend_beside(axes)
        else:
            title, names = in_common([name.rpartition(".")[0] or name for name in robots])
            sheet.band(names, shades, title, axes)
            axes.legend(loc="best", fontsize=7)
        for name in robots[:1]:
            signal = results.signals[name]
            write_times(axes, positions(signal), signal.times, every(signal.times, self.interval), shades[0])
        sheet.save([path])

    def _leaves(self, signal: Signal, results: Results) -> float | None:
        """When a body is no longer there, if others go on sending: an interval after its last state."""
        if len(signal.times) < 2:
            return None
        interval = float(np.median(np.diff(signal.times)))
        others = selected((*self.robots, *self.obstacle), results)
        last = max(float(results.signals[name].times[-1]) for name in others if len(results.signals[name].times))
        end = float(signal.times[-1]) + interval
        return end if last > end + 0.5 * interval else None

    def _path(self, sheet: Sheet, signal: Signal, shade: str, *, is_first: bool, named: bool) -> None:
        points = positions(signal)
        if len(points) == 0:
            return
        (axes,) = sheet.axes
        label = (signal.name.rpartition(".")[0] or signal.name) if named else None
        width, order = (2.4, 5) if is_first else (1.3, 4)
        axes.plot(*points.T, color=shade, linewidth=width, label=label, zorder=order)
        axes.plot(*points[every(signal.times, self.interval)].T, ".", color=shade, markersize=4 + width, zorder=order)
        axes.plot(*points[0], "o", markersize=8, markerfacecolor="white", markeredgecolor=shade, zorder=order)
        arrows(axes, points, shade, size=8.0 + 3.0 * width, zorder=order + 0.5)
        tip_path(sheet, axes, signal.name, signal.times, points)

    def _obstacle(self, sheet: Sheet, signal: Signal, is_named: bool) -> None:
        from matplotlib.patches import Circle

        (axes,) = sheet.axes
        points = positions(signal)
        label = "obstacle" if is_named and len(points) else None
        axes.plot(*points.T, "--", color="0.25", linewidth=1.2, label=label, zorder=3)
        arrows(axes, points, "0.25", zorder=3.5)
        tip_path(sheet, axes, signal.name, signal.times, points)
        marks = every(signal.times, self.interval)
        for number, index in enumerate(marks, start=1):
            label = f"{self.safe_distance:g} m around it" if is_named and number == len(marks) else None
            look = {"color": "0.3", "alpha": 0.05 + 0.13 * number / len(marks), "linewidth": 0}
            axes.add_patch(Circle(points[index], self.safe_distance, label=label, **look))

    def _ellipses(self, axes: Any, signal: Signal) -> None:
        from matplotlib.patches import Ellipse

        label: str | None = "estimate, 2 std. dev."
        for index in every(signal.times, self.interval):
            token = signal.tokens[index]
            for estimate in token.estimates if has_tracks(signal) else [token]:
                x, y, along, across, angle = map(float, ellipse(estimate))
                look: Any = {"fill": False, "edgecolor": LIMIT, "linewidth": 0.8, "alpha": 0.8, "zorder": 3}
                place, turned = (x, y), float(np.degrees(angle))
                axes.add_patch(Ellipse(place, 2.0 * along, 2.0 * across, angle=turned, label=label, **look))
                label = None


def every(times: Floats, interval: float) -> list[int]:
    """Indices of the first tokens at or after multiples of an interval."""
    steps = np.floor(np.asarray(times) / interval + 1e-9)
    return [int(index) for index in np.unique(steps, return_index=True)[1]]


def arrows(axes: Any, points: Floats, shade: str, *, size: float = 11.0, zorder: float = 4.5) -> None:
    """Arrowheads halfway along a path and at its end, in the direction of the path."""
    walked = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    look = {"arrowstyle": "-|>", "color": shade, "mutation_scale": size, "linewidth": 0, "shrinkA": 0, "shrinkB": 0}
    for share in (0.5, 1.0):
        tip = int(np.searchsorted(walked, share * walked[-1]))
        # The last step alone may be as short as a rounding error.
        tail = int(np.searchsorted(walked, walked[tip] - 0.01 * walked[-1], side="right")) - 1
        if 0 <= tail < tip:
            axes.annotate("", points[tip], points[tail], arrowprops=look, zorder=zorder)


def tip_path(sheet: Sheet, axes: Any, name: str, times: Floats, points: Floats, most: int = 150) -> None:
    """Add tips that show the time at places of a path, at most ``most`` of them."""
    texts = [f"{name}\n{time:.4g} s at ({x:.4g}, {y:.4g}) m" for time, (x, y) in zip(times, points, strict=True)]
    sheet.tip(axes, points, texts, most)


def write_times(axes: Any, points: Floats, times: Floats, marks: Sequence[int], shade: str) -> None:
    """Write times beside dots of a path, to the left of its direction, where there is space."""
    transform, taken = axes.transData.transform, list[Floats]()
    for index in marks[:: math.ceil(len(marks) / TIMES) or 1]:
        place = transform(points[index])
        ahead = transform(points[min(index + 1, len(points) - 1)]) - transform(points[max(index - 1, 0)])
        length = math.hypot(*ahead)
        if any(math.dist(place, other) < _APART for other in taken):
            continue
        taken.append(place)
        across, up = (-ahead[1] / length, ahead[0] / length) if length else (0.0, 1.0)
        axes.annotate(
            f"{times[index]:.3g} s",
            points[index],
            (8.0 * across, 8.0 * up),
            textcoords="offset points",
            ha="center" if abs(across) < 0.5 else "left" if across > 0 else "right",
            va="center" if abs(up) < 0.5 else "bottom" if up > 0 else "top",
            fontsize=7,
            color=shade,
            zorder=7,
        )
