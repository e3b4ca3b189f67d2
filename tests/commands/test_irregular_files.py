"""Pipes, devices and names that no file can have, wherever the command line or a file names a file: refused at once."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

import pytest

from epicycle.runner.interface.cli import main

MODEL = "model: m\nactors: {clock: {type: Clock, period: 1}}\nrun: {stop: 3}\n"
STUDY = "study: s\nmodel: ./m.yaml\nmetrics: {number: events}\n"
LONG = "x" * 300
KINDS = ["is a named pipe, not a regular file", "is a device, not a regular file"]

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A folder with a model; code that waits in it is interrupted."""
    monkeypatch.chdir(tmp_path)
    Path("m.yaml").write_text(MODEL)

    def give_up(_number: int, _frame: FrameType | None) -> None:
        raise AssertionError("somebody waits")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    """What is wrong with ``x.yaml`` and ``x.py``."""
    for name in ("x.yaml", "x.py"):
        if request.param == KINDS[0]:
            os.mkfifo(name)
        else:  # not everybody may create a device
            Path(name).symlink_to("/dev/zero")
    return str(request.param)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        *((f"{command} x.yaml", "x.yaml {}") for command in ("run", "validate", "graph", "describe", "study")),
        ("run x.yaml --trace", "x.yaml {}"),
        ("describe x.yaml --aspects", "x.yaml {}"),
        ("run m.yaml --overrides x.yaml", "x.yaml {}"),
        ("run m.yaml --disturb ./x.yaml", "x.yaml {}"),
        ("run m.yaml --types x.py", "--types x.py: this {}"),
        ("list actors --types x.py", "--types x.py: this {}"),
    ],
)
def test_on_the_command_line(words: str, message: str, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 2
    assert capsys.readouterr().err == f"error: {message.format(kind)}\n"
    assert not Path("results").exists()


def test_an_included_part(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("m.yaml").write_text(f"include: [x.yaml]\n{MODEL}")
    assert main(["run", "m.yaml"]) == 2
    if "device" in kind:  # the link leads out of the model's folder, and is not followed
        assert capsys.readouterr().err == (
            "m.yaml:1:11: error: 'x.yaml' cannot be included\n    1 | include: [x.yaml]\n      |           ^^^^^^\n"
            "   help: included files are .yaml files in or below the model's folder\n"
        )
        return
    assert capsys.readouterr().err == (
        f"m.yaml:1:11: error: the included file 'x.yaml' {kind}\n    1 | include: [x.yaml]\n      |           ^^^^^^\n"
    )


IN_STUDIES = [
    ("model: {}", 8, "the model"),
    ("disturb: [{}]", 11, "the disturbance"),
    ("claims: {}", 9, "claims: the study"),
]


def study_with(line: str) -> str:
    """A study with this line, the second one."""
    rest = [each for each in STUDY.splitlines() if not each.startswith(line.partition(":")[0])]
    return "\n".join([rest[0], line, *rest[1:], ""])


@pytest.mark.parametrize(("line", "column", "what"), IN_STUDIES)
def test_in_a_study(line: str, column: int, what: str, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = line.format("./x.yaml")
    Path("s.yaml").write_text(study_with(line))
    assert main(["study", "s.yaml"]) == 2
    assert capsys.readouterr().err == (
        f"s.yaml:2:{column}: error: {what} './x.yaml' {kind}\n    2 | {line}\n      | {' ' * (column - 1)}{'^' * 8}\n"
    )


@pytest.mark.parametrize(("line", "column", "what"), IN_STUDIES)
def test_names_that_are_too_long(line: str, column: int, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("s.yaml").write_text(study_with(line.format(f"./{LONG}.yaml")))
    assert main(["study", "s.yaml"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert said[0] == f"s.yaml:2:{column}: error: {what} './{LONG}.yaml' cannot be read: File name too long"
    assert len(said) == 3


def test_own_types_in_a_file_whose_name_is_too_long(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "actors", "--types", f"{LONG}.py"]) == 2
    assert capsys.readouterr().err == f"error: --types {LONG}.py: this cannot be read: File name too long\n"
