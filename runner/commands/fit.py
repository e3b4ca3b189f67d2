"""fit models of losses and delays to a measured trace"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import tell, tell_json
from .options import COUNT, DONE, JSON, check_path, command, option, several

COLUMNS = ("time", "lost", "received", "delay", "sequence")


@command(
    "fit models of losses and delays to a measured trace",
    option("trace", metavar="TRACE", type=Path, help="a .csv or .parquet file with a row for each message"),
    *(
        option(f"--{each}", metavar="COLUMN", help=words)
        for each, words in zip(
            COLUMNS,
            (
                "column of the times of sending, in s (default: time)",
                "column that says whether a message was lost (default: lost)",
                "column that says whether it arrived, in place of --lost (default: received)",
                "column of delays (default: delay)",
                "column of sequence numbers: messages whose numbers are missing were lost",
            ),
            strict=True,
        )
    ),
    option("--wraps", type=COUNT, metavar="N", help="how many sequence numbers there are before they start again"),
    option("--delay-unit", choices=("s", "ms", "us", "ns"), default="s", help="unit of the delays (default: s)"),
    several(
        "--at", metavar="PORTS", help="ports, or a pattern, that the disturbance attaches to (default: all); repeat it"
    ),
    option("-o", "--out", metavar="FILE", type=Path, help="write the disturbance there (default: print it)"),
    JSON,
    imports=("calls.fitting",),
)
def fit(options: argparse.Namespace) -> int:
    """Fit models of losses (independent, Gilbert, Gilbert-Elliott) and laws of delays (exponential, gamma, with and
    without a shift) to a measured trace by maximum likelihood, with tests of how well they fit.  Those with the least
    BIC, marked *, go into a disturbance file."""
    from ..calls import fit

    if options.out is not None:
        check_path("--out", options.out)
    columns = {each: getattr(options, each) for each in (*COLUMNS, "wraps") if getattr(options, each) is not None}
    found = fit(options.trace, at=options.at or "**", delay_unit=options.delay_unit, **columns)
    if options.out is not None:
        found.save(options.out)
    if options.json:
        tell_json(found.facts())
        return DONE
    tell(str(found))
    tell(f"\n{found.disturbance()}".rstrip() if options.out is None else f"wrote {options.out}")
    return DONE
