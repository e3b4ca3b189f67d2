"""Models with a planted fault: a search finds a run in which it shows, and an explanation of that run is the fault."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

import epicycle
from epicycle.runner.execution.engine import Interventions, Simulation
from epicycle.runner.execution.results import Results
from epicycle.runner.interface.cli import main
from epicycle.runner.model.graph.acts import ActName

PLANTED = Path(__file__).parent / "planted"
RUNS = 300  # within which each fault is found, with any seed of the search


def late_permit(results: Results) -> list[ActName]:
    """The permit of the cycle in which the press was not safe."""
    return [ActName("late", "press.permit", int(broken(results, "safe")) + 1)]


def lost_plans(results: Results) -> list[ActName]:
    """The plans lost since the one that had been valid for 2 s; the robot looks every 100 ms, plans come every 500."""
    since = broken(results, "fresh") - 2.2
    return [act.name for act in results.acts if act.name.aspect == "radio" and since < act.time / 1e9 <= since + 2.2]


def doubled_message(results: Results) -> list[ActName]:
    """The first of the messages of the burst that came twice."""
    cycle = int(broken(results, "lossless"))
    burst = range(3 * cycle + 1, 3 * cycle + 4)
    return [act.name for act in results.acts if act.name.aspect == "echo" and act.name.token in burst][:1]


def lost_message(results: Results) -> list[ActName]:
    """The request or answer of the cycle after which nothing came any more."""
    cycle = int(broken(results, "answered")) + 1
    return [act.name for act in results.acts if act.name.aspect == "radio" and act.name.token == cycle]


def broken(results: Results, monitor: str) -> float:
    """When it was."""
    time = results.monitors[monitor].time
    assert time is not None
    return time


class Plant(NamedTuple):
    monitor: str
    vary: list[str]
    fault: Callable[[Results], list[ActName]]


PLANTS = {
    "race": Plant("safe", ["jitter=1 ms..40 ms"], late_permit),
    "stale_plan": Plant("fresh", ["period=0.5 s..1.4 s", "loss=0..0.01"], lost_plans),
    "small_buffer": Plant("lossless", ["twice=0..0.004"], doubled_message),
    "no_exit": Plant("answered", ["loss=0..0.004"], lost_message),
}


def check(name: str, seed: int, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, plant = PLANTED / f"{name}.yaml", PLANTS[name]
    found = epicycle.search(
        file, epicycle.Break(plant.monitor, runs=RUNS), vary=plant.vary, seed=seed, out=folder, jobs=1
    )
    assert found.broken is not None, found.sentence
    assert found.explain[:2] == ["epicycle", "explain"]
    # What is printed, in a shell.
    assert main([*found.command[1:], "--check", "--out", str(folder / "run")]) == 3
    assert main([*found.explain[1:], "--no-page", "--json", "--out", str(folder / "why")]) == 0
    explained = json.loads(capsys.readouterr().out.splitlines()[-1])
    acts = [ActName(*each["act"]["name"]) for each in explained["effects"]]
    values = dict(each.partition("=")[::2] for each in found.command if "=" in each)
    results = Simulation(epicycle.load(file, set=values), seed=found.broken.seed, acts=Interventions()).run()
    assert acts == plant.fault(results)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTS)
def test_a_planted_fault_is_found_and_explained(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check(name, 3_000, tmp_path, capsys)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(0, 20_000, 1_000))
@pytest.mark.parametrize("name", PLANTS)
def test_planted_faults_are_found_whatever_the_seed(
    name: str, seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    check(name, seed, tmp_path, capsys)


@pytest.mark.parametrize("name", PLANTS)
def test_without_acts_the_planted_models_are_right(name: str) -> None:
    """The faults do not show by themselves: something has to happen."""
    model = epicycle.load(PLANTED / f"{name}.yaml")
    results = Simulation(model, acts=Interventions(frozenset())).run()
    assert results.monitors[PLANTS[name].monitor].holds
