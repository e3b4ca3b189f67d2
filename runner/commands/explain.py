"""explain which disturbances break a property of a run"""

from __future__ import annotations

import argparse

from . import searching
from .options import CHANGES, COUNT, DONE, INTERRUPTED, RUN, SEED, UNTIL, command, open_run, option, several


@command(
    "find the smallest set of faults that breaks a property of a run",
    option("model", metavar="MODEL or RESULTS", help=RUN),
    *CHANGES,
    SEED,
    UNTIL,
    searching.monitor("always clearance.distance >= 2 m", default="the one of the model's that is broken first"),
    option(
        "--runs",
        type=COUNT,
        metavar="N",
        default=500,
        help="number of sets of acts that are tried at most (default: 500)",
    ),
    several(
        "--only", metavar="ASPECT", help="look at the acts of this aspect; those of others happen; may be repeated"
    ),
    searching.out("MODEL/explanation"),
    option("--no-page", action="store_true", help="write no page with both runs"),
    searching.JSON,
    imports=("calls.explaining",),
)
def explain(options: argparse.Namespace) -> int:
    """Find a smallest set of acts of aspects (single losses, delays, failures) that breaks a property in a run.

    With these acts and no others the property is broken; without any single one of them it holds.  A search that comes
    to its limit of runs, or is interrupted, tells the smallest set so far.  The folder gets a disturbance with just
    these acts, the facts as JSON, and a page that shows both runs.  Each run that was tried is noted there, so that the
    same command, or one with more runs, continues.
    """
    from dataclasses import replace

    from ..bars import bar
    from ..calls import Explained, explained
    from ..search import INTERRUPT

    spec, made, seed, until, _ = open_run(options)
    folder = searching.folder_of(options, made.name, "explanation")
    seed = made.output.seed if seed is None else seed
    given = (spec if spec.study else replace(spec, seed=seed)).command()

    def search() -> Explained:
        with bar(made.name) as show:

            def report(runs: int, acts: int) -> None:
                if show is not None:
                    words = f"{runs:,} of at most {options.runs:,} runs, smallest set: {acts:,} acts"
                    show(float(runs), float(options.runs), words)

            return explained(
                made, options.monitor, seed, until, given, folder, report, limit=options.runs, only=options.only
            )

    def is_interrupted(found: Explained) -> bool:
        return found.explanation.ended == INTERRUPT

    return searching.answer(
        options,
        search,
        lambda found: found.save(folder, page=not options.no_page and not is_interrupted(found)),
        lambda found: INTERRUPTED if is_interrupted(found) else DONE,
    )
