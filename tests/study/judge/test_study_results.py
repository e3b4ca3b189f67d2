"""The results of a study: its table, means, differences, and progress."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from statistics import mean

import pytest
from scipy import stats

from epicycle.actors import EpicycleError
from epicycle.runner import open_study
from epicycle.runner.interface.cli import main
from epicycle.runner.study.judge.study_results import StudyResults
from epicycle.runner.study.run.locking import lock
from epicycle.runner.study.run.manifest import StoreError
from epicycle.runner.study.session import run_study
from tests.study.study_commands import message, study
from tests.study.study_parts import STUDY, plan_of, write


def test_status_tells_how_far_it_is(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["status", str(done / "out"), "--conditions"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "walks: 10 of 10 runs are finished (10 ok)",
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


def test_the_mean_of_what_is_true_or_false_is_a_share_with_wilsons_interval(tmp_path: Path) -> None:
    metrics = "place: place\n  far: place > 10\n  far_in_numbers: {value: 1 if place > 10 else 0}"
    text = STUDY.replace("place: place", metrics)
    run_study(plan_of(write(tmp_path, text)), tmp_path / "out", jobs=1)
    results = open_study(tmp_path / "out")
    numbers = [row["far"] for row in results.table().to_pylist()]
    assert numbers == [row["far_in_numbers"] for row in results.table().to_pylist()]
    for row, drift, number in zip(results.means("far"), (numbers[:5], numbers[5:]), (0, 1), strict=True):
        found = stats.binomtest(round(sum(drift)), 5).proportion_ci(method="wilson")
        assert (row["low"], row["high"]) == pytest.approx((found.low, found.high), abs=1e-12), number
        assert 0.0 <= row["low"] <= row["value"] <= row["high"] <= 1.0
    assert results.means("far_in_numbers")[0]["low"] <= 0.0
    assert results.plan.shares == {"far"}
    again = StudyResults(tmp_path / "out")
    assert again.plan.shares == {"far"}
    assert " to " in str(results).splitlines()[-1]


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


def test_fewer_replications_take_no_row_from_the_table(
    copied: Path, done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (done / "out" / "table.parquet").read_bytes()
    kept = "out has 6 runs beyond the 2 replications requested: they stay in the table\n"
    assert study(copied, "--replications", 2) == 0
    assert capsys.readouterr() == (
        f"walks: 2 conditions, 0 new runs, 4 already there\nwrote {copied / 'out' / 'table.parquet'}\n",
        kept.replace("out has", f"{copied / 'out'} has"),
    )
    assert (copied / "out" / "table.parquet").read_bytes() == before
    assert main(["status", str(copied / "out")]) == 0
    assert message(capsys, copied, out=True) == f"walks: 4 of 4 runs are finished, and 6 more (10 ok)\n{kept}"
    assert main(["report", str(copied / "out")]) == 0
    page = (copied / "out" / "report.html").read_text(encoding="utf-8")
    assert "4 of 4 runs are finished, and 6 more from replications beyond those requested." in page
    assert "Seeds 20 to 24:" in page


@pytest.mark.slow
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
        f"walks: 2 conditions, {made} already there\nwrote {tmp_path / 'out' / 'table.parquet'}\n",
        (
            f"{tmp_path / 'out'} has {lost} runs of another version of the study, its model or Epicycle: "
            "they are not in the table\n"
        ),
    )
    tables = [(tmp_path / out / "table.parquet").read_bytes() for out in ("out", "fresh")]
    assert tables[0] == tables[1]
