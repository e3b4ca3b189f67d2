"""The pen of all pictures, matplotlib: one style, text drawn as it stands, files that are the same each time."""

from __future__ import annotations

import math
import os
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from textwrap import fill
from types import MappingProxyType
from typing import Any, Literal

from epicycle.actors import EpicycleError, readable, shortened

from ..catalogue import Figure
from ..results import Results
from ..text import Position, describe, raised_at, told_raised

# Okabe and Ito, Color Universal Design, 2008; with markers and dashes, so that lines differ in print, too.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#7f7f7f")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (7, 2, 1, 2)))
LIMIT = "#a00000"
MAX_LINES = len(PALETTE)  # in one panel; more could not be told apart
MAX_PANELS = 24
FORMATS = ("png", "svg")
MAX_TEXT = 200  # characters of a label
_LONG = 30  # letters in a line beside an axis
_LONGEST = {1: 60, 2: 46, 3: 30}  # and above a panel, by the number of columns
# What matplotlib would write into a file of its own accord: names, versions, times.
_METADATA = {
    "svg": ("Creator", "Date", "Format", "Type"),
    "png": ("Software",),
    "pdf": ("Creator", "Producer", "CreationDate"),
}


def open_matplotlib() -> None:
    """Import matplotlib, also where MPLBACKEND asks for what there is not: our canvases need no backend."""
    if "matplotlib" in sys.modules:
        return
    asked = os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib
    finally:
        if asked is not None:
            os.environ["MPLBACKEND"] = asked
    if asked is not None:
        with suppress(ValueError):  # for what users draw themselves
            matplotlib.rcParams["backend"] = asked


@contextmanager
def style(further: Mapping[str, Any] = MappingProxyType({})) -> Iterator[None]:
    """What is drawn meanwhile looks as all our pictures do, whatever a user has set for plots of their own."""
    open_matplotlib()
    import matplotlib.style

    ours = Path(__file__).with_suffix(".mplstyle")
    with matplotlib.style.context(["default", ours, dict(further)]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a box stands for what the font lacks
        yield


@lru_cache(maxsize=16)
def font(size: float, bold: bool = False) -> Any:
    """The font that comes with matplotlib, in a size."""
    open_matplotlib()
    from matplotlib.font_manager import FontProperties

    return FontProperties(family="DejaVu Sans", size=size, weight="bold" if bold else "normal")


@lru_cache(maxsize=65536)
def text_width(text: str, size: float, bold: bool = False) -> float:
    """The width of a line of text in this font, in points, rounded up: layout needs no canvas."""
    open_matplotlib()
    from matplotlib.textpath import text_to_path

    wide, _, _ = text_to_path.get_text_width_height_descent(text, font(size, bold), ismath=False)
    return float(int(wide) + 1)


def new_canvas(width: float, height: float) -> Any:
    """An empty matplotlib figure (inches), which needs no screen."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height))


def save(canvas: Any, path: Path, **options: object) -> None:
    """Write a matplotlib figure; the ending decides the format, and the same figure gives the same bytes."""
    kind = path.suffix.lower().removeprefix(".")
    canvas.savefig(path, format=kind, metadata=dict.fromkeys(_METADATA.get(kind, ())), **options)


class FigureError(EpicycleError):
    """A figure cannot be drawn; ``raised`` is the line of a user's class from which the exception comes."""

    def __init__(self, name: str, reason: str, raised: Position | None = None) -> None:
        super().__init__(name, reason, raised)
        self.name = name
        self.reason = reason
        self.raised = raised

    def __str__(self) -> str:
        lines = [readable(f"figure {self.name} cannot be drawn: {self.reason}")]
        return "\n".join([*lines, *(told_raised(self.raised) if self.raised is not None else [])])


def draw(name: str, figure: Figure, results: Results, path: Path) -> None:
    """Draw a figure into a file; raises ``FigureError`` for whatever its class raises."""
    try:
        with style():
            figure.draw(results, path)
    except Exception as error:
        raise FigureError(name, describe(error), raised_at(error)) from error


class Sheet:
    """Panels in rows and columns, with letters if there are several; used within ``style``.

    With ``heights`` (inches) the panels stand below each other and belong together: one has the title of all, and the
    legend of each stands beside it.
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
        few = {0: 1, 4: 2}.get(count, min(count, 3))
        self.columns = 1 if heights else columns or (few if count <= 12 else 4)
        rows = math.ceil(count / self.columns)
        if heights:
            self.canvas = new_canvas(7.0, 0.4 + sum(heights))
        else:
            width = 4.4 if self.columns == 1 else 7.0
            self.canvas = new_canvas(width, 0.5 + rows * (height if self.columns < 4 else 0.85 * height))
            self.canvas.set_layout_engine("constrained", h_pad=0.06, w_pad=0.06)
        grid = self.canvas.subplots(
            rows, self.columns, squeeze=False, sharex=same_x, sharey=same_y, height_ratios=heights or None
        )
        self.axes: list[Any] = list(grid.flat)[:count]
        for axes in list(grid.flat)[count:]:
            axes.remove()
        for index, (axes, title) in enumerate(zip(self.axes, panels, strict=True)):
            letter = f"({chr(ord('a') + index)}) " if 1 < count <= 26 and not heights else ""
            if letter or title:
                axes.set_title(fill(f"{letter}{title}", _LONGEST.get(self.columns, 22)), loc="left")

    def call_axes(self, x: str, y: str) -> None:
        """Say what the axes are: below the panels that have nothing below them, and where rows begin."""
        for axes in self.axes[max(0, len(self.axes) - self.columns) :]:
            axes.set_xlabel(x)
            axes.tick_params(labelbottom=True)
        for axes in self.axes[:: self.columns]:
            axes.set_ylabel(fill(y, _LONG))

    def legend(self, handles: Sequence[Any], labels: Sequence[str], title: str = "") -> None:
        """Above the panels, where it hides nothing."""
        if not handles:
            return
        long = max(map(len, labels)) > 22
        columns = min(len(handles), 2 if long else 5 if self.columns > 1 else 4)
        self.canvas.legend(handles, labels, title=title or None, loc="outside upper center", ncols=columns)

    def save(self, paths: Sequence[Path]) -> None:
        """Write the files, whose endings decide the format."""
        from matplotlib.text import Text

        for text in self.canvas.findobj(Text):  # whatever a model is called: a sheet grows with the texts on it
            text.set_text(shortened(text.get_text(), MAX_TEXT))
        for path in paths:
            save(self.canvas, path, dpi=200, bbox_inches="tight")


def legend_beside(axes: Any, **options: Any) -> None:
    """A legend to the right of the axes, as long as need be."""
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0, **options)
