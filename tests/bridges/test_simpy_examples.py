"""The examples of SimPy's own source distribution, unchanged but for where ``env`` comes from, print the same.

They are not in this repository: the tests take them from the folder that EPICYCLE_SIMPY_SDIST names, or download them.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
from pathlib import Path
from typing import Any

import pytest
import simpy

from epicycle.bridges import Environment, Process
from epicycle.runner import Model, Simulation

pytestmark = pytest.mark.slow

EXAMPLES = (
    "bank_renege",
    "carwash",
    "gas_station_refuel",
    "latency",
    "machine_shop",
    "movie_renege",
    "process_communication",
)
MADE = "env = simpy.Environment()"


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = Path(os.environ.get("EPICYCLE_SIMPY_SDIST") or tmp_path_factory.mktemp("simpy"))
    if not any(folder.rglob("bank_renege.py")):
        words = ["download", "--quiet", "--no-deps", "--no-binary", "simpy", "--dest", str(folder), "simpy>=4.1,<5"]
        done = subprocess.run([sys.executable, "-m", "pip", *words], capture_output=True, check=False)
        if done.returncode:
            pytest.skip("SimPy's source distribution is not to be had")
        with tarfile.open(next(folder.glob("simpy-*.tar.gz"))) as archive:
            archive.extractall(folder, filter="data")
    return next(folder.rglob("bank_renege.py")).parent


def test_these_are_all(examples: Path) -> None:
    assert sorted(path.stem for path in examples.glob("*.py")) == sorted(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_on_the_director(name: str, examples: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (examples / f"{name}.py").read_text(encoding="utf-8")
    assert text.count(MADE) == (2 if name == "process_communication" else 1)
    names: dict[str, Any] = {"__name__": "__main__", "Environment": Environment}
    exec(compile(text.replace(MADE, "env = Environment()"), name, "exec"), names)
    assert capsys.readouterr().out == (examples / f"{name}.out").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_beside_an_attached_run(name: str, examples: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (examples / f"{name}.py").read_text(encoding="utf-8")

    def attached() -> simpy.Environment:
        env = simpy.Environment()
        model = Model("ticking")
        model.add(Process("ticking", function=tick))
        Simulation(model).attach(env)
        return env

    names: dict[str, Any] = {"__name__": "__main__", "attached": attached}
    text = text.replace(MADE, "env = attached()").replace("env.run()", "env.run(until=100)")  # which ticks for ever
    exec(compile(text, name, "exec"), names)
    assert capsys.readouterr().out == (examples / f"{name}.out").read_text(encoding="utf-8")


def tick(env: Any) -> Any:
    while True:
        yield env.timeout(0.5)
