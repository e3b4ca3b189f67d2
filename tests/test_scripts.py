"""The check of our pages' JavaScript: what it does with a compiler, and without."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests import scripts


def tool(folder: Path, name: str, script: str) -> None:
    """A program that is on the path, alone."""
    (folder / name).write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    (folder / name).chmod(0o755)


@pytest.fixture
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PATH", str(tmp_path))
    return tmp_path


def test_every_file_of_a_page_is_checked() -> None:
    checked = {path for files in scripts.PROGRAMS.values() for path in files}
    found = (scripts.ROOT / "runner").rglob("*.js")
    ours = {each for each in found if each.name != "codemirror.js"}  # which is bundled
    assert checked == {*ours, *(scripts.ROOT / "runner").rglob("*.d.ts")}


@pytest.mark.parametrize("npx", ["", "exit 1"])
def test_without_a_compiler_it_says_so(npx: str, alone: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if npx:
        tool(alone, "npx", npx)
    assert scripts.main() == 0
    assert capsys.readouterr().out == "JavaScript: not checked: there is no tsc, and no npx that can get it\n"


@pytest.mark.skipif(os.name == "nt", reason="the compiler of this test is a script of a shell")
def test_mistakes_are_told(alone: Path, capfd: pytest.CaptureFixture[str]) -> None:
    tool(alone, "npx", 'case "$*" in *--version) ;; *report/page.js) echo "page.js: wrong"; exit 2 ;; esac')
    assert scripts.main() == 1
    assert capfd.readouterr().out == "page.js: wrong\nJavaScript: mistakes in the page of a report\n"
    tool(alone, "tsc", "")
    assert scripts.main() == 0
    assert capfd.readouterr().out == "JavaScript: types are right\n"


@pytest.mark.slow
def test_types_hold(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """And would not if a part took a name that the data does not have."""
    if (command := scripts.compiler()) is None:
        pytest.skip("there is no tsc, and no npx that can get it")
    assert scripts.main() == 0, capfd.readouterr().out
    for path in scripts.PROGRAMS["the page of a run"]:
        shutil.copy(path, tmp_path)
    chart = tmp_path / "chart.js"
    chart.write_text(
        chart.read_text(encoding="utf-8").replace("run.firing_tag", "run.firing_tags", 1), encoding="utf-8"
    )
    done = subprocess.run(
        [*command, *scripts.OPTIONS.split(), *map(str, tmp_path.iterdir())], check=False, capture_output=True, text=True
    )
    assert "Property 'firing_tags' does not exist on type 'Run'" in done.stdout
