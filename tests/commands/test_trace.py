"""`epicycle run --trace`, runs paced by the wall clock, and runs that are interrupted."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest

from epicycle.runner.execution.engine import Pace
from epicycle.runner.interface.cli import main

MODEL = """
model: line
composites:
  Room:
    inputs: [in]
    outputs: [out]
    director: {start: 10 s}
    actors: {merge: {type: Merge}}
    connections: [in -> merge.input, merge.output -> out]
actors:
  clock: {type: Clock, period: 0.5 s}
  room: {type: Room}
  sink: {type: Recorder}
connections:
  - {from: clock.output, to: room.in, delay: 100 ms}
  - room.out -> sink.input
aspects:
  wait: {type: Latency, delay: 0.25, at: sink.input}
run: {stop: 1.2}
"""


@pytest.fixture
def model(tmp_path: Path) -> str:
    path = tmp_path / "line.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return str(path)


def test_trace_in_columns(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", model, "--trace", "--to", "0.6 s"]) == 0
    assert (
        capsys.readouterr().out
        == """\
(0 s, 1)           clock      <- wake-up                       requested in initialize
                              -> output                        0
(0.1 s, 1)         room.merge <- input[0]   clock.output       0  sent at (0 s, 1)
                              -> output                        0
(0.35 s, 1)        sink       <- input[0]   room.merge.output  0  sent at (0.1 s, 1)
(0.5 s, 1)         clock      <- wake-up                       requested at (0 s, 1)
                              -> output                        1
(0.6 s, 1)         room.merge <- input[0]   clock.output       1  sent at (0.5 s, 1)
                              -> output                        1
"""
    )


def test_trace_as_json(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A composite selects everything in it; the end is the model's."""
    arguments = ["--trace", "room", "--trace", "sink", "--from", "600 ms", "--to", "9", "--json"]
    assert main(["run", model, *arguments]) == 0

    def token(source: str, sent: float, value: int) -> dict[str, Any]:
        at = {"time": sent, "microstep": 1}
        return {"port": "input", "channel": 0, "token": value, "from": source, "sent": at}

    def line(time: float, actor: str, cause: dict[str, Any], *sends: dict[str, Any]) -> dict[str, Any]:
        head = {"time": time, "microstep": 1, "actor": actor, "outside": None, "wakes": []}
        return {**head, "tokens": [cause], "sends": list(sends)}

    def send(value: int) -> dict[str, Any]:
        return {"event": "send", "port": "output", "channel": None, "aspect": None, "token": value}

    assert [json.loads(text) for text in capsys.readouterr().out.splitlines()] == [
        line(0.6, "room.merge", token("clock.output", 0.5, 1), send(1)),
        line(0.85, "sink", token("room.merge.output", 0.6, 1)),
        line(1.1, "room.merge", token("clock.output", 1.0, 2), send(2)),
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--trace", "rom"], "error: --trace rom matches no actor, did you mean 'room'?\n"),
        (["--trace", "a..b"], "error: --trace a..b: '' is not a name, a name with an index, '*' or '**'\n"),
        (["--trace", "--from", "1 m"], "error: '1 m' is a length, expected a time in s\n"),
        (["--trace", "--to", "-1"], "error: --to -1: expected a time from 0 s to 1e9 s\n"),
        (["--to", "1"], "error: --to is for --trace\n"),
        (["--trace", "--out", "o"], "error: --trace prints a run and writes nothing: without --out\n"),
    ],
)
def test_wrong_options(arguments: list[str], message: str, model: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", model, *arguments]) == 2
    assert capsys.readouterr().err == message


def test_a_run_in_real_time(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It takes its time, and sends the same as otherwise."""
    digests = []
    for arguments in ([], ["--realtime", "4"]):
        began = time.perf_counter()
        assert main(["run", model, "--json", *arguments]) == 0
        digests.append(json.loads(capsys.readouterr().out)["digest"])
    assert time.perf_counter() - began >= 1.2 / 4
    assert digests[0] == digests[1]


def test_a_run_that_cannot_keep_up_says_so(
    model: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def wait_for(pace: Pace, now: float) -> None:
        pace.worst, pace.behind = 2.5, now / 1e10

    monkeypatch.setattr(Pace, "wait_for", wait_for)
    assert main(["run", model, "--json", "--realtime"]) == 0
    expected = "the run could not keep up with the wall clock: 2.5 s late at worst, 0.12 s at the end\n"
    assert capsys.readouterr().err == expected


def test_an_interrupted_run_keeps_what_it_recorded(
    model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def wait_for(pace: Pace, now: float) -> None:
        if now > 5e8:  # somebody presses Ctrl-C
            raise KeyboardInterrupt

    monkeypatch.setattr(Pace, "wait_for", wait_for)
    folder, log = tmp_path / "out", tmp_path / "log.jsonl"
    assert main(["run", model, "--realtime", "--out", str(folder), "--log", str(log)]) == 130
    assert capsys.readouterr().err == f"what was recorded before is in {folder}\ninterrupted\n"
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert (manifest["stopped"], manifest["error"], manifest["end"]) == ("interrupted", "interrupted", 0.5)
    assert len(log.read_text(encoding="utf-8").splitlines()) == manifest["events"] > 0


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "model.yaml"])
def test_a_wrong_pace(text: str, model: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["run", model, f"--realtime={text}"])
    assert caught.value.code == 2
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"epicycle run: error: argument --realtime: {text!r} is not a number of at least 1e-09 "
        "(write MODEL before --realtime)"
    )
