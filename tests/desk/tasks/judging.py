"""Tasks as files, and the judge of a model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.execution.engine import Simulation

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Task:
    """A task in ``words``; each of the ``checks`` is a run: how it is made, and what must come of it.

    A check says ``set``, ``disturb``, ``aspects``, ``seed`` and ``until`` of the run, ``monitors`` that must hold,
    ``broken`` those that must not, ``metrics`` that are added, and what metrics, of the model or added, ``expect``: a
    value, or bounds.  ``wrong`` are a part of the solution and what makes it wrong.
    """

    name: str
    words: str
    checks: list[dict[str, Any]]
    solution: str
    wrong: tuple[str, str]

    @property
    def wrong_solution(self) -> str:
        old, new = self.wrong
        assert self.solution.count(old) == 1, f"{self.name}: {old!r} stands {self.solution.count(old)} times"
        return self.solution.replace(old, new)


def tasks() -> dict[str, Task]:
    """The tasks by name."""
    found = {}
    for path in sorted(FOLDER.glob("*.yaml")):
        said = yaml.safe_load(path.read_text(encoding="utf-8"))
        said["wrong"] = tuple(said["wrong"])
        found[path.stem] = Task(path.stem, **said)
    return found


def judge(task: Task, model: Path) -> list[str]:
    """What is wrong with a model; nothing if it solves the task."""
    faults = []
    for number, check in enumerate(task.checks, 1):
        try:
            faults += [f"check {number}: {fault}" for fault in _faults(check, model)]
        except EpicycleError as error:
            faults.append(f"check {number}: {error}")
    return faults


def _faults(check: dict[str, Any], path: Path) -> list[str]:
    changes = {key: check[key] for key in ("set", "disturb", "aspects") if key in check}
    model = epicycle.load(path, **changes)
    monitors = {f"check_{key}": (text, True) for key, text in enumerate(check.get("monitors", ()))}
    monitors |= {f"check_not_{key}": (text, False) for key, text in enumerate(check.get("broken", ()))}
    for name, (text, _) in monitors.items():
        model.monitor(name, text)
    for name, options in check.get("metrics", {}).items():
        model.metric(name, **options)
    results = Simulation(model, seed=check.get("seed")).run(until=check["until"])
    faults = []
    for name, (text, wanted) in monitors.items():
        verdict = results.monitors[name]
        if verdict.holds is not wanted:
            faults.append(f"{text}: {'holds' if verdict.holds else verdict.missing or f'broken at {verdict.time} s'}")
    for name, wanted in check.get("expect", {}).items():
        if name not in results.metrics:
            faults.append(f"there is no metric {name}")
            continue
        value = results.metrics[name]
        low, high = wanted if isinstance(wanted, list) else (wanted, wanted)
        if value is None or not low - 1e-9 <= value <= high + 1e-9:
            faults.append(f"{name} is {value}, expected {low} to {high}")
    return faults
