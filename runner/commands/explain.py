"""explain which disturbances break a property of a run"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import tell, tell_json
from .options import CHANGES, DONE, SEED, command, load, option
from .past_run import as_before


@command(
    "find the smallest set of faults that breaks a property of a run",
    option("model", metavar="MODEL or RESULTS", help="a model, or a folder that a run was written to"),
    *CHANGES,
    SEED,
    option("--until", metavar="TIME", help="stop time, such as 30 or '500 ms' (default: the model's)"),
    option(
        "--monitor",
        metavar="NAME or PROPERTY",
        required=True,
        help="a monitor of the model, or a property such as 'always clearance.distance >= 2 m'",
    ),
    option("--out", metavar="DIR", type=Path, help="folder for what is found (default: results/MODEL/explanation)"),
    option("--no-page", action="store_true", help="write no page with both runs"),
    option("--json", action="store_true", help="print one JSON object instead of the tables"),
    imports=("calls.explaining",),
)
def explain(options: argparse.Namespace) -> int:
    """Find a smallest set of acts of aspects (single losses, delays, failures) that breaks a property in a run.

    With these acts and no others the property is broken; without any single one of them it holds.  The folder gets a
    disturbance with just these acts, the facts as JSON, and a page that shows both runs.  Each run that was tried is
    noted there, so that an interrupted search continues.
    """
    from epicycle.actors import abridged

    from ..bars import bar
    from ..calls import Changes, as_command, explained, seconds

    if Path(options.model).is_dir():
        as_before(options)
    made = load(options)
    folder = options.out or Path("results") / abridged(made.name, 60) / "explanation"
    seed = made.seed if options.seed is None else options.seed
    changes: Changes = {"set": options.set, "overrides": options.overrides, "disturb": options.disturb}
    changes |= {"aspects": options.aspect, "without_aspects": options.without}
    given = as_command(options.model, seed, options.until, changes)
    with bar(made.name) as show:

        def report(runs: int, acts: int) -> None:
            if show is not None:
                show(float(runs), None, f"{runs} runs, {acts} acts")

        until = seconds("--until", options.until)
        found = explained(made, options.monitor, seed, until, given, folder, report)
    written = found.save(folder, page=not options.no_page)
    if options.json:
        tell_json(found.facts())
        return DONE
    tell(str(found))
    for path in written:
        tell(f"wrote {path}")
    return DONE
