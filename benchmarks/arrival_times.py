"""The paper's main comparison: mean arrival time against the number of observers, at two disturbance levels.

    python benchmarks/arrival_times.py [--runs 40] [--range 30] [--levels 0,0.5] [--observers 0,1,2,3,4] [--jobs 2]
        [--first-seed 0] [--set PATH=VALUE ...]

Prints a Markdown table: mean arrival time with its standard error, smallest distances over all runs, runs that came
within 2 m of the obstacle or of another robot, runs that never arrived (counted apart, never averaged in), and the
mean number of the main robot's plans that broke a constraint.  Seeds count from --first-seed, the same for every
condition.
"""

from __future__ import annotations

import argparse
import math
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from statistics import fmean, stdev
from typing import Any

Condition = tuple[float, float, int]


def run(condition: Condition, settings: list[str], seed: int) -> dict[str, Any]:
    """The metrics of one run."""
    from epicycle.runner import Simulation, load_model

    measurement_range, level, observers = condition
    model = load_model(
        "collision_avoidance",
        set=[
            f"measurement_range={measurement_range}",
            f"disturbance={level}",
            f"observers={observers}",
            *settings,
        ],
    )
    return Simulation(model, seed=seed).run().metrics


def row(condition: Condition, runs: list[dict[str, Any]]) -> str:
    """One line of the table."""
    arrivals = [each["arrival_time"] for each in runs if each["arrival_time"] is not None]
    obstacle = [each["min_obstacle_distance"] for each in runs]
    robots = [each["min_robot_distance"] for each in runs if each["min_robot_distance"] is not None]
    error = stdev(arrivals) / math.sqrt(len(arrivals)) if len(arrivals) > 1 else math.nan
    cells = [
        f"{condition[0]:g}",
        f"{100 * condition[1]:g} %",
        str(condition[2]),
        f"{fmean(arrivals):.2f} ± {error:.2f}" if arrivals else "-",
        str(len(runs) - len(arrivals)),
        f"{min(obstacle):.2f}",
        str(sum(distance < 2.0 for distance in obstacle)),
        f"{min(robots):.2f}" if robots else "-",
        str(sum(distance < 2.0 for distance in robots)),
        f"{fmean(each['path_length'] for each in runs):.1f}",
        f"{fmean(each['infeasible_steps'] for each in runs):.1f}",
    ]
    return "| " + " | ".join(cells) + " |"


HEAD = """\
| range (m) | disturbance | observers | arrival (s) | never | min to obstacle (m) | < 2 m | min robots (m) | < 2 m \
| path (m) | infeasible |
|---|---|---|---|---|---|---|---|---|---|---|"""


def main() -> None:
    """Run all conditions and print the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--runs", type=int, default=40)
    options.add_argument("--range", dest="ranges", default="30")
    options.add_argument("--levels", default="0,0.5")
    options.add_argument("--observers", default="0,1,2,3,4")
    options.add_argument("--first-seed", type=int, default=0)
    options.add_argument("--set", dest="settings", action="append", default=[])
    options.add_argument("--jobs", type=int, default=os.cpu_count())
    given = options.parse_args()
    conditions: list[Condition] = [
        (float(measurement_range), float(level), int(observers))
        for measurement_range in given.ranges.split(",")
        for level in given.levels.split(",")
        for observers in given.observers.split(",")
    ]
    print(HEAD, flush=True)
    with ProcessPoolExecutor(given.jobs) as pool:
        for condition in conditions:
            seeds = range(given.first_seed, given.first_seed + given.runs)
            runs = list(pool.map(partial(run, condition, given.settings), seeds))
            print(row(condition, runs), flush=True)


if __name__ == "__main__":
    main()
