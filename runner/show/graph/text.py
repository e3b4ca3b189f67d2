"""How wide text is, in the font that comes with matplotlib, so that layout needs no canvas."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from ..pen import open_matplotlib

FAMILY = "DejaVu Sans"
NAME, KIND, PORT, PILL = 9.0, 7.5, 7.0, 6.5  # font sizes in points


@lru_cache(maxsize=16)
def font(size: float, bold: bool = False) -> Any:
    """The font of a size."""
    open_matplotlib()
    from matplotlib.font_manager import FontProperties

    return FontProperties(family=FAMILY, size=size, weight="bold" if bold else "normal")


@lru_cache(maxsize=65536)
def width(text: str, size: float, bold: bool = False) -> float:
    """The width of a line of text, in points, rounded up."""
    open_matplotlib()
    from matplotlib.textpath import text_to_path

    wide, _, _ = text_to_path.get_text_width_height_descent(text, font(size, bold), ismath=False)
    return float(int(wide) + 1)
