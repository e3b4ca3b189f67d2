"""The searches of the board by psy-taliro, on the same plants: its costs are the robustness of our monitors.

    python -m benchmarks.truth.psy_taliro [--searches N] [--optimizer DualAnnealing] [MONITOR ...]

psy-taliro is on PyPI, and no part of what we install: ``pip install psy-taliro``.  An input is a number, or one for
each segment, as in our searches; so are the number of runs at most and the seeds.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from importlib import import_module
from typing import Any

import yaml

import epicycle
from benchmarks.truth import board, falsifying
from epicycle.runner import Simulation


class _BrokenError(Exception):
    """The requirement is broken: the search is over."""


def runs_until_broken(case: Mapping[str, Any], optimizer: str, seed: int) -> int | None:
    """After how many runs psy-taliro breaks a requirement; None if it does not."""
    staliro = import_module("staliro")
    optimizers = import_module("staliro.optimizers")
    file = board.HERE / "falsification" / f"{case['search']}.yaml"
    said: Any = yaml.safe_load(file.read_text(encoding="utf-8"))["parameters"]
    ends = {name: list(map(float, ends.split(".."))) for name, ends in case["vary"].items()}
    lists = {name: len(said[name]["value"]) for name in ends if isinstance(said[name]["value"], list)}
    numbers = {
        f"{name}_{place}": (low, high) for name, (low, high) in ends.items() for place in range(lists.get(name, 1))
    }
    until = float(case["until"].split()[0]) if "until" in case else None  # s
    made = 0

    def robustness(sample: Any) -> float:
        nonlocal made
        made += 1
        given: dict[str, Any] = dict(case.get("set", {}))
        for name in ends:
            values = [float(sample.static[each]) for each in numbers if each.rpartition("_")[0] == name]
            given[name] = values if name in lists else values[0]
        model = epicycle.load(file, set=given)
        output = model.output
        output.monitors = [each for each in output.monitors if each.name == case["monitor"]]
        output.metrics = [each for each in output.metrics if each.monitor == case["monitor"]]
        found = Simulation(model).run(until=until)
        if found.monitors[case["monitor"]].holds is False:
            raise _BrokenError
        return float(found.metrics[f"{case['monitor']}_robustness"])

    options = staliro.TestOptions(static_inputs=numbers, iterations=falsifying.MOST, seed=seed)
    try:
        staliro.test(staliro.costfunc(robustness), getattr(optimizers, optimizer)(), options)
    except _BrokenError:
        return made
    return None


def main() -> None:
    """Print what it finds for each requirement, beside what is published."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cases = {case["monitor"]: case for case in board.source("searches")["cases"]}
    options.add_argument("monitors", nargs="*", metavar="MONITOR", choices=[*cases, []], help=", ".join(cases))
    options.add_argument("--searches", type=int, default=5, help="how often each is searched (default: 5)")
    options.add_argument("--optimizer", default="DualAnnealing", choices=("DualAnnealing", "UniformRandom"))
    given = options.parse_args()
    for name in given.monitors or cases:
        seeds = [falsifying.FIRST + number * falsifying.APART for number in range(given.searches)]
        runs = [runs_until_broken(cases[name], given.optimizer, seed) for seed in seeds]
        made = [each for each in runs if each is not None]
        mean = f", mean number of runs {sum(made) / len(made):.3g}" if made else ""
        print(f"{name}: {len(made)} of {len(runs)} searches{mean}", flush=True)


if __name__ == "__main__":
    main()
