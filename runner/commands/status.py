"""say how far a study is"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from ..printing import tell, tell_json
from .options import DONE
from .study import about_others

DESCRIPTION = "Say how far a study is, also while it is running."


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle status``."""
    command.add_argument("folder", metavar="DIR", type=Path, help="the results folder")
    command.add_argument("--conditions", action="store_true", help="for each condition")
    command.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Count what is there; name what failed."""
    from ..study import is_running, open_study

    results = open_study(options.folder)
    table = results.table()
    statuses = table["status"].to_pylist()
    counts = Counter(statuses)
    plan = results.plan
    failures = results.failures()
    if options.json:
        found = {"study": plan.study.name, "runs": plan.size, "conditions": plan.conditions, "statuses": dict(counts)}
        tell_json({**found, "running": is_running(options.folder), "failures": failures})
        return DONE
    beyond, running = results.beyond(), is_running(options.folder)
    about = ", ".join(f"{number:,} {status}" for status, number in sorted(counts.items())) or "none is over"
    most = "" if plan.study.until is None else "at most "
    tell(
        f"{plan.study.name}: {len(statuses) - beyond:,} of {most}{plan.size:,} runs are over"
        + (f", and {beyond:,} more" if beyond else "")
        + f" ({about})"
        + ("; it is running" if running else "")
    )
    for told in about_others(results):
        tell(told)
    if results.path.exists() and not running and not results.is_written():
        tell(
            f"{results.path} is not the table of these runs, but damaged or older than they are\n"
            f"   help: 'epicycle resume {options.folder}' writes it anew"
        )
    if options.conditions:
        by_condition = Counter(zip(table["condition"].to_pylist(), statuses, strict=True))
        for index in sorted({condition for condition, _ in by_condition}):
            values = ", ".join(f"{name}={value}" for name, value in plan.condition(index).values.items())
            done = ", ".join(
                f"{number:,} {status}" for (at, status), number in sorted(by_condition.items()) if at == index
            )
            tell(f"{index} ({values}): {done} of {plan.replications:,}")
    for row in failures:
        tell(f"{row['status']}: {row['error']}\n   repeat it: {row['replay']}")
    return DONE
