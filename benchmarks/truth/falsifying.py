"""The cases of the board that are about falsification, in two ways:

- ``replay: NAME`` with ``monitor``: inputs that are published as breaking it do, and what the port ``of`` sends then is
  ``within`` so much of what is published there; the robustness of the monitor is that of rtamt.  Where no inputs are
  published, they are ours; ``least`` is the least robustness that is published, and ours is ``within`` so much of it.
- ``search: NAME`` with ``monitor`` and ``vary``: searches with several seeds, each of at most as many runs as were
  published; ``published`` has in how many of 50 something was ``found``, and the ``mean`` number of runs of these.
  ``psy_taliro`` has the same, of so many ``searches``, as ``psy_taliro.py`` has counted it.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import yaml

import epicycle
from epicycle.runner import Simulation
from epicycle.runner.execution.results import Results
from epicycle.runner.study.session import available_cores

EXAMPLES = ("published.yaml", "ours.yaml")
SEGMENT = 5.0  # s
OUTCOMES = ("sent", "rtamt")  # of an example; all else in it are inputs
EQUAL = 1e-9  # the most by which margins differ that are the same
FIRST, APART = 50_000, 1_000  # the seed of the first search, of which none was looked at before; between seeds
MOST = 300  # runs of a search
OF = 50  # searches of each property, published and ours


@cache
def counterexamples(folder: Path) -> Mapping[str, Any]:
    """The examples of each property: published ones, or ours."""
    texts = [(folder / "counterexamples" / name).read_text(encoding="utf-8") for name in EXAMPLES]
    return {monitor: examples for text in texts for monitor, examples in yaml.safe_load(text).items()}


def inputs(example: Mapping[str, Any]) -> dict[str, Any]:
    """The inputs of an example, by the parameters that they are."""
    return {name: value for name, value in example.items() if name not in OUTCOMES}


def replayed(file: Path, case: Mapping[str, Any], example: Mapping[str, Any]) -> Results:
    """The run of an example, with no monitor but the one that it is of."""
    model = epicycle.load(file, set={**case.get("set", {}), **inputs(example)})
    output = model.output
    output.monitors = [each for each in output.monitors if each.name == case["monitor"]]
    output.metrics = [each for each in output.metrics if each.monitor == case["monitor"]]
    return Simulation(model).run(until=case["until"])


def deviation(found: Results, case: Mapping[str, Any], example: Mapping[str, Any]) -> float:
    """The largest difference from what is published.

    The published plants are a step behind: their first step has no length.
    """
    signal = found[case["of"]]
    step = float(signal.times[1])
    far = []
    for number, value in enumerate(example["sent"], 1):
        place = round(min(number * SEGMENT, case["until"]) / step) - 1
        far.append(abs(float(signal.tokens[place]) - value))
    return max(far)


def replays(file: Path, case: Mapping[str, Any]) -> Iterator[tuple[str, str, str, bool, str]]:
    """What is asked, published and found for the inputs of a case, whether it is the same, and a command."""
    examples, monitor, until = counterexamples(file.parent)[case["monitor"]], case["monitor"], case["until"]
    is_published = "of" in case
    robustness, broken, furthest = [], 0, 0.0
    for example in examples:
        found = replayed(file, case, example)
        robustness.append(float(found.metrics[f"{monitor}_robustness"]))
        broken += found.monitors[monitor].holds is False
        furthest = max(furthest, deviation(found, case, example)) if is_published else 0.0
    settings = {**case.get("set", {}), **inputs(examples[0])}
    sets = "".join(f" --set {shlex.quote(f'{name}={value}')}" for name, value in settings.items())
    command = f"{sets} --until {until} --check"
    if is_published:
        yield (
            f"{monitor} with published inputs; {case['of']}",
            f"broken in {len(examples)} of {len(examples)}; to {case['within']:g}",
            f"broken in {broken} of {len(examples)}; within {furthest:.3f}",
            broken == len(examples) and furthest <= case["within"],
            command,
        )
    if "least" in case:
        yield (
            f"least robustness of {monitor}",
            f"{case['least']:.4g}; to {case['within']:g}",
            f"{min(robustness):.4g}",
            abs(min(robustness) - case["least"]) <= case["within"],
            command,
        )
    apart = max(abs(ours - example["rtamt"]) for ours, example in zip(robustness, examples, strict=True))
    yield (
        f"robustness of {monitor} with {'published' if is_published else 'our'} inputs, by rtamt",
        ", ".join(f"{example['rtamt']:.4g}" for example in examples),
        "the same within 1e-9" if apart <= EQUAL else f"{apart:.2g} away",
        apart <= EQUAL,
        command,
    )


def searches(
    file: Path, case: Mapping[str, Any], folder: Path, jobs: int | None
) -> Iterator[tuple[str, str, str, bool, str]]:
    """How often searches find something, and after how many runs: asked, published, found, whether it is met."""
    until = case.get("until")

    def search(number: int) -> tuple[int | None, int]:
        """The number of the first run that breaks the requirement, and how many runs failed."""
        found = epicycle.search(
            file, epicycle.Break(case["monitor"], runs=MOST), vary=case["vary"], set=case.get("set", {}), until=until,
            seed=FIRST + number * APART, out=folder / f"{case['monitor']}_{number}", jobs=1, progress=False,
        )  # fmt: skip
        return None if found.broken is None else found.broken.number, len(found.failed)

    with ThreadPoolExecutor(jobs or available_cores()) as threads:  # each search makes its runs in another process
        ended = list(threads.map(search, range(OF)))
    made, failed = [number for number, _ in ended if number is not None], sum(failed for _, failed in ended)
    published, theirs = case["published"], case.get("psy_taliro", {})
    vary = "".join(f" --vary {name}={values}" for name, values in case["vary"].items())
    sets = "".join(f" --set {shlex.quote(f'{name}={value}')}" for name, value in case.get("set", {}).items())
    ends = f" --until {shlex.quote(until)}" if until else ""
    command = f" --break {case['monitor']}{vary}{sets}{ends} --runs {MOST} --seed {FIRST}"  # the first search
    yield (
        f"{case['monitor']} falsified",
        f"{published['found']} of {OF} searches"
        + ("; psy-taliro {found} of {searches}".format(**theirs) if theirs else ""),
        f"{len(made)} of {OF} searches{f'; {failed} runs failed' if failed else ''}",
        len(made) >= published["found"],
        command,
    )
    ours = sum(made) / len(made) if made else None
    yield (
        f"mean number of runs until {case['monitor']} is broken",
        f"{published['mean']:.3g}{f'; psy-taliro {mean:.3g}' if (mean := theirs.get('mean')) else ''}",
        "none" if ours is None else f"{ours:.3g}",
        ours is not None and ours <= published["mean"],
        command,
    )
