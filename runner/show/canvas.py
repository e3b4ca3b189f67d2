"""The door to matplotlib: it opens whatever the environment says, and text that is drawn is text."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

# Names, labels and docs of models stand in figures as they are: `$\left` is no formula, and no TeX is started.
PLAIN: Final[Any] = {
    "text.parse_math": False,
    "text.usetex": False,
    "axes.formatter.use_mathtext": False,
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
def plain_text() -> Iterator[None]:
    """All text that is drawn meanwhile is drawn as it stands; a box stands for what the font lacks."""
    open_matplotlib()
    import matplotlib

    with matplotlib.rc_context(PLAIN), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")
        yield
