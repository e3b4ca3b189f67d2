"""Runs that would take hours, on a terminal: they report it, show their progress, and end at Ctrl-C."""

from __future__ import annotations

import os
import re
import select
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from epicycle.runner.show.watching import outlook

# Takes the terminal, to which Ctrl-C goes; what is said of long runs comes after a second, not after five.
EPICYCLE = """
import os
os.login_tty(0)
from epicycle.runner.show import watching
watching.PATIENCE = 1.0
from epicycle.runner.interface.cli import main
raise SystemExit(main())
"""
CLOCK = """
model: long
actors: {clock: {type: Clock, period: 1 ns}}
run: {stop: 10 s}
"""
# All of its steps belong to one firing.
ODE = """
model: long
actors:
  clock: {type: Clock, period: 10 s, offset: 10 s}
  ode: {type: ODE, initial: {x: 1}, derivatives: {x: -x * x}, max_step: 1 ns}
connections: [clock.output -> ode.trigger]
run: {stop: 10 s}
"""
KEPT = "Ctrl-C ends it, and what was recorded is kept"


def on_a_terminal(arguments: list[str], folder: Path, is_over: Callable[[str], bool]) -> tuple[list[str], int, float]:
    """What a program prints, with a Ctrl-C typed once it has printed enough; its exit code; how long it took to end."""
    ours, its = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", EPICYCLE, *arguments],
        cwd=folder, stdin=its, stdout=its, stderr=its, env={**os.environ, "TERM": "xterm", "COLUMNS": "200"},
    )  # fmt: skip
    os.close(its)
    printed, typed = "", 0.0
    try:
        while select.select([ours], [], [], 60.0)[0]:
            try:
                piece = os.read(ours, 65_536)
            except OSError:  # the process has ended
                break
            printed += piece.decode()
            if not typed and is_over(printed):
                os.write(ours, b"\x03")
                typed = time.monotonic()
        code = process.wait(60.0)
    finally:
        process.kill()
        os.close(ours)
    plain = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]|\^C", "", printed)
    lines = [line.rstrip() for line in re.split(r"[\r\n]+", plain) if line.strip()]
    return lines, code, time.monotonic() - typed


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "login_tty"), reason="no terminals here")
@pytest.mark.parametrize(
    ("model", "progress", "word"),
    [
        (
            CLOCK,
            r"long (0|[0-9.e-]+) s of model time .*",
            rf"after 1 s the run is at [0-9.e-]+ s of 10 s: at this pace it takes another [0-9,.]+ h; {KEPT}",
        ),
        (ODE, "long 0 s of model time .*", f"after 1 s the run is still at 0 s of 10 s; {KEPT}"),
    ],
    ids=["clock", "ode"],
)
def test_steps_of_a_nanosecond(tmp_path: Path, model: str, progress: str, word: str) -> None:
    (tmp_path / "long.yaml").write_text(model)
    lines, code, seconds = on_a_terminal(["run", "long.yaml"], tmp_path, lambda printed: KEPT in printed)
    bar = [line for line in lines if re.fullmatch(progress, line)]
    first, *others = [line for line in lines if line not in bar]
    assert re.fullmatch(word, first)
    assert others == ["what was recorded before is in results/long", "interrupted"]
    assert len(bar) > 3
    if model is CLOCK:
        assert len({line.split()[1] for line in bar}) > 3
    assert code == 130
    assert seconds < 5.0  # 0.3 on an idle machine
    assert (tmp_path / "results" / "long" / "signals.parquet").is_file()


def test_what_is_said_of_runs_that_take_long() -> None:
    assert (
        outlook(5.0, 0.001, 1.0)
        == f"after 5 s the run is at 0.001 s of 1 s: at this pace it takes another 1.4 h; {KEPT}"
    )
    assert outlook(5.0, 0.0, 1.0) == f"after 5 s the run is still at 0 s of 1 s; {KEPT}"
    assert outlook(5.0, 0.01, 1.0) == ""
