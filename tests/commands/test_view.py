"""`epicycle view` of a model, of results, of two; and its errors."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from epicycle.runner import Results, Simulation
from epicycle.runner.interface.cli import main

MODEL = """
model: line
actors:
  clock: {type: Clock, period: 0.5 s}
  sink: {type: Recorder}
connections: [clock.output -> sink.input]
run: {stop: 3 s, record: clock.output}
"""

FAILING = """
model: failing
actors:
  clock: {type: Clock, period: 0.5 s}
  inverse: {type: Expression, expression: "1 / (2 - x)"}
connections: [clock.output -> inverse.x]
run: {stop: 3 s}
"""


@pytest.fixture(autouse=True)
def line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("line.yaml").write_text(MODEL, encoding="utf-8")
    return "line.yaml"


def said(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> str:
    assert main(["view", *arguments]) == code
    captured = capsys.readouterr()
    return captured.out + captured.err


def test_a_page_of_a_model(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, line, "-o", "page.html") == "wrote page.html\n"
    text = Path("page.html").read_text(encoding="utf-8")
    assert text.startswith('<!DOCTYPE html>\n<html lang="en">')
    assert "http:" not in text.replace("http-equiv", "")
    assert "https:" not in text


def test_without_a_file_the_page_stands_beside_the_results_and_is_opened(
    line: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert said(capsys, line) == "wrote results/line/view.html\n"
    assert opened == [Path("results/line/view.html").resolve().as_uri()]


def test_results_are_made_again_as_their_manifest_says(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", line, "--set", "clock.period=0.25", "--until", "2", "--out", "made"]) == 0
    capsys.readouterr()
    assert said(capsys, "made", "-o", "page.html") == "wrote page.html\n"
    # Other settings make another run, without a warning; another model is noticed.
    assert said(capsys, "made", "--set", "clock.period=1", "-o", "page.html") == "wrote page.html\n"
    Path(line).write_text(MODEL.replace("Clock, period", "Clock, offset: 0.1, period"), encoding="utf-8")
    assert said(capsys, "made", "-o", "page.html") == (
        "wrote page.html\nmade was made by another version of the model or of Epicycle: the run is no longer the same\n"
    )


def test_two_runs_in_one_page(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", line, "--set", "clock.period=0.25", "--out", "made"]) == 0
    capsys.readouterr()
    assert said(capsys, line, "made", "-o", "page.html") == "wrote page.html\n"
    message = "error: a page shows one run or two, not 3: line.yaml, made, line.yaml\n"
    assert said(capsys, line, "made", line, "-o", "page.html", code=2) == message


def test_a_run_that_fails_is_shown_up_to_there(capsys: pytest.CaptureFixture[str]) -> None:
    Path("failing.yaml").write_text(FAILING, encoding="utf-8")
    told = said(capsys, "failing.yaml", "-o", "page.html", code=1)
    assert told.startswith("wrote page.html\nerror: inverse failed in fire() at (1 s, 1)")
    assert Path("page.html").stat().st_size > 30_000


def test_what_is_no_result_of_a_run(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("empty").mkdir()
    message = "error: empty holds no results of a run: it has no manifest.json\n"
    assert said(capsys, "empty", code=2) == message
    (Path("empty") / "manifest.json").write_text("{", encoding="utf-8")
    broken = said(capsys, "empty", code=2)
    assert broken.startswith("error: empty/manifest.json is not the manifest of a run: Expecting property name")
    manifest = Path("empty") / "manifest.json"
    manifest.write_text(json.dumps({"command": ["epicycle.run", "mine"], "digest": ""}), encoding="utf-8")
    assert said(capsys, "empty", code=2) == (
        "error: empty/manifest.json does not say how to make the run again: 'epicycle.run mine' was made by another "
        "version, or from a model that only a program knows\n"
    )
    told = {"run": {"model": line, "types": ["own.py"]}, "digest": ""}
    manifest.write_text(json.dumps(told), encoding="utf-8")
    assert said(capsys, "empty", code=2) == (
        "error: the run in empty used types of its own\n   help: to let their code run, add --types own.py\n"
    )


@pytest.mark.parametrize(
    ("run", "message"),
    [
        ({"model": "line.yaml", "unheard": 1}, "'run' cannot have 'unheard': 1"),
        ({"model": "line.yaml", "seed": "3"}, "'run' cannot have 'seed': \"3\""),
        ({"model": "line.yaml", "set": [1]}, "'run' cannot have 'set': [1]"),
        ({"model": "line.yaml", "max_actors": True}, "'run' cannot have 'max_actors': true"),
        ({"model": ["line.yaml"]}, "'run' cannot have 'model': [\"line.yaml\"]"),
        ({"study": "there"}, "'run' names neither a model nor a run of a study"),
        ([], "'run' names neither a model nor a run of a study"),
    ],
)
def test_a_manifest_that_somebody_has_edited(run: object, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("made").mkdir()
    Path("made/manifest.json").write_text(json.dumps({"run": run, "digest": ""}), encoding="utf-8")
    assert said(capsys, "made", code=2) == f"error: made/manifest.json is not the manifest of a run: {message}\n"


def test_a_page_that_cannot_be_written(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    message = "error: --out none/page.html cannot be written: there is no folder none\n"
    assert said(capsys, line, "-o", "none/page.html", code=2) == message
    Path("taken").mkdir()
    assert said(capsys, line, "-o", "taken", code=2) == "error: --out taken cannot be written: it is a folder\n"


def test_files_for_other_viewers_are_written_instead_of_a_page_or_beside_it(
    line: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("webbrowser.open", lambda uri: pytest.fail(f"opened {uri}"))
    assert said(capsys, line, "--mcap", "line.mcap") == "wrote line.mcap\n"
    assert Path("line.mcap").read_bytes()[:5] == b"\x89MCAP"
    assert not Path("results").exists()
    assert said(capsys, line, "--mcap", "line.mcap", "-o", "page.html") == "wrote line.mcap\nwrote page.html\n"
    assert sorted(each.name for each in Path().iterdir()) == ["line.mcap", "line.yaml", "page.html"]


def test_a_recording_of_rerun(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("rerun")
    assert said(capsys, line, "--rerun", "line.rrd") == "wrote line.rrd\n"
    assert Path("line.rrd").read_bytes()[:3] == b"RRF"


def test_a_run_that_fails_is_written_up_to_there(capsys: pytest.CaptureFixture[str]) -> None:
    Path("failing.yaml").write_text(FAILING, encoding="utf-8")
    told = said(capsys, "failing.yaml", "--mcap", "run.mcap", code=1)
    assert told.startswith("wrote run.mcap\nerror: inverse failed in fire() at (1 s, 1)")


def test_other_viewers_are_shown_one_run(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    for flag in ("--mcap", "--rerun"):
        message = f"error: {flag} writes one run, not two: line.yaml, line.yaml\n"
        assert said(capsys, line, line, flag, "run", code=2) == message


@pytest.mark.parametrize(
    ("flag", "module", "message"),
    [
        (
            "--mcap",
            "foxglove",
            "an MCAP file needs the package foxglove-sdk, which is not installed: pip install 'epicycle[mcap]'",
        ),
        (
            "--rerun",
            "rerun",
            "a recording for rerun needs the package rerun-sdk, which is not installed: pip install 'epicycle[rerun]'",
        ),
    ],
)
def test_what_is_missing_for_other_viewers_is_said_before_the_run(
    flag: str,
    module: str,
    message: str,
    line: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.delitem(sys.modules, f"epicycle.runner.show.view.{flag[2:]}_file", raising=False)
    monkeypatch.setattr(
        "epicycle.runner.show.view.recording.Recording.run", lambda *_, **__: pytest.fail("the model was run")
    )
    assert said(capsys, line, flag, "run", code=2) == f"error: {message}\n"


def test_files_for_other_viewers_that_cannot_be_written(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    message = "error: --mcap none/run.mcap cannot be written: there is no folder none\n"
    assert said(capsys, line, "--mcap", "none/run.mcap", code=2) == message
    message = "error: --rerun none/run.rrd cannot be written: there is no folder none\n"
    assert said(capsys, line, "--rerun", "none/run.rrd", code=2) == message
    Path("taken").mkdir()
    assert said(capsys, line, "--mcap", "taken", code=2) == "error: --mcap taken cannot be written: it is a folder\n"
    name = "x" * 255
    message = f"error: {name} cannot be written: File name too long\n"
    assert said(capsys, line, "--mcap", name, code=2) == message


def test_a_run_that_is_interrupted_is_shown_up_to_there(
    line: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(simulation: Simulation, **given: Any) -> Results:
        simulation.advance(1.0)
        raise KeyboardInterrupt

    monkeypatch.setattr(Simulation, "run", interrupted)
    assert said(capsys, line, line, "-o", "page.html", code=130) == "wrote page.html\ninterrupted\n"
    assert Path("page.html").stat().st_size > 30_000
