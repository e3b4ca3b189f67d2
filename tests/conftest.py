"""What all tests have in common: what they count together is told at the end."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from collections import Counter
from typing import Any

import hypothesis

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


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """How many pairs of aspect and model were tested, on however many workers: sums of what tests record."""
    totals: Counter[str] = Counter()
    for report in terminalreporter.stats.get("passed", ()):
        totals.update({name: value for name, value in report.user_properties if name.startswith("pairs ")})
    for name, total in totals.items():
        terminalreporter.write_line(f"{name}: {total}")
