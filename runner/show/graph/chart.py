"""Draws statecharts: the modes of a machine and its transitions, as a picture or as Mermaid text."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, did_you_mean

from ..canvas import new_canvas, save, style, text_width
from .layout import MARGIN, Point, Words

if TYPE_CHECKING:
    from ...model.build.model import Model
    from .picture import Painter

INK = "#1a1a1a"
SIZE, LEADING, WIDEST = 8.0, 10.5, 34  # of labels: points, points from line to line, letters
NAME = 10.0
FLAGS = ("else", "immediate", "nondeterministic", "preemptive", "history", "error")
GAP = 120.0  # points between modes, in addition to the labels


@dataclass
class State:
    """A mode: its text and position."""

    name: str
    lines: list[str]
    is_final: bool
    x: float = 0.0
    y: float = 0.0
    width: float = 0.0
    height: float = 0.0


@dataclass
class Arrow:
    """All transitions from one mode to another."""

    source: State
    target: State
    labels: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Statechart:
    """The content of a machine's drawing."""

    path: str
    initial: State
    states: tuple[State, ...]
    arrows: tuple[Arrow, ...]


def statechart(model: Model, path: str) -> Statechart:
    """The statechart of a machine, or of a composite with modes; raises ``EpicycleError`` if there are none."""
    from epicycle.actors import StateMachine

    machines = {each: actor for each, actor in model.graph.actors.items() if isinstance(actor, StateMachine)}
    found = machines.get(path) or machines.get(f"{path}.machine")
    if found is None:
        known = [each.removesuffix(".machine") for each in machines]
        valid = ", ".join(known) or "none"
        raise EpicycleError(f"{path} has no modes{did_you_mean(path, known)}; machines: {valid}")
    domain = model.graph.domains.get(found.path.rpartition(".")[0])
    refinements = {} if domain is None else domain.refinements
    states = {}
    for name, mode in found.modes.items():
        lines = [f"{variable}' = {formula.source}" for variable, formula in mode.flow.items()]
        lines += [f"{when} / {_actions(does)}" for when, does in (("entry", mode.entry), ("exit", mode.exit)) if does]
        if name in refinements:
            lines.append(f"refinement {model.graph.components[refinements[name]].kind}")
        states[name] = State(name, lines, mode.final)
    arrows: dict[tuple[str, str], Arrow] = {}
    for each in found.transitions:
        sources = each.from_
        if sources == ("*",):
            sources = tuple(name for name, state in states.items() if name != each.to and not state.is_final)
        for source in sources:
            arrow = arrows.setdefault((source, each.to), Arrow(states[source], states[each.to]))
            arrow.labels.append(_label(each))
    initial = states[found.initial or next(iter(states))]
    return Statechart(found.path.removesuffix(".machine"), initial, tuple(states.values()), tuple(arrows.values()))


def _actions(actions: Any) -> str:
    return "; ".join(f"{name} = {formula.source}" for name, formula in actions)


def _label(each: Any) -> str:
    """A transition as UML writes it: trigger [guard] / actions."""
    flags = [flag for flag in FLAGS if vars(each)[flag]]
    words = [*flags, *([f"priority {each.priority}"] if each.priority else []), *each.on]
    words += [f"after {each.after.source} s"] if each.after is not None else []
    words += [f"[{each.when.source}]"] if each.when is not None else []
    return " ".join(words) + (f" / {_actions(each.do)}" if each.do else "")


def chart_text(chart: Statechart) -> str:
    """The statechart as Mermaid's state diagram."""
    lines = ["---", f"title: {chart.path}", "---", "stateDiagram-v2", f"    [*] --> {chart.initial.name}"]
    for state in chart.states:
        lines += [f"    {state.name}: {' ⏎ '.join([state.name, *map(_plain, state.lines)])}"] if state.lines else []
        lines += [f"    {state.name} --> [*]"] if state.is_final else []
    lines += [
        f"    {arrow.source.name} --> {arrow.target.name}" + (f": {_plain(label)}" if label else "")
        for arrow in chart.arrows
        for label in arrow.labels
    ]
    return "\n".join(lines) + "\n"


def _plain(words: str) -> str:
    """Text without characters that Mermaid would interpret."""
    return words.replace(";", ",").replace(":", " ").replace("#", "")


def write_statechart(chart: Statechart, path: Path) -> None:
    """Draw to a file whose ending determines the format."""
    _place(chart)
    arcs = [_Arc(arrow, chart) for arrow in chart.arrows]
    corners = [
        (each.x + side * each.width / 2, each.y + side * each.height / 2) for each in chart.states for side in (-1, 1)
    ]
    corners += [corner for arc in arcs for corner in arc.corners]
    corners.append((chart.initial.x - chart.initial.width / 2 - 30.0, chart.initial.y))
    left, top = min(x for x, _ in corners) - MARGIN, min(y for _, y in corners) - MARGIN - 2 * LEADING
    right, bottom = max(x for x, _ in corners) + MARGIN, max(y for _, y in corners) + MARGIN
    from .picture import Painter  # which imports everything needed for drawing

    with style({"path.simplify": False}):
        canvas = new_canvas((right - left) / 72, (bottom - top) / 72)
        sheet = canvas.add_axes((0, 0, 1, 1), xlim=(left, right), ylim=(bottom, top))
        sheet.set_axis_off()
        painter = Painter(sheet, {})
        painter.words(Words(chart.path, left + MARGIN, top + MARGIN + NAME, NAME, bold=True))
        for arc in arcs:
            arc.paint(painter)
        _begin(painter, chart.initial)
        for state in chart.states:
            _paint(painter, state)
        save(canvas, path, dpi=144, facecolor="white")


def _place(chart: Statechart) -> None:
    """Place the modes on an ellipse, in their order, with the first one on the left."""
    for state in chart.states:
        widths = [text_width(state.name, NAME), *(text_width(line, SIZE) for line in state.lines)]
        state.width = max(48.0, *widths) + 20.0
        state.height = 26.0 + LEADING * len(state.lines)
    count = len(chart.states)
    if count == 1:
        return
    around = sum(state.width for state in chart.states) + GAP * count
    wide = max(around / 3.6, 130.0)
    high = wide * (0.55 if count > 2 else 0.0)
    for number, state in enumerate(chart.states):
        angle = math.pi + 2 * math.pi * number / count
        state.x, state.y = wide * math.cos(angle), high * math.sin(angle)


class _Arc:
    """A curved arrow with its labels beside the middle."""

    def __init__(self, arrow: Arrow, chart: Statechart) -> None:
        self.lines = [line for label in arrow.labels for line in textwrap.wrap(label, WIDEST)]
        self.width = max((text_width(line, SIZE) for line in self.lines), default=0.0)
        source, target = arrow.source, arrow.target
        if source is target:
            self._loop(source, chart)
        else:
            away = (target.x - source.x, target.y - source.y)
            length = math.hypot(*away)
            aside = (away[1] / length, -away[0] / length)  # so that the two directions between modes are apart
            bend = 0.12 * length + 16.0
            control = ((source.x + target.x) / 2 + aside[0] * bend, (source.y + target.y) / 2 + aside[1] * bend)
            self.start, self.end = _edge(source, control), _edge(target, control)
            self.bends = [control]
            at = _quadratic(self.start, control, self.end, 0.5)
            reach = self.width / 2 * abs(aside[0]) + LEADING * len(self.lines) / 2 * abs(aside[1]) + 5.0
            self.middle = (at[0] + aside[0] * reach, at[1] + aside[1] * reach)

    def _loop(self, state: State, chart: Statechart) -> None:
        """An arrow back to the same mode, on its free side."""
        if state.x > 1 and abs(state.y) < 1:
            side = state.x + state.width / 2
            self.start, self.end = (side, state.y - 10.0), (side, state.y + 10.0)
            self.bends = [(side + 42.0, state.y - 30.0), (side + 42.0, state.y + 30.0)]
            self.middle = (side + 38.0 + self.width / 2, state.y)
            return
        way = 1.0 if state.y > 1 or (len(chart.states) > 1 and abs(state.y) < 1) else -1.0
        edge = state.y + way * state.height / 2
        self.start, self.end = (state.x - 14.0, edge), (state.x + 14.0, edge)
        self.bends = [(state.x - 34.0, edge + way * 46.0), (state.x + 34.0, edge + way * 46.0)]
        self.middle = (state.x, edge + way * (42.0 + LEADING * len(self.lines) / 2))

    @property
    def corners(self) -> list[Point]:
        """The corners of its bounding box."""
        x, y = self.middle
        half = LEADING * len(self.lines) / 2
        return [(x - self.width / 2, y - half), (x + self.width / 2, y + half), *self.bends]

    def paint(self, painter: Painter) -> None:
        from matplotlib.path import Path as Outline

        curve = Outline.CURVE3 if len(self.bends) == 1 else Outline.CURVE4
        outline = Outline([self.start, *self.bends, self.end], [Outline.MOVETO, *[curve] * (len(self.bends) + 1)])
        look: Any = {"fill": False, "edgecolor": INK, "linewidth": 0.9, "zorder": 2}
        painter.sheet.add_artist(painter.shapes.PathPatch(outline, **look))
        _head(painter, self.bends[-1], self.end)
        x, y = self.middle
        first = y - LEADING * (len(self.lines) - 1) / 2 + 0.35 * SIZE
        for number, line in enumerate(self.lines):
            painter.words(Words(line, x, first + LEADING * number, SIZE, align="center"))


def _quadratic(start: Point, control: Point, end: Point, at: float) -> Point:
    shares = (1 - at) * (1 - at), 2 * at * (1 - at), at * at
    points = (start, control, end)
    x, y = (sum(share * point[axis] for share, point in zip(shares, points, strict=True)) for axis in (0, 1))
    return x, y


def _edge(state: State, towards: Point) -> Point:
    """Where the line from the centre of a mode to a point leaves its box."""
    dx, dy = towards[0] - state.x, towards[1] - state.y
    share = min(
        (state.width / 2 + 1.0) / abs(dx) if dx else math.inf, (state.height / 2 + 1.0) / abs(dy) if dy else math.inf
    )
    return state.x + share * dx, state.y + share * dy


def _head(painter: Painter, before: Point, tip: Point) -> None:
    angle = math.atan2(tip[1] - before[1], tip[0] - before[0])
    corners = [tip]
    for side in (-1, 1):
        corners.append((tip[0] - 7.0 * math.cos(angle + side * 0.35), tip[1] - 7.0 * math.sin(angle + side * 0.35)))
    painter.sheet.add_artist(painter.shapes.Polygon(corners, closed=True, facecolor=INK, edgecolor="none", zorder=2.5))


def _begin(painter: Painter, state: State) -> None:
    """The dot where the machine starts."""
    start, end = (state.x - state.width / 2 - 28.0, state.y), (state.x - state.width / 2 - 1.0, state.y)
    painter.sheet.add_artist(painter.shapes.Circle(start, 3.6, facecolor=INK, edgecolor="none", zorder=2.5))
    painter.path([(start, end)], INK, 0.9)
    _head(painter, start, end)


def _paint(painter: Painter, state: State) -> None:
    x, y = state.x - state.width / 2, state.y - state.height / 2
    painter.rectangle(x, y, state.width, state.height, "#f3f5f8", 9.0, zorder=3)
    if state.is_final:
        painter.rectangle(x + 2.5, y + 2.5, state.width - 5.0, state.height - 5.0, "#f3f5f8", 7.0, zorder=3)
    first = y + 17.0 if state.lines else state.y + 0.35 * NAME
    painter.words(Words(state.name, state.x, first, NAME, bold=True, align="center"))
    for number, line in enumerate(state.lines):
        at = first + LEADING * (number + 1.1)
        painter.words(Words(line, state.x, at, SIZE, is_soft=True, align="center"))
