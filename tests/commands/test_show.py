"""`epicycle describe` and `epicycle compare`: what a model offers, and how its variants differ."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner.interface.cli import main

MODEL = """\
model: m
doc: A clock.
parameters:
  period: {value: 500 ms, unit: s, min: 0.1, max: 2, doc: between two ticks}
  loud: {value: true, doc: whether it rings}
  mode: {value: quick, choices: [quick, slow], doc: how}
  share: {value: 0.5, unit: "1", max: 1}
actors:
  clock: {type: Clock, period: "${period}", values: ["${loud}", "${mode}", "${share}"]}
run: {stop: 4 s, record: [clock.output]}
metrics: {ticks: {of: clock.output, take: count, doc: how many}}
figures: {ticks: {type: TimeSeries, signals: clock.output}}
"""


@pytest.fixture(autouse=True)
def _model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.yaml").write_text(MODEL)


def printed(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> str:
    assert main([*arguments]) == code
    return "".join(f"{line.rstrip()}\n" for line in capsys.readouterr().out.splitlines())


def test_a_model_shows_what_it_offers(capsys: pytest.CaptureFixture[str]) -> None:
    monitors = "monitors: {alive: {property: eventually sends clock.output, doc: it ticks}}\n"
    Path("m.yaml").write_text(MODEL + monitors)
    assert (
        printed(capsys, "describe", "m.yaml", "--set", "share=0.25")
        == """\
m: A clock.
1 actor, 0 connections, 0 aspects, stops at 4 s

parameter  type                    unit  value  what it is
period     number >= 0.1 and <= 2  s     0.5    between two ticks
loud       true or false                 yes    whether it rings
mode       one of quick, slow            quick  how
share      number <= 1                   0.25

metric  takes                  unit  what it is
ticks   count of clock.output        how many

monitor  property                       unit  what it is
alive    eventually sends clock.output        it ticks

figure  type
ticks   TimeSeries

records: clock.output

reads: m.yaml
"""
    )


def test_programs_are_shown_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    found: dict[str, Any] = json.loads(printed(capsys, "describe", "collision_avoidance", "--json"))
    assert {"parameter": "measurement_range", "type": "number >= 0", "unit": "m", "value": "30"}.items() <= next(
        each for each in found["parameters"] if each["parameter"] == "measurement_range"
    ).items()
    assert [each["disturbance"] for each in found["disturbances"]] == [
        "gps_drift", "range_limited", "robot_crash", "sensor_dropout_burst", "shared_radio", "slow_controller",
        "wifi_burst",
    ]  # fmt: skip
    assert [Path(each).name for each in found["reads"]] == ["collision_avoidance.yaml", "mobile_robot.yaml"]


@pytest.mark.slow
def test_variants_are_compared(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("compare", "m.yaml", "--vary", "period=1 s", "--replications", "2", "--seed", "5")
    assert (
        printed(capsys, *words)
        == """\
m: none, period=1 s; seeds 5 to 6

metric  variant     mean  unit  difference from none  p (Holm)  runs
ticks   none        9                                           2
ticks   period=1 s  5           -4                    0.5       2
wrote results/m/comparison/comparison.json
wrote results/m/comparison/comparison.csv
"""
    )
    found = json.loads(printed(capsys, *words, "--json"))
    assert found["seeds"] == [5, 6]
    variants = {"none": {}, "period=1 s": {"set": ["period=1 s"]}}
    same = epicycle.compare("m.yaml", variants, replications=2, seed=5).differences()  # type: ignore[arg-type]
    assert [each["metric"]["value"] for each in found["differences"]] == [each.metric.value for each in same]
    assert found["differences"][0]["p"] is None


def test_a_variant_may_have_several_parameters(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("compare", "m.yaml", "--vary", "period=1 s, share=0.25", "--replications", "1", "--json")
    found = json.loads(printed(capsys, *words))
    assert [(each["variant"], each["metric"]["value"]) for each in found["differences"]] == [
        ("none", 9),
        ("period=1 s, share=0.25", 5),
    ]


@pytest.mark.parametrize("text", ["period=1 s share=0.25", "period=0.5 share=0.25"])
def test_parameters_without_a_comma_are_told(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "m.yaml", "--vary", text]) == 2
    assert capsys.readouterr().err == (
        f"command line:1:8: error: {text!r} sets more than one parameter without a comma between them\n"
        f"    1 | --vary {text}\n      |        {'^' * len(text)}\n   help: write load=0.9,servers=2\n"
    )


@pytest.mark.slow
def test_the_same_in_several_processes(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("compare", "mm1", "--vary", "load=0.5", "--vary", "load=0.6", "--replications", "3", "--until", "500")
    for more in ((), ("--json",)):
        one, two = (printed(capsys, *words, *more, "--jobs", jobs) for jobs in ("1", "2"))
        assert one == two
    changes: Any = {"a": {"set": {"load": 0.5}}, "b": {"set": {"load": 0.6}}}
    here, there = (epicycle.compare("mm1", changes, replications=2, until=500, jobs=jobs) for jobs in (1, 2))
    assert here.rows() == there.rows()
    for name, runs in here.runs.items():
        for seed, results in runs.items():
            assert (results.digest, results.events) == (there.runs[name][seed].digest, there.runs[name][seed].events)
    made = epicycle.load("mm1")
    made.stop = 100.0  # which no other process knows
    with pytest.raises(EpicycleError, match="variant a cannot be made in other processes"):
        epicycle.compare("mm1", {"a": made, "b": {}}, jobs=2)
    with pytest.raises(EpicycleError, match=r"^jobs: '0' is not a whole number from 1 to 1e9$"):
        epicycle.compare("mm1", changes, jobs=0)


def test_what_cannot_be_compared_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "m.yaml"]) == 2
    assert capsys.readouterr().err == "error: a comparison needs at least two variants\n"
    assert main(["compare", "m.yaml", "--disturb", "none", "--disturb", "nothing"]) == 2
    assert capsys.readouterr().err.startswith("error: there is no packaged disturbance 'nothing'\n")


def test_runs_that_fail_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    inverse = '  inverse: {type: Expression, expression: "1 / x"}\nconnections: [clock.output -> inverse.x]\nrun'
    text = MODEL.replace('"${loud}", "${mode}", "${share}"', '"${share}"').replace("run", inverse, 1)
    Path("m.yaml").write_text(
        "".join(line for line in text.splitlines(True) if "loud" not in line and "mode:" not in line)
    )
    words = ["compare", "m.yaml", "--vary", "share=0", "--replications", "1", "--jobs"]
    assert main([*words, "2"]) == 1
    printed = capsys.readouterr()
    assert main([*words, "1"]) == 1
    assert capsys.readouterr() == printed
    assert printed.out.startswith("m: none, share=0; seed 0; 1 run failed\n")
    assert printed.err == (
        "error: share=0, seed 0: inverse failed in fire() at (0 s, 1): '1 / x': 1 / x divides by zero, with x = 0.0\n"
        "   declared at m.yaml:8:3\n"
    )
