"""fit parameters to measured signals"""

from __future__ import annotations

import argparse
from pathlib import Path

from . import searching
from .options import DISTURB, DONE, SEED, command, option, several


@command(
    "fit parameters to measured signals",
    option("model", metavar="MODEL", help="a path to a YAML file, or the name of a packaged model"),
    several(
        "--match",
        metavar="SIGNAL=FILE",
        help="an output port, and a .csv or .parquet file of what was measured there, with the columns time (s) and "
        "value; may be repeated",
    ),
    several("--vary", metavar="PATH=LOW..HIGH", help="fit a parameter: mass='1 kg..5 kg'; may be repeated"),
    option(
        "--between",
        choices=("hold", "linear"),
        default="hold",
        help="what a signal does between two tokens (default: hold)",
    ),
    SEED,
    searching.SET,
    DISTURB,
    searching.out("MODEL/calibration"),
    *searching.ENDING,
    imports=("calls.calibrating",),
)
def calibrate(options: argparse.Namespace) -> int:
    """Fit parameters so that signals of the model match measured ones, by least squares.

    Points are spread over the ranges first; least squares start from the best three.  The folder gets the parameters as
    a file for --overrides, the facts as JSON, and the residuals.  Each run that was made is noted there, so that an
    interrupted search continues.
    """
    from ..calls import calibrated
    from ..search import Task

    task = Task(
        options.model,
        options.match,
        options.vary,
        options.between == "linear",
        options.seed,
        options.set,
        options.disturb,
        [Path(each) for each in options.types],
    )
    folder = searching.folder_of(options, Path(options.model).stem, "calibration")
    return searching.answer(options, lambda: calibrated(task, folder), lambda found: found.save(folder), lambda _: DONE)
