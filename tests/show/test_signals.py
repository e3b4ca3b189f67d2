"""What was recorded is in signals.parquet, whatever type it is of."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from enum import Enum, IntEnum
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from epicycle.actors import Tag
from epicycle.runner import Simulation, load_model
from epicycle.runner.execution.engine import Results, Signal, plain
from epicycle.runner.execution.results import write_signals
from epicycle.runner.model.catalogue.packaged import packaged_models
from tests.demo_models import DURATIONS


class Light(Enum):
    RED = "stop"
    GREEN = "go"


class Level(IntEnum):
    LOW = 1


@dataclass(frozen=True)
class Nothing:
    pass


@dataclass(frozen=True)
class Pose:
    at: Any
    mode: str
    ready: bool


@pytest.fixture(scope="module")
def empty() -> Results:
    return Simulation(load_model("mm1")).run(until=0.0)


def written(results: Results, folder: Path, **signals: list[tuple[int, Any]]) -> list[dict[str, Any]]:
    """The rows of the file for tokens at times in ns."""
    results.signals = {
        name: Signal(name, [Tag(time, 1) for time, _ in sent], [token for _, token in sent])
        for name, sent in signals.items()
    }
    write_signals(results, folder / "signals.parquet")
    rows: list[dict[str, Any]] = pq.read_table(folder / "signals.parquet").to_pylist()
    return rows


@pytest.mark.parametrize(
    ("token", "rows"),
    [
        (1.5, [("", "float", 1.5, None)]),
        (-0.0, [("", "float", -0.0, None)]),
        (np.float32(0.5), [("", "float", 0.5, None)]),
        (3, [("", "int", 3.0, None)]),
        (np.int8(-3), [("", "int", -3.0, None)]),
        (2**53 + 1, [("", "int", 2.0**53, "9007199254740993")]),
        (-(10**400), [("", "int", -math.inf, "-1" + 400 * "0")]),
        (True, [("", "bool", 1.0, None)]),
        (np.bool_(False), [("", "bool", 0.0, None)]),
        ("", [("", "text", None, "")]),
        ("é, 'x'\n\x00", [("", "text", None, "é, 'x'\n\x00")]),
        ("\ud800", [("", "text", None, "\\ud800")]),
        (None, [("", "none", None, None)]),
        (Light.RED, [("", "Light", None, "RED")]),
        (Level.LOW, [("", "Level", 1.0, "LOW")]),
        (1 + 2j, [("", "complex", None, "(1+2j)")]),
        (Decimal("1.10"), [("", "Decimal", None, "Decimal('1.10')")]),
        (np.datetime64("2020-01-01"), [("", "datetime64", None, "datetime.date(2020, 1, 1)")]),
        ({2, 1}, [("", "set", None, "[1, 2]")]),
        ([], [("", "list", None, "[]")]),
        ({}, [("", "dict", None, "{}")]),
        (np.zeros((2, 0)), [("[0]", "ndarray", None, "[]"), ("[1]", "ndarray", None, "[]")]),
        (Nothing(), [("", "Nothing", None, "{}")]),
        (np.array(2.5), [("", "float", 2.5, None)]),
        (np.array([[1, 2]]), [("[0][0]", "int", 1.0, None), ("[0][1]", "int", 2.0, None)]),
        ((1, "a", [None]), [("[0]", "int", 1.0, None), ("[1]", "text", None, "a"), ("[2][0]", "none", None, None)]),
        (
            Pose({"x": 1.0, "tags": ("a",)}, "wait", True),
            [
                ("at.x", "float", 1.0, None),
                ("at.tags[0]", "text", None, "a"),
                ("mode", "text", None, "wait"),
                ("ready", "bool", 1.0, None),
            ],
        ),
    ],
    ids=repr,
)
def test_tokens_of_any_type_are_in_the_file(
    token: Any, rows: list[tuple[object, ...]], empty: Results, tmp_path: Path
) -> None:
    found = written(empty, tmp_path, it=[(1_500_000_001, token)])
    assert [repr(tuple(row.values())) for row in found] == [
        repr((1.500000001, 1_500_000_001, 1, "it", *row)) for row in rows
    ]


def test_not_a_number_is_not_nothing(empty: Results, tmp_path: Path) -> None:
    first, second = written(empty, tmp_path, it=[(0, math.nan), (1, None)])
    assert math.isnan(first["value"])
    assert second["value"] is None


def test_files_of_nothing_have_the_same_columns(empty: Results, tmp_path: Path) -> None:
    assert written(empty, tmp_path) == []
    assert pq.read_table(tmp_path / "signals.parquet").schema.to_string() == (
        "time: double\ntime_ns: int64\nmicrostep: int64\nsignal: dictionary<values=string, indices=int32, ordered=0>\n"
        "field: dictionary<values=string, indices=int32, ordered=0>\n"
        "type: dictionary<values=string, indices=int32, ordered=0>\nvalue: double\ntext: string"
    )


def flat(value: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """What plain data is made of."""
    if isinstance(value, list) and value:
        for index, item in enumerate(value):
            yield from flat(item, f"{place}[{index}]")
    elif isinstance(value, dict) and value:
        for name, item in value.items():
            yield from flat(item, f"{place}.{name}" if place else name)
    else:
        yield place, value


def restored(row: dict[str, Any]) -> Any:
    """The plain value that a row was made of."""
    kind, value, text = row["type"], row["value"], row["text"]
    if kind in ("list", "tuple", "dict", "ndarray"):
        return json.loads(text)
    made = {"float": lambda: value, "int": lambda: int(text or value), "bool": lambda: value == 1.0}
    return made.get(kind, lambda: text)()


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(packaged_models()))
def test_what_models_send_can_be_read_from_the_file(name: str, tmp_path: Path) -> None:
    """Every port of every packaged model, recorded or not."""
    results = Simulation(load_model(name), keep_log=True).run(until=DURATIONS.get(name, 100.0))
    results.signals = {}
    for record in results.log.records:
        if record.event == "send":
            signal = f"{record.actor}.{record.port}"
            results.signals.setdefault(signal, Signal(signal)).add(record.tag, record.value)
    assert results.signals
    write_signals(results, tmp_path / "signals.parquet")
    expected = [
        repr((signal, tag.time, tag.microstep, place, value))
        for signal, sent in results.signals.items()
        for tag, token in zip(sent.tags, sent.tokens, strict=True)
        for place, value in flat(plain(token))
    ]
    assert [
        repr((row["signal"], row["time_ns"], row["microstep"], row["field"], restored(row)))
        for row in pq.read_table(tmp_path / "signals.parquet").to_pylist()
    ] == expected
