"""The effect of each packaged disturbance on the paper's scenario.

    python benchmarks/disturbances.py [NAME ...] [--runs 10] [--observers 3] [--first-seed 0] [--jobs 2]
        [--set PATH=VALUE ...]

Prints a Markdown table with a line for the unchanged scenario and one for each disturbance: mean arrival time with its
standard error, runs that did not arrive in 30 s (counted separately, never averaged in), the mean over the runs of the
smallest distance to the obstacle, runs in which it was below 2 m, the same between robots, the mean path length of the
main robot, and the mean number of its plans that broke a constraint.  Seeds count from --first-seed, the same for all.
"""

from __future__ import annotations

import argparse
import math
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from statistics import fmean, stdev
from typing import Any


def run(disturbance: str | None, settings: list[str], seed: int) -> dict[str, Any]:
    """The metrics of one run."""
    from epicycle.runner import Simulation, load_model

    disturb = () if disturbance is None else disturbance
    model = load_model("collision_avoidance", disturb=disturb, set=settings)
    return Simulation(model, seed=seed).run().metrics


def row(name: str, runs: list[dict[str, Any]]) -> str:
    """One line of the table."""
    arrivals = [each["arrival_time"] for each in runs if each["arrival_time"] is not None]
    error = stdev(arrivals) / math.sqrt(len(arrivals)) if len(arrivals) > 1 else math.nan
    cells = [name, f"{fmean(arrivals):.2f} ± {error:.2f}" if arrivals else "-", str(len(runs) - len(arrivals))]
    for metric in ("min_obstacle_distance", "min_robot_distance"):
        distances = [each[metric] for each in runs if each[metric] is not None]
        cells += [f"{fmean(distances):.2f}" if distances else "-", str(sum(each < 2.0 for each in distances))]
    cells += [f"{fmean(each['path_length'] for each in runs):.1f}"]
    cells += [f"{fmean(each['infeasible_steps'] for each in runs):.1f}"]
    return "| " + " | ".join(cells) + " |"


HEAD = """\
| disturbance | arrival (s) | never | to obstacle (m) | < 2 m | between robots (m) | < 2 m | path (m) | infeasible |
|---|---|---|---|---|---|---|---|---|"""


def main() -> None:
    """Run all disturbances and print the table."""
    from epicycle.runner.model.catalogue.packaged import packaged_disturbances

    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("names", nargs="*", metavar="NAME", help="packaged disturbances, or files (default: all)")
    options.add_argument("--runs", type=int, default=10)
    options.add_argument("--observers", type=int, default=3)
    options.add_argument("--first-seed", type=int, default=0)
    options.add_argument("--set", dest="settings", action="append", default=[])
    options.add_argument("--jobs", type=int, default=os.cpu_count())
    given = options.parse_args()
    settings = [f"observers={given.observers}", *given.settings]
    seeds = range(given.first_seed, given.first_seed + given.runs)
    print(HEAD, flush=True)
    with ProcessPoolExecutor(given.jobs) as pool:
        for name in given.names or (None, *packaged_disturbances()):
            runs = list(pool.map(partial(run, name, settings), seeds))
            print(row(name or "none", runs), flush=True)


if __name__ == "__main__":
    main()
