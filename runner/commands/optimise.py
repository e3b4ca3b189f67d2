"""look for the best parameters"""

from __future__ import annotations

import argparse
from pathlib import Path

from . import searching
from .options import COUNT, DISTURB, DONE, FAILED, command, option, several, whole


def points(text: str) -> int:
    """How many points are tried."""
    from ..search import MAX_POINTS

    return whole(1, MAX_POINTS, "100,000")(text)


@command(
    "look for the parameters with the best mean of a metric",
    option("target", metavar="MODEL or STUDY", help="a path to a YAML file, or the name of a packaged model or study"),
    option("--minimise", metavar="METRIC", help="a metric, or an expression over metrics and varied parameters"),
    option("--maximise", metavar="METRIC", help="the same, whose mean is to be large"),
    searching.VARY,
    several(
        "--subject-to",
        metavar="CONDITION",
        help="a condition that all runs must meet, such as 'longest_wait < 30'; may be repeated",
    ),
    option("--points", type=points, metavar="N", default=200, help="number of points that are tried (default: 200)"),
    option("--replications", type=COUNT, metavar="N", help="runs of each point (default: the study's, or 1)"),
    searching.seed_of_search("seed of the search and of the first replication (default: the study's, or 0)"),
    searching.SET,
    DISTURB,
    searching.out("NAME/optimisation"),
    *searching.WORKERS,
    *searching.ENDING,
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
    return searching.answer(
        options,
        lambda: optimised(goal, options.out, jobs=options.jobs, timeout=options.run_timeout),
        lambda found: [found.results.path],
        lambda found: DONE if found.best is not None else FAILED,
    )
