"""The examples of SimPy's own source distribution, unchanged but for where ``env`` comes from, print the same.

They are not in this repository; ``benchmarks/truth/programs.py`` says where they come from.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import simpy

from benchmarks.truth import board, programs
from epicycle.bridges import Process
from epicycle.runner import Model, Simulation

pytestmark = pytest.mark.slow

EXAMPLES = tuple(case["program"] for case in board.source("simpy")["cases"])


@pytest.fixture(scope="module")
def examples() -> Path:
    folder = programs.examples()
    if folder is None:
        pytest.skip("SimPy's source distribution is not to be had")
    return folder


def test_these_are_all(examples: Path) -> None:
    assert sorted(path.stem for path in examples.glob("*.py")) == sorted(EXAMPLES)


def test_all_of_the_board_are_met(examples: Path) -> None:
    lines = board.lines_of("simpy")
    assert [(line.case, line.ours) for line in lines] == [(name, "the same lines") for name in EXAMPLES]
    assert all(line.is_met and not line.is_interval for line in lines)


def test_a_line_that_differs_is_shown(examples: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = programs.published("latency")
    monkeypatch.setattr(programs, "published", lambda name: [*lines[:4], "something else", *lines[5:]])
    (line,) = board._of_program("simpy", {"program": "latency", "asked": "it"}, None)
    assert (line.ours, line.is_met) == (f"line 5 is {lines[4]!r}, not 'something else'", False)
    monkeypatch.setattr(programs, "published", lambda name: [*lines, "more"])
    (line,) = board._of_program("simpy", {"program": "latency", "asked": "it"}, None)
    assert (line.ours, line.is_met) == (f"{len(lines)} lines instead of {len(lines) + 1}", False)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_beside_an_attached_run(name: str, examples: Path) -> None:
    def attached() -> simpy.Environment:
        env = simpy.Environment()
        model = Model("ticking")
        model.add(Process("ticking", function=tick))
        Simulation(model).attach(env)
        return env

    # The model ticks for ever.
    found = programs.printed(name, attached, lambda text: text.replace("env.run()", "env.run(until=100)"))
    assert found == programs.published(name)


def tick(env: Any) -> Any:
    while True:
        yield env.timeout(0.5)
