"""Sheets: panels of axes, legends beside or above them, and tips, texts that appear under the pointer."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any, Literal, NamedTuple
from xml.etree import ElementTree
from xml.sax.saxutils import escape

from epicycle.actors import EpicycleError, abridged, shortened, visible_lines

from .canvas import new_canvas, save

# Okabe and Ito, Color Universal Design, 2008; with markers and dashes, so that lines differ in print, too.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#7f7f7f")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (7, 2, 1, 2)))
LIMIT = "#a00000"
FEW = len(PALETTE)  # lines that distinct colours tell apart; more lines get colours from a scale
MAX_LINES = 40  # per panel of a study
MAX_PANELS = 24
MAX_TEXT = 200  # characters per label
MAX_TIPS = 3000  # per picture
WIDTH, NARROW = 7.0, 4.6  # inches; the latter, of one or two columns, can be read on the screen of a telephone
_MAX_NAME = 36  # characters of a name beside an axis
_LONG = 30  # characters per line beside an axis
_LONGEST = {1: 58, 2: 29, 3: 30}  # and above a panel, by the number of columns
_PER_INCH = 15  # characters of a legend, in which a line takes the room of six
_NAMED = 26  # rows of a band that are named
_PAD = 0.06  # inches around the drawing
_SVG = "http://www.w3.org/2000/svg"
_INDEX = re.compile(r"\[(\d+)\]")


def width_of(columns: int) -> float:
    """The width of a sheet with so many columns, in inches."""
    return NARROW if columns <= 2 else WIDTH


def colours(count: int) -> list[str]:
    """Colours for a number of lines: the palette, or a scale from dark to light if there are more."""
    if count <= FEW:
        return [*PALETTE[:count]]
    import matplotlib
    from matplotlib.colors import to_hex

    scale = matplotlib.colormaps["viridis"]
    return [to_hex(scale(0.06 + 0.86 * index / (count - 1))) for index in range(count)]


class Tip(NamedTuple):
    """A text that appears under the pointer; its place is in points from the top left corner of the picture."""

    x: float
    y: float
    text: str


class Sheet:
    """Panels in rows and columns, with letters if there are several; used within ``style``.

    One or two columns fit on the screen of a telephone.  With ``heights`` (inches), the panels are below each other
    and belong together: the top one carries the title, and each has its legend beside it.
    """

    def __init__(
        self,
        panels: Sequence[str],
        *,
        columns: int | None = None,
        height: float = 2.3,
        heights: Sequence[float] = (),
        same_x: bool = False,
        same_y: bool | Literal["row"] = False,
    ) -> None:
        count = len(panels)
        few = max(1, min(count, 2)) if count <= 6 else 3
        self.columns = 1 if heights else columns or (few if count <= 12 else 4)
        self._width = WIDTH if heights else width_of(self.columns)
        rows = math.ceil(count / self.columns)
        tall = sum(heights) if heights else rows * height * {1: 1.25, 2: 1.0, 3: 1.0}.get(self.columns, 0.85)
        self.canvas = new_canvas(self._width, 0.5 + tall)
        self.canvas.set_layout_engine("constrained", h_pad=0.06, w_pad=0.06)
        grid = self.canvas.subplots(
            rows, self.columns, squeeze=False, sharex=same_x, sharey=same_y, height_ratios=heights or None
        )
        self.axes: list[Any] = list(grid.flat)[:count]
        self.are_alike = True  # whether all panels, or all in a row, share their axes
        self._tips: list[tuple[Any, float, float, str]] = []
        for axes in list(grid.flat)[count:]:
            axes.remove()
        for index, (axes, title) in enumerate(zip(self.axes, panels, strict=True)):
            letter = f"({chr(ord('a') + index)}) " if 1 < count <= 26 and not heights else ""
            if letter or title:
                longest = 90 if heights else _LONGEST.get(self.columns, 22)
                axes.set_title(fill(f"{letter}{title}", longest), loc="left")

    def call(self, axes: Any, x: str, y: str) -> None:
        """Label the axes of a panel; panels with the same axes are labelled only once."""
        index = self.axes.index(axes)
        has_below, has_before = index < len(self.axes) - self.columns, index % self.columns > 0
        axes.set_xlabel("" if self.are_alike and has_below else x)
        axes.set_ylabel("" if self.are_alike and has_before else fill(y, _LONG))
        if not has_below:
            axes.tick_params(labelbottom=True)

    def call_axes(self, x: str, y: str) -> None:
        """Label the axes of all panels."""
        for axes in self.axes:
            self.call(axes, x, y)

    def legend(self, handles: Sequence[Any], labels: Sequence[str], title: str = "") -> None:
        """Add a legend above the panels, where it hides nothing."""
        if not handles:
            return
        fit = int(self._width * _PER_INCH) // (max(map(len, labels)) + 6)
        columns = max(1, min(len(handles), fit, 5))
        self.canvas.legend(handles, labels, title=title or None, loc="outside upper center", ncols=columns)

    def band(self, names: Sequence[str], shades: Sequence[str], title: str, axes: Any = None) -> None:
        """Add a band of colours beside a panel, or beside all of them, in place of a legend with many names."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import BoundaryNorm, ListedColormap

        edges = [index - 0.5 for index in range(len(names) + 1)]
        scale = ScalarMappable(BoundaryNorm(edges, len(names)), ListedColormap(list(shades)))
        every = math.ceil(len(names) / _NAMED)
        ticks, beside = range(0, len(names), every), self.axes if axes is None else axes
        bar = self.canvas.colorbar(scale, ax=beside, ticks=ticks, pad=0.02, fraction=0.05)
        bar.ax.set_yticklabels([abridged(name, _MAX_NAME) for name in names[::every]])
        bar.ax.tick_params(labelsize=7, length=2)
        bar.minorticks_off()
        bar.outline.set_visible(False)
        bar.ax.set_title(fill(title, 18), loc="left", fontsize=8)

    def key(
        self, axes: Any, names: Sequence[str], handles: Sequence[Any], shades: Sequence[str], said: Sequence[str] = ()
    ) -> None:
        """Add a legend for a few lines beside a panel, which says more of each, or a band for many."""
        if len(names) <= FEW:
            labels = [f"{name}, {more}" for name, more in zip(names, said, strict=True)] if said else names
            legend_beside(axes, handles=handles, labels=labels)
        else:
            title, rows = in_common(names)
            self.band(rows, shades, title, axes)

    def tip(self, axes: Any, places: Iterable[tuple[float, float]], texts: Iterable[str], most: int = MAX_TIPS) -> None:
        """Add tips at places of a panel, in its coordinates; only a part if there are more than ``most``."""
        found = [(axes, x, y, text) for (x, y), text in zip(places, texts, strict=True)]
        self._tips += found[:: math.ceil(len(found) / most) or 1]

    def save(self, paths: Sequence[Path]) -> None:
        """Write the files, whose endings determine the format; SVG files contain the tips."""
        from matplotlib.text import Text

        for text in self.canvas.findobj(Text):  # the sheet grows with its texts, however long names are
            text.set_text(visible_lines(shortened(text.get_text(), MAX_TEXT)))
        self.canvas.draw_without_rendering()
        self.canvas.set_layout_engine("none")  # all files keep the layout for which tips are placed
        box = self.canvas.get_tightbbox().padded(_PAD)
        tips = list(self._placed(box))
        for path in paths:
            save(self.canvas, path, dpi=200, bbox_inches=box)
            if path.suffix.lower() == ".svg" and tips:
                _add_tips(path, tips)

    def _placed(self, box: Any) -> Iterable[Tip]:
        """The visible tips; only a part if there are very many."""
        inside = []
        for axes, x, y, text in self._tips:
            across, up = axes.transData.transform((x, y))
            if axes.bbox.x0 - 1 <= across <= axes.bbox.x1 + 1 and axes.bbox.y0 - 1 <= up <= axes.bbox.y1 + 1:
                inside.append(Tip(72 * (across / self.canvas.dpi - box.x0), 72 * (box.y1 - up / self.canvas.dpi), text))
        return inside[:: math.ceil(len(inside) / MAX_TIPS) or 1]


def _add_tips(path: Path, tips: Iterable[Tip]) -> None:
    """Add tips to an SVG file as invisible shapes with titles."""
    shapes = (
        f'<circle cx="{tip.x:.1f}" cy="{tip.y:.1f}" r="4"><title>{escape(visible_lines(tip.text))}</title></circle>\n'
        for tip in tips
    )
    text, end = path.read_text(encoding="utf-8"), "</svg>"
    body = text.rpartition(end)[0]
    path.write_text(f'{body}<g id="tips" fill-opacity="0">\n{"".join(shapes)}</g>\n{end}\n', encoding="utf-8")


class Tipped(NamedTuple):
    """The size of an SVG picture in points, and its tips."""

    width: float
    height: float
    tips: list[Tip]


def tips_of(svg: bytes) -> Tipped | None:
    """The size and the tips of a picture; None if it does not state its size."""
    try:
        root = ElementTree.fromstring(svg)
        _, _, width, height = map(float, root.attrib["viewBox"].replace(",", " ").split())
        found = [
            Tip(float(shape.attrib["cx"]), float(shape.attrib["cy"]), shape.findtext(f"{{{_SVG}}}title") or "")
            for group in root.findall(f"{{{_SVG}}}g[@id='tips']")
            for shape in group
        ]
    except (ElementTree.ParseError, KeyError, ValueError):
        return None
    return Tipped(width, height, found)


# -- legends ----------------------------------------------------------------------------------------------------------


def legend_beside(axes: Any, **options: Any) -> None:
    """A legend to the right of the axes, of any length."""
    found = axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0, **options)
    for text in found.get_texts():
        text.set_text(fill(abridged(text.get_text(), 2 * _MAX_NAME), _MAX_NAME))


def in_common(names: Sequence[str]) -> tuple[str, list[str]]:
    """The common part of the names of an array's elements and their indices; otherwise the names."""
    parts = [_INDEX.split(name) for name in names]
    alike = {len(each) for each in parts}
    varying = [place for place, column in enumerate(zip(*parts, strict=False)) if len(set(column)) > 1]
    if len(alike) != 1 or len(varying) != 1 or varying[0] % 2 == 0:
        return "", [*names]
    place, words = varying[0], [*parts[0]]
    words[place] = "*"
    whole = "".join(f"[{word}]" if at % 2 else word for at, word in enumerate(words))
    return whole, [each[place] for each in parts]


def set_log(axes: Any, *, x: bool, y: bool) -> None:
    """Make axes logarithmic; raises ``EpicycleError`` if nothing on one of them is positive."""
    from matplotlib.ticker import LogLocator, NullFormatter

    for which, wanted in (("x", x), ("y", y)):
        if not wanted:
            continue
        low, high = getattr(axes.dataLim, f"minpos{which}"), getattr(axes.dataLim, f"interval{which}")[1]
        if not high > 0.0 or not math.isfinite(low):
            side = "horizontal" if which == "x" else "vertical"
            raise EpicycleError(f"no value on the {side} axis is positive, so it cannot be logarithmic")
        getattr(axes, f"set_{which}scale")("log", nonpositive="clip")
        axis = getattr(axes, f"{which}axis")
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)))
        axis.set_major_formatter(lambda value, _: f"{value:g}")  # the default one writes formulas
        axis.set_minor_formatter(NullFormatter())
