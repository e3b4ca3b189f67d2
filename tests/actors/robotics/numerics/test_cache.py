"""Compiled kernels are kept on disk, and made anew when any source has changed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import epicycle.actors

SOURCES = Path(next(iter(epicycle.actors.__path__))) / "robotics" / "numerics"
PROGRAM = "import numerics.user as user; print(user.twice_and(1.0))"
INNER = """
from .compiled import inner
@inner
def twice(number):
    return {factor} * number
"""
USER = """
from .compiled import kernel
from .inner import twice
@kernel
def twice_and(number):
    return twice(number) + 1.0
"""


def test_a_kernel_is_compiled_anew_when_what_it_calls_has_changed(tmp_path: Path) -> None:
    package = tmp_path / "numerics"
    package.mkdir()
    (package / "__init__.py").touch()
    # Here it stands in no package of ours, whose elementary functions it finds by their full name.
    source = (SOURCES / "compiled.py").read_text("utf-8").replace("from ...core", "from epicycle.actors.core")
    (package / "compiled.py").write_text(source, "utf-8")
    (package / "user.py").write_text(USER)

    def result(factor: str) -> str:
        (package / "inner.py").write_text(INNER.format(factor=factor))
        command = [sys.executable, "-B", "-c", PROGRAM]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout.strip()

    assert result("2.0") == "3.0"
    assert len(list(package.glob("__pycache__/*/*/*.nbc"))) == 1
    assert result("2.0") == "3.0"
    assert len(list(package.glob("__pycache__/*/*/*.nbc"))) == 1  # the one that was there
    assert result("3.0") == "4.0"
    assert len(list(package.glob("__pycache__/*/*/*.nbc"))) == 2
