"""The plants of falsification on the truth board: published inputs do what is published, and margins are rtamt's."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import pytest

from benchmarks.truth import board, falsifying
from epicycle.runner.execution.results import Results

FOLDER = board.HERE / "falsification"
CASES = {case["monitor"]: case for case in board.source("falsification")["cases"] if "replay" in case}
# The requirements as rtamt writes them, over the names of ports below.
REQUIREMENTS = {
    "AT1": "always[0:20] (speed < 120)",
    "AT2": "always[0:10] (rpm < 4750)",
    "AT6a": "(always[0:30] (rpm / 3000 < 1)) implies (always[0:4] (speed / 35 < 1))",
    "AT6b": "(always[0:30] (rpm / 3000 < 1)) implies (always[0:8] (speed / 50 < 1))",
    "AT6c": "(always[0:30] (rpm / 3000 < 1)) implies (always[0:20] (speed / 65 < 1))",
    "CC1": "always[0:100] (last <= 40)",
    "CC2": "always[0:70] (eventually[0:30] (last >= 15))",
    "CC3": "always[0:80] ((always[0:20] (front <= 20)) or (eventually[0:20] (last >= 40)))",
    "CC4": "always[0:65] (eventually[0:30] (always[0:5] (last >= 8)))",
    "CC5": "always[0:72] (eventually[0:8] ((always[0:5] (front >= 9)) implies (always[5:20] (last >= 9))))",
}
STEP = {"AT": 0.01, "CC": 0.05}


def signals(found: Results, monitor: str) -> dict[str, list[float]]:
    """What the requirements are about, at each step."""
    step = STEP[monitor[:2]]
    number = round(CASES[monitor]["until"] / step) + 1

    def sampled(name: str) -> list[float]:
        times = [round(float(each), 9) for each in found[name].times]
        return [float(found[name].tokens[bisect_right(times, round(k * step, 9)) - 1]) for k in range(number)]

    if monitor.startswith("AT"):
        return {"rpm": sampled("car.rpm"), "speed": sampled("car.speed")}
    places = [sampled(name) for name in ("first.place", "car[0].place", "car[2].place", "car[3].place")]
    return {
        "front": [second - first for first, second in zip(*places[:2], strict=True)],
        "last": [second - first for first, second in zip(*places[2:], strict=True)],
    }


def robustness(requirement: str, values: dict[str, list[float]], step: float) -> float:
    """What rtamt finds at the first sample."""
    rtamt = pytest.importorskip("rtamt")
    specification: Any = rtamt.StlDiscreteTimeSpecification()
    for name in values:
        specification.declare_var(name, "float")
    specification.spec = f"out = {requirement}"
    specification.declare_var("out", "float")
    specification.set_sampling_period(round(step * 1000), "ms", 0.1)
    specification.parse()
    number = len(next(iter(values.values())))
    found = specification.evaluate({"time": [k * step for k in range(number)], **values})
    return float(found[0][1])


@pytest.mark.slow
@pytest.mark.parametrize("monitor", REQUIREMENTS)
def test_margins_are_those_of_rtamt(monitor: str) -> None:
    pytest.importorskip("rtamt")
    case = CASES[monitor]
    if monitor.startswith("CC"):
        case = {**case, "set": {"step": STEP["CC"]}}
    file = FOLDER / f"{case['replay']}.yaml"
    for example in falsifying.counterexamples(FOLDER)[monitor]:
        found = falsifying.replayed(file, case, example)
        theirs = robustness(REQUIREMENTS[monitor], signals(found, monitor), STEP[monitor[:2]])
        assert found.metrics[f"{monitor}_robustness"] == pytest.approx(theirs, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("monitor", ["AT2", "AT54", "CC1"])
def test_published_inputs_do_what_is_published(monitor: str) -> None:
    case = CASES[monitor]
    told = falsifying.replays(FOLDER / f"{case['replay']}.yaml", case)
    assert told[3], told


@pytest.mark.slow
def test_a_search_of_the_board(tmp_path: Any) -> None:
    case = {
        "search": "transmission", "monitor": "AT2", "vary": {"throttle": "0..100", "brake": "0..350"}, "until": "7 s",
        "searches": 1, "published": {"found": 50, "mean": 9.22},
    }  # fmt: skip
    falsified, runs = falsifying.searches(FOLDER / "transmission.yaml", case, tmp_path, 1)
    assert falsified[:4] == ("AT2 falsified", "50 of 50 searches", "1 of 1 searches", True)
    assert runs[0] == "mean number of runs until AT2 is broken"
    assert runs[3]
