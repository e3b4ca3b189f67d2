"""Prints the tasks, or judges the models in a folder."""

from __future__ import annotations

import sys
from pathlib import Path

from .judging import judge, tasks


def main(arguments: list[str]) -> int:
    if not arguments:
        for name, task in tasks().items():
            print(f"{name}.yaml: {' '.join(task.words.split())}\n")
        return 0
    solved = 0
    for name, task in tasks().items():
        path = Path(arguments[0], f"{name}.yaml")
        faults = judge(task, path) if path.exists() else ["there is no such file"]
        solved += not faults
        print(f"{name}: {'; '.join(faults) if faults else 'solved'}")
    print(f"{solved} of {len(tasks())} tasks are solved")
    return solved < len(tasks())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
