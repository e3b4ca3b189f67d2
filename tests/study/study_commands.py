"""The command line of studies, in the process of the test.

It is apart from ``study_parts``, which each process that makes runs imports.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main
from tests.study.study_parts import THIS


def study(folder: Path, *arguments: object, out: str = "out") -> int:
    """``epicycle study`` of the file that ``write`` has made."""
    return main(
        ["study", str(folder / "walks.yaml"), "--types", str(THIS), "--out", str(folder / out), *map(str, arguments)]
    )


def message(capsys: pytest.CaptureFixture[str], folder: Path, *, out: bool = False) -> str:
    """What a command has said, without the folder."""
    said = capsys.readouterr()
    return (said.out if out else said.err).replace(f"{folder}/", "")
