"""explain which disturbances break a property of a run"""

from __future__ import annotations

import argparse
from pathlib import Path

from . import searching
from .options import CHANGES, DONE, SEED, UNTIL, command, load, option
from .past_run import as_before


@command(
    "find the smallest set of faults that breaks a property of a run",
    option("model", metavar="MODEL or RESULTS", help="a model, or a folder that a run was written to"),
    *CHANGES,
    SEED,
    UNTIL,
    searching.monitor("always clearance.distance >= 2 m"),
    searching.out("MODEL/explanation"),
    option("--no-page", action="store_true", help="write no page with both runs"),
    searching.JSON,
    imports=("calls.explaining",),
)
def explain(options: argparse.Namespace) -> int:
    """Find a smallest set of acts of aspects (single losses, delays, failures) that breaks a property in a run.

    With these acts and no others the property is broken; without any single one of them it holds.  The folder gets a
    disturbance with just these acts, the facts as JSON, and a page that shows both runs.  Each run that was tried is
    noted there, so that an interrupted search continues.
    """
    from ..bars import bar
    from ..calls import Changes, Explained, as_command, explained, seconds

    if Path(options.model).is_dir():
        as_before(options)
    made = load(options)
    folder = searching.folder_of(options, made.name, "explanation")
    seed = made.seed if options.seed is None else options.seed
    changes: Changes = {"set": options.set, "overrides": options.overrides, "disturb": options.disturb}
    changes |= {"aspects": options.aspect, "without_aspects": options.without}
    given = as_command(options.model, seed, options.until, changes)
    until = seconds("--until", options.until)

    def search() -> Explained:
        with bar(made.name) as show:

            def report(runs: int, acts: int) -> None:
                if show is not None:
                    show(float(runs), None, f"{runs} runs, {acts} acts")

            return explained(made, options.monitor, seed, until, given, folder, report)

    return searching.answer(options, search, lambda found: found.save(folder, page=not options.no_page), lambda _: DONE)
