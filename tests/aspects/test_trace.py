"""Losses and delays that are replayed from measured traces."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as arrow
import pytest
from pyarrow import parquet

from epicycle.actors import EpicycleError
from epicycle.aspects import TraceReplay
from epicycle.aspects.trace import MOST
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.text.problems import ModelError
from tests.aspects.bench import Bench
from tests.engine.engine_parts import Probe, Ticker, seen

TABLE = "time,lost,delay\n0,0,2\n1,1,\n2,0,0\n3,0,2500\n"


def file_of(folder: Path, table: str | dict[str, list[Any]]) -> Path:
    file = folder / ("t.csv" if isinstance(table, str) else "t.parquet")
    if isinstance(table, str):
        file.write_text(table, encoding="utf-8")
    else:
        parquet.write_table(arrow.table(table), file)
    return file


@pytest.mark.parametrize(
    ("table", "columns"),
    [
        (TABLE, {}),
        ("received,delay\n1,2\n0,\n1,0\n1,2500\n", {}),
        ("received,delay\ntrue,2\nfalse,7\ntrue,0\ntrue,2500\n", {}),
        ('delay\n2\n""\n0\n2500\n', {}),
        ("rtt,n\n2500,9\n0,8\n2,6\n3,8\n", {"delay": "rtt", "sequence": "n"}),  # in any order, the second 8 a copy
        ("rtt,n\n2500,2\n0,1\n2,7\n3,1\n", {"delay": "rtt", "sequence": "n", "wraps": 8}),
        ({"lost": [False, True, False, False], "delay": [2, None, 0, 2500]}, {}),
        ({"n": [4, 6, 7], "delay": [2.0, 0.0, 2500.0], "data": ["x", "y", "z"]}, {"sequence": "n"}),
    ],
)
def test_each_message_has_the_fate_of_its_row(tmp_path: Path, table: Any, columns: dict[str, str]) -> None:
    aspect = TraceReplay(file=file_of(tmp_path, table), delay_unit="ms", **columns)
    bench = Bench(aspect).play("abcdefgh", period=1000)
    a_to_d = [(2.0, "a"), (2000.0, "c"), (5500.0, "d")]
    assert bench.passed == sorted([*a_to_d, *((time + 4000.0, chr(ord(each) + 4)) for time, each in a_to_d)])
    assert bench.told[:3] == [("delayed", ["a", 0.002]), ("dropped", "b"), ("delayed", ["d", 2.5])]


def test_the_end_of_a_trace(tmp_path: Path) -> None:
    file = file_of(tmp_path, "lost\n1\n0\n")
    assert Bench(TraceReplay(file=file)).play("abcde").tokens == ["b", "d"]
    assert Bench(TraceReplay(file=file, at_end="pass")).play("abcde").tokens == ["b", "c", "d", "e"]
    results = Simulation(made(tmp_path, MODEL.replace("it: {", "it: {at_end: stop, "), "lost\n1\n0\n")).run()
    assert (results.stopped, results.end) == ("aspect it", 2.0)
    assert results.aspects["it"] == {"dropped": 1, "delayed": 0}


def test_rows_by_time(tmp_path: Path) -> None:
    """A row is valid until the next one, the last for as long as the one before; the first row is time 0."""
    file = file_of(tmp_path, "time,lost\n1700000000.0,0\n1700000000.5,1\n1700000001.5,0\n")
    lost = [5, 6, 7, 8, 9, 10, 11, 12, 13, 14]  # tenths of a second; the trace is 2.5 s long
    bench = Bench(TraceReplay(file=file, by="time")).play(range(50), period=100)
    assert bench.of("dropped") == [*lost, *(each + 25 for each in lost)]
    bench = Bench(TraceReplay(file=file, by="time", at_end="pass")).play(range(50), period=100)
    assert bench.of("dropped") == lost


@pytest.mark.parametrize("by", ["token", "time"])
def test_places_begin_anywhere_in_the_trace(tmp_path: Path, by: str) -> None:
    rows = np.random.default_rng(1).random(100) < 0.5
    file = file_of(tmp_path, {"time": np.arange(100.0), "lost": rows})
    starts = set()
    for seed in range(40):
        bench = Bench(TraceReplay(file=file, by=by, start="random"), seed).play(range(100), period=1000)
        lost = np.ones(100, bool)
        lost[bench.tokens] = False
        starts |= {shift for shift in range(100) if (np.roll(rows, -shift) == lost).all()}
    assert len(starts) > 25


MODEL = """
model: m
actors:
  a: {type: Ticker, limit: 8}
  probe: {type: Probe}
connections: [a.output -> probe.input]
aspects:
  it: {type: TraceReplay, file: trace.csv, delay_unit: ms, at: probe.input}
"""


def made(folder: Path, model: str = MODEL, table: str = TABLE) -> Model:
    (folder / "trace.csv").write_text(table)
    (folder / "m.yaml").write_text(model)
    return load_model(folder / "m.yaml", types=[Ticker, Probe])


def test_a_run_goes_on_from_a_snapshot_in_the_middle_of_the_trace(tmp_path: Path) -> None:
    model = made(tmp_path)
    whole = Simulation(model, seed=1)
    digest = whole.run().digest
    assert [time for time, _, _ in seen(whole)] == [0.002, 2.0, 4.002, 5.5, 6.0, 9.5]
    part = Simulation(model, seed=1)
    part.advance(3.0)  # the fourth is on its way
    snapshot = part.snapshot()
    assert part.run().digest == digest
    other = Simulation(model, seed=1)
    other.restore(snapshot)
    assert other.run().digest == digest


def test_a_crash_of_the_receiver_does_not_rewind_the_channel(tmp_path: Path) -> None:
    text = MODEL + "  crash: {type: CrashRestart, times: [2.5], repair: 200 ms, at: probe}\n"
    simulation = Simulation(made(tmp_path, text), keep_log=True)
    results = simulation.run()
    assert results.aspects["it"] == {"dropped": 2, "delayed": 4}
    acts = [(each.tag.seconds, each.value) for each in results.log.records if each.aspect == "it"]
    assert acts == [(0, [0, 0.002]), (1, 1), (3, [3, 2.5]), (4, [4, 0.002]), (5, 5), (7, [7, 2.5])]


def whole_message(caught: pytest.ExceptionInfo[BaseException], folder: Path) -> str:
    return str(caught.value).replace(str(folder), "DIR")


@pytest.mark.parametrize(
    ("table", "columns", "message"),
    [
        ("time,loss\n0,1\n", {"lost": "loses"}, "it has no column 'loses', did you mean 'loss'?; columns: time, loss"),
        ("time\n0\n", {}, "it has no column 'lost', 'received' or 'delay', and no sequence is named; columns: time"),
        ("lost,lost\n0,1\n", {}, "two of its columns have the same name: lost, lost"),
        ("lost\n", {}, "it has no rows"),
        ("", {}, "Empty CSV file"),
        ("lost\n0\n2\n", {}, "row 2: lost is neither true (1) nor false (0)"),
        ("lost\n0\nno\n", {}, "its column 'lost' holds string values, expected numbers, or true and false"),
        ("lost,received\n0,1\n1,1\n", {}, "row 2: lost and received contradict each other"),
        ("lost,delay\n0,1\n0,\n", {}, "row 2: delay is empty, but the message was not lost"),
        ("delay\n-1\n", {}, "row 1: delay is not from 0 s to 1e9 s"),
        ("delay\ninf\n", {}, "row 1: delay is not from 0 s to 1e9 s"),
        ("delay\nsoon\n", {}, "In CSV column #0: CSV conversion error to double: invalid value 'soon'"),
        ("time,lost\n1,0\n0.5,0\n", {}, "row 2: time is before that of the row above"),
        ("time,lost\n1,0\n,0\n", {}, "row 2: time is not a time in s"),
        ("time,lost\n1,0\n2e9,0\n", {}, "row 2: time is more than 1e9 s after the first"),
        (
            "n\n65535\n0\n",
            {"sequence": "n"},
            "row 2: n falls by more than 1000; if it starts again, set 'wraps'",
        ),
        ("n\n1\n1.5\n", {"sequence": "n"}, "row 2: n is not a whole number"),
        (
            "n\n1\n1e12\n",
            {"sequence": "n"},
            "its sequence numbers span 1,000,000,000,000 messages, more than 10,000,000",
        ),
        ("lost\n1\n", {"by": "time"}, "'by: time' needs a column of times and no sequence; there is no 'time'"),
        ("time,lost\n1,0\n", {"by": "time"}, "'by: time' needs two rows with different times"),
        ({"lost": ["a"]}, {}, "its column 'lost' holds string values, expected numbers, or true and false"),
        (
            {"lost": [[1], [0]]},
            {},
            "its column 'lost' holds list<element: int64> values, expected numbers, or true and false",
        ),
    ],
)
def test_wrong_tables(tmp_path: Path, table: Any, columns: dict[str, str], message: str) -> None:
    file = file_of(tmp_path, table)
    with pytest.raises(EpicycleError) as caught:
        TraceReplay(file=file, **columns)
    assert whole_message(caught, tmp_path) == f"DIR/{file.name} is not a trace: {message}"


def test_wrong_files(tmp_path: Path) -> None:
    binary = np.random.default_rng(1).integers(0, 256, 3_000_000, dtype=np.uint8).tobytes()
    for name in ("t.csv", "t.parquet"):
        (tmp_path / name).write_bytes(binary)
        with pytest.raises(EpicycleError, match=re.escape(f"{tmp_path / name} is not a trace: ")) as caught:
            TraceReplay(file=tmp_path / name)
        assert len(str(caught.value)) < 1000
    (tmp_path / "t.csv").write_bytes(b"lost\n" + b"1" * 5_000_000)
    with pytest.raises(EpicycleError, match="straddling object straddles two block boundaries"):
        TraceReplay(file=tmp_path / "t.csv")
    for path, message in (
        (tmp_path / "t.txt", "its name must end in .csv or .parquet"),
        (tmp_path / "none.csv", "No such file or directory"),
    ):
        with pytest.raises(EpicycleError) as caught:
            TraceReplay(file=path)
        assert str(caught.value) == f"{path} is not a trace: {message}"
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.csv")
        with pytest.raises(EpicycleError) as caught:
            TraceReplay(file=tmp_path / "pipe.csv")
        assert str(caught.value) == f"{tmp_path / 'pipe.csv'} is not a trace: it is a named pipe, not a regular file"


def test_a_table_that_is_too_long_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "long.parquet"
    schema = arrow.schema([("lost", arrow.int8())])
    block = arrow.table({"lost": arrow.array(np.zeros(MOST // 2, np.int8))}, schema)
    with parquet.ParquetWriter(file, schema) as writer:
        for _ in range(3):
            writer.write_table(block)
    with pytest.raises(EpicycleError) as caught:
        TraceReplay(file=file)
    assert (
        str(caught.value) == f"{file} is not a trace: it has 15,000,000 rows, more than 10,000,000; take a part of it"
    )


def test_a_model_is_told_where_its_trace_is_wrong(tmp_path: Path) -> None:
    def problems(text: str) -> list[str]:
        with pytest.raises(ModelError) as caught:
            made(tmp_path, text)
        return [str(problem).replace(str(tmp_path), "DIR") for problem in caught.value.problems]

    assert problems(MODEL.replace("ms, at", "ms, by: time, lost: los, at"))[0].startswith(
        "DIR/m.yaml:8:3: error: aspect it: DIR/trace.csv is not a trace: it has no column 'los', did you mean 'lost'?"
    )
    outside = problems(MODEL.replace("trace.csv", "../trace.csv"))
    assert "'../trace.csv' cannot be read: a file named in a model must be in or below the folder" in outside[0]
