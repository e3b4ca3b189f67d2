"""Optimisation: known minima, conditions, studies, the same runs every time, and what is said of it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.interface.cli import main
from tests.study.study_parts import command

pytest.importorskip("cma")

BOWL = """
model: bowl
parameters: {x: 0.0, y: 0.0, n: 3, noise: 0.0}
actors:
  clock: {type: Clock, period: 1 s}
  chance: {type: Random, distribution: {type: Normal, mean: 0, standard_deviation: 1}}
  f:
    type: Expression
    expression: "((${x}) - 1.5) ** 2 + 2 * ((${y}) + 0.5) ** 2 + (${n} - 4) ** 2 + ${noise} * chance"
connections: [clock.output -> chance.trigger, chance.output -> f.chance]
run: {stop: 0 s}
metrics: {cost: {of: f.output, take: last}}
"""
VARY = {"x": "-5..5", "y": "-5..5"}


@pytest.fixture
def bowl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("bowl.yaml").write_text(BOWL, encoding="utf-8")
    return "./bowl.yaml"


def optimum(bowl: str, **more: Any) -> epicycle.Optimum:
    """What a search finds: the options of its goal, and others."""
    given = {"vary": VARY, "set": {"n": 4}, "jobs": 2, **more}
    kind = epicycle.Maximise if "maximise" in given else epicycle.Minimise
    objective = given.pop("maximise", None) or given.pop("minimise", "cost")
    own = {name: given.pop(name) for name in ("subject_to", "points", "replications") if name in given}
    return epicycle.search(bowl, kind(objective, **own), **given)


@pytest.mark.slow
def test_the_minimum_of_a_bowl(bowl: str) -> None:
    found = optimum(bowl)
    assert found.best is not None
    assert found.best == {"x": pytest.approx(1.5, abs=0.1), "y": pytest.approx(-0.5, abs=0.1)}
    assert found.value is not None
    assert found.value.value < 0.01
    assert found.checked is not None
    assert found.checked.value == found.value.value  # nothing is random
    table = found.results.table()
    assert min(table["cost"].to_pylist()) == found.value.value
    number = found.point.number if found.point else 0
    x, y = found.best.values()
    assert found.sentence == (
        f"The least cost of 200 points is {found.value.value:g}, at x={x}, y={y} (point {number}). In 1 run with new "
        f"seeds it is {found.value.value:g}. There may be a better point that was not tried."
    )


@pytest.mark.slow
def test_whole_numbers_lists_and_expressions(bowl: str) -> None:
    found = optimum(bowl, minimise="cost + n / 10", vary={"x": "-5..5", "n": "0..10", "y": [-0.5, 0.5]}, set=())
    assert found.best is not None
    assert found.best == {"x": pytest.approx(1.5, abs=0.2), "n": 4, "y": -0.5}


@pytest.mark.slow
def test_the_greatest_lies_at_an_end(bowl: str) -> None:
    found = optimum(bowl, maximise="cost", vary={"x": "-5..5"}, points=100)
    assert found.best == {"x": pytest.approx(-5.0, abs=0.1)}
    assert "x is at the end of its range: the best may lie beyond." in found.sentence


@pytest.mark.slow
def test_conditions_hold_in_all_runs(bowl: str) -> None:
    found = optimum(bowl, subject_to="x + y <= 0", points=400)
    assert found.best is not None
    assert found.best == {"x": pytest.approx(5 / 6, abs=0.15), "y": pytest.approx(-5 / 6, abs=0.15)}
    assert found.best["x"] + found.best["y"] <= 0
    assert found.value is not None
    assert 2 / 3 <= found.value.value < 0.75
    none = optimum(bowl, subject_to=["x > 4", "cost < 1"], points=60, out="none")
    assert none.best is None
    assert none.sentence == (
        "None of 60 points has a mean of cost and meets all conditions. 60 points break a condition."
    )


@pytest.mark.slow
def test_of_noisy_runs_the_best_is_told_with_new_seeds(bowl: str) -> None:
    found = optimum(bowl, set={"n": 4, "noise": 3.0}, replications=4)
    assert found.value is not None
    assert found.checked is not None
    assert found.value.count == found.checked.count == 4
    rows = found.results.table().to_pylist()
    best = [row for row in rows if all(row[path] == value for path, value in (found.best or {}).items())]
    assert [row["replication"] for row in best] == list(range(8))
    assert sum(row["cost"] for row in best[4:]) / 4 == pytest.approx(found.checked.value)


@pytest.mark.slow
def test_the_runs_hang_on_the_seed_alone(bowl: str) -> None:
    one = optimum(bowl, points=120, out="one", jobs=1)
    two = optimum(bowl, points=120, out="two", jobs=2)
    other = optimum(bowl, points=120, out="other", seed=5)
    assert one.results.digest() == two.results.digest() != other.results.digest()
    assert one.facts() == {**two.facts(), "folder": "one"}


@pytest.mark.slow
def test_a_search_continues(bowl: str) -> None:
    first = optimum(bowl, points=80, out="grown")
    keys = set(first.results.table()["run"].to_pylist())
    assert main(["study", "grown"]) == 2  # by its own command
    grown, fresh = optimum(bowl, points=120, out="grown"), optimum(bowl, points=120, out="fresh")
    assert grown.facts() == {**fresh.facts(), "folder": "grown"}
    assert len(keys - set(grown.results.table()["run"].to_pylist())) <= 1  # the check of what was best then


@pytest.mark.slow
def test_a_killed_search_continues_to_the_same_answer(bowl: str) -> None:
    words = ["search", bowl, "--minimise", "cost", "--vary", "x=-5..5", "--vary", "y=-5..5", "--jobs", "2", "--json"]
    process = subprocess.Popen(command(*words, "--out", "killed"), start_new_session=True)
    while not list(Path("killed").glob("journal*")) and process.poll() is None:
        time.sleep(0.02)
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    said = [
        subprocess.run(command(*words, "--out", each), capture_output=True, check=True) for each in ("killed", "new")
    ]
    one, two = (json.loads(each.stdout) for each in said)
    assert one == {**two, "folder": "killed"}


@pytest.mark.slow
def test_the_conditions_of_a_study_count_alike(bowl: str) -> None:
    Path("s.yaml").write_text(
        "study: s\nmodel: ./bowl.yaml\nvary: {y: [0.5, -1.5], n: [4, 5]}\nmetrics: {double: 2 * cost}\nseed: 3\n"
        "claims: {low: {always: double < 3}}\n"
    )
    found = epicycle.search("./s.yaml", epicycle.Minimise("double", points=100), vary={"x": "0..3"}, jobs=2)
    assert found.best == {"x": pytest.approx(1.5, abs=0.1)}
    assert found.value is not None
    assert found.value.value == pytest.approx(2 * (2 + 0.5), abs=0.05)
    assert found.results.counts().total() == 4 * (len({each.level.values["x"] for each in found.tested}) + 1)
    assert set(found.results.table()["seed"].to_pylist()) == {3, 4}


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["--minimise", "cost"], "error: there is nothing to vary\n   help: add --vary load=0.5..0.9\n"),
        (
            ["--minimise", "csot", "--vary", "x=0..1"],
            (
                "command line:1:12: error: there is no metric or varied parameter 'csot', did you mean 'cost'?\n"
                "    1 | --minimise csot\n"
                "      |            ^^^^\n"
                "   help: known: cost, x\n"
            ),
        ),
        (
            ["--minimise", "cost", "--vary", "x=0..1", "--subject-to", "cost +"],
            (
                "command line:1:14: error: this is not an expression: invalid syntax\n"
                "    1 | --subject-to cost +\n"
                "      |              ^\n"
            ),
        ),
        (
            ["--minimise", "cost", "--vary", "x=0..1", "--subject-to", "x + 1"],
            (
                "command line:1:14: error: 'x + 1' is not a condition\n"
                "    1 | --subject-to x + 1\n"
                "      |              ^^^^^\n"
                "   help: write a comparison such as 'longest_wait < 30'\n"
            ),
        ),
        (
            ["--minimise", "cost", "--vary", "x=0..1", "--set", "x=3"],
            (
                "command line:1:7: error: 'x' is set and varied\n"
                "    1 | --set x=3\n"
                "      |       ^^^\n"
                "   help: leave out --set or --vary\n"
            ),
        ),
        (
            ["--minimise", "cost", "--vary", "z=0..1"],
            (
                "command line:1:8: error: 'z' matches no parameter\n"
                "    1 | --vary z=0..1\n"
                "      |        ^^^^^^\n"
                "   help: valid parameters here: x, y, n, noise\n"
            ),
        ),
    ],
)
def test_messages(bowl: str, given: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["search", bowl, *given, "--points", "5"]) == 2
    assert capsys.readouterr().err == told


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["--vary", "x=0..1"], "one of the arguments --break --minimise --maximise --match is required"),
        (["--minimise", "cost", "--maximise", "cost"], "argument --maximise: not allowed with argument --minimise"),
    ],
)
def test_a_search_has_one_goal(bowl: str, given: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["search", bowl, *given])
    assert capsys.readouterr().err.splitlines()[-1] == f"epicycle search: error: {told}"


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["--minimise", "cost", "--runs", "5"], "--runs is for --break"),
        (["--break", "--points", "5"], "--points is for --minimise and --maximise"),
        (["--maximise", "cost", "--between", "linear"], "--between is for --match"),
        (
            ["--match", "f.output=m.csv", "--run-timeout", "5"],
            "--run-timeout is not for --match, which needs every run",
        ),
    ],
)
def test_an_option_of_another_goal(bowl: str, given: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["search", bowl, *given, "--vary", "x=0..1"]) == 2
    assert capsys.readouterr().err == f"error: {told}\n"


def test_failed_runs_are_told(bowl: str) -> None:
    found = optimum(bowl, minimise="1 / (x > 0)", points=40, vary={"x": "-1..1"})
    known = [each for each in found.tested if each.outcome.value is not None]
    assert 0 < len(known) < 40
    assert f"{40 - len(known)} points have no mean: runs failed or have no number." in found.sentence


def test_without_conditions_it_must_be_a_model_for_a_disturbance() -> None:
    with pytest.raises(EpicycleError, match="--disturb is for models: a study declares its own"):
        epicycle.search("waiting_time", epicycle.Minimise("mean_wait"), vary={"load": "0.1..0.2"}, disturb="wifi_burst")


def test_a_study_may_not_vary_what_a_search_adds(bowl: str) -> None:
    Path("s.yaml").write_text("study: s\nmodel: ./bowl.yaml\nvary: {point: {cases: {one: , two: {n: 5}}}}\n")
    told = "^s varies 'point', which is the name of what a search varies: rename it$"
    with pytest.raises(EpicycleError, match=told):
        epicycle.search("./s.yaml", epicycle.Minimise("cost"), vary={"x": "0..3"})
