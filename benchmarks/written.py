"""Models as people write them, against SimPy by hand: `python -m benchmarks.written [--rounds 5] [NAME ...]`.

Each model is run as it is written, with its log, digest, recorded signals and metrics; beside it a program of
``by_hand`` that simulates the same with SimPy, and gives the same metrics and nothing else.  A slow test shows that the
metrics agree.
"""

from __future__ import annotations

import argparse
import importlib
import math
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median

import yaml

from benchmarks.lift import Lift
from benchmarks.measure import Row, compare, cpu_seconds, ratios, table, take_turns
from epicycle.runner import Simulation, load_model
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.catalogue.packaged import packaged_models

HERE = Path(__file__).parent
NAMES = (
    "emergency_room", "warehouse", "switched_network", "manufacturing_cell", "lift_group", "drones", "pendulum",
)  # fmt: skip
MOST = 2.0  # times the time of SimPy


def model(name: str) -> Model:
    """One of the models: packaged, or of the benchmarks alone."""
    own = HERE / "models" / f"{name}.yaml"
    return load_model(own if own.exists() else name)


def of_python() -> Model:
    """``lift_group`` with the lift as an actor in Python."""
    whole = yaml.safe_load(packaged_models()["lift_group"].read_text(encoding="utf-8"))
    given = {name: f"${{{name}}}" for name in ("places", "pace", "doors", "step")}
    whole["actors"]["lift"] = {"type": "Lift", "count": "${lifts}", **given}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lift_group.yaml"
        path.write_text(yaml.safe_dump(whole), encoding="utf-8")
        return load_model(path, types=[Lift])


def by_hand(name: str) -> Callable[[int], dict[str, float]]:
    """The program that somebody would write instead; takes a seed."""
    program: Callable[[int], dict[str, float]] = importlib.import_module(f"benchmarks.by_hand.{name}").run
    return program


def ours(model: Model) -> float:
    """The CPU time of a run, with what it needs to begin and to end."""
    return cpu_seconds(lambda: Simulation(model, seed=1).run())


def rows(rounds: int = 5, names: tuple[str, ...] = NAMES) -> Iterator[Row]:
    """The table's lines."""
    how = f"{rounds} runs each in one process, taking turns; CPU time of a run with its initialisation and metrics"
    found = []
    for name in names:
        results = take_turns(
            {"SimPy": partial(cpu_seconds, partial(by_hand(name), 1)), "ours": partial(ours, model(name))}, rounds
        )
        found.append(median(ratios(results, "SimPy", "ours")))
        yield compare(name, results, "SimPy", "ours", how=how, goal=1 / MOST, unit=(1e-3, "ms"))
    results = take_turns(
        {
            "SimPy": partial(cpu_seconds, partial(by_hand("lift_group"), 1)),
            "Python": partial(ours, of_python()),
            "the machine in YAML": partial(ours, model("lift_group")),
        },
        rounds,
    )
    for peer in ("SimPy", "the machine in YAML"):
        work = "lift_group, its lift an actor in Python"
        yield compare(work, results, peer, "Python", how=how, unit=(1e-3, "ms"))
    middle = math.exp(sum(map(math.log, found)) / len(found))
    yield Row("all of them, geometric mean", "SimPy", f"{middle:.3g}x", ">= 1x", middle >= 1.0, how)


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("names", nargs="*", metavar="NAME", help=f"of the models; all: {', '.join(NAMES)}")
    given = options.parse_args()
    print(table(rows(given.rounds, tuple(given.names) or NAMES)))
