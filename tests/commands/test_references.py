"""A run is named by its model, the folder of its results, or as a run of a study; each command opens each of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import epicycle
from epicycle.runner.interface.cli import main

MODEL = """
model: line
parameters: {period: {value: 0.5 s, unit: s}}
actors:
  clock: {type: Clock, period: "${period}"}
  noise: {type: Random, distribution: {type: Uniform}}
  sink: {type: Recorder}
connections:
  - clock.output -> noise.trigger
  - noise.output -> sink.input
aspects:
  losses: {type: PacketLoss, probability: 0.5, at: sink.input}
run: {stop: 3 s, record: noise.output}
monitors: {low: always noise.output <= 0.001}
metrics: {number: {of: noise.output, take: count}}
"""
STUDY = "study: lines\nmodel: ./line.yaml\nvary: {period: [0.5, 0.25]}\nreplications: 2\nmetrics: [number]\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("line.yaml").write_text(MODEL, encoding="utf-8")


def manifest(folder: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(Path(folder, "manifest.json").read_text(encoding="utf-8"))
    return found


def said(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> str:
    capsys.readouterr()
    assert main([*arguments]) == code
    captured = capsys.readouterr()
    return captured.out + captured.err


@pytest.fixture
def references(capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    """References to runs, and the digest of each."""
    assert main(["run", "line.yaml", "--set", "period=0.25", "--seed", "4", "--until", "2", "--out", "by_command"]) == 0
    epicycle.run("line.yaml", set={"period": "250 ms"}, seed=4, until=2, out="by_program", progress=False)
    model = epicycle.load("line.yaml", set={"period": "250 ms"})
    epicycle.run(model, seed=4, until=2, out="by_model", progress=False)
    Path("lines.yaml").write_text(STUDY, encoding="utf-8")
    assert main(["study", "lines.yaml", "--jobs", "1", "--out", "results/lines"]) == 0
    row = epicycle.open_study("results/lines").table().to_pylist()[3]
    assert main(["run", f"results/lines/{row['run'][:10]}"]) == 0
    capsys.readouterr()
    found = {each: manifest(each)["digest"] for each in ("by_command", "by_program", "by_model")}
    name = f"results/lines/{row['run'][:10]}"
    replayed = f"results/lines/replays/{row['run'][:12]}"
    return {**found, name: row["digest"], replayed: row["digest"]}


def test_every_command_opens_every_run(references: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert references["by_command"] == references["by_program"] == references["by_model"]
    for name, digest in references.items():
        assert said(capsys, "view", name, "-o", "page.html") == "wrote page.html\n"
        assert json.loads(said(capsys, "run", name, "--json"))["digest"] == digest
        traced = said(capsys, "run", name, "--trace", "noise")
        explained = json.loads(
            said(capsys, "explain", name, "--monitor", "always noise.output <= 0.001", "--json", "--no-page")
        )
        seconds = 2 if name.startswith("by") else 3
        assert f"({seconds} s, " in traced
        command = explained["command"]
        assert json.loads(said(capsys, *command[1:], "--json"))["digest"] == digest


def test_a_program_opens_every_run(references: dict[str, str]) -> None:
    for name, digest in references.items():
        assert epicycle.run(name, progress=False).digest == digest
        [recording] = epicycle.view(name, progress=False).recordings
        assert recording.results is not None
        assert recording.results.digest == digest
        found = epicycle.explain(name, "always noise.output <= 0.001", progress=False)
        assert main([*found.command[1:], "--json"]) == 0


def test_a_model_that_a_program_has_changed_has_no_reference(capsys: pytest.CaptureFixture[str]) -> None:
    def stops_sooner(model: epicycle.Model) -> None:
        model.stop = 1.0

    def loses_less(model: epicycle.Model) -> None:
        model.unweave("losses")

    def loses_more(model: epicycle.Model) -> None:
        model.weave("more", epicycle.aspects.PacketLoss(probability=0.1), at="sink.input")

    for number, change in enumerate((stops_sooner, loses_less, loses_more)):
        model = epicycle.load("line.yaml")
        change(model)
        epicycle.run(model, out=f"changed_{number}", progress=False)
        assert said(capsys, "run", f"changed_{number}", code=2) == (
            f"error: changed_{number}/manifest.json does not say how to make the run again: 'epicycle.run line' was "
            "made by another version, or from a model that only a program knows\n"
        )


def test_a_folder_says_how_its_run_is_made(references: dict[str, str]) -> None:
    by_command, by_program, by_model, _, replayed = (manifest_of(name) for name in references)
    assert by_command == {"model": "line.yaml", "set": ["period=0.25"], "seed": 4, "until": "2"}
    assert by_program == {"model": "line.yaml", "set": ['period="250 ms"'], "seed": 4, "until": 2}
    assert by_model == by_program
    assert replayed.keys() == {"study", "run"}


def manifest_of(name: str) -> dict[str, Any]:
    found: dict[str, Any] = manifest(name)["run"] if Path(name).is_dir() else {}
    return found


def test_a_run_that_is_made_again_stands_where_the_command_says(
    references: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    name = next(each for each in references if each.startswith("results/lines/") and not Path(each).exists())
    told = said(capsys, "run", name)
    folder = f"results/lines/replays/{Path(name).name}"
    assert any(line.startswith(f"wrote {folder}") for line in told.splitlines())
    assert said(capsys, "run", "by_command", "--seed", "5", "--out", "other").count("wrote other/") == 2
    assert manifest_of("other") == {"model": "line.yaml", "set": ["period=0.25"], "seed": 5, "until": "2"}


def test_a_changed_model_is_noticed(references: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    Path("line.yaml").write_text(MODEL.replace("{type: Uniform}", "{type: Normal}"), encoding="utf-8")
    told = said(capsys, "run", "by_command", "--out", "again")
    message = "by_command was made by another version of the model or of Epicycle: the run is no longer the same\n"
    assert told.endswith(message)
    study = next(each for each in references if each.startswith("results/lines/") and not Path(each).exists())
    assert said(capsys, "view", study, code=2).startswith(
        "error: the model has changed since results/lines was made: line.yaml\n"
    )


def test_what_is_no_reference(references: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    first = epicycle.open_study("results/lines").table().to_pylist()[0]["run"][:12]
    assert said(capsys, "view", "results/lines", code=2) == (
        f"error: results/lines holds the 4 runs of a study: name one of them, such as results/lines/{first}\n"
    )
    assert said(capsys, "view", "results/lines/xyz", code=2) == (
        "error: results/lines has no run 'xyz'\n"
        "   help: the column 'run' of results/lines/table.parquet lists their names\n"
    )
    assert said(capsys, "run", f"results/lines/{first}", "--set", "period=1", "--seed", "3", code=2) == (
        f"error: results/lines/{first} is a run of a study, and is made as it was: without --set, --seed\n"
    )
