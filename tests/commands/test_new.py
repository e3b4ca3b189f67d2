"""`epicycle new`: what it writes runs at once, and its tests pass."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_model_runs_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "shop"]) == 0
    assert capsys.readouterr().out == "wrote shop.yaml\nrun it: epicycle run shop.yaml\n"
    assert main(["validate", "shop.yaml", "--strict"]) == 0
    assert main(["run", "shop.yaml"]) == 0
    printed = capsys.readouterr()
    assert "wrote results/shop/queue.png" in printed.out
    assert printed.err == ""


@pytest.mark.slow
def test_a_package_runs_at_once_and_its_tests_pass() -> None:
    assert main(["new", "acme", "--package"]) == 0
    types = ["--types", "acme/src/acme/__init__.py"]
    assert main(["run", "acme/acme.yaml", *types, "--out", "out"]) == 0
    assert Path("out/smoothed.png").is_file()
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "acme"], capture_output=True, text=True, check=False)
    assert "3 passed" in done.stdout, done.stdout
    tools = [["ruff", "check", "--isolated", "--line-length", "120", "--select", "E,F,I,B,UP", "acme"]]
    tools += [["ruff", "format", "--isolated", "--line-length", "120", "--check", "acme"]]
    for words in tools:
        subprocess.run([sys.executable, "-m", *words], check=True, capture_output=True)


@pytest.mark.slow
def test_models_know_a_package_once_it_is_installed(tmp_path: Path) -> None:
    assert main(["new", "acme", "--package"]) == 0
    install = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-index", "--no-build-isolation"]
    subprocess.run([*install, "--target", tmp_path / "site", "./acme"], check=True)
    command = [sys.executable, "-c", "from epicycle.runner.interface.cli import main; raise SystemExit(main())"]
    there = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    done = subprocess.run([*command, "run", "acme/acme.yaml", "--json"], env=there, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["my-model"],
            "error: 'my-model' is not a name\n   help: use letters, digits and _, and no digit first\n",
        ),
        (["class"], "error: 'class' is not a name\n   help: use letters, digits and _, and no digit first\n"),
        (["../up"], "error: '../up' is not a name\n   help: use letters, digits and _, and no digit first\n"),
        (["here"], "error: here.yaml already exists\n   help: choose another name or another folder\n"),
        (["folder", "--package"], "error: folder already exists\n   help: choose another name or another folder\n"),
    ],
)
def test_nothing_is_written_where_it_cannot_be(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("here.yaml").write_text("mine")
    Path("folder").mkdir()
    assert main(["new", *arguments]) == 2
    assert capsys.readouterr().err == message
    assert {str(path) for path in Path().rglob("*")} == {"here.yaml", "folder"}
    assert Path("here.yaml").read_text() == "mine"
