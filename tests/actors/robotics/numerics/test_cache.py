"""Compiled kernels are kept on disk, and made anew when any source has changed."""

from __future__ import annotations

import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest

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
def twice_and(number: float) -> float:
    return twice(number) + 1.0
"""


def packed(folder: Path) -> Path:
    """A package of a kernel and a function that it calls, compiled as ours are."""
    package = folder / "numerics"
    package.mkdir()
    (package / "__init__.py").touch()
    # Here it stands in no package of ours, whose elementary functions it finds by their full name.
    for name in ("compiled.py", "entry.py", "jit.py", "kept.py"):
        source = (SOURCES / name).read_text("utf-8").replace("from ...core", "from epicycle.actors.core")
        source = source.replace("from .. import", "from epicycle.actors.robotics import")
        (package / name).write_text(source, "utf-8")
    (package / "user.py").write_text(USER)
    (package / "inner.py").write_text(INNER.format(factor="2.0"))
    assert result(package) == ("3.0", "")  # as Python
    assert result(package) == ("3.0", "")
    return package


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package that a test changes."""
    return packed(tmp_path)


@pytest.fixture(scope="module")
def mended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package that is as it was after each damage."""
    return packed(tmp_path_factory.mktemp("mended"))


def result(package: Path) -> tuple[str, str]:
    """What a new process computes, and what it says."""
    command = [sys.executable, "-B", "-c", PROGRAM]
    done = subprocess.run(command, cwd=package.parent, capture_output=True, text=True, check=True)
    return done.stdout.strip(), done.stderr.replace(f"{package}/", "")


@pytest.mark.slow
def test_a_kernel_is_compiled_anew_when_what_it_calls_has_changed(package: Path) -> None:
    assert len(list(package.glob("__pycache__/*/*/*.nbc"))) == 2
    assert result(package) == ("3.0", "")
    assert len(list(package.glob("__pycache__/*/*/*.nbc"))) == 2  # the one that was there
    (package / "inner.py").write_text(INNER.format(factor="3.0"))
    assert result(package) == ("4.0", "")  # as Python
    assert result(package) == ("4.0", "")
    assert len(list(package.glob("__pycache__/*/*/*.nbc"))) == 4


# One of each kind; the others are slow, for each takes two processes that compile.


@pytest.mark.slow
@pytest.mark.parametrize(("damage", "ending"), [*product(("cut", "empty", "flipped"), ("nbi", "nbc"))])
def test_damaged_code_is_compiled_again_with_a_word(mended: Path, damage: str, ending: str) -> None:
    """That of the entry, which contains the kernel's."""
    path = max(mended.glob(f"__pycache__/*/*/*twice_and_entry*.{ending}"), key=lambda each: each.stat().st_mtime_ns)
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    if damage == "flipped":
        data[middle] ^= 1
    path.write_bytes(data[: {"cut": middle, "empty": 0}.get(damage, len(data))])
    found, said = result(mended)
    assert found == "3.0"
    if (ending, damage) != ("nbi", "flipped"):  # which leads to code that is not there
        assert said.startswith("compiled code in __pycache__/")
        assert said.endswith(" and is made again\n")
        assert said.count("\n") == 1
    assert result(mended) == ("3.0", "")


@pytest.mark.slow
def test_code_that_cannot_be_kept_is_used(package: Path) -> None:
    path = next(package.glob("__pycache__/*/*/*twice_and_entry*.nbi"))
    path.unlink()
    path.mkdir()
    found, said = result(package)
    assert (found, "compiled code cannot be kept in __pycache__/" in said) == ("3.0", True)
