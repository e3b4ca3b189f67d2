"""Calibration: known parameters from measured signals, how sure they are, resuming, and what is said of bad data."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import epicycle
from epicycle.actors import EpicycleError, random_stream
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.interface.cli import main
from epicycle.runner.support.apart import WorkerError

OSCILLATOR = """
model: oscillator
parameters:
  frequency: {value: 1 Hz, unit: Hz}
  damping: 0.1
  start: {value: 1, unit: m}
  n: 1
actors:
  clock: {type: Clock, period: 0.05 s}
  mass:
    type: ODE
    initial: {place: "${start}", speed: 0}
    derivatives:
      place: speed
      speed: "-(2 * pi * ${frequency}) ** 2 * place - 2 * ${damping} * 2 * pi * ${frequency} * speed"
  show: {type: Scale, factor: "${n}"}
connections: [clock.output -> mass.trigger, mass.place -> show.input]
run: {stop: 3 s}
"""
TRUE = {"frequency": 1.3, "damping": 0.08, "start": 0.7}
VARY = {"frequency": "0.5 Hz..3 Hz", "damping": "0.01..0.5", "start": "0.1 m..2 m"}
LINE = """
model: line
parameters: {slope: 1.0, offset: 0.0, other: 0.0}
actors:
  clock: {type: Clock, period: 1 s}
  f: {type: Expression, expression: "(${slope}) * time + (${offset}) + 0 * (${other}) + 0 * tick"}
connections: [clock.output -> f.tick]
run: {stop: 20 s}
"""


def test_parameters_are_not_fitted_to_two_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path("line.yaml")
    path.write_text(LINE, encoding="utf-8")
    match = {"f.output": measured([1.0, 2.0, 3.0], [1.0, 2.0, 3.0])}
    run = Simulation.run

    def changing(*given: Any, **more: Any) -> Any:
        """The run, while somebody edits its model."""
        path.write_text(LINE.replace("0 * tick", "1 * tick"), encoding="utf-8")
        return run(*given, **more)

    monkeypatch.setattr(Simulation, "run", changing)
    with pytest.raises(WorkerError, match=r"^line\.yaml changed while runs were made, and the next ones would be of"):
        epicycle.search("line.yaml", epicycle.Match(match), vary={"slope": "0.5..3"}, jobs=1)


def place(time: float) -> float:
    """Of the oscillator with the true parameters."""
    w, z = 2 * math.pi * TRUE["frequency"], TRUE["damping"]
    wd = w * math.sqrt(1 - z * z)
    return TRUE["start"] * math.exp(-z * w * time) * (math.cos(wd * time) + z * w / wd * math.sin(wd * time))


def measured(times: list[float], values: list[float], file: str = "measured.csv") -> str:
    rows = "".join(f"{time!r},{value!r}\n" for time, value in zip(times, values, strict=True))
    Path(file).write_text(f"time,value\n{rows}", encoding="utf-8")
    return file


@pytest.fixture(autouse=True)
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("oscillator.yaml").write_text(OSCILLATOR, encoding="utf-8")
    Path("line.yaml").write_text(LINE, encoding="utf-8")


def noise(seed: int, count: int, deviation: float) -> list[float]:
    stream = random_stream(seed, "noise")
    return [float(stream.normal(0.0, deviation)) for _ in range(count)]


TIMES = [round(0.05 * each, 9) for each in range(61)]


def oscillator(match: object = None, **more: Any) -> epicycle.Calibration:
    goal = epicycle.Match(match or {"mass.place": "measured.csv"})
    return epicycle.search("./oscillator.yaml", goal, **{"vary": VARY, "jobs": 1, **more})


@pytest.mark.slow  # the same with noise: in every run
def test_a_damped_oscillator_without_noise() -> None:
    measured(TIMES, [place(time) for time in TIMES])
    found = oscillator()
    for each in found.parameters:
        assert each.value == pytest.approx(TRUE[each.path], rel=1e-4)
        assert not each.at_end
    assert found.best["damping"] == found.parameters[1].value
    assert str(found.best["frequency"]).endswith(" Hz")
    assert found.matches[0].rms < 1e-4


@pytest.mark.slow
def test_a_damped_oscillator_with_noise_is_resumed_and_saved(capsys: pytest.CaptureFixture[str]) -> None:
    gaps = noise(1, len(TIMES), 0.01)
    measured(TIMES, [place(time) + gap for time, gap in zip(TIMES, gaps, strict=True)])
    words = [
        "--match",
        "mass.place=measured.csv",
        *(word for each in VARY.items() for word in ("--vary", "=".join(each))),
    ]
    assert main(["search", "./oscillator.yaml", *words, "--out", "out", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    for each in facts["parameters"]:
        assert each["low"] < TRUE[each["path"]] < each["high"]
        assert each["error"] < 0.02
    assert facts["matches"][0]["rms"] == pytest.approx(0.01, rel=0.25)
    [tried] = Path("out").glob("tried-*.jsonl")
    lines = tried.read_text().splitlines(keepends=True)
    tried.write_text("".join(lines[: len(lines) // 2]))  # as if it had been killed
    assert main(["search", "./oscillator.yaml", *words, "--out", "out", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == facts
    assert tried.read_text().splitlines(keepends=True) == lines
    assert main(["run", "./oscillator.yaml", "--overrides", "out/parameters.yaml"]) == 0
    rows = Path("out/residuals.csv").read_text().splitlines()
    assert rows[0] == "signal,time,measured,modelled,residual"
    assert len(rows) == 62


def test_a_line_has_the_values_and_errors_of_linear_regression() -> None:
    times = [float(each) for each in range(21)]
    values = [2 * time - 3 + gap for time, gap in zip(times, noise(2, 21, 0.5), strict=True)]
    measured(times, values)
    vary = ["slope=-10..10", "offset=-10..10"]
    found = epicycle.search("./line.yaml", epicycle.Match("f.output=measured.csv"), vary=vary)
    design = np.array([times, [1.0] * 21]).T
    expected, [squares], *_ = np.linalg.lstsq(design, np.array(values))
    errors = np.sqrt(np.diag(np.linalg.inv(design.T @ design)) * squares / 19)
    quantile = 2.0930240544  # Student, 19
    for each, value, error in zip(found.parameters, expected, errors, strict=True):
        assert each.value == pytest.approx(value, abs=1e-5)
        assert each.error == pytest.approx(error, rel=1e-4)
        assert each.high - each.value == pytest.approx(quantile * error, rel=1e-4)
    assert found.agreeing == found.starts == 3


@pytest.mark.slow
def test_intervals_hold_the_truth_nineteen_times_of_twenty() -> None:
    times = [float(each) for each in range(21)]
    hits = 0
    for seed in range(40):
        measured(times, [2 * time - 3 + gap for time, gap in zip(times, noise(seed, 21, 0.5), strict=True)])
        found = epicycle.search(
            "./line.yaml", epicycle.Match("f.output=measured.csv"), vary={"slope": "0..5"}, set={"offset": -3}
        )
        [slope] = found.parameters
        hits += slope.low < 2 < slope.high
    assert hits >= 34  # of 40 that each hold it with 95 %: fewer in 1 of 500 cases


def test_what_the_data_do_not_tell() -> None:
    times = [float(each) for each in range(21)]
    measured(times, [2 * time for time in times])
    vary = {"slope": "0..5", "other": "0..1"}
    found = epicycle.search("./line.yaml", epicycle.Match("f.output=measured.csv"), vary=vary)
    assert "These data do not tell other: other values fit as well." in found.sentence
    assert [math.isinf(each.error) for each in found.parameters] == [False, True]


def test_an_end_of_a_range_and_residuals_with_a_pattern_are_told() -> None:
    times = [float(each) for each in range(21)]
    measured(times, [2 * time + math.sin(time / 2) for time in times])
    found = epicycle.search("./line.yaml", epicycle.Match("f.output=measured.csv"), vary={"slope": "0..1.5"})
    assert "slope is at the end of its range: the best may lie beyond, and its interval says little." in found.sentence
    assert "The residuals of f.output are no independent errors (correlation of neighbours 0." in found.sentence


def test_between_tokens_a_signal_holds_or_is_linear() -> None:
    times = [each + 0.5 for each in range(20)]
    measured(times, [3 * time for time in times])
    for linear, offset in ((True, 0.0), (False, 1.5)):
        vary = ["slope=0..5", "offset=-5..5"]
        found = epicycle.search(
            "./line.yaml", epicycle.Match("f.output=measured.csv", between="linear" if linear else "hold"), vary=vary
        ).best
        assert found == {"slope": pytest.approx(3, abs=1e-4), "offset": pytest.approx(offset, abs=1e-3)}


@pytest.mark.slow
def test_several_signals_of_one_table() -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {"time": TIMES, "mass.place": list(map(place, TIMES)), "show.output": [2 * place(each) for each in TIMES]}
    pq.write_table(pa.table(columns), "both.parquet")
    match = {"mass.place": "both.parquet", "show.output": "both.parquet"}
    found = oscillator(match=match, vary={"start": "0.1 m..2 m"}, set={"frequency": "1.3 Hz", "damping": 0.08, "n": 2})
    assert found.parameters[0].value == pytest.approx(0.7, rel=1e-5)
    assert [each.signal for each in found.matches] == ["mass.place", "show.output"]


@pytest.mark.parametrize(
    ("text", "match", "vary", "told"),
    [
        ("time,value\n0,1\n1,x\n", "", "", "error: m.csv: row 2: value is 'x', expected a number\n"),
        ("time,value\n0,1\n1,\n", "", "", "error: m.csv: row 2: value is empty, expected a number\n"),
        ("time,value\n0,1\n-1,2\n", "", "", "error: m.csv: row 2: time is -1, expected 0 to 1e+09 s\n"),
        ("time,value\n", "", "", "error: m.csv has no rows\n"),
        (
            "time,a,b\n0,1,2\n",
            "",
            "",
            "error: m.csv has the columns time, a, b\n   help: it needs 'time' and 'value', or 'mass.place'\n",
        ),
        ("time,value\n0,1\n", "", "", "error: 1 measured values cannot tell 1 parameters: more are needed\n"),
        (
            "time,value\n0,1\n9,1\n",
            "",
            "",
            "error: damping=0.24288973743480535: the run ends at 3.0 s, before the last measured value at 9.0 s\n",
        ),
        ("", "mass.place=none.csv", "", "error: none.csv cannot be read: No such file or directory\n"),
        ("", "mass.place=m.txt", "", "error: --match mass.place=m.txt: 'm.txt' must end in .csv or .parquet\n"),
        ("", "mass.place", "", "error: --match mass.place: write signal=file.csv\n"),
        ("", "mass.*=m.csv", "", "error: --match mass.*=m.csv: give one output port, not a pattern\n"),
        (
            "time,value\n0,1\n1,2\n",
            "mass.plac=m.csv",
            "",
            (
                "command line:1:9: error: record: 'mass.plac' matches no output port, did you mean 'mass.place'?\n"
                "    1 | --match mass.plac\n"
                "      |         ^^^^^^^^^\n"
                "   help: valid ports of mass: place, speed\n"
            ),
        ),
        ("", "", "damping=[0.1, 0.2]", "error: 'damping' has no range of real numbers, which least squares need\n"),
    ],
)
def test_messages(text: str, match: str, vary: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("m.csv").write_text(text, encoding="utf-8")
    words = ["--match", match or "mass.place=m.csv", "--vary", vary or "damping=0.01..0.5"]
    assert main(["search", "./oscillator.yaml", *words, "--out", "out"]) == 2
    assert capsys.readouterr().err == told


def test_there_must_be_something_to_match_and_to_vary(capsys: pytest.CaptureFixture[str]) -> None:
    measured([0.0, 1.0], [1.0, 2.0])
    with pytest.raises(EpicycleError) as caught:
        epicycle.search("./oscillator.yaml", epicycle.Match([]), vary={"damping": "0.01..0.5"})
    assert str(caught.value) == "there is nothing to match\n   help: add --match server.size=measured.csv"
    assert main(["search", "./oscillator.yaml", "--match", "mass.place=measured.csv"]) == 2
    assert capsys.readouterr().err == ("error: there is nothing to vary\n   help: add --vary load=0.5..0.9\n")
