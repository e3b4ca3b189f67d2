"""``epicycle validate``: warnings, ``--strict`` and overrides files."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.runner.cli import main

MODEL = """model: m
actors:
  clock: {type: Clock, period: 1 s}
  seen: {type: Recorder}
  idle: {type: Scale, factor: 2}
  also: {type: Merge, count: 2}
connections:
  - clock.output -> seen.input
  - {from: "also[*].output", to: "also[1, 0].input", delay: 1}
  - {from: "also[0].output", to: idle.input, delay: 1}
"""
WARNING = """m.yaml:6:3: {}: also[0] can never fire: it is no source, and only the loop also[0], also[1] feeds it
    6 |   also: {{type: Merge, count: 2}}
      |   ^^^^
   help: nor can what it feeds: idle
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.yaml").write_text(MODEL)
    return tmp_path


def test_warnings_and_strict(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "m.yaml"]) == 0
    out, err = capsys.readouterr()
    assert (out, err) == ("m.yaml is valid: 5 actors, 4 wires, 0 aspects\n", WARNING.format("warning"))
    assert main(["validate", "m.yaml", "--strict"]) == 2
    assert capsys.readouterr() == ("", WARNING.format("error"))
    assert main(["validate", "collision_avoidance", "--strict"]) == 0


def test_overrides(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "over.yaml").write_text("clock.period: 2 s\n'*.factor': 3\nidle.fcator: 4\n")
    assert main(["validate", "m.yaml", "--overrides", "over.yaml"]) == 2
    assert capsys.readouterr().err == (
        "over.yaml:3:1: error: 'idle.fcator' sets no parameter, did you mean 'idle.factor'?\n"
        "    3 | idle.fcator: 4\n"
        "      | ^^^^^^^^^^^\n"
    )
    (folder / "over.yaml").write_text("clock.period: 2 s\n")
    (folder / "more.yaml").write_text("'*.period': 4 s\n")
    for options, times in {
        (): 9,
        ("--overrides", "over.yaml"): 5,
        ("--overrides", "over.yaml", "--overrides", "more.yaml"): 3,
        ("--set", "clock.period=8", "--overrides", "more.yaml"): 2,
    }.items():
        assert main(["run", "m.yaml", "--until", "8", "--log", "log.csv", "--out", "out", *options]) == 0
        lines = (folder / "log.csv").read_text().splitlines()
        assert sum("send" in line and "clock" in line for line in lines) == times
