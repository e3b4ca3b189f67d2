"""What all tests have in common: what they count together is told at the end."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from typing import Any

import hypothesis
import pytest

# The examples of a property are the same in every run and take the time they take, so that one that passes here passes
# elsewhere; `make fuzz` tries others each time.
hypothesis.settings.register_profile("the same", derandomize=True, deadline=None)
hypothesis.settings.load_profile("the same")


# Tests start hundreds of processes, which take a third longer where Python may not keep what it has compiled.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# The key of seals is not the user's.
_STATE = tempfile.TemporaryDirectory()
os.environ["XDG_STATE_HOME"] = _STATE.name

# Started in the background of a shell, everything ignores Ctrl-C, and what tests start inherits that.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# Each process that needs kernels would compile them all, and two that start together do so twice.
KERNELS = (
    "warm_up.compile_modules('association'); warm_up.compile_modules('barrier', which=slice(1))",
    "warm_up.compile_others(); warm_up.compile_modules('retreat', 'lines_of_sight', 'barrier')",
)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Before all tests are divided among workers, the robots' kernels are compiled, if they are not yet."""
    config = session.config
    is_whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None) or not is_whole:
        return
    head = "from epicycle.actors.robotics.numerics import warm_up; "
    for each in [subprocess.Popen([sys.executable, "-c", head + program]) for program in KERNELS]:
        each.wait()


@pytest.fixture(scope="module", autouse=True)
def _what_is_there_stays() -> None:
    """Python need not look for garbage in what earlier modules have left, such as all that they have imported."""
    gc.collect()
    gc.freeze()


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """How many pairs of aspect and model were tested, on however many workers: sums of what tests record."""
    totals: Counter[str] = Counter()
    for report in terminalreporter.stats.get("passed", ()):
        totals.update({name: value for name, value in report.user_properties if name.startswith("pairs ")})
    for name, total in totals.items():
        terminalreporter.write_line(f"{name}: {total}")
