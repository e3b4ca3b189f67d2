"""A copy of the project in which mutants live, and test runs that begin with all imported that takes long."""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import resource
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pytest

# All that our own modules and the tests import from others; a forked process has it at once.
HEAVY = (
    "numpy", "scipy.stats", "scipy.optimize", "scipy.integrate", "scipy.linalg", "numba", "pyarrow.parquet",
    "pyarrow.csv", "simpy", "networkx", "yaml", "filterpy.kalman", "rich.table", "rich.console", "hypothesis",
    "jsonschema", "pandas", "matplotlib.figure", "casadi", "pytest", "pytest_asyncio", "doctest", "mpmath",
)  # fmt: skip
OPTIONS = (
    "-q", "--tb=no", "--no-header", "-W", "ignore",
    "-p", "no:cacheprovider", "-p", "no:unraisableexception", "-p", "no:threadexception",
)  # fmt: skip
ROOT = Path(__file__).parents[2]  # of the project that is copied, which no test must meet
MEMORY = 16_000_000_000  # address space of a process, in bytes


def preload() -> None:
    """Import what is heavy and not ours."""
    for name in HEAVY:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    assert "epicycle" not in sys.modules
    sys.dont_write_bytecode = False  # whatever the environment says
    gc.collect()
    gc.freeze()  # none of it is looked at again in a fork


def copy_project(root: Path, to: Path) -> Path:
    """A copy of what git knows or would add, importable as ``epicycle`` from its root."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=root, check=True, capture_output=True, text=True
    ).stdout
    for name in listed.splitlines():
        if (root / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, to / name)
    shutil.copytree(to / "api", to / "epicycle")
    for folder in ("actors", "aspects", "bridges", "models", "ptolemy", "runner"):
        (to / "epicycle" / folder).symlink_to(to / folder)
    return to


class Verdict(NamedTuple):
    """What came of tests: ``failed`` is the first that failed, or what ended them."""

    passed: bool
    failed: str
    seconds: float  # of the processor


class _Chosen:
    """Lets the tests of a list run, in its order, and notes the first that fails."""

    def __init__(self, tests: Sequence[str]) -> None:
        self.places = {test: place for place, test in enumerate(tests)}
        self.failed = ""

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = sorted(
            (item for item in items if item.nodeid in self.places), key=lambda item: self.places[item.nodeid]
        )

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid


def in_child(tree: Path, compiled: bool, limit: float, work: Callable[[], Any]) -> tuple[Any, int, float]:
    """Do something in a fork of this process: what it returns as JSON (None if it died), its end, and its CPU time."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            os.close(reading)
            os.setsid()
            _settle(tree, compiled, limit)
            answer = json.dumps(work()).encode()
            with os.fdopen(writing, "wb") as pipe:
                pipe.write(answer)
        except BaseException:  # whatever it is, the parent sees that nothing came
            os._exit(70)
        os._exit(0)
    os.close(writing)
    read, deadline = bytearray(), time.monotonic() + 60.0 + 10.0 * limit
    while (left := deadline - time.monotonic()) > 0.0:
        if select.select([reading], [], [], left)[0]:
            block = os.read(reading, 1 << 20)
            if not block:
                break
            read += block
    os.close(reading)
    with contextlib.suppress(ProcessLookupError):
        if left <= 0.0:
            os.killpg(pid, signal.SIGKILL)
    _, status, usage = os.wait4(pid, 0)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)  # what it left behind
    return (json.loads(read) if read else None), status, usage.ru_utime + usage.ru_stime


def _settle(tree: Path, compiled: bool, limit: float) -> None:
    """Make this process one that was started in the copy."""
    os.chdir(tree)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 3))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    os.environ.update(
        PYTHONPATH=str(tree),
        PYTHONDONTWRITEBYTECODE="1",
        PYTEST_DISABLE_PLUGIN_AUTOLOAD="1",
        NUMBA_DISABLE_JIT=str(int(not compiled)),
    )
    sys.path[:] = [str(tree), *(each for each in sys.path if each and Path(each) != ROOT)]
    ours = {path.stem for path in tree.iterdir()}
    for name in [name for name in sys.modules if name.partition(".")[0] in ours]:
        del sys.modules[name]
    importlib.invalidate_caches()
    silence = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(silence, stream)


def run_tests(tree: Path, tests: Sequence[str], compiled: bool, limit: float, anew: bool = False) -> Verdict:
    """Run tests, one after the other, until one fails; ``anew``: kernels are compiled first."""
    files = list(dict.fromkeys(test.partition("::")[0] for test in tests))
    ordered = [test for file in files for test in tests if test.partition("::")[0] == file]

    def work() -> tuple[int, str]:
        sys.dont_write_bytecode = True
        if anew:  # the first process would take them as Python
            importlib.import_module("epicycle.actors.robotics.numerics.compiled").LEDGER.close()
        chosen = _Chosen(ordered)
        return int(pytest.main([*OPTIONS, "-x", *files], plugins=[chosen])), chosen.failed

    answer, status, seconds = in_child(tree, compiled, limit, work)
    if answer is None:
        return Verdict(False, f"ended by signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else "died", seconds)
    code, failed = answer
    return Verdict(code == 0, failed or ("" if code == 0 else f"pytest: exit code {code}"), seconds)
