"""Sessions of a study: what is made, what was there, and what cannot be gone on with."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from epicycle.runner import open_study
from epicycle.runner.interface.cli import main
from epicycle.runner.study import session as session_module
from epicycle.runner.study.plan import plan as plan_module
from epicycle.runner.study.run.backlog import Backlog
from epicycle.runner.study.run.manifest import manifest_text
from epicycle.runner.study.session import run_study
from tests.study.study_commands import message, study
from tests.study.study_parts import MODEL, STUDY, moved, plan_of, write


@pytest.mark.slow
def test_extension_makes_only_what_is_new(done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(done, tmp_path, dirs_exist_ok=True)
    before = open_study(tmp_path / "out").table().to_pylist()

    def said(*arguments: object) -> str:
        assert study(tmp_path, *arguments) == 0
        return capsys.readouterr().out.splitlines()[0]

    assert said() == "walks: 2 conditions, 0 new runs, 10 already there"
    assert said("--replications", 7) == "walks: 2 conditions, 4 new runs, 10 already there"
    (tmp_path / "walks.yaml").write_text(STUDY.replace("[0 m/s,", "[-1 m/s, 0 m/s,"))
    assert said() == "walks: 3 conditions, 5 new runs, 10 already there"
    after = open_study(tmp_path / "out").table().to_pylist()
    assert [
        row | {"condition": row["condition"] - 1} for row in after[5:] if row["replication"] < 5
    ] == before  # fmt: skip
    # Anything that a run hangs on makes it another one.
    assert said("--set", "fails=[9]") == "walks: 3 conditions, 15 new runs, 0 already there"
    (tmp_path / "walk.yaml").write_text(MODEL + "# as it was, but who knows\n")
    assert said("--replications", 1) == "walks: 3 conditions, 3 new runs, 0 already there"


def test_identity_hangs_on_content_and_not_on_place(
    done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(done, tmp_path / "moved")
    monkeypatch.chdir(tmp_path)
    here, there = plan_of(Path("moved/walks.yaml")), plan_of(done / "walks.yaml")
    keys = [[plan.key(plan.condition(c), r) for c in range(2) for r in range(5)] for plan in (here, there)]
    assert keys[0] == keys[1]
    assert set(keys[0]) == {row["run"] for row in open_study(done / "out").table().to_pylist()}


@pytest.mark.slow
def test_another_first_seed_is_that_of_a_study_that_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path)
    assert study(tmp_path, "--replications", 2, "--seed", 120, out="asked") == 0
    with pytest.raises(SystemExit):
        study(tmp_path, "--seed", 2**63)
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"epicycle study: error: argument --seed: '{2**63}' is not a whole number from 0 to {2**63 - 1 - 10**9}"
    )
    # The folder knows it, whatever the file says.
    assert main(["study", str(tmp_path / "asked")]) == 0
    assert "0 new runs, 4 already there" in capsys.readouterr().out
    write(tmp_path, STUDY.replace("seed: 20", "seed: 120"))
    assert study(tmp_path, "--replications", 2, out="said") == 0
    tables = [(tmp_path / out / "table.parquet").read_bytes() for out in ("asked", "said")]
    assert tables[0] == tables[1]
    assert set(pq.read_table(tmp_path / "asked" / "table.parquet")["seed"].to_pylist()) == {120, 121}


def test_resume_wants_the_same_model(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (copied / "walk.yaml").write_text(MODEL + "\n")
    manifest = json.loads((copied / "out" / "manifest.json").read_text())
    (copied / "out" / "manifest.json").write_text(manifest_text(moved(manifest, copied / "walks.yaml")))
    assert main(["study", str(copied / "out")]) == 2
    assert message(capsys, copied) == (
        "error: the model has changed since out was made: walk.yaml\n"
        "   help: 'epicycle study walks.yaml --out out' makes the runs of the changed model\n"
    )


def test_results_can_be_read_where_their_model_is_not(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = open_study(copied / "out").means("place")
    home = copied / "elsewhere"
    home.mkdir()
    (copied / "out").rename(home / "out")
    manifest = json.loads((home / "out" / "manifest.json").read_text())
    (home / "out" / "manifest.json").write_text(manifest_text(moved(manifest, Path("/nowhere/walks.yaml"))))
    assert open_study(home / "out").means("place") == before
    assert main(["status", str(home / "out")]) == 0
    capsys.readouterr()
    assert main(["study", str(home / "out")]) == 2
    assert capsys.readouterr().err == "error: there is no file /nowhere/walk.yaml: there is no folder /nowhere\n"


def test_results_of_another_version_are_read_and_not_gone_on_with(
    copied: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = open_study(copied / "out").table()
    manifest = json.loads((copied / "out" / "manifest.json").read_text())
    (copied / "out" / "manifest.json").write_text(manifest_text(moved(manifest, copied / "walks.yaml")))
    for module in (plan_module, session_module):
        monkeypatch.setattr(module, "epicycle_version", lambda: "47.11")
    assert open_study(copied / "out").table() == before
    assert main(["study", str(copied / "out")]) == 2
    assert message(capsys, copied) == (
        f"error: out was made with Epicycle {manifest['epicycle']}, but this is Epicycle 47.11\n"
        "   help: install that version, or repeat all runs: 'epicycle study walks.yaml --out ANOTHER'\n"
    )
    assert study(copied) == 0
    assert capsys.readouterr().out.startswith("walks: 2 conditions, 10 new runs, 0 already there\n")


def test_a_thousand_million_runs_are_asked_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = STUDY.replace("[0 m/s, 100 cm/s]", "{from: 0, to: 1, step: 0.00002}").replace("ns: 5", "ns: 20000")
    write(tmp_path, text)
    assert study(tmp_path, "--jobs", 2) == 2
    said = capsys.readouterr().err
    assert said.startswith(
        "error: walks has 50,001 conditions of 20,000 replications: 1,000,020,000 runs, which take about "
    )
    assert said.endswith(" with 2 at a time\n   help: add --yes if that is what you want\n")
    assert not (tmp_path / "out").exists()
    plan = plan_of(tmp_path / "walks.yaml")
    last = plan.condition(50_000)
    assert last.values == {"drift": 1.0}
    assert plan.find(last.key, {"drift": 1.0}) == 50_000
    assert [plan.find(last.key, {"drift": each}) for each in (0.5, 0.25e-5, 2.0)] == [None] * 3
    # A backlog takes no memory for what is still to come.
    backlog = Backlog(plan, {})
    tasks = [backlog.next() for _ in range(5)]
    assert [(task.condition, task.replication) for task in tasks if task] == [(0, each) for each in range(5)]


def test_a_study_may_ask_for_properties_of_its_own(tmp_path: Path) -> None:
    text = STUDY.replace(
        "metrics:\n", "monitors: {low: always walk.output < 5}\nmetrics:\n  low: low\n  margin: low_robustness\n"
    )
    run_study(plan_of(write(tmp_path, text)), tmp_path / "out", jobs=1)
    table = open_study(tmp_path / "out").table().to_pylist()
    assert {row["low"] for row in table} == {0.0, 1.0}
    assert all((row["margin"] > 0) == bool(row["low"]) for row in table)
    # Another property is another study; what is there of this one is left out.
    plan = plan_of(write(tmp_path, text.replace("output < 5", "output < 500")))
    run_study(plan, tmp_path / "out", jobs=1)
    again = open_study(tmp_path / "out")
    assert again.left_out == len(table)
    assert {row["low"] for row in again.table().to_pylist()} == {1.0}
