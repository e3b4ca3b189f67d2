"""draw the model graph"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import complain, tell
from .options import DONE, add_model, load, whole

DESCRIPTION = "Draw the model graph: actors, composites, ports, connections with their delays, and aspects."


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle graph``."""
    add_model(command)
    command.add_argument(
        "-o",
        dest="out",
        metavar="FILE",
        type=Path,
        help="write to FILE (.svg, .png or .pdf; .mmd or .md for Mermaid); without it, Mermaid text is printed",
    )
    command.add_argument(
        "--depth",
        metavar="N",
        type=whole(0),
        help="open composites N levels deep, 0 for none (default: as deep as the drawing stays readable)",
    )
    command.add_argument(
        "--expand", action="store_true", help="draw every instance of an array, also where they are alike"
    )


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Draw the graph, and say what is not shown of it."""
    from ..show.graph import check_graph_path, mermaid, outline, write_graph

    if options.out is not None:
        check_graph_path(options.out)
    model = load(options)
    drawn = outline(model, depth=options.depth, expand=options.expand)
    if options.out is None:
        tell(mermaid(drawn).rstrip("\n"))
    else:
        write_graph(drawn, options.out)
        tell(f"wrote {options.out}")
    if drawn.note and options.depth is None:
        complain(f"note: {drawn.note}")
    return DONE
