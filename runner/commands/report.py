"""draw and write up what a study has found"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ..printing import complain, console, tell
from .options import DONE, FAILED, count

DESCRIPTION = "Write report.html, one file that holds all, and its figures; the study need not be finished."


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle report``."""
    command.add_argument("folder", metavar="DIR", type=Path, help="the results folder of the study")
    command.add_argument("--out", metavar="DIR", type=Path, help="where to write (default: the results folder)")
    command.add_argument("--jobs", metavar="N", type=count, help="runs that are repeated at once (default: one a core)")


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Read the folder, draw, write."""
    from ..show.report import write_report
    from ..study import available_cores, open_study

    results = open_study(options.folder)
    folder = options.out or options.folder
    with _progress() as told:
        report = write_report(results, folder, jobs=options.jobs or available_cores(), tell=told)
    for path in report.files:
        tell(f"wrote {path}")
    if report.verdicts:
        tell("claims: " + ", ".join(f"{number} {verdict}" for verdict, number in sorted(report.verdicts.items())))
    for problem in report.problems:
        complain(f"error: {problem}")
    return FAILED if report.problems else DONE


@contextmanager
def _progress() -> Iterator[Callable[[int, int], None]]:
    """A bar on a terminal while runs are repeated."""
    if not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.progress import Progress

    with Progress(console=console(stderr=True), transient=True) as bar:
        task = bar.add_task("repeating runs for their signals", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
