"""look for the best parameters"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import complain, tell, tell_json
from .options import COUNT, DISTURB, DONE, FAILED, INTERRUPTED, TYPES, command, option, several, whole
from .studies import first_seed, positive_seconds

VARY = several(
    "--vary",
    metavar="PATH=VALUES",
    help="search a parameter: load=0.5..0.9, period='1 s..5 s', 'policy=[fifo, lifo]'; may be repeated",
)


def points(text: str) -> int:
    """How many points are tried."""
    from ..search import MAX_POINTS

    return whole(1, MAX_POINTS, "100,000")(text)


@command(
    "look for the parameters with the best mean of a metric",
    option("target", metavar="MODEL or STUDY", help="a path to a YAML file, or the name of a packaged model or study"),
    option("--minimise", metavar="METRIC", help="a metric, or an expression over metrics and varied parameters"),
    option("--maximise", metavar="METRIC", help="the same, whose mean is to be large"),
    VARY,
    several(
        "--subject-to",
        metavar="CONDITION",
        help="a condition that all runs must meet, such as 'longest_wait < 30'; may be repeated",
    ),
    option("--points", type=points, metavar="N", default=200, help="number of points that are tried (default: 200)"),
    option("--replications", type=COUNT, metavar="N", help="runs of each point (default: the study's, or 1)"),
    option(
        "--seed",
        type=first_seed,
        metavar="N",
        help="seed of the search and of the first replication (default: the study's, or 0)",
    ),
    several("--set", metavar="PATH=VALUE", help="set a parameter in all runs; may be repeated"),
    DISTURB,
    option("--out", metavar="DIR", type=Path, help="results folder (default: results/NAME/optimisation)"),
    option("--jobs", type=COUNT, metavar="N", help="processes at a time (default: one per core)"),
    option(
        "--run-timeout",
        type=positive_seconds,
        metavar="S",
        help="real time in seconds after which a run is ended and counts as failed (default: no limit)",
    ),
    option("--json", action="store_true", help="print one JSON object instead of the text"),
    TYPES,
    imports=("calls.optimising",),
)
def optimise(options: argparse.Namespace) -> int:
    """Look for the parameters for which the mean of a metric is best, under conditions that all runs must meet.

    Points are spread over the ranges at first; then CMA-ES goes towards better means, if its library is installed.  The
    conditions of a study count alike.  The best point is run once more with new seeds, because its own runs chose it.
    The exit code is 1 if no point meets the conditions.  The folder is that of a study; an interrupted search continues
    there.
    """
    from epicycle.actors import EpicycleError

    from ..calls import optimised
    from ..search import Goal
    from ..study import WorkerError, WriteError

    if (options.minimise is None) == (options.maximise is None):
        raise EpicycleError("give one of --minimise METRIC and --maximise METRIC")
    goal = Goal(
        options.target,
        options.minimise if options.maximise is None else options.maximise,
        options.maximise is not None,
        tuple(options.subject_to),
        tuple(options.vary),
        options.points,
        options.replications,
        options.seed,
        tuple(options.set),
        tuple(options.disturb),
        tuple(map(Path, options.types)),
        tuple(options.given),
    )
    try:
        found = optimised(goal, options.out, jobs=options.jobs, timeout=options.run_timeout)
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
    return DONE if found.best is not None else FAILED
