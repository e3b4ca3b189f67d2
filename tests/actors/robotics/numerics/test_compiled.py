"""Kernels are run by Python at first, and compiled when that pays; both give the same."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from epicycle.actors import CORE
from epicycle.actors.robotics.numerics import compiled, kept

PROGRAM = """
import sys
from epicycle.actors.robotics.numerics import compiled, kept
compiled._LIMIT = {limit}

@compiled.inner
def inverse(number):
    return 1.0 / number

@compiled.kernel
def beyond(number: float) -> float:
    return inverse(number) + 1.0

@compiled.kernel
def twice_beyond(number: float) -> float:
    return 2.0 * beyond(number)

compiled.LEDGER.prepared.append(lambda: print("prepared"))
print([twice_beyond(number) for number in {numbers}], "numba" in sys.modules)
"""


def said(folder: Path, numbers: list[float], limit: float = 10.0, **variables: str) -> list[str]:
    program = folder / "program.py"
    program.write_text(PROGRAM.format(numbers=numbers, limit=limit))
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache"), "NUMBA_DISABLE_JIT": "0", **variables}
    done = subprocess.run([sys.executable, str(program)], env=environment, capture_output=True, text=True, check=True)
    assert not done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
def test_the_first_process_takes_kernels_as_python_and_the_second_compiles_them(tmp_path: Path) -> None:
    assert said(tmp_path, [2.0, 4.0]) == ["[3.0, 2.5] False"]
    assert not list(tmp_path.rglob("*.nbc"))
    assert said(tmp_path, [2.0, 4.0]) == ["prepared", "[3.0, 2.5] True"]
    assert list(tmp_path.rglob("*twice_beyond*.nbc"))


@pytest.mark.slow
def test_a_process_that_spends_long_in_them_compiles_them(tmp_path: Path) -> None:
    assert said(tmp_path, [2.0, 4.0, 2.0], limit=1e-12) == ["prepared", "[3.0, 2.5, 3.0] True"]


@pytest.mark.slow
@pytest.mark.parametrize("core", sorted({"python", CORE}))
def test_kernels_that_are_not_compiled_yet_where_others_are(core: str, tmp_path: Path) -> None:
    """As a tracker's are after a run of a model without one."""
    said(tmp_path, [2.0], EPICYCLE_CORE=core)
    [first] = tmp_path.rglob("python")
    first.with_name("compiled").touch()
    assert said(tmp_path, [2.0, 4.0], EPICYCLE_CORE=core)[-1] == "[3.0, 2.5] True"


@pytest.mark.slow
def test_what_python_refuses_to_compute_is_compiled(tmp_path: Path) -> None:
    assert said(tmp_path, [2.0, 0.0, 2.0]) == ["prepared", "[3.0, inf, 3.0] True"]


def test_where_nothing_can_be_kept_python_is_first_in_each_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    for module in (compiled, kept):
        monkeypatch.setattr(module, "folder", lambda: tmp_path / "file" / "cache")
    for _ in range(2):
        assert compiled._Ledger().allows()
    for module in (compiled, kept):
        monkeypatch.setattr(module, "folder", lambda: tmp_path / "cache")
    assert compiled._Ledger().allows()
    assert not compiled._Ledger().allows()  # as in a later process
