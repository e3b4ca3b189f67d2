"""``epicycle diff``: what changed in a model, not in its text."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import epicycle
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.packaged import packaged_models

BEFORE = """model: line
parameters: {loss: {value: 0.2, min: 0}}
actors:
  clock: {type: Clock, period: 500 ms, count: 2}
  gain: {type: Scale, factor: 2}
  sum: {type: Merge}
connections:
  - clock[*].output -> sum.input
  - {from: sum.output, to: gain.input, delay: 1 s}
aspects:
  lossy: {type: PacketLoss, probability: "${loss}", at: gain.input}
run: {stop: 10 s, record: [gain.output]}
metrics: {seen: {of: gain.output, take: count}}
monitors: {small: always gain.output < 50}
figures: {signal: {type: TimeSeries, signals: gain.output}}
"""
# The same in other words: comments, order, units, defaults, and an expression.
SAME = """# A line.
model: line
run:
  record: gain.output
  stop: 10
metrics: {seen: {take: count, of: [gain.output]}}
monitors: {small: {property: always gain.output < 50}}
figures: {signal: {signals: gain.output, type: TimeSeries}}
parameters: {loss: 0.2}
aspects: {lossy: {type: PacketLoss, at: "*.input", probability: "${loss}"}}
connections:
  - clock[0].output, clock[1].output -> sum.input
  - {from: sum.output, to: gain.input, delay: "${2 * 0.5}"}
actors:
  clock: {type: Clock, period: 0.5, count: 2, offset: 0}
  gain: {type: Scale, factor: "${1 + 1}"}
  sum: {type: Merge}
"""


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.yaml").write_text(BEFORE)
    return tmp_path


def said(after: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    Path("b.yaml").write_text(after)
    code = main(["diff", "a.yaml", "b.yaml"])
    out, err = capsys.readouterr()
    assert err == ""
    return code, out


def test_other_words_are_no_difference(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    after = SAME.replace('at: "*.input"', "at: gain.input")
    assert said(after, capsys) == (0, "line and line are the same model\n")
    code, out = said(SAME, capsys)
    expected = (
        "aspects\n  ~ lossy.at: [gain.input] -> [gain.input, sum.input]\n0 parts added, 0 removed, 1 value changed\n"
    )
    assert (code, out) == (1, expected)


@pytest.mark.parametrize(
    ("old", "new", "lines"),
    [
        ("model: line", "model: row", ["model", "  ~ model.name: line -> row"]),
        ("period: 500 ms", "period: 1 s", ["actors", "  ~ clock[*].period: 0.5 -> 1 (2)"]),
        ("factor: 2", "factor: 3", ["actors", "  ~ gain.factor: 2 -> 3"]),
        (
            "value: 0.2",
            "value: 0.3",
            ["parameters", "  ~ loss: 0.2 -> 0.3", "aspects", "  ~ lossy.probability: 0.2 -> 0.3"],
        ),
        ("delay: 1 s", "delay: 2 s", ["connections", "  ~ sum.output -> gain.input.delay: 1 s -> 2 s"]),
        ("stop: 10 s", "stop: 1 min", ["run", "  ~ run.stop: 10 s -> 60 s"]),
        ("take: count", "take: mean", ["metrics", "  ~ seen.take: count -> mean"]),
        (
            "output < 50",
            "output < 60",
            ["monitors", "  ~ small.property: always gain.output < 50 -> always gain.output < 60"],
        ),
        ("{type: Merge}", "{type: Merge, priority: 2}", ["actors", "  ~ sum.priority: none -> 2"]),
        ("signals: gain.output}", "signals: gain.output, style: line}", ["figures", "  ~ signal.style: none -> line"]),
        (
            "  lossy: {type: PacketLoss, probability",
            "  lost: {type: PacketLoss, probability",
            [
                "aspects",
                "  - lossy: type PacketLoss, at [gain.input], probability 0.2, spare_first false, from 0",
                "  + lost: type PacketLoss, at [gain.input], probability 0.2, spare_first false, from 0",
            ],
        ),
    ],
)
def test_a_change_is_found(
    old: str, new: str, lines: list[str], files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out = said(BEFORE.replace(old, new), capsys)
    assert (code, out.splitlines()[:-1]) == (1, lines)


def test_an_actor_less(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out = said(BEFORE.replace("count: 2", "count: 1").replace("clock[*].output", "clock[0].output"), capsys)
    rest = "new_period next cycle, reset_period false, late_trigger false"
    assert code == 1
    assert out.splitlines()[:2] == [
        "actors",
        f"  - clock[1]: type Clock, period 0.5, offset 0, offsets [0], {rest}",
    ]
    assert "  - clock[1].output -> sum.input" in out.splitlines()


def test_a_change_in_a_transition(files: Path) -> None:
    machine = (
        "model: m\nactors: {it: {type: StateMachine, modes: [a, b], transitions: [a -> b rate 3, b -> a after 2 s]}}\n"
    )
    Path("a.yaml").write_text(machine)
    Path("b.yaml").write_text(machine.replace("rate 3", "rate 3 / 2"))
    [change] = epicycle.diff("a.yaml", "b.yaml").changes
    assert (change.section, change.path, change.fact) == ("actors", "it", "transitions")
    assert [each["rate"] for each in change.after if "rate" in each] == ["3 / 2"]


def test_json_and_python(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("b.yaml").write_text(BEFORE.replace("factor: 2", "factor: 3"))
    assert main(["diff", "a.yaml", "b.yaml", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    change = {"section": "actors", "path": "gain", "what": "changed", "fact": "factor", "before": 2, "after": 3}
    assert found == {"models": ["line", "line"], "same": False, "changes": [change]}
    made = epicycle.diff("a.yaml", epicycle.load("b.yaml"))
    assert made
    assert made.to_dict() == found
    assert not epicycle.diff("a.yaml", "b.yaml", set={"gain.factor": 5})


def test_what_is_no_model_is_trouble(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", "a.yaml", "c.yaml"]) == 2
    assert capsys.readouterr().err == "error: there is no file c.yaml, did you mean 'a.yaml'?\n"


@pytest.mark.parametrize("name", sorted(packaged_models()))
def test_a_model_is_the_same_as_itself(name: str) -> None:
    assert str(epicycle.diff(name, name)) == f"{name} and {name} are the same model"
