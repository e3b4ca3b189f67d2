"""Searches for small sets of single acts that break a property: known answers, and all sets once."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.interface.cli import main
from epicycle.runner.model.graph.acts import ActName
from epicycle.runner.search.space import FaultSpace, _by_sum

# A plan comes each second: one that is lost makes the robot's plan 1.9 s old, two in a row 2.9 s.
TEXT = """
model: stale
parameters: {loss: 0.5}
actors:
  planning: {type: Clock, period: 1 s}
  plan: {type: CurrentTime}
  ticks: {type: Clock, period: 100 ms}
  robot: {type: HoldingExpression, expression: time - plan + 0 * tick, held: {plan: 0}}
  sink: {type: Recorder}
connections:
  - planning.output -> plan.trigger
  - plan.output -> robot.plan
  - ticks.output -> robot.tick
  - robot.output -> sink.input
aspects:
  radio: {type: PacketLoss, probability: "${loss}", at: robot.plan}
run: {stop: 20 s}
monitors:
  fresh: always robot.output <= 2.5
  usable: always robot.output <= 3.5
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("stale.yaml").write_text(TEXT, encoding="utf-8")


def falsify(*arguments: object) -> int:
    return main(["search", "stale.yaml", "--jobs", "1", "--out", "out", *map(str, arguments)])


def lost(seed: int) -> list[int]:
    """The numbers of the plans that are lost in a run."""
    from epicycle.runner import Simulation, load_model
    from epicycle.runner.execution.engine import Interventions

    results = Simulation(load_model("stale.yaml"), seed=seed, acts=Interventions()).run()
    return [act.name.token for act in results.acts]


@pytest.mark.slow
def test_two_faults_that_no_single_one_replaces(capsys: pytest.CaptureFixture[str]) -> None:
    numbers = lost(4)
    pairs = [each for each in itertools.combinations(numbers, 2) if each[1] == each[0] + 1]
    assert pairs  # or the run has no such fault
    assert falsify("--break", "fresh", "--max-faults", 2, "--seed", 4) == 3
    said = capsys.readouterr().out
    results = epicycle.open_study("out")
    table = results.to_pandas()
    assert set(table["seed"]) == {4}
    found = epicycle.search("stale.yaml", epicycle.Break("fresh", max_faults=2), seed=4, out="out", progress=False)
    assert found.broken is not None
    first, second = sorted(int(each["token"]) for each in _exactly(found))
    assert (first, second) in pairs
    assert any(f"exactly radio at robot.plan, token {each}; " in said for each in (first, second))
    assert f"no fault at all, {len(numbers)} of {len(numbers)} sets of 1 fault, " in said
    alone = table[[text.count("token") == 1 for text in table["exactly"]]]
    assert len(alone) == len(numbers)
    assert alone["fresh"].all()
    # What it tells to do gives the same; and there is no smaller explanation.
    assert main([*found.command[1:], "--check"]) == 3
    capsys.readouterr()
    explained = epicycle.explain(epicycle.load("stale.yaml", set={"exactly": _exactly(found)}), "fresh", seed=4)
    assert sorted(each.act.name.token for each in explained.effects) == [first, second]


def _exactly(found: epicycle.Falsification) -> list[dict[str, object]]:
    assert found.broken is not None
    facts = found.facts()["run"]["set"]["exactly"]
    assert isinstance(facts, list)
    return facts


@pytest.mark.slow
def test_it_ends_when_all_sets_are_tried(capsys: pytest.CaptureFixture[str]) -> None:
    count = len(lost(2))
    assert falsify("--break", "usable", "--max-faults", 2, "--seed", 2) == 0
    pairs = math.comb(count, 2)
    tried = f"no fault at all, {count} of {count} sets of 1 fault, {pairs} of {pairs} sets of 2 faults."
    assert capsys.readouterr().out.split("\n")[0] == (
        "No run broke usable (always robot.output <= 3.5), which does not prove that it always holds. Tried: "
        f"{1 + count + pairs} runs, seed 2, {tried}"
    )


def test_what_needs_no_fault(capsys: pytest.CaptureFixture[str]) -> None:
    """The first run has none."""
    assert falsify("--break", "always robot.output < 0.85", "--max-faults", 1, "--seed", 2) == 3
    assert capsys.readouterr().out.startswith(
        "Run 1, with exactly no fault and seed 2, breaks property (always robot.output < 0.85): "
    )


@pytest.mark.slow
def test_a_longer_search_continues(capsys: pytest.CaptureFixture[str]) -> None:
    assert falsify("--break", "usable", "--max-faults", 2, "--seed", 2, "--runs", 5) == 0
    assert falsify("--break", "usable", "--max-faults", 2, "--seed", 2) == 0
    said = capsys.readouterr().out.replace("out/", "").rpartition("No run")[2]
    assert falsify("--break", "usable", "--max-faults", 2, "--seed", 2, "--out", "anew", "--jobs", 2) == 0
    assert capsys.readouterr().out.replace("anew/", "").rpartition("No run")[2] == said
    parts = [(Path(each) / "table.parquet").read_bytes() for each in ("out", "anew")]
    assert parts[0] == parts[1]


ONE = "faults are searched in one run"
MANY = "20,000 runs are too many for one folder, where faults may take 9,375 values each"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--vary loss=0.1..0.2", f"{ONE}, in which nothing varies\n   help: leave out --vary or --max-faults"),
        ("--set loss=0", "no aspect does anything in the run of stale with seed 0\n   help: add --disturb"),
        ("--runs 20000", f"{MANY}\n   help: search with --runs 9375 and several seeds, in a folder each"),
    ],
)
def test_what_is_wrong(options: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert falsify("--break", "fresh", "--max-faults", 2, *options.split()) == 2
    assert capsys.readouterr().err == f"error: {message}\n"
    assert not Path("out").exists()


@pytest.mark.parametrize(("size", "count"), [(1, 1), (2, 2), (2, 9), (3, 7), (4, 4), (5, 8)])
def test_each_set_once_by_its_sum(size: int, count: int) -> None:
    found = list(_by_sum(size, count))
    assert sorted(found) == list(itertools.combinations(range(count), size))
    assert [sum(each) for each in found] == sorted(sum(each) for each in found)


def test_the_worst_acts_come_first() -> None:
    """By their robustness alone, whatever the order in which they were tried."""
    space = FaultSpace([ActName("radio", "robot.plan", number) for number in range(30)], 3)
    batches = space.proposals(7)
    alone: list[tuple[float, ...]] = []
    points = next(batches)
    while len(alone) < 31:
        alone += points
        points = batches.send([abs(sum(each) - 11.2) if each else 50.0 for each in points])
    assert alone[0] == ()
    assert sorted(alone[1:]) == [(float(place),) for place in range(30)]
    assert [set(each) for each in points[:4]] == [{11, 12}, {11, 10}, {11, 13}, {12, 10}]


# -- the setting ------------------------------------------------------------------------------------------------------


def test_a_setting_names_the_only_acts() -> None:
    model = epicycle.load("stale.yaml", set={"exactly": [{"aspect": "radio", "at": "robot.plan", "token": 3}]})
    assert model.exactly == {("radio", "robot.plan", 3)}
    assert epicycle.load("stale.yaml", set={"exactly": []}).exactly == frozenset()
    assert epicycle.load("stale.yaml").exactly is None


def test_a_parameter_of_that_name_comes_first() -> None:
    text = TEXT.replace("loss: 0.5}", "loss: 0.5, exactly: 1}").replace("${loss}", "${loss * exactly / 2}")
    Path("own.yaml").write_text(text, encoding="utf-8")
    model = epicycle.load("own.yaml", set={"exactly": 2})
    assert model.parameters["exactly"] == 2
    assert model.exactly is None


def test_acts_that_cannot_be() -> None:
    acts = "exactly=[{aspect: radoi, at: robot.plan, token: 1}, {aspect: radio, at: robot, token: 1}]"
    with pytest.raises(EpicycleError) as caught:
        epicycle.load("stale.yaml", set=[acts])
    assert str(caught.value) == (
        "command line:1:25: error: exactly: there is no aspect 'radoi', did you mean 'radio'?\n"
        f"    1 | --set {acts}\n"
        f"      | {' ' * 24}^^^^^\n"
        "   help: the aspects: radio\n"
        "\n"
        "command line:1:79: error: exactly: aspect radio does not attach to 'robot', did you mean 'robot.plan'?\n"
        f"    1 | --set {acts}\n"
        f"      | {' ' * 78}^^^^^\n"
        "   help: it attaches to robot.plan\n"
        "2 errors in command line"
    )
