"""Studies from file to table: what is run, what is kept, what is run again."""

from __future__ import annotations

import errno
import json
import os
import shutil
import sys
from collections import Counter
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy import stats

from epicycle.actors import EpicycleError
from epicycle.runner import Simulation, load_model, open_study
from epicycle.runner.cli import main
from epicycle.runner.study import StoreError, run_study
from epicycle.runner.study import session as session_module
from epicycle.runner.study.plan import plan as plan_module
from epicycle.runner.study.run import pulse as progress_module
from epicycle.runner.study.run import store as store_module
from epicycle.runner.study.run.backlog import OK, Backlog, Done
from epicycle.runner.study.run.manifest import checksum, manifest_text
from epicycle.runner.study.run.store import Store, Writer, lock, prepare
from epicycle.runner.study.session import manifest_of
from tests.study.study_parts import MODEL, STUDY, THIS, plan_of, write


def study(folder: Path, *arguments: object, out: str = "out") -> int:
    """``epicycle study`` of the file that ``write`` has made."""
    return main(
        ["study", str(folder / "walks.yaml"), "--types", str(THIS), "--out", str(folder / out), *map(str, arguments)]
    )


OTHER_FORMAT = "\n   help: its table.parquet can be read with pandas; make its runs anew in another folder"
MADE_ANEW = "\n   help: 'epicycle study STUDY --out mine' writes it anew, and keeps the runs that are there"


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its results in ``out``."""
    folder = tmp_path_factory.mktemp("done")
    write(folder)
    assert study(folder, "--jobs", 2) == 0
    return folder


# -- what is run ------------------------------------------------------------------------------------------------------


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


def test_extension_makes_only_what_is_new(done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(done, tmp_path, dirs_exist_ok=True)
    before = open_study(tmp_path / "out").table().to_pylist()

    def said(*arguments: object) -> str:
        assert study(tmp_path, *arguments) == 0
        return capsys.readouterr().out.splitlines()[0]

    assert said() == "walks: 2 conditions, 0 new runs, 10 there before"
    assert said("--replications", 7) == "walks: 2 conditions, 4 new runs, 10 there before"
    (tmp_path / "walks.yaml").write_text(STUDY.replace("[0 m/s,", "[-1 m/s, 0 m/s,"))
    assert said() == "walks: 3 conditions, 5 new runs, 10 there before"
    after = open_study(tmp_path / "out").table().to_pylist()
    assert [
        row | {"condition": row["condition"] - 1} for row in after[5:] if row["replication"] < 5
    ] == before  # fmt: skip
    # Anything that a run hangs on makes it another one.
    assert said("--set", "fails=[9]") == "walks: 3 conditions, 15 new runs, 0 there before"
    (tmp_path / "walk.yaml").write_text(MODEL + "# as it was, but who knows\n")
    assert said("--replications", 1) == "walks: 3 conditions, 3 new runs, 0 there before"


def test_identity_hangs_on_content_and_not_on_place(
    done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(done, tmp_path / "moved")
    monkeypatch.chdir(tmp_path)
    here, there = plan_of(Path("moved/walks.yaml")), plan_of(done / "walks.yaml")
    keys = [[plan.key(plan.condition(c), r) for c in range(2) for r in range(5)] for plan in (here, there)]
    assert keys[0] == keys[1]
    assert set(keys[0]) == {row["run"] for row in open_study(done / "out").table().to_pylist()}


def test_table_is_the_same_for_any_number_of_jobs(done: Path, tmp_path: Path) -> None:
    run_study(plan_of(done / "walks.yaml"), tmp_path / "one", jobs=1)
    assert (tmp_path / "one" / "table.parquet").read_bytes() == (done / "out" / "table.parquet").read_bytes()
    assert list((done / "out" / "journals").iterdir()) == []


def test_sequential_stopping_is_decided_between_batches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    until = "until: {metric: place, half_width: 2, batch: 4, at_most: 40}\n"
    plan = plan_of(write(tmp_path, STUDY + until))
    outcome = run_study(plan, tmp_path / "out", jobs=2)
    table = open_study(tmp_path / "out").to_pandas()
    for _, rows in table.groupby("condition"):
        places = rows["place"].to_numpy()
        needed = next(n for n in range(4, 44, 4) if n == 40 or _width(places[:n]) < 2)
        assert len(places) == needed
    assert outcome.stopped_early == 80 - len(table)
    assert main(["status", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out == f"walks: {len(table)} of at most 80 runs are over ({len(table)} ok)\n"
    assert run_study(plan, tmp_path / "out", jobs=1).made == 0


def _width(values: Any) -> float:
    return float(stats.t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / np.sqrt(len(values)))


# -- what fails -------------------------------------------------------------------------------------------------------


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
    assert f"epicycle replay {tmp_path / 'out'} {rows['failed']['run'][:12]}\n" in said
    # What has failed is not run again; what hangs on the machine is, if that is asked for.
    assert study(tmp_path, "--run-timeout", 0.5) == 1
    assert capsys.readouterr().out.startswith("walks: 1 condition, 0 new runs, 10 there before\n")
    assert study(tmp_path, "--run-timeout", 0.5, "--retry", "--jobs", 2) == 1
    assert capsys.readouterr().out.startswith("walks: 1 condition, 2 new runs, 8 there before\n")
    assert main(["replay", str(tmp_path / "out"), rows["failed"]["run"][:12]]) == 1
    assert "ValueError: seed 23 is unlucky" in capsys.readouterr().err


def test_replay_gives_the_digest_of_the_row(done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for row in open_study(done / "out").table().to_pylist()[::4]:
        assert main(["replay", str(done / "out"), row["run"][:12], "--out", str(tmp_path)]) == 0
        assert capsys.readouterr().out.splitlines()[-1] == f"digest {row['digest']}: the same"
        manifest = json.loads((tmp_path / "manifest.json").read_text())
        assert (manifest["seed"], manifest["digest"]) == (row["seed"], row["digest"])
        log = pq.read_table(tmp_path / "log.parquet")
        assert log.num_rows == row["events"]
        assert {"signals.parquet"} < {path.name for path in tmp_path.iterdir()}


def test_status_tells_how_far_it_is(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["status", str(done / "out"), "--conditions"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "walks: 10 of 10 runs are over (10 ok)",
        "0 (drift=0.0): 5 ok of 5",
        "1 (drift=1.0): 5 ok of 5",
    ]
    assert main(["status", str(done / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == {
        **{"study": "walks", "runs": 10, "conditions": 2, "statuses": {"ok": 10}, "running": False, "failures": []}
    }
    with lock(done / "out"):
        assert main(["status", str(done / "out")]) == 0
        assert capsys.readouterr().out.endswith("; it is running\n")


def test_means_and_differences_are_those_of_the_table(done: Path) -> None:
    results = open_study(done / "out")
    rows = results.table().to_pylist()
    first, second = ([row["place"] for row in rows if row["drift"] == drift] for drift in (0.0, 1.0))
    for found, places, drift in zip(results.means("place"), (first, second), (0.0, 1.0), strict=True):
        assert (found["drift"], found["count"], found["runs"]) == (drift, 5, 5)
        assert (found["value"], found["error"]) == pytest.approx((mean(places), stats.sem(places)))
    (found,) = results.differences("lost", over="drift")
    assert (found["first"], found["second"]) == (0.0, 1.0)
    # The same steps are lost, as the random numbers are common.
    assert (found["value"], found["p"], found["p_holm"]) == (0.0, 1.0, 1.0)
    (found,) = results.differences("place", over="drift")
    assert (found["value"], found["low"], found["high"]) == pytest.approx((10.0, 10.0, 10.0))
    assert found["p_holm"] == 2.0**-4  # five times the same difference: the sign test
    with pytest.raises(StoreError, match="has no metric 'plaec', did you mean 'place'"):
        results.means("plaec")
    with pytest.raises(StoreError, match="has no factor 'drfit', did you mean 'drift'"):
        results.differences("place", over="drfit")


def test_xarray_is_an_extra(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(EpicycleError, match=r"this needs xarray: pip install 'epicycle\[xarray\]'"):
        open_study(done / "out").to_xarray()


def test_factors_become_coordinates(done: Path) -> None:
    pytest.importorskip("xarray")
    found = open_study(done / "out").to_xarray()
    assert dict(found.sizes) == {"drift": 2, "replication": 5}
    gaps = found["place"].sel(drift=1.0) - found["place"].sel(drift=0.0)
    assert gaps.values == pytest.approx([10.0] * 5)


def test_failed_runs_are_counted_apart(tmp_path: Path) -> None:
    run_study(plan_of(write(tmp_path, STUDY + "set: {fails: [3]}\n")), tmp_path / "out", jobs=1)
    assert [(row["count"], row["runs"]) for row in open_study(tmp_path / "out").means("place")] == [(4, 5)] * 2


def test_progress_is_a_line_a_minute_without_a_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    backlog = Backlog(plan_of(write(tmp_path)), {})
    tasks = [backlog.next() for _ in range(10)]
    now = 1000.0
    monkeypatch.setattr(progress_module.time, "monotonic", lambda: now)
    with progress_module.progress("walks") as tell:
        for number, task in enumerate(tasks):
            assert task is not None
            backlog.finished(task, Done("failed" if number == 2 else OK))
            now += 12.0
            tell(backlog)
    lines = [line.partition(" ")[2] for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        "walks: 5 of 10 runs, 1 failed, 0.0833 runs/s, 60 s left",
        "walks: 10 of 10 runs, 1 failed, 0.0833 runs/s, 0 s left",
    ]


def test_what_is_left_is_only_what_has_to_be_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study goes on with more replications: half of its runs are there, and not only in the beginning."""
    plan = plan_of(write(tmp_path))
    keys = [plan.key(plan.condition(each), one) for each in range(2) for one in range(5)]
    there = {key: Done(OK) for key in (*keys[:2], *keys[5:8], "a run of another model")}
    now = 1000.0
    monkeypatch.setattr(progress_module.time, "monotonic", lambda: now)
    backlog, pulse = Backlog(plan, there), progress_module.Pulse()
    lines = []
    while (task := backlog.next()) is not None:
        now += 12.0
        backlog.finished(task, Done(OK))
        lines.append(pulse.line(backlog))
    assert lines == [
        "3 of 10 runs, 0.0833 runs/s, 48 s left",
        "4 of 10 runs, 0.0833 runs/s, 36 s left",
        "5 of 10 runs, 0.0833 runs/s, 24 s left",
        "9 of 10 runs, 0.0833 runs/s, 12 s left",
        "10 of 10 runs, 0.0833 runs/s, 0 s left",
    ]


# -- the folder -------------------------------------------------------------------------------------------------------


@pytest.fixture
def copied(done: Path, tmp_path: Path) -> Path:
    """Results to spoil."""
    shutil.copytree(done, tmp_path, dirs_exist_ok=True)
    return tmp_path


def message(capsys: pytest.CaptureFixture[str], folder: Path, *, out: bool = False) -> str:
    said = capsys.readouterr()
    return (said.out if out else said.err).replace(f"{folder}/", "")


def test_fewer_replications_take_no_row_from_the_table(
    copied: Path, done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (done / "out" / "table.parquet").read_bytes()
    kept = "out has 6 runs beyond the 2 replications asked for: the table keeps them\n"
    assert study(copied, "--replications", 2) == 0
    assert capsys.readouterr() == (
        f"walks: 2 conditions, 0 new runs, 4 there before\nwrote {copied / 'out' / 'table.parquet'}\n",
        kept.replace("out has", f"{copied / 'out'} has"),
    )
    assert (copied / "out" / "table.parquet").read_bytes() == before
    assert main(["status", str(copied / "out")]) == 0
    assert message(capsys, copied, out=True) == f"walks: 4 of 4 runs are over, and 6 more (10 ok)\n{kept}"
    assert main(["report", str(copied / "out")]) == 0
    page = (copied / "out" / "report.html").read_text(encoding="utf-8")
    assert "4 of 4 runs are over, and 6 more of replications beyond those asked for." in page
    assert "Seeds 20 to 24:" in page


@pytest.mark.parametrize("paired", ["true", "false"])
def test_runs_of_another_seed_are_told_and_not_mixed_in(
    paired: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, STUDY + f"paired: {paired}\n")
    assert study(tmp_path, "--replications", 2) == 0
    write(tmp_path, STUDY.replace("seed: 20", "seed: 21") + f"paired: {paired}\n")
    assert study(tmp_path, "--replications", 2, out="fresh") == 0
    capsys.readouterr()
    assert study(tmp_path, "--replications", 2) == 0
    made, lost = ("2 new runs, 2", 2) if paired == "true" else ("4 new runs, 0", 4)
    assert capsys.readouterr() == (
        f"walks: 2 conditions, {made} there before\nwrote {tmp_path / 'out' / 'table.parquet'}\n",
        (
            f"{tmp_path / 'out'} has {lost} runs of another version of the study, its model or Epicycle, "
            "which the table leaves out\n"
        ),
    )
    tables = [(tmp_path / out / "table.parquet").read_bytes() for out in ("out", "fresh")]
    assert tables[0] == tables[1]


def test_another_first_seed_is_that_of_a_study_that_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path)
    assert study(tmp_path, "--replications", 2, "--seed", 120, out="asked") == 0
    with pytest.raises(SystemExit):
        study(tmp_path, "--seed", 2**63)
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"epicycle study: error: argument --seed: '{2**63}' is not a whole number from 0 to {2**63 - 1 - 10**9}"
    )
    # The folder knows it, whatever the file says.
    assert main(["resume", str(tmp_path / "asked")]) == 0
    assert "0 new runs, 4 there before" in capsys.readouterr().out
    write(tmp_path, STUDY.replace("seed: 20", "seed: 120"))
    assert study(tmp_path, "--replications", 2, out="said") == 0
    tables = [(tmp_path / out / "table.parquet").read_bytes() for out in ("asked", "said")]
    assert tables[0] == tables[1]
    assert set(pq.read_table(tmp_path / "asked" / "table.parquet")["seed"].to_pylist()) == {120, 121}


def test_folder_of_another_study(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(copied, STUDY.replace("study: walks", "study: strolls"))
    assert study(copied) == 2
    assert message(capsys, copied) == (
        "error: out holds results of the study 'walks', not of 'strolls'\n   help: choose another folder with --out\n"
    )
    write(copied, STUDY.replace("  place: place\n", "  highest: highest\n"))
    assert study(copied) == 2
    assert message(capsys, copied) == (
        "error: out was made when walks had other metrics: place, lost (aspects['loss']['dropped']), mean_place "
        "(sum(signals['walk.output']['value']) / len(signals['walk.output']['value'])), not highest, lost "
        "(aspects['loss']['dropped']), mean_place (sum(signals['walk.output']['value']) / "
        "len(signals['walk.output']['value']))\n   help: choose another folder with --out\n"
    )
    write(copied)
    (copied / "mine").mkdir()
    (copied / "mine" / "letter.txt").write_text("Dear")
    assert study(copied, out="mine") == 2
    assert message(capsys, copied) == (
        "error: mine is not empty, and holds no results of a study\n   help: choose another folder with --out\n"
    )
    (copied / "mine" / "manifest.json").write_text('{"model": "mm1"}')
    assert study(copied, out="mine") == 2
    assert message(capsys, copied) == "error: mine holds other results, not those of a study\n"
    manifest = json.loads((copied / "out" / "manifest.json").read_text())
    for spoiled, said in (
        (manifest | {"format": 2}, f"mine has format 2, this Epicycle reads format 4{OTHER_FORMAT}"),
        (
            {key: manifest[key] for key in manifest if key != "text"},
            f"mine/manifest.json is damaged: it has no 'text'{MADE_ANEW}",
        ),
    ):
        (copied / "mine" / "manifest.json").write_text(manifest_text(spoiled))
        assert main(["status", str(copied / "mine")]) == 2
        assert message(capsys, copied) == f"error: {said}\n"
    with lock(copied / "out"):
        assert study(copied) == 2
    said = message(capsys, copied)
    assert said == f"error: out is being written by another process (pid {os.getpid()})\n"
    for command in ("resume", "status"):
        assert main([command, str(copied / "nothing")]) == 2
        assert message(capsys, copied) == "error: there is no folder nothing\n"
    assert main(["replay", str(copied / "out"), "abc"]) == 2
    assert message(capsys, copied) == (
        "error: out has no run 'abc'\n   help: the column 'run' of out/table.parquet has their names\n"
    )


def test_resume_wants_the_same_model(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (copied / "walk.yaml").write_text(MODEL + "\n")
    manifest = json.loads((copied / "out" / "manifest.json").read_text())
    (copied / "out" / "manifest.json").write_text(manifest_text(manifest | {"file": str(copied / "walks.yaml")}))
    assert main(["resume", str(copied / "out")]) == 2
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
    (home / "out" / "manifest.json").write_text(manifest_text(manifest | {"file": "/nowhere/walks.yaml"}))
    assert open_study(home / "out").means("place") == before
    assert main(["status", str(home / "out")]) == 0
    capsys.readouterr()
    assert main(["resume", str(home / "out")]) == 2
    assert capsys.readouterr().err == "error: there is no file /nowhere/walk.yaml: there is no folder /nowhere\n"


def test_results_of_another_version_are_read_and_not_gone_on_with(
    copied: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = open_study(copied / "out").table()
    manifest = json.loads((copied / "out" / "manifest.json").read_text())
    (copied / "out" / "manifest.json").write_text(manifest_text(manifest | {"file": str(copied / "walks.yaml")}))
    for module in (plan_module, session_module):
        monkeypatch.setattr(module, "epicycle_version", lambda: "47.11")
    assert open_study(copied / "out").table() == before
    assert main(["resume", str(copied / "out")]) == 2
    assert message(capsys, copied) == (
        f"error: out was made with Epicycle {manifest['epicycle']}, and this is Epicycle 47.11\n"
        "   help: install that one, or make all runs anew: 'epicycle study walks.yaml --out ANOTHER'\n"
    )
    assert study(copied) == 0
    assert capsys.readouterr().out.startswith("walks: 2 conditions, 10 new runs, 0 there before\n")


def test_truncated_part(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part = next((copied / "out" / "parts").glob("*.parquet"))
    lost = pq.read_metadata(part).num_rows
    part.write_bytes(part.read_bytes()[:-20])
    assert main(["status", str(copied / "out")]) == 2
    assert message(capsys, copied) == (
        f"error: out/parts/{part.name} is damaged: it is not what was written\n"
        "   help: 'epicycle resume out' puts it aside and makes the runs anew that are lost with it\n"
    )
    assert study(copied) == 0
    assert [path.name for path in (copied / "out" / "damaged").iterdir()] == [part.name]
    new = f"{lost} new run{'s' if lost > 1 else ''}"
    assert capsys.readouterr().out.startswith(f"walks: 2 conditions, {new}, {10 - lost} there before\n")


def test_a_line_that_is_not_whole_was_not_finished(copied: Path, done: Path) -> None:
    plan = plan_of(copied / "walks.yaml")
    store = Store(copied / "out")
    rows = [row for batch in store.rows() for row in batch.to_pylist()]
    for part in (copied / "out" / "parts").iterdir():
        part.unlink()
    lines = [f"{checksum(text.encode())} {text}" for text in map(json.dumps, rows)]
    # The same row twice, as if killed between the journal's part and its end; and half a row.
    (copied / "out" / "journals" / "a.jsonl").write_text("\n".join([*lines[:4], lines[0], lines[5][:-9]]))
    (copied / "out" / "parts" / ".b.parquet.77").write_text("half a part")
    assert len(open_study(copied / "out").table()) == 4
    assert run_study(plan, copied / "out", jobs=1).made == 6
    assert (copied / "out" / "table.parquet").read_bytes() == (done / "out" / "table.parquet").read_bytes()
    assert [path.name for path in (copied / "out" / "parts").iterdir() if path.name.startswith(".")] == []


def test_full_disk_leaves_nothing_half(
    copied: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plan_of(copied / "walks.yaml")
    (copied / "full").mkdir()
    store = prepare(copied / "full", manifest_of(plan))
    rows = [row for batch in Store(copied / "out").rows() for row in batch.to_pylist()]
    writer = Writer(store)
    writer.add(rows[0])
    real = os.write

    def full(handle: int, data: bytes) -> int:
        if room.pop(0):
            return real(handle, data[: len(data) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    room = [True, False]
    monkeypatch.setattr(store_module.os, "write", full)
    with pytest.raises(OSError, match="No space left"):
        writer.add(rows[1])
    monkeypatch.setattr(store_module.os, "write", real)
    assert [row["run"] for batch in store.rows() for row in batch.to_pylist()] == [rows[0]["run"]]
    writer.add(rows[2])
    monkeypatch.setattr(pq, "write_table", _refuse)
    with pytest.raises(OSError, match="No space left"):
        writer.flush()
    assert list((copied / "full" / "parts").iterdir()) == []
    # What the command says of it.
    assert study(copied, "--replications", 6) == 1
    assert message(capsys, copied) == (
        "error: cannot write to out: No space left on device\n"
        "   help: what was finished is kept; 'epicycle resume out' goes on\n"
    )
    monkeypatch.undo()
    writer.flush()
    assert [row["run"] for batch in store.rows() for row in batch.to_pylist()] == [rows[0]["run"], rows[2]["run"]]
    assert study(copied, "--replications", 6) == 0
    assert capsys.readouterr().out.startswith("walks: 2 conditions, 0 new runs, 12 there before\n")


def test_folder_that_takes_nothing_from_the_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path)
    (tmp_path / "letter.txt").write_text("Dear")
    assert study(tmp_path, out="letter.txt/out") == 1
    assert message(capsys, tmp_path) == "error: cannot write to letter.txt/out: Not a directory\n"


def _refuse(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


# -- how large it may be ----------------------------------------------------------------------------------------------


def test_a_thousand_million_runs_are_asked_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = STUDY.replace("[0 m/s, 100 cm/s]", "{from: 0, to: 1, step: 0.000001}").replace("ns: 5", "ns: 1000")
    write(tmp_path, text)
    assert study(tmp_path, "--jobs", 2) == 2
    said = capsys.readouterr().err
    assert said.startswith(
        "error: walks has 1,000,001 conditions of 1,000 replications: 1,000,001,000 runs, which take about "
    )
    assert said.endswith(" with 2 at a time\n   help: add --yes if that is what you want\n")
    assert not (tmp_path / "out").exists()
    plan = plan_of(tmp_path / "walks.yaml")
    last = plan.condition(1_000_000)
    assert last.values == {"drift": 1.0}
    assert plan.find(last.key, {"drift": 1.0}) == 1_000_000
    assert [plan.find(last.key, {"drift": each}) for each in (0.5, 0.25e-6, 2.0)] == [None] * 3
    # A backlog takes no memory for what is still to come.
    backlog = Backlog(plan, {})
    tasks = [backlog.next() for _ in range(5)]
    assert [(task.condition, task.replication) for task in tasks if task] == [(0, each) for each in range(5)]


@pytest.mark.parametrize(
    ("seconds", "shown"), [(3, "3 s"), (600, "10 min"), (7200, "2 h"), (864_000, "10 days"), (1e10, "317 years")]
)
def test_duration_is_readable(seconds: float, shown: str) -> None:
    assert progress_module.duration(seconds) == shown


def test_schedule_gives_every_run_once_and_keeps_only_open_conditions(tmp_path: Path) -> None:
    plan = plan_of(write(tmp_path, STUDY.replace("[0 m/s, 100 cm/s]", "{from: 0, to: 40, step: 1}")))
    known = {plan.key(plan.condition(3), 2): Done(OK)}
    backlog = Backlog(plan, known)
    running = []
    given: Counter[tuple[int, int]] = Counter()
    random = np.random.default_rng(1)
    while (task := backlog.next()) is not None or running:
        if task is not None:
            running.append(task)
        if task is None or len(running) > 3:
            over = running.pop(int(random.integers(len(running))))
            if random.random() < 0.1:
                backlog.again(over)
            else:
                given[over.condition, over.replication] += 1
                backlog.finished(over, Done(OK))
        assert len(backlog._open) <= 5
    assert set(given.values()) == {1}
    assert set(given) == {(c, r) for c in range(41) for r in range(5)} - {(3, 2)}
    assert (backlog.there, backlog.made) == (Counter({OK: 1}), Counter({OK: 204}))
