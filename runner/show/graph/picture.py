"""Writes a drawing as SVG, PNG or PDF.

matplotlib makes all of them, so they look the same; text is drawn as shapes, so no font is needed.  The colours are
Okabe and Ito's, which people with any colour vision can tell apart; every badge also shows its name.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import networkx as nx

from epicycle.aspects import Processor

from ...model.graph.woven import WovenAspect, extent
from ..canvas import font, new_canvas, save, style, text_width
from .layout import (
    BADGE,
    BADGE_HEIGHT,
    LINE,
    MARGIN,
    PORT,
    Badge,
    Drawing,
    Line,
    PlacedBox,
    Point,
    Wire,
    Words,
    badge_height,
    badge_width,
)
from .outlines import FINAL, START, duration, shared, short_name

INK, SOFT, FAINT = "#1a1a1a", "#5f6672", "#a9afb8"
FRAMES = ("#f3f5f8", "#e9edf3", "#dfe5ed", "#d5dde7")
ASPECTS = ("#E69F00", "#56B4E9", "#009E73", "#CC79A7", "#F0E442", "#D55E00", "#0072B2", "#999999")
DARK = ("#D55E00", "#0072B2", "#009E73")  # text on these is white
# For a PNG: whole pixels per point, so that lines are sharp; the most pixels in all, and on one side.
DPI, PIXELS, SIDE = (144, 72), 1.6e7, 12000
ROW = 15.0  # height of a line of the legend


def write_picture(drawing: Drawing, path: Path) -> None:
    """Draw to a file whose ending determines the format; equal drawings give equal bytes."""
    aspects = aspects_seen(drawing)
    legend = legend_of(drawing, aspects)
    width = max([drawing.width, *(row.indent + text_width(row.explanation, PORT) + 2 * MARGIN for row in legend)])
    height = drawing.height + ROW * len(legend) + (MARGIN if legend else 0.0)
    most = 72 * min(SIDE / max(width, height), math.sqrt(PIXELS / (width * height)))
    with style({"path.simplify": False}):
        canvas = new_canvas(width / 72, height / 72)
        sheet = canvas.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(height, 0))
        sheet.set_axis_off()
        colours = dict(zip(aspects, cycle(ASPECTS), strict=False))
        Painter(sheet, colours).paint(drawing, legend)
        save(canvas, path, dpi=next((dpi for dpi in DPI if dpi <= most), most), facecolor="white")


def aspects_seen(drawing: Drawing) -> dict[str, list[WovenAspect]]:
    """The aspects whose badges are in a drawing, by name, in order of declaration."""
    seen = {badge.aspect for badge in drawing.badges}
    found: dict[str, list[WovenAspect]] = {}
    for woven in drawing.outline.model.aspects:
        if (name := short_name(woven.name)) in seen:
            found.setdefault(name, []).append(woven)
    return found


class Row(NamedTuple):
    """A line of the legend: a sample from the drawing, and its meaning."""

    sample: str  # aspect, label, port, stack, director or closed
    words: str
    explanation: str

    @property
    def indent(self) -> float:
        """Where the explanation starts, beside the sample."""
        return 6.0 + (badge_width(self.words) if self.words else 14.0)


def tied(drawing: Drawing) -> list[list[Badge]]:
    """For each medium and processor that several places share, its badges."""
    groups: dict[tuple[str, ...], list[Badge]] = {}
    for woven in drawing.outline.model.aspects:
        if key := shared(woven):
            places = [*woven.ports, *woven.actors]
            groups.setdefault(key, []).extend(
                badge
                for badge in drawing.badges
                if badge.aspect == short_name(woven.name)
                and any(place == badge.place or place.startswith(f"{badge.place}.") for place in places)
            )
    return [group for group in groups.values() if len(group) > 1]


def ties(group: list[Badge]) -> Iterator[Line]:
    """Lines that join badges: each to the nearest earlier one, horizontally and then vertically."""
    middles = sorted((badge.x + badge.width / 2, badge.y) for badge in group)
    for number, (x, y) in enumerate(middles[1:], start=1):
        other, level = min(middles[:number], key=lambda end: abs(end[0] - x) + abs(end[1] - y))
        yield ((other, level), (x, level), (x, y)) if other != x and level != y else ((other, level), (x, y))


def legend_of(drawing: Drawing, aspects: dict[str, list[WovenAspect]]) -> list[Row]:
    """The lines that explain a drawing."""
    boxes = [placed.box for placed in drawing.boxes]
    rows = []
    for name, woven in aspects.items():
        kinds = ", ".join(dict.fromkeys(each.kind for each in woven))
        rows.append(Row("aspect", name, f"aspect {kinds}, at {extent(woven)}{_sharing(woven)}"))
    delay = next((badge.delay for badge in drawing.badges if badge.delay is not None), None)
    if delay is not None:
        rows.append(Row("label", duration(delay), "delay of a connection"))
    if drawing.cut:
        which = "a connection" if drawing.cut == 1 else f"{drawing.cut} connections"
        rows.append(Row("label", "a.output \u2192", f"the other end of {which} with a long way"))
    signs = {
        "port": ("port for any number of connections", any(p.is_multi for b in boxes for p in (*b.inputs, *b.outputs))),
        "stack": ("identical instances", any(box.count > 1 for box in boxes)),
        "director": ("composite with its own director", any(box.has_director for box in boxes)),
        "closed": ("composite shown without its inside", any(box.is_closed for box in boxes)),
    }
    return rows + [Row(sample, "", explanation) for sample, (explanation, is_seen) in signs.items() if is_seen]


def _sharing(woven: list[WovenAspect]) -> str:
    """The explanation if the places of aspects share something."""
    found = {shared(each) for each in woven}
    if None in found or sum(len(each.places) for each in woven) < 2:
        return ""
    what = "processor" if isinstance(woven[0].aspect, Processor) else "medium"
    return f", which share one {what}" if len(found) == 1 else f"; dashed lines join those that share one {what}"


class Painter:
    """Paints on matplotlib axes."""

    def __init__(self, sheet: Any, colours: dict[str, str]) -> None:
        from matplotlib import patches

        self.sheet = sheet
        self.shapes = patches
        self.colours = colours  # of aspects
        self.waiting: dict[tuple[str, str, float], list[Any]] = {}  # small shapes by face, edge and order

    def paint(self, drawing: Drawing, legend: list[Row]) -> None:  # from bottom to top
        for placed in drawing.boxes:
            self.box(placed)
        for group in tied(drawing):
            self.path(ties(group), self.colours[group[0].aspect], 3.0, dashes=(1.2, 1.0))
        self.wires(drawing.wires)
        for placed in drawing.boxes:
            for port in placed.ports if not placed.box.shape else ():
                self.port(port.x, port.y, INK if port.is_joined else FAINT, port.port.is_multi)
        self.marks()
        for words in drawing.words:
            self.words(words)
        for badge in drawing.badges:
            self.badge(badge.text, badge.aspect, badge.x, badge.y)
        for number, row in enumerate(legend):
            self.row(row, MARGIN, drawing.height + MARGIN / 2 + ROW * (number + 0.5))
        self.marks()

    def box(self, placed: PlacedBox) -> None:
        """A box: white for an actor, shaded for a composite, with a double border if it has a director."""
        box, x, y = placed.box, placed.x, placed.y
        if box.shape == START:
            self.sheet.add_artist(self.shapes.Circle((x + placed.width / 2, y + placed.height / 2), 4.0, facecolor=INK))
            return
        fill = FRAMES[placed.level % len(FRAMES)] if box.is_composite else "white"
        for inset in (8.0, 4.0) if box.count > 1 else ():
            self.rectangle(x + inset, y + inset, placed.width - 2 * inset, placed.height - inset / 4, fill)
        radius = 9.0 if box.shape else 3.0
        self.rectangle(x, y, placed.width, placed.height, fill, radius)
        if box.has_director or box.shape == FINAL:
            self.rectangle(x + 2.5, y + 2.5, placed.width - 5.0, placed.height - 5.0, fill, radius - 0.5)
        if box.is_closed:
            self.closed(x + placed.width - 10.0, y + 3.0)

    def rectangle(
        self, x: float, y: float, width: float, height: float, fill: str, radius: float = 3.0, **look: float
    ) -> None:
        """A box with rounded corners."""
        style = f"round,pad=0,rounding_size={radius:g}"
        look = {"linewidth": 1.0, **look}
        box = self.shapes.FancyBboxPatch((x, y), width, height, style, facecolor=fill, edgecolor=INK, **look)
        self.sheet.add_artist(box)

    def closed(self, x: float, y: float) -> None:
        """The symbol of a composite that is drawn closed."""
        self.path([((x, y), (x + 7, y), (x + 7, y + 7), (x, y + 7), (x, y))], SOFT, 0.7, radius=0.0)
        self.path([((x + 1.5, y + 3.5), (x + 5.5, y + 3.5)), ((x + 3.5, y + 1.5), (x + 3.5, y + 5.5))], SOFT, 0.7)

    def port(self, x: float, y: float, ink: str, is_multi: bool) -> None:
        """A mark on the edge, white if it takes any number of connections."""
        corners = [(x - 2.2, y - 2.2), (x + 2.2, y - 2.2), (x + 2.2, y + 2.2), (x - 2.2, y + 2.2)]
        self.waiting.setdefault(("white" if is_multi else ink, ink, 3.0), []).append(self.shapes.Polygon(corners))

    def marks(self) -> None:
        """Paint the small shapes that wait: those that look alike as one path, which is much quicker."""
        from matplotlib.path import Path as Outline

        for (face, edge, order), shapes in self.waiting.items():
            paths = [shape.get_transform().transform_path(shape.get_path()) for shape in shapes]
            look: Any = {"facecolor": face, "edgecolor": edge, "linewidth": 0.8, "zorder": order}
            self.sheet.add_artist(self.shapes.PathPatch(Outline.make_compound_path(*paths), **look))
        self.waiting.clear()

    def wires(self, wires: Iterable[Wire]) -> None:
        """All lines, dots where they branch, and arrowheads where they end."""
        marks = self.waiting.setdefault((INK, "none", 2.5), [])
        # Lines that share a port partly overlap: painted as one path, they are not darker there.
        graph: Any = nx.Graph()
        for wire in wires:
            graph.add_edges_from((wire, end) for end in (wire.source, *wire.targets))
        for together in nx.connected_components(graph):
            self.path([line for wire in wires if wire in together for line in wire.lines], INK, 1.0)
        for dot in (dot for wire in wires for dot in wire.dots):
            marks.append(self.shapes.Circle(dot, 1.8))
        for x, y in (head for wire in wires for head in wire.heads):
            marks.append(self.shapes.Polygon([(x - 2.4, y), (x - 8.4, y - 2.6), (x - 8.4, y + 2.6)]))

    def path(
        self, lines: Iterable[Line], colour: str, width: float, radius: float = 4.0, dashes: Sequence[float] = ()
    ) -> None:
        """Lines with rounded corners."""
        from matplotlib.path import Path as Outline

        corners: list[Point] = []
        codes: list[Any] = []
        for line in lines:
            corners.append(line[0])
            codes.append(Outline.MOVETO)
            for before, corner, after in zip(line, line[1:], line[2:], strict=False):
                room = min(radius, math.dist(before, corner) / 2, math.dist(corner, after) / 2)
                corners += [_towards(corner, before, room), corner, _towards(corner, after, room)]
                codes += [Outline.LINETO, Outline.CURVE3, Outline.CURVE3]
            corners.append(line[-1])
            codes.append(Outline.LINETO)
        if corners:
            look: dict[str, Any] = {"fill": False, "edgecolor": colour, "linewidth": width, "zorder": 2}
            look |= {"linestyle": (0, dashes), "capstyle": "butt"} if dashes else {"capstyle": "round"}
            self.sheet.add_artist(self.shapes.PathPatch(Outline(corners, codes), **look))

    def badge(self, words: str, aspect: str, x: float, y: float) -> None:
        """A badge: coloured for an aspect, white for a label of the connection."""
        fill, width, height = self.colours[aspect] if aspect else "white", badge_width(words), badge_height(words)
        self.rectangle(x, y - height / 2, width, height, fill, BADGE_HEIGHT / 2, linewidth=0.6, zorder=4)
        ink = "white" if fill in DARK else INK
        first = y - (height - BADGE_HEIGHT) / 2 + 0.35 * BADGE
        for number, line in enumerate(words.split("\n")):
            self.words(Words(line, x + width / 2, first + LINE * number, BADGE, align="center"), ink)

    def words(self, words: Words, colour: str = "") -> None:
        look = {"color": colour or (SOFT if words.is_soft else INK), "ha": words.align, "va": "baseline", "zorder": 5}
        self.sheet.text(words.x, words.y, words.text, fontproperties=font(words.size, words.bold), **look)

    def row(self, row: Row, x: float, middle: float) -> None:
        if row.sample == "stack":
            for step in (2, 1, 0):
                self.rectangle(x + step, middle - 4.0 + 1.7 * step, 13.0 - 2 * step, 6.0, "white")
        elif row.sample == "port":
            self.port(x + 7.0, middle, INK, True)
        elif row.sample == "director":
            self.rectangle(x, middle - 5.0, 13.0, 10.0, "white")
            self.rectangle(x + 2.0, middle - 3.0, 9.0, 6.0, "white")
        elif row.sample == "closed":
            self.closed(x + 3.0, middle - 3.5)
        else:
            self.badge(row.words, row.words if row.sample == "aspect" else "", x, middle)
        self.words(Words(row.explanation, x + row.indent, middle + 0.35 * PORT, PORT))


def _towards(start: Point, end: Point, way: float) -> Point:
    """The point at a given distance from one point towards another."""
    share = way / (math.dist(start, end) or 1.0)
    return start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share
