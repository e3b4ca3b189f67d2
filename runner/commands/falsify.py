"""look for a run that breaks a property"""

from __future__ import annotations

import argparse
from pathlib import Path

from . import searching
from .options import ASPECTS, BROKEN, DISTURB, DONE, FAILED, UNTIL, command, option, whole


def runs(text: str) -> int:
    """How many runs a search makes at most."""
    from ..search import MAX_RUNS

    return whole(1, MAX_RUNS, "1e6")(text)


@command(
    "look for a run that breaks a property",
    option("model", metavar="MODEL", help="a path to a YAML file, or the name of a packaged model"),
    searching.monitor("always clearance.distance >= 2 m", default="all of the model's"),
    searching.VARY,
    option(
        "--acts",
        type=whole(1, 10),
        metavar="N",
        default=0,
        help="search the single acts of aspects (losses, delays, failures) in the run of the seed: sets of at most N",
    ),
    searching.SET,
    DISTURB,
    *ASPECTS,
    UNTIL,
    option("--runs", type=runs, metavar="N", default=500, help="number of runs at most (default: 500)"),
    searching.seed_of_search("seed of the search and of its first run; each run has the next (default: 0)", 0),
    searching.out("MODEL/falsification"),
    *searching.WORKERS,
    *searching.ENDING,
    imports=("calls.falsifying",),
)
def falsify(options: argparse.Namespace) -> int:
    """Look for a run that breaks a property: over seeds, and parameters that --vary gives.

    Points are spread over the ranges at first; then CMA-ES goes towards less robustness, if its library is installed.
    The search ends at the first broken run, with exit code 3.  It ends with 0 when all runs are made and none is
    broken, which does not show that the property holds, and with 1 if some of these runs failed.  The folder is that of
    a study; an interrupted search continues there.
    """
    from ..calls import Falsified, falsified, seconds
    from ..search import Asked

    asked = Asked(
        options.model,
        options.monitor,
        tuple(options.vary),
        options.runs,
        options.seed,
        tuple(options.set),
        tuple(options.disturb),
        tuple(map(Path, options.types)),
        tuple(options.given),
        options.acts,
        tuple(options.aspect),
        tuple(options.without),
        seconds("--until", options.until),
    )

    def code(found: Falsified) -> int:
        if found.broken is not None:
            return BROKEN
        return FAILED if found.findings.failed else DONE

    return searching.answer(
        options,
        lambda: falsified(asked, options.out, jobs=options.jobs, timeout=options.run_timeout),
        lambda found: [found.results.path],
        code,
    )
