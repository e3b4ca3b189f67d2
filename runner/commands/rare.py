"""estimate the probability that a run breaks a property"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..printing import tell, tell_json
from .options import COUNT, DONE, MODEL, SEED, command, load, option


@command(
    "estimate how probable it is that a run breaks a property, however rare",
    *MODEL,
    SEED,
    option("--until", metavar="TIME", help="stop time, such as 30 or '500 ms' (default: the model's)"),
    option(
        "--monitor",
        metavar="NAME or PROPERTY",
        required=True,
        help="a monitor of the model, or a property such as 'always server.size < 40'",
    ),
    option(
        "--guide",
        metavar="NAME or PROPERTY",
        help="the one whose robustness says how close a run is to the break (default: the monitor)",
    ),
    option("--runs", type=COUNT, default=200, metavar="N", help="runs from each level (default: 200)"),
    option("--repetitions", type=COUNT, default=10, metavar="N", help="independent estimates (default: 10)"),
    option("--out", metavar="DIR", type=Path, help="folder for what is found (default: results/MODEL/rare)"),
    option("--json", action="store_true", help="print one JSON object instead of the table"),
    imports=("calls.estimating",),
)
def rare(options: argparse.Namespace) -> int:
    """Estimate the probability that a run breaks a property, by importance splitting over its robustness.

    Runs that get close to the break continue from there many times, each time with other random numbers. The result is
    an unbiased estimate with a 95 % interval. Each repetition is noted in the folder, so that an interrupted estimate
    continues.
    """
    from epicycle.actors import abridged

    from ..bars import bar
    from ..calls import rare as estimate

    made = load(options)
    folder = options.out or Path("results") / abridged(made.name, 60) / "rare"
    with bar(made.name) as show:

        def report(runs: int, repetitions: int) -> None:
            if show is not None:
                show(float(repetitions), float(options.repetitions), f"{runs:,} runs")

        found = estimate(
            made,
            options.monitor,
            guide=options.guide,
            runs=options.runs,
            repetitions=options.repetitions,
            seed=options.seed,
            until=options.until,
            folder=folder,
            progress=report,
        )
    written = folder / "rare.json"
    written.write_text(json.dumps(found.facts(), indent=2) + "\n", encoding="utf-8")
    if options.json:
        tell_json(found.facts())
        return DONE
    tell(str(found))
    tell(f"wrote {written}")
    return DONE
