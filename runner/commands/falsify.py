"""look for a run that breaks a property"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import complain, tell, tell_json
from .options import BROKEN, COUNT, DISTURB, DONE, FAILED, INTERRUPTED, TYPES, command, option, several, whole
from .studies import first_seed, positive_seconds


def runs(text: str) -> int:
    """How many runs a search makes at most."""
    from ..search import MAX_RUNS

    return whole(1, MAX_RUNS, "1e6")(text)


@command(
    "look for a run that breaks a property",
    option("model", metavar="MODEL", help="a path to a YAML file, or the name of a packaged model"),
    option(
        "--monitor",
        metavar="NAME or PROPERTY",
        required=True,
        help="a monitor of the model, or a property such as 'always clearance.distance >= 2 m'",
    ),
    several(
        "--vary",
        metavar="PATH=VALUES",
        help="search a parameter: load=0.5..0.9, period='1 s..5 s', 'policy=[fifo, lifo]'; may be repeated",
    ),
    several("--set", metavar="PATH=VALUE", help="set a parameter in all runs; may be repeated"),
    DISTURB,
    option("--runs", type=runs, metavar="N", default=500, help="number of runs at most (default: 500)"),
    option(
        "--seed",
        type=first_seed,
        metavar="N",
        default=0,
        help="seed of the search and of its first run; each run has the next (default: 0)",
    ),
    option("--out", metavar="DIR", type=Path, help="results folder (default: results/MODEL/falsification)"),
    option("--jobs", type=COUNT, metavar="N", help="processes at a time (default: one per core)"),
    option(
        "--run-timeout",
        type=positive_seconds,
        metavar="S",
        help="real time in seconds after which a run is ended and counts as failed (default: no limit)",
    ),
    option("--json", action="store_true", help="print one JSON object instead of the text"),
    TYPES,
    imports=("calls.falsifying",),
)
def falsify(options: argparse.Namespace) -> int:
    """Look for a run that breaks a property: over seeds, and parameters that --vary gives.

    Points are spread over the ranges at first; then CMA-ES goes towards less robustness, if its library is installed.
    The search ends at the first broken run, with exit code 3.  It ends with 0 when all runs are made and none is
    broken, which does not show that the property holds, and with 1 if some of these runs failed.  The folder is that of
    a study; an interrupted search continues there.
    """
    from ..calls import falsified
    from ..search import Asked
    from ..study import WorkerError, WriteError

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
    )
    try:
        found = falsified(asked, options.out, jobs=options.jobs, timeout=options.run_timeout)
    except KeyboardInterrupt:
        complain("interrupted; what was finished is kept: the same command goes on")
        return INTERRUPTED
    except (WorkerError, WriteError) as error:
        complain(f"error: {error}")
        return FAILED
    if options.json:
        tell_json(found.facts())
    else:
        tell(str(found))
        tell(f"wrote {found.results.path}")
    if found.broken is not None:
        return BROKEN
    return FAILED if found.findings.failed else DONE
