"""What was recorded is in signals.parquet and in figures, whatever type it is of."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from enum import Enum, IntEnum
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pyarrow.parquet as pq
import pytest

from epicycle.actors import Actor, OutputPort, Tag
from epicycle.runner import Simulation, load_model
from epicycle.runner.catalogue import packaged_models
from epicycle.runner.engine import Results, Signal, plain
from epicycle.runner.show import draw, figures_of
from epicycle.runner.show.folder import write_signals
from epicycle.runner.show.pen import Sheet
from epicycle.runner.text import Problems


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


DURATIONS = {"collision_avoidance": 2.0, "machine_shop": 100_000.0}  # s


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


# -- figures ----------------------------------------------------------------------------------------------------------


class Talk(Actor):
    """Sends states of all kinds, one a second."""

    is_source: ClassVar[bool] = True
    text: OutputPort[str] = OutputPort(str)
    flag: OutputPort[bool] = OutputPort(bool)
    light: OutputPort[Any] = OutputPort(object)
    pose: OutputPort[Any] = OutputPort(object)

    def initialize(self) -> None:
        for second in range(5):
            self.wake_at(second)

    def fire(self) -> None:
        second = round(self.now)
        if second == 4:
            return  # only the run goes on until then
        self.text.send(["idle", "$\\frac{", "_x", "idle"][second])
        self.flag.send(second < 2)
        self.light.send([Light.RED, None, 3.0, Light.GREEN][second])
        self.pose.send(Pose(0.5 * second, "go", True))


FIGURES = """
model: talk
actors: {t: {type: Talk}}
run: {stop: 4, record: ["t.*"]}
figures:
  states: {type: TimeSeries, signals: t.text}
  both: {type: TimeSeries, signals: [t.flag, t.light, t.pose], label: speed}
  often: {type: Histogram, signals: t.text}
"""


def drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, list[Any]]:
    """The axes of all figures of the model."""
    (tmp_path / "m.yaml").write_text(FIGURES, encoding="utf-8")
    model = load_model(tmp_path / "m.yaml", types=[Talk])
    results = Simulation(model).run()
    found: dict[str, list[Any]] = {}
    monkeypatch.setattr(Sheet, "save", lambda sheet, paths: found.update({paths[0].stem: sheet.axes}))
    for name, figure in figures_of(model, Problems()).items():
        draw(name, figure, results, tmp_path / f"{name}.png")
    return found


def bars(axes: Any) -> dict[str, list[tuple[str, float, float]]]:
    """The name of each strip, with the states that it shows, and from when to when."""
    from matplotlib.colors import to_hex

    legend = axes.get_legend()
    names = {
        to_hex(patch.get_facecolor()): text.get_text()
        for patch, text in zip(legend.get_patches(), legend.get_texts(), strict=True)
    }
    found: dict[str, list[tuple[str, float, float]]] = {}
    for bar in axes.collections:
        for path in bar.get_paths():
            (begin, low), (end, high) = path.vertices.min(0), path.vertices.max(0)
            strip = axes.get_yticklabels()[round((low + high) / 2)].get_text()
            found.setdefault(strip, []).append((names[to_hex(bar.get_facecolor()[0])], float(begin), float(end)))
    return {strip: sorted(spans, key=lambda span: span[1]) for strip, spans in found.items()}


def test_a_text_is_a_strip_of_states(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    axes = drawn(monkeypatch, tmp_path)
    [states] = axes["states"]
    assert bars(states) == {
        "t.text": [("idle", 0.0, 1.0), ("$\\frac{", 1.0, 2.0), ("'_x'", 2.0, 3.0), ("idle", 3.0, 4.0)]
    }
    assert (states.get_xlabel(), states.get_title("left")) == ("time (s)", "talk, seed 0, 4 s")


def test_lines_are_above_strips(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    lines, strips = drawn(monkeypatch, tmp_path)["both"]
    assert [line.get_label() for line in lines.lines] == ["t.light", "t.pose.at"]
    assert lines.lines[1].get_ydata().tolist() == [0.0, 0.5, 1.0, 1.5, 1.5]
    assert bars(strips) == {
        "t.flag": [("true", 0.0, 1.0), ("true", 1.0, 2.0), ("false", 2.0, 3.0), ("false", 3.0, 4.0)],
        "t.light": [("RED", 0.0, 1.0), ("GREEN", 3.0, 4.0)],
        "t.pose.mode": [("go", float(second), second + 1.0) for second in range(4)],
        "t.pose.ready": [("true", float(second), second + 1.0) for second in range(4)],
    }
    assert (lines.get_ylabel(), strips.get_xlabel()) == ("speed", "time (s)")
    assert lines.get_xlim() == strips.get_xlim()


def test_a_histogram_of_states_counts_them(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    [often] = drawn(monkeypatch, tmp_path)["often"]
    assert [text.get_text() for text in often.get_yticklabels()] == ["idle", "$\\frac{", "'_x'"]
    assert [bar.get_width() for bar in often.patches] == [2, 1, 1]
    assert often.get_xlabel() == "t.text: how often"


def test_figures_of_states_are_files(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(FIGURES, encoding="utf-8")
    model = load_model(tmp_path / "m.yaml", types=[Talk])
    results = Simulation(model).run()
    for name, figure in figures_of(model, Problems()).items():
        draw(name, figure, results, tmp_path / f"{name}.svg")
        assert (tmp_path / f"{name}.svg").read_bytes().startswith(b"<?xml")
