"""estimate the probability that a run breaks a property"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from . import searching
from .options import COUNT, DONE, MODEL, SEED, UNTIL, command, load, option


@command(
    "estimate how probable it is that a run breaks a property, however rare",
    *MODEL,
    SEED,
    UNTIL,
    searching.monitor("always server.size < 40"),
    option(
        "--guide",
        metavar="NAME or PROPERTY",
        help="the one whose robustness says how close a run is to the break (default: the monitor)",
    ),
    option("--runs", type=COUNT, default=200, metavar="N", help="runs from each level (default: 200)"),
    option("--repetitions", type=COUNT, default=10, metavar="N", help="independent estimates (default: 10)"),
    searching.out("MODEL/rare"),
    searching.JSON,
    imports=("calls.estimating",),
)
def rare(options: argparse.Namespace) -> int:
    """Estimate the probability that a run breaks a property, by importance splitting over its robustness.

    Runs that get close to the break continue from there many times, each time with other random numbers. The result is
    an unbiased estimate with a 95 % interval. Each repetition is noted in the folder, so that an interrupted estimate
    continues.
    """
    from ..bars import bar
    from ..calls import RareEvent
    from ..calls import rare as estimate

    made = load(options)
    folder = searching.folder_of(options, made.name, "rare")

    def search() -> RareEvent:
        with bar(made.name) as show:

            def report(runs: int, repetitions: int) -> None:
                if show is not None:
                    show(float(repetitions), float(options.repetitions), f"{runs:,} runs")

            return estimate(
                made,
                options.monitor,
                guide=options.guide,
                runs=options.runs,
                repetitions=options.repetitions,
                seed=options.seed,
                until=options.until,
                out=folder,
                progress=report,
            )

    def save(found: RareEvent) -> list[Path]:
        written = folder / "rare.json"
        written.write_text(json.dumps(found.facts(), indent=2) + "\n", encoding="utf-8")
        return [written]

    return searching.answer(options, search, save, lambda _: DONE)
