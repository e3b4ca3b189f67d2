"""Examples of SimPy's own source distribution as processes: what they define, unchanged, prints what is printed there.

They are not in this repository: the tests take them from the folder that EPICYCLE_SIMPY_SDIST names, or download them.
"""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import tarfile
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
import simpy

from epicycle.actors import Process
from epicycle.runner import Model, Simulation

pytestmark = pytest.mark.slow


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


def definitions(file: Path) -> dict[str, Any]:
    """The imports, constants, functions and classes of an example, without the lines that run it."""
    nodes = ast.parse(file.read_text(encoding="utf-8")).body
    kept = [
        node
        for node in nodes
        if isinstance(node, (ast.Import, ast.ImportFrom, ast.FunctionDef, ast.ClassDef))
        or (isinstance(node, ast.Assign) and ast.unparse(node.targets[0]).isupper())
    ]
    names: dict[str, Any] = {"__name__": "example"}
    exec(compile(ast.Module(kept, []), str(file), "exec"), names)
    names["random"].seed(names["RANDOM_SEED"])
    return names


def run(behave: Any, stop: float | None = None) -> None:
    class Example(Process):
        def run(self) -> Generator[Any, Any, None]:
            behave(self.environment)
            yield self.environment.timeout(0)

    model = Model("example", stop=stop)
    model.add(Example("example"))
    Simulation(model).run()


def test_bank_renege(examples: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = definitions(examples / "bank_renege.py")

    def begin(env: Any) -> None:
        counter = simpy.Resource(env, capacity=1)
        env.process(names["source"](env, names["NEW_CUSTOMERS"], names["INTERVAL_CUSTOMERS"], counter))

    run(begin)
    assert capsys.readouterr().out.splitlines() == (examples / "bank_renege.out").read_text().splitlines()[1:]


def test_machine_shop(examples: Path) -> None:
    names = definitions(examples / "machine_shop.py")
    machines: list[Any] = []

    def begin(env: Any) -> None:
        repairman = simpy.PreemptiveResource(env, capacity=1)
        machines.extend(names["Machine"](env, f"Machine {i}", repairman) for i in range(names["NUM_MACHINES"]))
        env.process(names["other_jobs"](env, repairman))

    run(begin, stop=names["SIM_TIME"])
    printed = [f"{machine.name} made {machine.parts_made} parts." for machine in machines]
    assert printed == (examples / "machine_shop.out").read_text().splitlines()[2:]
