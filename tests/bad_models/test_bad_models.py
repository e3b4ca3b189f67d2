"""Every wrong model gets its message, to the letter: `NAME.yaml` the one that `NAME.txt` holds.

A first line `# epicycle validate NAME.yaml ...` says with which options.  To write the messages anew, call
``python tests/bad_models/test_bad_models.py``; read the difference as the author of such a model would, and keep it
only if it helps.
"""

from __future__ import annotations

import contextlib
import io
import os
import shlex
from pathlib import Path

import pytest

from epicycle.runner.cli import main

FOLDER = Path(__file__).parent
NAMES = sorted(path.stem for path in FOLDER.glob("*.yaml"))
COMMAND = "# epicycle "


def said(name: str) -> tuple[int, str]:
    """The exit code of `epicycle validate` and what it says."""
    with (FOLDER / f"{name}.yaml").open(encoding="utf-8", errors="replace") as file:
        first = file.readline()
    arguments = shlex.split(first.removeprefix(COMMAND)) if first.startswith(COMMAND) else ["validate", f"{name}.yaml"]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(FOLDER), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(arguments)
    return code, err.getvalue()


@pytest.mark.parametrize("name", NAMES)
def test_message(name: str) -> None:
    assert said(name) == (2, (FOLDER / f"{name}.txt").read_text(encoding="utf-8"))


def test_each_message_has_its_model() -> None:
    assert sorted(path.stem for path in FOLDER.glob("*.txt")) == NAMES
    assert len(NAMES) >= 60


def test_nothing_was_done() -> None:
    """Some of them would leave a file behind if they were obeyed."""
    assert not list(FOLDER.rglob("harm")) + list(Path.cwd().glob("harm"))


def write_anew() -> None:
    """Write the messages of today."""
    for name in NAMES:
        code, text = said(name)
        if code != 2:
            print(f"{name} is not refused, the exit code is {code}")
        (FOLDER / f"{name}.txt").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    os.chdir(FOLDER)
    write_anew()
