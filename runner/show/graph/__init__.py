"""Draws the model graph as a picture (SVG, PNG, PDF) or as Mermaid text, without any system package.

Four steps: what is drawn (``outlines``), in which layer (``layers``), where exactly (``places``, ``layout``), and how
it looks (``picture``, ``mermaid_text``).

Why we have our own layout: it needs nested boxes, ports on fixed sides, lines at right angles, trees for fan-out and
room for badges.  Graphviz has no ports on clusters, and its right-angled lines ignore ports altogether; its builds for
WebAssembly inherit that.  The Eclipse Layout Kernel can do all of this, but in Java and JavaScript; the Python port
that we tried (pyelk 0.3) omits connections of composite ports and lets boxes overlap. graph-layout supports ports only
in a layout without layers and nesting; grandalf, graphlay and fast-sugiyama do not support them.  So only the graph
algorithms (networkx), the linear programme (SciPy) and the drawing (matplotlib) come from libraries.
"""

from __future__ import annotations

from pathlib import Path

from epicycle.actors import EpicycleError

from .chart import statechart
from .layout import Drawing, draw
from .mermaid_text import mermaid
from .outlines import Outline, outline

MOST_BOXES = 2000  # in a picture, and on a page; Mermaid text has no limit
PICTURES, TEXTS = (".svg", ".png", ".pdf"), (".mmd", ".md")

__all__ = [
    "MOST_BOXES",
    "Drawing",
    "GraphError",
    "Outline",
    "check_graph_path",
    "draw",
    "mermaid",
    "outline",
    "statechart",
    "write_graph",
]


class GraphError(EpicycleError):
    """A picture of the model graph cannot be made."""


def check_graph_path(path: Path) -> None:
    """Raise ``GraphError`` if a graph cannot be written to this path."""
    if path.suffix.lower() not in (*PICTURES, *TEXTS):
        raise GraphError(f"{path} is not a picture: its name must end in one of {', '.join((*PICTURES, *TEXTS))}")
    if path.is_dir():
        raise GraphError(f"{path} cannot be written: it is a folder")
    if not path.parent.is_dir():
        raise GraphError(f"{path} cannot be written: there is no folder {path.parent}")


def write_graph(drawn: Outline, path: Path) -> None:
    """Write an outline, such as a statechart, to a file whose ending determines the format; raises ``GraphError``."""
    check_graph_path(path)
    try:
        if path.suffix.lower() in TEXTS:
            text = mermaid(drawn)
            path.write_text(f"```mermaid\n{text}```\n" if path.suffix.lower() == ".md" else text, encoding="utf-8")
        else:
            from .picture import write_picture

            if (boxes := drawn.size) > MOST_BOXES:
                raise GraphError(
                    f"{boxes:,} boxes are too many for a picture (at most {MOST_BOXES:,})\n"
                    "   help: --depth 0 draws the outermost level only, without --expand what is alike is one box, and "
                    "Mermaid text (.mmd) has no limit"
                )
            write_picture(draw(drawn), path)
    except OSError as error:
        raise GraphError(f"{path} cannot be written: {error.strerror or error}") from error
