"""How long it takes to start: `python -m benchmarks.start [--rounds 9]`.

A model of two actors and ten firings is validated and run in separate processes, with warm caches; wall-clock time, for
which a person waits, and CPU time.  The time for Python to start and import NumPy is shown for comparison.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from benchmarks.measure import Row, of_the_pace, pace, table

TINY = """\
model: tiny
actors: {clock: {type: Clock, period: 1 s}, scale: {type: Scale, factor: 2}}
connections: [clock.output -> scale.input]
run: {stop: 10 s, record: [scale.output]}
"""


def seconds_of(command: list[str], folder: str) -> tuple[float, float]:
    """The wall-clock and the CPU time of a process."""
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": f"{folder}/pycache"}
    wall, usage = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - usage.ru_utime - usage.ru_stime
    return time.perf_counter() - wall, cpu


def rows(rounds: int = 9) -> Iterator[Row]:
    """The table's lines."""
    epicycle = [sys.executable, "-m", "epicycle.runner.interface.cli"]
    commands = {
        "epicycle run of a tiny model": ([*epicycle, "run", "tiny.yaml"], 0.5),
        "epicycle validate of a tiny model": ([*epicycle, "validate", "tiny.yaml"], None),
        "python -c 'import numpy'": ([sys.executable, "-c", "import numpy"], None),
    }
    paces = [pace()]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "tiny.yaml").write_text(TINY, encoding="utf-8")
        took: dict[str, list[tuple[float, float]]] = {name: [] for name in commands}
        for number in range(rounds + 1):
            for name, (command, _) in commands.items():
                measured = seconds_of(command, folder)
                if number:
                    took[name].append(measured)
    paces.append(pace())
    how = f"{rounds} processes each, taking turns, after one that fills the caches"
    for name, (_, goal) in commands.items():
        wall, cpu = (median(each[index] for each in took[name]) for index in (0, 1))
        result = f"{wall:.2f} s ({cpu:.2f} s CPU)"
        limit, is_met = ("", None) if goal is None else (f"<= {goal:g} s", wall <= goal)
        yield Row(name, "", result, limit, is_met, how, of_the_pace(name, wall, "s", paces))


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=9)
    print(table(rows(options.parse_args().rounds)))
