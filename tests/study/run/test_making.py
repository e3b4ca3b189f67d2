"""How runs are made: each as it would be alone, whatever becomes of the others."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy import stats

from epicycle.runner import Simulation, load_model, open_study
from epicycle.runner.interface.cli import main
from epicycle.runner.model.language.study import read_study
from epicycle.runner.study.plan.plan import Plan
from epicycle.runner.study.session import run_study
from epicycle.runner.support.apart import WorkerError
from tests.study.study_commands import study
from tests.study.study_parts import MODEL, STUDY, THIS, plan_of, write


def test_rows_are_what_single_runs_give(done: Path) -> None:
    from tests.study.study_parts import Walk

    rows = open_study(done / "out").table().to_pylist()
    assert [(row["condition"], row["replication"]) for row in rows] == [(c, r) for c in range(2) for r in range(5)]
    assert [row["drift"] for row in rows] == [0.0] * 5 + [1.0] * 5
    assert len({row["run"] for row in rows}) == 10
    for row in rows[::3]:
        model = load_model(done / "walk.yaml", set={"drift": row["drift"]}, types=[Walk])
        results = Simulation(model, seed=row["seed"]).run()
        assert (row["status"], row["error"], row["events"]) == ("ok", None, results.events)
        assert row["digest"] == results.digest
        assert row["place"] == results.metrics["place"]
        assert row["lost"] == results.aspects["loss"]["dropped"]
        assert row["mean_place"] == pytest.approx(mean(results["walk.output"].tokens))


@pytest.mark.parametrize("paired", [True, False])
def test_paired_conditions_have_common_random_numbers(paired: bool, tmp_path: Path) -> None:
    plan = plan_of(write(tmp_path, STUDY + f"paired: {str(paired).lower()}\n"))
    run_study(plan, tmp_path / "out", jobs=1)
    rows = open_study(tmp_path / "out").table().to_pylist()
    first, second = rows[:5], rows[5:]
    if paired:
        assert [row["seed"] for row in first] == [row["seed"] for row in second] == [20, 21, 22, 23, 24]
        # Ten steps that are longer by 1 m each, and otherwise the same.
        gaps = [b["place"] - a["place"] for a, b in zip(first, second, strict=True)]
        assert gaps == pytest.approx([10.0] * 5)
    else:
        assert len({row["seed"] for row in rows}) == 10
        # A level that comes in front moves no seed of the others.
        more = plan_of(write(tmp_path / "more", STUDY.replace("[0 m/s,", "[5 m/s, 0 m/s,") + "paired: false\n"))
        seeds = [more.seed(more.condition(1), each) for each in range(5)]
        assert seeds == [row["seed"] for row in first]


@pytest.mark.parametrize("text", [MODEL.replace("factor: 2", "factor: 3"), "model: [", None])
def test_runs_of_a_model_that_has_changed_since_are_not_made(text: str | None, tmp_path: Path) -> None:
    """They would stand in the table as those of the model that was checked."""
    plan, model = plan_of(write(tmp_path)), tmp_path / "walk.yaml"
    if text is None:
        model.unlink()
    else:
        model.write_text(text, encoding="utf-8")
    with pytest.raises(WorkerError) as error:
        run_study(plan, tmp_path / "out", jobs=1)
    assert str(error.value) == (
        f"{model} changed while runs were made, and the next ones would be of another model\n"
        "   help: finished runs are kept; undo the change and repeat the command to continue them, or repeat it with "
        "the change to make all runs again"
    )
    assert open_study(tmp_path / "out").counts() == {}
    write(tmp_path)
    assert run_study(plan, tmp_path / "out", jobs=1).made == 10


def test_runs_are_not_made_with_types_that_have_changed_since(tmp_path: Path) -> None:
    types = tmp_path / "walking.py"
    types.write_text(THIS.read_text(encoding="utf-8"), encoding="utf-8")
    plan = Plan.made(read_study(write(tmp_path), types=[types]))
    types.write_text(THIS.read_text(encoding="utf-8").replace("range(10)", "range(9)"), encoding="utf-8")
    with pytest.raises(WorkerError, match=rf"^{re.escape(str(types))} changed while runs were made, and the next"):
        run_study(plan, tmp_path / "out", jobs=1)


def test_table_is_the_same_for_any_number_of_jobs(done: Path, tmp_path: Path) -> None:
    run_study(plan_of(done / "walks.yaml"), tmp_path / "one", jobs=1)
    assert (tmp_path / "one" / "table.parquet").read_bytes() == (done / "out" / "table.parquet").read_bytes()
    assert list((done / "out" / "journals").iterdir()) == []


def test_sequential_stopping_is_decided_between_batches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    until = "until: {metric: place, half_width: 2, batch: 4, at_most: 40}\n"
    plan = plan_of(write(tmp_path, STUDY.replace("replications: 5\n", until)))
    outcome = run_study(plan, tmp_path / "out", jobs=2)
    table = open_study(tmp_path / "out").to_pandas()
    for _, rows in table.groupby("condition"):
        places = rows["place"].to_numpy()
        needed = next(n for n in range(4, 44, 4) if n == 40 or _width(places[:n]) < 2)
        assert len(places) == needed
    assert outcome.stopped_early == 80 - len(table)
    assert main(["status", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out == f"walks: {len(table)} of at most 80 runs are finished ({len(table)} ok)\n"
    assert run_study(plan, tmp_path / "out", jobs=1).made == 0


def _width(values: Any) -> float:
    return float(stats.t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / np.sqrt(len(values)))


@pytest.mark.slow
def test_runs_that_fail_hang_or_die_are_rows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = STUDY.replace("[0 m/s, 100 cm/s]", "[0 m/s]").replace("replications: 5", "replications: 10")
    write(tmp_path, text + "set: {fails: [3], hangs: [5], dies: [7]}\n")
    assert study(tmp_path, "--jobs", 2, "--run-timeout", 1) == 1
    said = capsys.readouterr().err
    results = open_study(tmp_path / "out")
    assert results.counts() == {"ok": 7, "failed": 1, "timeout": 1, "killed": 1}
    rows = {row["status"]: row for row in results.failures()}
    place = tmp_path / "walk.yaml"
    assert rows["failed"]["seed"] == 23
    source = THIS.read_text(encoding="utf-8").splitlines()
    [(number, line)] = [(number, line) for number, line in enumerate(source, 1) if "is unlucky" in line]
    assert rows["failed"]["error"] == (
        "walk failed in initialize() at (0 s, 1): ValueError: seed 23 is unlucky\n"
        f"   raised at {os.path.relpath(THIS)}:{number}:13\n{number:>5} | {line}\n"
        f"      | {' ' * 12}{'^' * len(line.strip())}\n   declared at {place}:5:3"
    )
    assert (rows["timeout"]["seed"], rows["timeout"]["error"]) == (25, "it took longer than 1 s")
    assert (rows["killed"]["seed"], rows["killed"]["error"]) == (27, "its process ended 3 times (exit code 3)")
    assert said.endswith("error: 3 runs failed\n")
    assert f"epicycle run {tmp_path / 'out' / rows['failed']['run'][:12]}\n" in said
    # What has failed is not run again; what hangs on the machine is, if that is asked for.
    assert study(tmp_path, "--run-timeout", 0.5) == 1
    assert capsys.readouterr().out.startswith("walks: 1 condition, 0 new runs, 10 already there\n")
    assert study(tmp_path, "--run-timeout", 0.5, "--retry", "--jobs", 2) == 1
    assert capsys.readouterr().out.startswith("walks: 1 condition, 2 new runs, 8 already there\n")
    assert main(["run", str(tmp_path / "out" / rows["failed"]["run"][:12])]) == 1
    assert "ValueError: seed 23 is unlucky" in capsys.readouterr().err


def test_a_run_that_is_made_again_has_the_digest_of_the_row(done: Path, tmp_path: Path) -> None:
    for row in open_study(done / "out").table().to_pylist()[::4]:
        assert (
            main(
                [
                    "run",
                    str(done / "out" / row["run"][:12]),
                    "--out",
                    str(tmp_path),
                    "--log",
                    str(tmp_path / "log.parquet"),
                ]
            )
            == 0
        )
        manifest = json.loads((tmp_path / "manifest.json").read_text())
        assert (manifest["seed"], manifest["digest"]) == (row["seed"], row["digest"])
        log = pq.read_table(tmp_path / "log.parquet")
        assert log.num_rows == row["events"]
        assert {"signals.parquet"} < {path.name for path in tmp_path.iterdir()}


def test_a_metric_that_cannot_be_calculated_is_told_by_replay_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(
        tmp_path,
        STUDY.replace("[0 m/s, 100 cm/s]", "[0 m/s]").replace("  place: place\n", "  place: 1 / (end - end)\n"),
    )
    assert study(tmp_path, "--replications", 1) == 1
    (row,) = open_study(tmp_path / "out").failures()
    assert row["error"] == "'1 / (end - end)': 1 / (end - end) divides by zero, with end = 9.0"
    capsys.readouterr()
    assert main(["run", str(tmp_path / "out" / row["run"][:12])]) == 1
    said = capsys.readouterr()
    assert said.err == f"error: {row['error']}\n"
    assert "ended by no events left" in said.out


def test_modules_in_the_working_directory_do_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path)
    for name in ("pickle", "queue", "simpy"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('somebody else')\n")
    monkeypatch.chdir(tmp_path)
    assert study(tmp_path, "--replications", 1) == 0
