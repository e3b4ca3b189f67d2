"""run a model"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from ..printing import console, tell, tell_json
from .options import (
    BROKEN,
    CHANGES,
    RUN,
    SEED,
    UNTIL,
    command,
    complain_of,
    complain_of_change,
    number,
    open_run,
    option,
    several,
)

if TYPE_CHECKING:
    from ..build.model import Model
    from ..calls import RunSpec


def factor(text: str) -> float:
    """How many seconds of model time pass per second."""
    from ..engine import SLOWEST

    if not SLOWEST <= (found := number(text)) < math.inf:
        # Perhaps the model, which follows the option.
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a number of at least {SLOWEST:g} (write MODEL before --realtime)"
        )
    return found


@command(
    "run a model",
    option("model", metavar="MODEL or RESULTS", help=RUN),
    *CHANGES,
    SEED,
    UNTIL,
    option(
        "--realtime",
        metavar="FACTOR",
        type=factor,
        nargs="?",
        const=1.0,
        help="limit model time to FACTOR seconds per second of the wall clock (default: 1)",
    ),
    option(
        "--out",
        metavar="DIR",
        type=Path,
        help="folder for manifest, signals and figures (default: results/MODEL; with --json: none)",
    ),
    option("--log", metavar="FILE", type=Path, help="write the event log to FILE (.parquet, .csv or .jsonl)"),
    several(
        "--log-where",
        metavar="COLUMN=PATTERN",
        help="write only matching records, such as aspect=packet_loss, aspect='*' (all acts of aspects), "
        "event=dropped, actor='observer[*].**' or port=plan; may be repeated: a record must match one pattern of "
        "each column that has any",
    ),
    option("--json", action="store_true", help="print one JSON object instead of the table"),
    option("--check", action="store_true", help="exit with code 3 if a monitor of the model is broken"),
    imports=("calls.running", "show"),
)
def run(options: argparse.Namespace) -> int:
    """Run a model once and report the results.

    For a results folder, its run is repeated, with what else is said on top.
    """
    from epicycle.actors import EpicycleError

    from ..calls import perform
    from ..engine import LogFilter, Pace
    from ..results import LogFile
    from ..show import summary_object, summary_table

    log = LogFile(options.log) if options.log is not None else None
    if log is None and options.log_where:
        raise EpicycleError(f"--log-where {options.log_where[0]} needs --log FILE, the file to write the log to")
    log_filter = LogFilter.of(options.log_where)
    spec, model, seed, until, before = open_run(options)
    done = perform(
        model,
        seed=seed,
        until=until,
        pace=Pace(options.realtime) if options.realtime is not None else None,
        keep_log=False if log is None else log_filter,
        log=log,
        folder=options.out or (None if options.json else _folder_of(spec, model)),
        given=options.given,
        spec=spec,
        after=0.0,
    )
    if options.json:
        tell_json(summary_object(done.results))
    else:
        console().print(summary_table(model, done.results))
        for path in done.written:
            tell(f"wrote {path}")
    complain_of_change(options.model, before, done.results.digest)
    code = complain_of(done.failed, options)
    broken = any(verdict.holds is False for verdict in done.results.monitors.values())
    return BROKEN if options.check and broken and not code else code


def _folder_of(spec: RunSpec, model: Model) -> Path:
    return Path(spec.study) / "replays" / spec.run if spec.study else Path("results") / model.name
