"""The paper's study: `python -m benchmarks.studies [--replications 20]`.

Runs of all 60 conditions of table_1 are made by `epicycle study`, in two processes and in one, and with the Python
core; wall-clock time, for which a person waits.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from benchmarks.measure import Row, of_the_pace, pace, table
from epicycle.actors import CORE

CONDITIONS, ALL = 60, 6_000
REPLICATIONS, ALONE = 20, 5  # of each condition, in two processes and in one
GOAL = 5.0  # min
ROUNDS = 3


def rate(replications: int, jobs: int, **environment: str) -> float:
    """Runs a second, with these variables set."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "epicycle.runner.interface.cli",
            "study",
            "table_1",
            "--yes",
            "--out",
            "results",
        ]
        before = time.perf_counter()
        subprocess.run(
            [*command, "--replications", str(replications), "--jobs", str(jobs)],
            cwd=folder,
            env={**os.environ, **environment},
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        took = time.perf_counter() - before
        assert (Path(folder) / "results" / "table.parquet").is_file()
    return CONDITIONS * replications / took


def rows(replications: int = REPLICATIONS) -> Iterator[Row]:
    """The table's lines."""
    paces = [pace()]
    two = rate(replications, 2)
    paces.append(pace())
    one = rate(ALONE, 1)
    minutes = ALL / two / 60
    how = f"{replications} replications of each of the 60 conditions, wall-clock time from the command to its end"
    result = f"{minutes:.1f} min at the rate of {CONDITIONS * replications:,} of them ({two:.1f} runs a second)"
    work = f"table_1, {ALL:,} runs, 2 processes"
    reason = of_the_pace(work, minutes, "min", paces)
    yield Row(work, "", result, f"<= {GOAL:g} min", minutes <= GOAL, how, reason)
    how = f"the same against {ALONE} replications in one process"
    yield Row("two processes", "one process", f"{two / one:.2g}x ({one:.1f} runs a second)", "", None, how)
    if CORE == "compiled":
        turns = [(rate(ALONE, 2), rate(ALONE, 2, EPICYCLE_CORE="python")) for _ in range(ROUNDS)]
        ratio = median(ours / python for ours, python in turns)
        how = f"{ALONE} replications of each condition with each, taking turns {ROUNDS} times; both solve with numba"
        slow = median(python for _, python in turns)
        result = f"{ratio:.2g}x ({slow:.1f} runs a second)"
        yield Row("table_1, 2 processes, compiled core", "the core in Python", result, "", None, how)


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--replications", type=int, default=REPLICATIONS)
    print(table(rows(options.parse_args().replications)))
