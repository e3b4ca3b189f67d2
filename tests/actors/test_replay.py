"""Replay of recorded tables."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pyarrow as arrow
import pytest
from pyarrow import parquet

from epicycle.runner.execution.engine import ActorError, Simulation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.problems import ModelError
from tests.engine.engine_parts import sends


def replay(folder: Path, table: str | dict[str, list[Any]], options: str = "") -> list[Any]:
    """Time, microstep and token of all that is sent for a table."""
    name = "t.csv" if isinstance(table, str) else "t.parquet"
    if isinstance(table, str):
        (folder / name).write_text(table, encoding="utf-8")
    else:
        parquet.write_table(arrow.table(table), folder / name)
    model = folder / "m.yaml"
    model.write_text(f"model: m\nactors:\n  it: {{type: Replay, file: {name}{options}}}\n", encoding="utf-8")
    results = Simulation(load_model(model), keep_log=True).run()
    return [(time, microstep, token) for time, microstep, _, token in sends(results)]


@pytest.mark.parametrize(
    ("table", "options", "expected"),
    [
        ("time,x\n0,1\n0.5,2\n0.5,3\n", "", [(0, 1, 1), (0.5, 1, 2), (0.5, 2, 3)]),
        ("time,x\n0,1.5\n1,\n2,2.5\n", "", [(0, 1, 1.5), (2, 1, 2.5)]),
        ("time,x,y\n0,1,a\n1,,b\n", "", [(0, 1, {"x": 1, "y": "a"}), (1, 1, {"x": None, "y": "b"})]),
        ("y,t,x\na,0,true\nb,1,false\n", ", time: t, columns: x", [(0, 1, True), (1, 1, False)]),
        ("time,x\n", "", []),
        ({"time": [0.25, 1.0], "x": [[1, 2], [3]]}, "", [(0.25, 1, [1, 2]), (1, 1, [3])]),
    ],
)
def test_rows_come_at_their_times(
    tmp_path: Path, table: str | dict[str, list[Any]], options: str, expected: list[Any]
) -> None:
    assert replay(tmp_path, table, options) == expected


@pytest.mark.parametrize(
    ("table", "options", "message"),
    [
        ("time,x\n1,1\n0.5,2\n", "", "row 2: time is 0.5, which is before the row above"),
        ("time,x\n-1,1\n", "", "row 1: time is -1, expected a time in s >= 0"),
        ("time,x\nsoon,1\n", "", "row 1: time is 'soon', expected a time in s >= 0"),
        ("time,x\n0,1\n,1\n", "", "row 2: time is empty, expected a time in s >= 0"),
        ("time,x\n0,1\ninf,1\n", "", "row 2: time is inf, expected a time in s >= 0"),
        ("times,x\n0,1\n", "", "it has no column 'time', did you mean 'times'?; columns: times, x"),
        ("time,x\n0,1\n", ", columns: [x, weight]", "it has no column 'weight'; columns: time, x"),
        ("time\n0\n", "", "it has no column of values, only 'time'"),
        ("time,x,x\n0,1,2\n", "", "two of its columns have the same name: time, x, x"),
        ("time,x\n0,1,2\n", "", "CSV parse error: Expected 2 columns, got 3: 0,1,2"),
        ("", "", "Empty CSV file"),
    ],
)
def test_wrong_tables(tmp_path: Path, table: str, options: str, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        replay(tmp_path, table, options)
    assert caught.value.reason == f"{tmp_path / 't.csv'} cannot be replayed: {message}"
    assert caught.value.doing == "initialize()"


def test_wrong_files(tmp_path: Path) -> None:
    (tmp_path / "t.parquet").write_bytes(b"PAR1 this is no table PAR1")
    (tmp_path / "t.txt").write_text("time,x\n")
    model = tmp_path / "m.yaml"
    model.write_text("model: m\nactors: {it: {type: Replay, file: t.parquet}}\n")
    with pytest.raises(ActorError, match=r"t\.parquet cannot be replayed: Could not open Parquet input source"):
        Simulation(load_model(model)).run()
    model.write_text("model: m\nactors: {it: {type: Replay, file: t.txt}}\n")
    with pytest.raises(ModelError) as caught:
        load_model(model)
    assert [problem.message for problem in caught.value.problems] == ["it: file: 't.txt' must end in .csv or .parquet"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_a_pipe_does_not_hold_us_up(tmp_path: Path) -> None:
    """A file may have become another one since the model was checked."""
    (tmp_path / "t.csv").write_text("time,x\n0,1\n")
    (tmp_path / "m.yaml").write_text("model: m\nactors: {it: {type: Replay, file: t.csv}}\n")
    model = load_model(tmp_path / "m.yaml")
    (tmp_path / "t.csv").unlink()
    os.mkfifo(tmp_path / "t.csv")
    with pytest.raises(ActorError) as caught:
        Simulation(model).run()
    assert caught.value.reason == (f"{tmp_path / 't.csv'} cannot be replayed: it is a named pipe, not a regular file")
