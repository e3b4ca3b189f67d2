"""Where results are kept by default: in the folder of the model's name, or the study's, whatever the file is called."""

from __future__ import annotations

from pathlib import Path

import pytest

import epicycle
from epicycle.runner.interface.cli import main
from epicycle.runner.search.spec import results_folder

MODEL = """
model: inner
parameters: {factor: {value: 2.0, above: 0}}
actors:
  clock: {type: Clock, period: 1 s, values: [0, 1, 2, 3]}
  gain: {type: Scale, factor: "${factor}"}
connections: [clock.output -> gain.input]
run: {stop: 3 s, record: [gain.output]}
metrics: {highest: {of: gain.output, take: max}}
monitors: {low: always gain.output < 2}
"""
STUDY = """
study: many
model: ./outer.yaml
vary: {clock.period: [1 s, 2 s]}
metrics: [highest]
"""
SEARCHES = {
    "falsification": ("search", "--break", "always gain.output < 4.5", "--vary", "factor=1.0..2.0", "--runs", "5"),
    "optimisation": ("search", "--minimise", "highest", "--vary", "factor=1.0..2.0", "--points", "3"),
    "calibration": ("search", "--match", "gain.output=measured.csv", "--vary", "factor=1.0..2.0"),
    "comparison": ("compare", "--vary", "factor=1.0", "--replications", "1"),
    "": ("run",),
}


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("outer.yaml").write_text(MODEL, encoding="utf-8")
    Path("searched.yaml").write_text(STUDY, encoding="utf-8")
    Path("measured.csv").write_text("time,value\n0,0\n1,1.5\n2,3\n3,4.5\n", encoding="utf-8")


@pytest.mark.parametrize("kind", SEARCHES)
def test_by_the_name_of_the_model(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    verb, *options = SEARCHES[kind]
    jobs = () if verb == "run" else ("--jobs", "1")
    assert main([verb, "outer.yaml", *options, *jobs]) in (0, 3), capsys.readouterr()
    [folder] = Path("results").iterdir()
    assert folder.name == "inner"
    assert (folder / kind).is_dir()
    assert f"wrote {folder / kind}/" in capsys.readouterr().out
    assert list(folder.iterdir()) == [folder / kind] or not kind


def test_by_the_name_of_the_study() -> None:
    goal = epicycle.Minimise("highest", points=2)
    found = epicycle.search("searched.yaml", goal, vary={"factor": "1.0..2.0"}, jobs=1)
    assert found.folder == results_folder("many", "optimisation")
    assert [path.name for path in Path("results").iterdir()] == ["many"]


def test_long_names_are_cut_with_a_mark() -> None:
    folders = {results_folder("n" * 300 + end, "rare") for end in "ab"}
    assert len(folders) == 2
    assert {len(folder.parent.name) for folder in folders} == {60}
