"""Drawing with matplotlib: one style, text drawn literally, reproducible files."""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from epicycle.actors import EpicycleError, readable, visible

from ..execution.results import Results
from ..model.catalogue.figure import Figure
from ..model.text.problems import Position, told_raised
from ..model.text.program import describe, raised_at

FORMATS = ("png", "svg")
_UNWRITABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")  # not allowed in XML files
# What matplotlib would write into a file by default: names, versions, times.
_METADATA = {
    "svg": ("Creator", "Date", "Format", "Type"),
    "png": ("Software",),
    "pdf": ("Creator", "Producer", "CreationDate"),
}


def open_matplotlib() -> None:
    """Import matplotlib even if MPLBACKEND names a missing backend: our canvases need none."""
    if "matplotlib" in sys.modules:
        return
    asked = os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib
    finally:
        if asked is not None:
            os.environ["MPLBACKEND"] = asked
    if asked is not None:
        with suppress(ValueError):  # for users' own drawings
            matplotlib.rcParams["backend"] = asked


@contextmanager
def style(further: Mapping[str, Any] = MappingProxyType({})) -> Iterator[None]:
    """Apply the style of all our pictures, regardless of what users have set for their own plots."""
    open_matplotlib()
    import matplotlib.style

    ours = Path(__file__).with_suffix(".mplstyle")
    with matplotlib.style.context(["default", ours, dict(further)]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # the font shows a box for missing characters
        yield


@lru_cache(maxsize=16)
def font(size: float, bold: bool = False) -> Any:
    """The font that comes with matplotlib, in a given size."""
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


def save(canvas: Any, path: Path, **options: Any) -> None:
    """Write a matplotlib figure; the ending determines the format, and equal figures give equal bytes."""
    kind = path.suffix.lower().removeprefix(".")
    if kind == "png":
        options = {"pil_kwargs": {"optimize": True}, **options}
    canvas.savefig(path, format=kind, metadata=dict.fromkeys(_METADATA.get(kind, ())), **options)
    if kind == "svg" and _UNWRITABLE.search(text := path.read_text(encoding="utf-8")):
        # Comments contain the texts, too, without escapes.
        path.write_text(_UNWRITABLE.sub(lambda found: visible(found[0]), text), encoding="utf-8")


class FigureError(EpicycleError):
    """A figure cannot be drawn; ``raised`` is the line of a user's class that raised the exception."""

    def __init__(self, name: str, reason: str, raised: Position | None = None) -> None:
        super().__init__(name, reason, raised)
        self.name = name
        self.reason = reason
        self.raised = raised

    def __str__(self) -> str:
        lines = [readable(f"figure {self.name} cannot be drawn: {self.reason}")]
        return "\n".join([*lines, *(told_raised(self.raised) if self.raised is not None else [])])


def draw(name: str, figure: Figure, results: Results, path: Path) -> None:
    """Draw a figure to a file; raises ``FigureError`` for any exception of its class."""
    try:
        with style():
            figure.draw(results, path)
    except Exception as error:
        raise FigureError(name, describe(error), raised_at(error)) from error
