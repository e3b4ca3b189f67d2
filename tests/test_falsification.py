"""The plants of falsification on the truth board: they do what is published, and margins are rtamt's."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks.truth import board, falsifying
from epicycle.runner.execution.results import Results

FOLDER = board.HERE / "falsification"
CASES = {case["monitor"]: case for case in board.source("falsification")["cases"] if "replay" in case}
SIGNALS = {
    "speed": "car.speed",
    "rpm": "car.rpm",
    "gear": "shift_logic.gear",
    "throttle": "throttle.output",
    "mu": "mu.output",
}
GAPS = {"front": ("first.place", "car[0].place"), "last": ("car[2].place", "car[3].place")}
SHIFT = (
    "always[0:30] (((not (gear == {0})) and (eventually[0.001:0.1] (gear == {0}))) implies "
    "(eventually[0.001:0.1] (always[0:2.5] (gear == {0}))))"
)
# The requirements as rtamt writes them, over the names above.
REQUIREMENTS = {
    "AT1": "always[0:20] (speed < 120)",
    "AT2": "always[0:10] (rpm < 4750)",
    **{f"AT5{gear}": SHIFT.format(gear) for gear in range(1, 5)},
    "AT6a": "(always[0:30] (rpm / 3000 < 1)) implies (always[0:4] (speed / 35 < 1))",
    "AT6b": "(always[0:30] (rpm / 3000 < 1)) implies (always[0:8] (speed / 50 < 1))",
    "AT6c": "(always[0:30] (rpm / 3000 < 1)) implies (always[0:20] (speed / 65 < 1))",
    "CC1": "always[0:100] (last <= 40)",
    "CC2": "always[0:70] (eventually[0:30] (last >= 15))",
    "CC3": "always[0:80] ((always[0:20] (front <= 20)) or (eventually[0:20] (last >= 40)))",
    "CC4": "always[0:65] (eventually[0:30] (always[0:5] (last >= 8)))",
    "AFC27": (
        "always[11:50] ((((throttle < 8.8) and (eventually[0:0.05] (throttle > 40))) or "
        "((throttle > 40) and (eventually[0:0.05] (throttle < 8.8)))) implies (always[1:5] (abs(mu) < 0.008)))"
    ),
    "AFC29": "always[11:50] (abs(mu) < 0.007)",
    "AFC33": "always[11:50] (abs(mu) < 0.007)",
    "CC5": "always[0:72] (eventually[0:8] ((always[0:5] (front >= 9)) implies (always[5:20] (last >= 9))))",
}


def latest(found: Results, name: str) -> dict[float, float]:
    """The values of a signal by their times, the last one where there are several."""
    signal = found[name]
    return {round(float(time), 9): float(value) for time, value in zip(signal.times, signal.tokens, strict=True)}


def signals(found: Results, requirement: str, until: float) -> dict[str, list[list[float]]]:
    """What a requirement is about: times and values, up to the end."""
    values = {name: latest(found, port) for name, port in SIGNALS.items() if name in requirement}
    for name, ports in GAPS.items():
        if name in requirement:
            before, after = (latest(found, port) for port in ports)
            values[name] = {time: after[time] - before[time] for time in before}
    for each in values.values():
        each.setdefault(float(until), each[max(each)])
    return {name: [list(pair) for pair in sorted(each.items())] for name, each in values.items()}


def robustness(requirement: str, values: dict[str, list[list[float]]]) -> float:
    """What rtamt finds at time 0, in dense time."""
    rtamt = pytest.importorskip("rtamt")
    specification: Any = rtamt.StlDenseTimeSpecification()
    for name in (*values, "out"):
        specification.declare_var(name, "float")
    specification.spec = f"out = {requirement}"
    specification.parse()
    found = specification.evaluate(*([name, pairs] for name, pairs in values.items()))
    return float(found[0][1])


@pytest.mark.slow
@pytest.mark.parametrize("monitor", REQUIREMENTS)
def test_robustness_is_that_of_rtamt(monitor: str) -> None:
    pytest.importorskip("rtamt")
    case, requirement = CASES[monitor], REQUIREMENTS[monitor]
    for example in falsifying.counterexamples(FOLDER)[monitor]:
        found = falsifying.replayed(FOLDER / f"{case['replay']}.yaml", case, example)
        theirs = robustness(requirement, signals(found, requirement, case["until"]))
        assert theirs == pytest.approx(example["rtamt"], abs=falsifying.EQUAL)
        assert found.metrics[f"{monitor}_robustness"] == pytest.approx(theirs, abs=falsifying.EQUAL)


@pytest.mark.slow
@pytest.mark.parametrize("monitor", ["AT2", "AT54", "CC1", "AFC33"])
def test_what_is_published_is_found(monitor: str) -> None:
    case = CASES[monitor]
    for told in falsifying.replays(FOLDER / f"{case['replay']}.yaml", case):
        assert told[3], told


@pytest.mark.slow
def test_what_differs_is_told() -> None:
    """With a coarser step AFC33 is broken by 5e-5 more."""
    case = {**CASES["AFC33"], "set": {"step": "5 ms"}, "until": 12}
    least, robust = falsifying.replays(FOLDER / "fuel_control.yaml", case)
    assert least[:4] == ("least robustness of AFC33", "-0.0001098; to 2e-05", "-0.0001651", False)
    asked = "robustness of AFC33 with our inputs, by rtamt"
    assert robust[:4] == (asked, "-0.0001203, -0.0001197", "4.5e-05 away", False)


@pytest.mark.slow
def test_a_search_of_the_board(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(falsifying, "OF", 1)
    case = {
        "search": "transmission", "monitor": "AT2", "vary": {"throttle": "0..100", "brake": "0..350"}, "until": "7 s",
        "published": {"found": 1, "mean": 9.22},
    }  # fmt: skip
    falsified, runs = falsifying.searches(FOLDER / "transmission.yaml", case, tmp_path, 1)
    assert falsified[:4] == ("AT2 falsified", "1 of 1 searches", "1 of 1 searches", True)
    assert runs[0] == "mean number of runs until AT2 is broken"
    assert runs[3]
