"""Two main robots under the conditions of Table I, as Markdown for docs/paper.md.

    python benchmarks/side_by_side.py results/table_1_safe [--into docs/paper.md [--place NAME]]

For each condition of ``table_1_safe``, and for all of them: how many runs came within 2 m of the obstacle, the mean
arrival times, and the mean of the paired differences with its 95 % interval (Student).
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from claims import about, claims, head, put, row, said

from epicycle.runner import StudyResults, open_study
from epicycle.runner.study.inference import paired_difference

NEAR = 2.0  # m
Times = dict[str, dict[int, float]]  # by controller and replication


def cells(times: Times, near: dict[str, list[bool]]) -> list[str]:
    """Counts of approaches, mean times and their difference."""
    difference = paired_difference(times["paper"], times["safe"]).estimate
    paper = sum(times["paper"].values()) / len(times["paper"])
    percent = f"{100 * difference.value / paper:+.1f} %"
    interval = f"{difference.value:+.2f} ({difference.low:+.2f} to {difference.high:+.2f})"
    means = [f"{sum(times[name].values()) / len(times[name]):.2f}" for name in ("paper", "safe")]
    return [*(f"{sum(near[name])} of {len(near[name]):,}" for name in ("paper", "safe")), *means, interval, percent]


def lines(rows: list[dict[str, Any]], factors: list[str]) -> Iterator[str]:
    """A line for each combination of some factors; the times of the others are averaged, replication by replication."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = defaultdict(list)
    for each in rows:
        groups[tuple(each[name] for name in factors)].append(each)
    for levels, members in groups.items():
        sums: dict[str, dict[int, list[float]]] = {name: defaultdict(list) for name in ("paper", "safe")}
        near: dict[str, list[bool]] = {name: [] for name in ("paper", "safe")}
        for each in members:
            sums[each["controller"]][each["replication"]].append(each["arrival_time"])
            near[each["controller"]].append(each["min_obstacle_distance"] < NEAR)
        times = {name: {key: sum(all_of) / len(all_of) for key, all_of in runs.items()} for name, runs in sums.items()}
        yield row([*(map(said, levels) if factors else ["all"]), *cells(times, near)])


def text(results: StudyResults) -> str:
    """All of it."""
    rows = results.table().to_pylist()
    found = ["within 2 m, paper", "safe", "arrival (s), paper", "safe", "difference (s)", ""]
    varied = [name for name in ("measurement_range", "disturbance", "observers") if name in rows[0]]
    tables = []
    for factors in ([], [name for name in varied if name != "measurement_range"], varied):
        table = [*head([*(factors or [""]), *found]), *lines(rows, factors)]
        if table not in tables:
            tables.append(table)
    if judged := results.claims():
        tables.insert(0, list(claims(judged)))
    return "\n\n".join([about(results), *map("\n".join, tables)])


def main() -> int:
    """Print the block, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--into", type=Path, metavar="FILE")
    parser.add_argument("--place", metavar="NAME")
    options = parser.parse_args()
    results = open_study(options.folder)
    place = options.place or results.plan.study.name
    if options.into is None:
        print(text(results))
    elif not put(options.into, place, text(results)):
        print(f"{options.into} has no place for {place}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
