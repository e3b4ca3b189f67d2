"""The command line loses nothing silently: logs that are streamed, runs without an end, folders of other commands."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from epicycle.actors import Tag
from epicycle.runner.execution.engine import LogError, Record
from epicycle.runner.execution.results import log_file as log_file_module
from epicycle.runner.execution.results.log_file import LogFile
from epicycle.runner.interface.cli import main

ENDLESS = """
model: tick
actors: {clock: {type: Clock, period: 1 ms}, scale: {type: Scale, factor: 2}}
connections: [clock.output -> scale.input]
run: {record: [clock.output]}
"""
NO_END = "tick never ends: clock ticks for ever, and the model sets neither stop nor stop_when"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "tick.yaml").write_text(ENDLESS)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def count(path: Path) -> int:
    """The number of records in a log, each of which must be readable."""
    if path.suffix == ".parquet":
        return int(pq.read_table(path).num_rows)
    with path.open(encoding="utf-8", newline="") as file:
        rows = [json.loads(line) for line in file] if path.suffix == ".jsonl" else list(csv.reader(file))[1:]
    assert all(len(row) == 8 for row in rows)
    return len(rows)


# -- a model without an end -------------------------------------------------------------------------------------------


def test_validate_warns_of_a_model_without_an_end(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hint = "\n   help: write 'run: {stop: 60 s}', or run it with --until\n"
    assert main(["validate", "tick.yaml"]) == 0
    assert capsys.readouterr() == (
        "tick.yaml is valid: 2 actors, 1 connection, 0 aspects\n", f"warning: {NO_END}{hint}"
    )  # fmt: skip
    assert main(["validate", "tick.yaml", "--strict"]) == 2
    assert capsys.readouterr().err == f"error: {NO_END}{hint}"


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("run: {", "run: {stop: 1 s, "),
        lambda text: text.replace("run: {", "run: {stop_when: scale.output, "),
        lambda text: text.replace("period: 1 ms", "period: 1 ms, stop_time: 1 s"),
        lambda text: text.replace("actors: {", "actors: {end: {type: Stop}, ").replace(
            "connections: [", "connections: [scale.output -> end.input, "
        ),
    ],
)
def test_a_model_that_may_end_is_not_warned_of(
    change: object, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(change)
    (folder / "tick.yaml").write_text(change(ENDLESS))
    assert main(["validate", "tick.yaml"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["jsonl", "csv", "parquet"])
def test_an_interrupt_ends_a_run_without_an_end(ending: str, folder: Path) -> None:
    """What was recorded and logged before is complete."""
    process = subprocess.Popen(
        [sys.executable, "-m", "epicycle.runner.interface.cli",
         "run", "tick.yaml", "--out", "out", "--log", f"log.{ending}"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    log, start = folder / f"log.{ending}", time.monotonic()
    while not (log.exists() and log.stat().st_size > 10_000) and time.monotonic() - start < 60:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert said == (
        f"{NO_END}\n   help: end it with Ctrl-C, which keeps what was recorded, or run it with --until\n"
        "what was recorded before is in out\ninterrupted\n"
    )
    manifest = json.loads((folder / "out" / "manifest.json").read_text())
    assert (manifest["stopped"], manifest["error"]) == ("interrupted", "interrupted")
    assert count(log) in (manifest["events"], manifest["events"] - 1)  # just between counting and writing
    recorded = pq.read_table(folder / "out" / "signals.parquet").num_rows
    assert abs(2 * recorded - manifest["events"]) <= 2


def test_a_study_of_a_model_without_an_end_is_warned_of(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    (folder / "s.yaml").write_text("study: s\nmodel: ./tick.yaml\nmetrics: {number: events}\n")
    assert main(["validate", "s.yaml"]) == 0
    assert [record.getMessage() for record in caplog.records] == [
        f"warning: {NO_END}\n   help: set 'stop' in its section 'run'; --run-timeout ends runs that take too long"
    ]


def test_nothing_is_said_where_until_is_given(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "tick.yaml", "--until", "0.01", "--json"]) == 0
    assert capsys.readouterr().err == ""


# -- the log ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["jsonl", "csv", "parquet"])
def test_a_log_takes_no_more_memory_the_longer_it_gets(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log_file_module, "_ROWS", 500)
    path = tmp_path / f"log.{ending}"
    with LogFile(path) as file:
        peaks = []
        tracemalloc.start()
        for some in range(5):
            tracemalloc.reset_peak()
            for index in range(2_000):
                file.add(Record(Tag(index, 1), "send", "a", "output", None, "", [some, float(index)]))
            peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[-1] < 1.2 * peaks[1], peaks
    assert count(path) == 10_000


def test_a_full_disk_costs_the_log_and_not_the_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no full device here")
    (folder / "log.csv").symlink_to("/dev/full")
    with pytest.raises(LogError) as caught, LogFile(Path("log.csv")):
        pass
    assert str(caught.value) == "log.csv cannot be written: No space left on device"
    (folder / "log.jsonl").symlink_to("/dev/full")
    assert main(["run", "tick.yaml", "--until", "1", "--log", "log.jsonl"]) == 2
    assert capsys.readouterr().err == "error: log.jsonl cannot be written: No space left on device\n"
    assert json.loads((folder / "results" / "tick" / "manifest.json").read_text())["stopped"] == "stop time"


def test_a_failed_run_leaves_its_log(
    folder: Path, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    (folder / "tick.yaml").write_text(
        ENDLESS.replace("aspects", "")
        + 'aspects: {no: {type: Assert, at: scale.input, that: "token < 5", on_violation: fail}}\n'
    )
    assert main(["run", "tick.yaml", "--log", "log.csv", "--json"]) == 1
    said = capsys.readouterr().err
    assert count(folder / "log.csv") == 12
    if Path("/dev/full").exists():
        (folder / "log.jsonl").symlink_to("/dev/full")
        assert main(["run", "tick.yaml", "--log", "log.jsonl", "--json"]) == 1
        assert [record.getMessage() for record in caplog.records] == [
            "error: log.jsonl cannot be written: No space left on device"
        ]
        assert capsys.readouterr().err == said


# -- the results folder -----------------------------------------------------------------------------------------------


def test_results_of_another_command_are_not_replaced_silently(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*arguments: str) -> tuple[int, str]:
        code = main(["run", *arguments])
        return code, capsys.readouterr().err

    first = ("tick.yaml", "--until", "0.01", "--out", "my out")
    assert run(*first) == (0, "")
    assert run(*first) == (0, "")  # its own
    assert run(*first, "--seed", "2") == (
        0, "replacing the results of 'epicycle run tick.yaml --until 0.01 --out 'my out'' in my out\n"
    )  # fmt: skip
    before = (folder / "my out" / "manifest.json").read_bytes()
    choose = "\n   help: choose another folder with --out, or delete this one\n"
    assert run("mm1", "--out", "my out") == (
        2,
        (
            "error: my out holds results of the model 'tick', not 'mm1': epicycle run tick.yaml --until 0.01 "
            f"--out 'my out' --seed 2{choose}"
        ),
    )
    assert (folder / "my out" / "manifest.json").read_bytes() == before
    for text in ("{}", "[", "[1]", '{"study": "x", "model": {}}', '{"command": [1], "model": "tick"}'):
        (folder / "my out" / "manifest.json").write_text(text)
        assert run(*first) == (2, f"error: my out holds results that are not from a run{choose}")
    os.mkfifo(folder / "results.fifo")
    (folder / "my out" / "manifest.json").unlink()
    (folder / "results.fifo").rename(folder / "my out" / "manifest.json")
    assert run(*first) == (2, f"error: my out holds results that are not from a run{choose}")
