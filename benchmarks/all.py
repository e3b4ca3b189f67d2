"""All benchmarks with a goal, into benchmarks/RESULTS.md: `python -m benchmarks.all [NAME ...]`, or `make bench`.

Each part runs in its own process, one after another, so that none warms or fills another's memory.  Keep the machine
otherwise idle.
"""

from __future__ import annotations

import argparse
import importlib
import os
import platform
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

from benchmarks.measure import pace, table
from epicycle.actors import CORE

HERE = Path(__file__).parent
PARTS = ("controllers", "studies", "events", "written", "growth", "start", "desk")
PACKAGES = ("numpy", "numba", "casadi", "scipy", "filterpy", "simpy", "networkx")


def machine() -> str:
    """The machine and versions used."""
    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    packages = ", ".join(f"{each} {version(each)}" for each in PACKAGES)
    return (
        f"{name}, {os.cpu_count()} cores, {platform.system()}; "
        f"{platform.python_implementation()} {platform.python_version()}, {packages}; {CORE} core."
    )


def part(name: str) -> str:
    """The section of one part, measured now."""
    module = importlib.import_module(f"benchmarks.{name}")
    rows = []
    for row in module.rows():
        print(f"{name}: {row.work}, {row.peer}: {row.result}", file=sys.stderr, flush=True)
        rows.append(row)
    works: dict[str, dict[str, None]] = {}  # by method of measurement; each once
    for row in rows:
        works.setdefault(row.how, {})[row.work] = None
    notes = [f"- {'; '.join(named)}: {how}." for how, named in works.items()]
    reasons = dict.fromkeys(row.reason for row in rows if row.is_met is False and row.reason)
    notes += [f"- Not met: {reason}." for reason in reasons]
    return "\n".join([table(rows), "", *notes])


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("names", nargs="*", metavar="NAME", help=f"of the parts; all: {', '.join(PARTS)}")
    options.add_argument("--part", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.part:
        print(part(given.part))
        return
    began = time.perf_counter()
    sections, paces = [], [pace()]
    for name in given.names or PARTS:
        done = subprocess.run(
            [sys.executable, "-m", "benchmarks.all", "--part", name],
            cwd=HERE.parent,
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        text = done.stdout if done.returncode == 0 else f"This part failed (exit code {done.returncode}).\n"
        about = importlib.import_module(f"benchmarks.{name}").__doc__ or name
        title = about.splitlines()[0].partition(": `")[0].rstrip(".")
        sections.append(f"## {title}\n\n{text}")
        paces.append(pace())
    minutes = (time.perf_counter() - began) / 60
    told = ", ".join(f"{each:.2f}" for each in paces)
    head = (
        f"# Benchmarks\n\nWritten by `make bench` in {minutes:.0f} min.\n\n{machine()}\n\n"
        f"3,000,000 turns of a loop in Python took {told} s of CPU before and after the parts: "
        "ratios do not depend on the machine's pace; times, and ratios to fixed times, do.\n"
    )
    report = "\n".join([head, *sections])
    print(report)
    if not given.names:
        (HERE / "RESULTS.md").write_text(report, encoding="utf-8")


if __name__ == "__main__":
    main()
