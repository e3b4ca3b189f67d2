"""How figures of a report look: one style, colours that everyone can tell apart, files that are the same each time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import Any, Literal

from ..canvas import open_matplotlib, plain_text
from ..figures import save

# Okabe and Ito, Color Universal Design, 2008; with markers and dashes, so that lines differ in print, too.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#7f7f7f")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
DASHES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)), (0, (1, 1)), (0, (7, 2, 1, 2)))
LIMIT = "#a00000"
MAX_LINES = len(PALETTE)  # in one panel; more could not be told apart
MAX_PANELS = 24
FORMATS = ("png", "svg")
_LONG = 30  # letters in a line beside an axis
_LONGEST = {1: 60, 2: 46, 3: 30}  # and above a panel, by the number of columns
_STYLE: dict[str, Any] = {
    "font.size": 8.5,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "svg.fonttype": "path",
}


@contextmanager
def style() -> Iterator[None]:
    """Whatever a user has set for plots of their own."""
    open_matplotlib()
    import matplotlib.style

    with matplotlib.style.context(["default", _STYLE]), plain_text():
        yield


class Sheet:
    """Panels in rows and columns, with letters if there are several; used within ``style``."""

    def __init__(
        self,
        panels: Sequence[str],
        *,
        columns: int | None = None,
        height: float = 2.3,
        same_x: bool = False,
        same_y: bool | Literal["row"] = False,
    ) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        count = len(panels)
        self.columns = columns or _columns(count)
        rows = math.ceil(count / self.columns)
        width = 4.4 if self.columns == 1 else 7.0
        self.canvas = Figure(figsize=(width, 0.5 + rows * (height if self.columns < 4 else 0.85 * height)))
        FigureCanvasAgg(self.canvas)
        self.canvas.set_layout_engine("constrained", h_pad=0.06, w_pad=0.06)
        grid = self.canvas.subplots(rows, self.columns, squeeze=False, sharex=same_x, sharey=same_y)
        self.axes: list[Any] = list(grid.flat)[:count]
        for axes in list(grid.flat)[count:]:
            axes.remove()
        for index, (axes, title) in enumerate(zip(self.axes, panels, strict=True)):
            letter = f"({chr(ord('a') + index)}) " if 1 < count <= 26 else ""
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
        self.canvas.legend(
            handles, labels, title=title or None, title_fontsize=8.5, loc="outside upper center", ncols=columns
        )

    def save(self, paths: Sequence[Path]) -> None:
        """Write the files, whose endings decide the format."""
        for path in paths:
            save(self.canvas, path)


def _columns(count: int) -> int:
    if count <= 3:
        return max(count, 1)
    return 2 if count == 4 else 3 if count <= 12 else 4
