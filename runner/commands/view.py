"""show a run in a browser, or in other viewers"""

from __future__ import annotations

import argparse
import webbrowser
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING

from ..printing import tell
from .options import CHANGES, DONE, RUN, SEED, UNTIL, check_path, command, complain_of_change, open_run, option

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..show.view import Recording


@command(
    "show a run in a browser: space, graph, signals, and what caused what",
    option("model", metavar="MODEL or RESULTS", nargs="+", help=f"one or two of: {RUN}"),
    *CHANGES,
    SEED,
    UNTIL,
    option(
        "-o",
        "--out",
        metavar="FILE",
        type=Path,
        help="write the page to FILE (default: results/MODEL/view.html, which is opened in the browser)",
    ),
    option("--mcap", metavar="FILE", type=Path, help="write the run for Foxglove or Lichtblick; no page without -o"),
    option("--rerun", metavar="FILE", type=Path, help="write the run for rerun; no page without -o"),
    imports=("calls.viewing",),
)
def view(options: argparse.Namespace) -> int:
    """Run a model and write a page that shows the run: it needs no network, and any browser opens it.

    For a results folder, its run is repeated, with what else is said on top.  Two runs are shown side by side, with the
    first difference between them.  --mcap and --rerun write the run for other viewers.
    """
    from epicycle.actors import EpicycleError

    from ..calls import recorded

    if len(options.model) > 2:
        raise EpicycleError(f"a page shows one run or two, not {len(options.model)}: {', '.join(options.model)}")
    if options.out is not None:
        check_path("--out", options.out)
    exports = _exports(options)
    each = [copy(options) for _ in options.model]
    for one, name in zip(each, options.model, strict=True):
        one.model = name
    runs = [open_run(one) for one in each]
    made = recorded(
        [run.model for run in runs],
        seed=[run.seed for run in runs],
        until=[run.until for run in runs],
        names=[Path(name).name.removesuffix(".yaml") for name in options.model],
    )
    for name, run, recording in zip(options.model, runs, made.recordings, strict=False):
        if not made.errors and recording.results is not None:
            complain_of_change(name, run.digest, recording.results.digest)
    for path, write in exports:
        write(made.recordings[0], path)
        tell(f"wrote {path}")
    page = options.out
    if page is None and not exports:
        page = Path("results") / made.recordings[0].model.name / "view.html"
        page.parent.mkdir(parents=True, exist_ok=True)
    if page is not None:
        made.save(page)
        tell(f"wrote {page}")
    if made.errors:
        raise made.errors[0]
    if page is not None and options.out is None:
        webbrowser.open(page.resolve().as_uri())
    return DONE


def _exports(options: argparse.Namespace) -> list[tuple[Path, Callable[[Recording, Path], None]]]:
    """The files for other viewers and the functions that write them; obstacles are reported before a run."""
    from epicycle.actors import EpicycleError

    from ..show.view import require_mcap, require_rerun, write_mcap, write_rerun

    found: list[tuple[Path, Callable[[Recording, Path], None]]] = []
    for flag, path, require, write in (
        ("--mcap", options.mcap, require_mcap, write_mcap),
        ("--rerun", options.rerun, require_rerun, write_rerun),
    ):
        if path is None:
            continue
        if len(options.model) > 1:
            raise EpicycleError(f"{flag} writes one run, not two: {', '.join(options.model)}")
        check_path(flag, path)
        require()
        found.append((path, write))
    return found
