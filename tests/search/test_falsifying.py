"""Searches for a run that breaks a property: what they say, what they leave, and that they come to the same."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import time
from pathlib import Path

import pytest

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.interface.cli import main
from epicycle.runner.search import proposals as proposing
from epicycle.runner.search import space
from tests.search.far import TEXT, falsify
from tests.study.study_parts import MODEL, THIS, command

BOX = ["x=0.0..1.0", "y=0 m..1 m"]
ALONE = ["n=0", "policy=lifo"]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far.yaml").write_text(TEXT, encoding="utf-8")


def made_again(run: str) -> str:
    """The digest of a run of a folder, made again."""
    assert main(["run", run, "--out", "again"]) == 0
    digest: str = json.loads(Path("again/manifest.json").read_text(encoding="utf-8"))["digest"]
    return digest


# -- what it finds ----------------------------------------------------------------------------------------------------


def test_a_broken_run_and_what_is_said_of_it(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(
        [
            "search",
            "far.yaml",
            "--break",
            "always far.output < 4.3",
            "--vary",
            "y=0 m..1 m",
            "--out",
            "out",
            "--jobs",
            "1",
        ]
    )
    assert code == 3
    assert capsys.readouterr().out.splitlines() == [
        (
            "Run 1, with y=0.47529 m and seed 0, breaks property (always far.output < 4.3): broken at 0 s, where "
            "far.output = 4.62333. Tried: 20 runs, seeds 0 to 19, y 0.00122 to 0.95382 m."
        ),
        "",
        "to         command",
        "repeat it  epicycle run far.yaml --set 'y=0.47529 m' --seed 0",
        "",
        "run  y          seed  robustness",
        "14   0.95382 m  13    -0.882779",
        "11   0.93257 m  10    -0.848219",
        "2    0.88494 m  1     -0.774034",
        "15   0.80855 m  14    -0.66453",
        "3    0.75571 m  2     -0.595613",
        "wrote out/table.parquet",
        "wrote out/falsification.json",
    ]


@pytest.mark.slow
def test_nothing_found_is_not_called_safe(capsys: pytest.CaptureFixture[str]) -> None:
    assert falsify("--vary", "n=1..3", "--vary", "policy=[fifo, lifo]", "--runs", 25, "--seed", 7, "--out", "out") == 0
    assert capsys.readouterr().out.splitlines() == [
        (
            "No run broke away (always far.output > 0.0001), which does not prove that it always holds. Tried: "
            "25 runs, seeds 7 to 31, n 1 to 3, policy fifo or lifo."
        ),
        "",
        "run  n  policy  seed  robustness",
        "6    1  lifo    12    1.5209",
        "17   1  lifo    23    1.5209",
        "23   1  lifo    29    1.5209",
        "24   1  lifo    30    1.5209",
        "25   1  lifo    31    1.5209",
        "wrote out/table.parquet",
        "wrote out/falsification.json",
    ]


@pytest.mark.slow
def test_it_follows_robustness_where_the_library_is() -> None:
    pytest.importorskip("cma")
    found = epicycle.search(
        "far.yaml", epicycle.Break("away"), vary=BOX, set={"n": 0, "policy": "lifo"}, out="out", jobs=1
    )
    assert found.broken is not None
    assert found.guided
    x, y = (float(number) for number in found.broken.level.values.values())  # type: ignore[arg-type]
    assert (x - 0.71) ** 2 + (y - 0.13) ** 2 <= 0.0001
    assert found.broken.seed == found.broken.number - 1
    # The command makes the same run, and says the same of it.
    assert main([*found.command[1:], "--check", "--out", "run"]) == 3
    assert json.loads(Path("run/manifest.json").read_text(encoding="utf-8"))["digest"] == found.broken.digest
    assert found.explain == []  # no aspect acts in it


@pytest.mark.slow
def test_without_the_library_it_goes_on_at_random_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(space, "find_spec", lambda name: None)
    found = epicycle.search("far.yaml", epicycle.Break("away", runs=70), vary=BOX, set=ALONE, out="out", jobs=1)
    assert found.broken is None
    assert found.sentence.endswith(
        "All values were chosen at random: the library that guides a search is not installed (pip install "
        "'epicycle[falsify]')."
    )


def test_runs_that_are_all_the_same_are_told() -> None:
    found = epicycle.search("far.yaml", epicycle.Break("away", runs=5), out="out", jobs=1)
    assert found.sentence == (
        "No run broke away (always far.output > 0.0001), which does not prove that it always holds. "
        "Tried: 5 runs, seeds 0 to 4. All runs were the same: nothing in the model depends on the seed or on what was "
        "varied."
    )


def test_a_program_asks_for_some_runs() -> None:
    for runs in (0, 10**7):
        with pytest.raises(EpicycleError, match=f"^runs: '{runs}' is not a whole number from 1 to 1e6$"):
            epicycle.search("far.yaml", epicycle.Break("away", runs=runs), out="out")


def test_runs_that_fail_or_cannot_be_judged_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    Path("walk.yaml").write_text(MODEL, encoding="utf-8")
    options = ["--types", str(THIS), "--runs", "20", "--out", "out", "--set", "fails=[3, 4]", "--jobs", "1"]
    assert main(["search", "walk.yaml", "--break", "always walk.output < 100", *options]) == 1
    assert capsys.readouterr().out.splitlines()[0] == (
        "No run broke property (always walk.output < 100), which does not prove that it always holds. Tried: 20 runs, "
        "seeds 0 to 19. 4 runs failed, and nothing is known of the property there: 'epicycle status out' shows them."
    )
    late = epicycle.search(
        "walk.yaml",
        epicycle.Break("eventually within 1 min walk.output > 1000", runs=2),
        types=[THIS],
        out="late",
        jobs=1,
    )
    assert late.sentence.endswith("Tried: 2 runs, seeds 0 to 1. In 2 runs the property could not be judged.")


# -- all monitors, and changes of the model ----------------------------------------------------------------------------

BOTH = "  low: always far.output < 4.3\n"


@pytest.mark.slow
def test_all_monitors_of_the_model_by_default(capsys: pytest.CaptureFixture[str]) -> None:
    Path("both.yaml").write_text(TEXT + BOTH, encoding="utf-8")
    words = ["search", "both.yaml", "--break", "--vary", "y=0 m..1 m", "--out", "out", "--jobs", "1"]
    assert main([*words, "--json"]) == 3
    facts = json.loads(capsys.readouterr().out)
    assert facts["monitors"] == {"away": "always far.output > 0.0001", "low": "always far.output < 4.3"}
    assert (facts["monitor"], facts["property"], facts["broken"]) == ("low", "always far.output < 4.3", ["low"])
    names = epicycle.open_study("out").table().column_names
    assert names[-7:-3] == ["away", "away_robustness", "low", "low_robustness"]
    assert main(words) == 3
    assert capsys.readouterr().out.startswith(
        "Run 1, with y=0.47529 m and seed 0, breaks low (always far.output < 4.3): "
    )
    calm = epicycle.search("both.yaml", epicycle.Break(runs=2), set={"n": 1}, out="calm", jobs=1)
    assert calm.sentence.startswith(
        "No run broke away (always far.output > 0.0001) or low (always far.output < 4.3), which does not prove that "
        "they always hold. "
    )
    assert calm.facts()["monitor"] is None


def test_a_model_without_monitors(capsys: pytest.CaptureFixture[str]) -> None:
    for name, flag, more in (("search", "--break", ["--break", "--jobs", "1"]), ("explain", "--monitor", [])):
        assert main([name, "mm1", "--out", "out", *more]) == 2
        assert capsys.readouterr().err == (
            f"error: mm1 has no monitor\n   help: say what is to hold, such as {flag} 'always server.size < 40'\n"
        )


@pytest.mark.slow
def test_aspects_and_a_stop_time_as_run_has_them(capsys: pytest.CaptureFixture[str]) -> None:
    aspects = "aspects:\n  rounds: {type: Noise, deviation: 0.5, at: noise.output}\n"
    Path("far.yaml").write_text(TEXT + aspects, encoding="utf-8")
    loss = "lost=PacketLoss,probability=0.5,at=sink.input"
    changes = ["--aspect", loss, "--without", "rounds", "--until", "8 s"]
    few = ["--break", "eventually within 5 s sends far.output", "--runs", "2", "--out", "out"]
    assert main(["search", "far.yaml", *few, *changes, "--jobs", "1"]) == 0
    capsys.readouterr()
    table = epicycle.open_study("out").table().to_pylist()
    for row in table:
        again = epicycle.run("far.yaml", seed=row["seed"], aspects=[loss], without_aspects=["rounds"], until="8 s")
        assert again.digest == row["digest"]
        assert made_again(f"out/{row['run']}") == row["digest"]
    # The commands that it tells make the same run, too.
    found = epicycle.search(
        "far.yaml",
        epicycle.Break("always far.output < 4.3"),
        aspects=[loss],
        without_aspects=["rounds"],
        until=8,
        out="broken",
        jobs=1,
    )
    assert found.broken is not None
    assert found.command[3:] == ["--aspect", loss, "--without", "rounds", "--seed", "0", "--until", "8"]
    # Other changes are another search.
    assert main(["search", "far.yaml", *few, *changes[:-2], "--jobs", "1"]) in (0, 2)


# -- what it leaves ---------------------------------------------------------------------------------------------------


def test_the_folder_is_that_of_a_study(capsys: pytest.CaptureFixture[str]) -> None:
    options = [
        "--vary",
        "n=1..3",
        "--vary",
        "policy=[fifo, lifo]",
        "--vary",
        "noise=0..1 ",
        "--runs",
        30,
        "--out",
        "out",
    ]
    falsify(*options)
    results = epicycle.open_study("out")
    table = results.table()
    assert table.column_names == [
        "run", "condition", "replication", "n", "policy", "noise", "seed", "status", "away", "away_robustness",
        "events", "digest", "error",
    ]  # fmt: skip
    assert sorted(table["seed"].to_pylist()) == list(range(30))
    assert set(table["n"].to_pylist()) == {1, 2, 3}
    assert set(table["policy"].to_pylist()) == {"fifo", "lifo"}
    assert set(table["status"].to_pylist()) == {"ok"}
    assert results.left_out == results.beyond() == 0
    assert (Path("out") / "table.parquet").is_file()
    capsys.readouterr()
    assert main(["status", "out"]) == 0
    assert capsys.readouterr().out == "falsify_far: 30 of at most 30 runs are finished (30 ok)\n"
    run = table["run"][17].as_py()
    assert made_again(f"out/{run}") == table["digest"][17].as_py()
    assert main(["study", "out"]) == 2
    told = shlex.join(["epicycle", "search", "far.yaml", "--break", "away", "--jobs", "1", *map(str, options)])
    assert capsys.readouterr().err == f"error: out holds a search, which its own command continues\n   help: {told}\n"


def test_facts_are_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert falsify("--runs", 3, "--vary", "x=0.0..1.0", "--json", "--out", "out") == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["found"] is False
    assert facts["runs"] == 3
    assert facts["least"]["robustness"] > 3
    assert facts["least"]["set"].keys() == {"x"}


# -- where it looks ----------------------------------------------------------------------------------------------------


def test_each_slice_of_each_axis_gets_a_point() -> None:
    for number in range(3):
        points = proposing.spread(2, 5, number)
        for column in zip(*points, strict=True):
            assert sorted(int(share * proposing.BATCH) for share in column) == list(range(proposing.BATCH))
    assert proposing.spread(2, 5, 0) != proposing.spread(2, 5, 1) != proposing.spread(2, 6, 1)
    assert proposing.spread(0, 5, 0) == [()] * proposing.BATCH


def test_ranks_are_finite() -> None:
    nan, inf = float("nan"), float("inf")
    assert proposing.ranks([0.5, None, -inf, nan, 0.5, inf, -1.0]) == [2, 3, 0, 3, 2, 3, 1]


def test_where_nothing_is_broken_by_a_margin_it_stays_spread() -> None:
    """Properties that hold or do not, and no more, show no way down."""
    batches = proposing.proposals([1], 0, guided=True)
    points = next(batches)
    for number in range(1, 8):
        assert points == proposing.spread(1, 0, number - 1)
        points = batches.send([float("inf")] * proposing.BATCH)


def test_it_goes_down_and_begins_again() -> None:
    """From wherever the least was; when the step is small, the next batch is spread."""
    pytest.importorskip("cma")
    batches = proposing.proposals([1], 0, guided=True)
    points, centres = next(batches), []
    for _ in range(40):
        points = batches.send([abs(share - 0.3) for (share,) in points])
        assert all(0.0 <= share <= 1.0 for (share,) in points)
        centres.append(sum(share for (share,) in points) / proposing.BATCH)
    assert sum(abs(centre - 0.3) < 0.01 for centre in centres) > 10
    assert sum(abs(centre - 0.5) < 0.02 for centre in centres) >= 3  # spread


# -- the same each time -----------------------------------------------------------------------------------------------


def table(folder: str) -> bytes:
    return (Path(folder) / "table.parquet").read_bytes()


@pytest.mark.slow
def test_it_depends_on_its_seed_alone() -> None:
    arguments = ["--vary", BOX[0], "--vary", BOX[1], "--vary", "noise=0.0..0.1", "--runs", 90]
    arguments += [word for each in ALONE for word in ("--set", each)]
    for folder, jobs, seed in (("one", 1, 0), ("two", 2, 0), ("other", 2, 1)):
        falsify(*arguments, "--jobs", jobs, "--seed", seed, "--out", folder)
    assert table("one") == table("two")
    assert table("one") != table("other")


@pytest.mark.slow
def test_more_runs_continue_it() -> None:
    options = ["--vary", "x=0.0..1.0", "--out", "out"]
    falsify(*options, "--runs", 10)
    before = epicycle.open_study("out").table(times=True).to_pylist()
    falsify(*options, "--runs", 50)
    after = epicycle.open_study("out").table(times=True).to_pylist()
    assert len(after) == 50
    assert [row | {"condition": 0} for row in after if row["seed"] < 10] == [row | {"condition": 0} for row in before]
    falsify(*options[:2], "--out", "calm", "--runs", 50)
    assert table("out") == table("calm")


@pytest.mark.slow  # an estimate that is killed (test_rare.py), and a study, keep their rows in the same way
def test_a_search_that_is_killed_comes_to_the_same() -> None:
    Path("walk.yaml").write_text(MODEL, encoding="utf-8")
    said = ["search", "walk.yaml", "--break", "always walk.output < 8.5", "--vary", "drift=-1 m/s..0.2 m/s"]
    words = command(*said, "--types", THIS, "--runs", 80, "--jobs", 2, "--set", "pause=0.01")
    calm = subprocess.run([*words, "--out", "calm", "--json"], capture_output=True, check=False)
    out = Path("out")
    for _ in range(2):
        process = subprocess.Popen([*words, "--out", "out"], start_new_session=True, stdout=subprocess.DEVNULL)
        before, start = size(out), time.monotonic()
        while size(out) <= before + 2_000 and process.poll() is None and time.monotonic() - start < 60:
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    made = len(epicycle.open_study("out").table())
    assert made > 0
    again = subprocess.run([*words, "--out", "out", "--json"], capture_output=True, check=False)
    assert again.returncode == calm.returncode
    assert json.loads(again.stdout) | {"folder": ""} == json.loads(calm.stdout) | {"folder": ""}
    assert table("out") == table("calm")


def size(folder: Path) -> int:
    """How many bytes of rows there are."""
    return sum(path.stat().st_size for path in (*folder.glob("journals/*"), *folder.glob("parts/*")) if path.exists())


@pytest.mark.slow
def test_an_interrupt_keeps_what_is_there() -> None:
    Path("walk.yaml").write_text(MODEL, encoding="utf-8")
    said = ["search", "walk.yaml", "--break", "always walk.output < 1000", "--types", THIS, "--set", "pause=0.2"]
    words = command(*said, "--jobs", 1, "--out", "out")
    process = subprocess.Popen(words, start_new_session=True, stderr=subprocess.PIPE, text=True)
    start = time.monotonic()
    while size(Path("out")) == 0 and time.monotonic() - start < 60:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    _, told = process.communicate(timeout=30)
    assert process.returncode == 130
    assert told == "interrupted; finished runs are kept: the same command continues\n"
    assert 0 < len(epicycle.open_study("out").table()) < 20
