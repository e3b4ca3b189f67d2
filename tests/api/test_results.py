"""What a run leaves behind, as NumPy arrays, data frames, and what a prompt or notebook shows."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from epicycle.actors import EpicycleError, Tag
from epicycle.runner.execution.engine import Signal, SignalError
from epicycle.runner.support.tables import MAX_ROWS, Table, as_html, as_text


@dataclass
class Pose:
    position: np.ndarray[Any, Any]
    label: str


def signal(*tokens: Any) -> Signal:
    return Signal("a.output", [Tag(250_000_000 * index, index % 2 + 1) for index in range(len(tokens))], list(tokens))


@pytest.mark.parametrize(
    ("tokens", "kind", "shape"),
    [
        ((), "f", (0,)),
        ((1, 2, 3), "i", (3,)),
        ((1, 2.5), "f", (2,)),
        ((True, False), "b", (2,)),
        (("a", "bc"), "U", (2,)),
        ((1, "a"), "O", (2,)),
        ((10**30, 1), "O", (2,)),
        ((None, 1.0), "O", (2,)),
        (([1, 2], [3, 4], [5, 6]), "i", (3, 2)),
        ((np.zeros((2, 2)), np.ones((2, 2))), "f", (2, 2, 2)),
        ((np.zeros(2), np.zeros(3)), "O", (2,)),
        (([1], [1, 2]), "O", (2,)),
        ((Pose(np.zeros(2), "x"),), "O", (1,)),
    ],
    ids=repr,
)
def test_values_are_an_array_with_the_tokens_in_it(tokens: tuple[Any, ...], kind: str, shape: tuple[int, ...]) -> None:
    values = signal(*tokens).values
    assert (values.dtype.kind, values.shape) == (kind, shape)
    assert all(np.array_equal(value, token) or value is token for value, token in zip(values, tokens, strict=True))


def test_times_and_fields() -> None:
    found = signal(Pose(np.array([1.0, 2.0]), "x"), Pose(np.array([3.0, 4.0]), "y"))
    assert found.times.tolist() == [0.0, 0.25]
    assert found.microsteps.tolist() == [1, 2]
    assert found.fields == ("position", "label")
    assert found["position"].tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert found.field("label").tolist() == ["x", "y"]
    assert signal({"n": 1}, {"n": 2, "m": 3})["n"].tolist() == [1, 2]
    with pytest.raises(SignalError) as caught:
        found["positon"]
    assert str(caught.value) == (
        "a.output: a token of type Pose has no field 'positon', did you mean 'position'?; its fields: position, label"
    )
    with pytest.raises(SignalError) as caught:
        signal(1.0)["x"]
    assert str(caught.value) == "a.output: a token of type float has no field 'x'; its fields: none"


def test_frame_has_a_column_for_each_leaf() -> None:
    frame = signal(Pose(np.array([1.0, 2.0]), "x"), Pose(np.array([3.0, 4.0]), "y")).to_pandas()
    assert frame.index.name == "time"
    assert frame.index.tolist() == [0.0, 0.25]
    assert list(frame.columns) == ["microstep", "position[0]", "position[1]", "label"]
    assert frame["position[1]"].tolist() == [2.0, 4.0]
    assert signal(3, 4).to_pandas()["value"].tolist() == [3, 4]
    # Two columns of one name could not be told apart, nor could the index become one.
    stamped = signal({"time": 0.5, "microstep": 3}).to_pandas().reset_index()
    assert list(stamped.columns) == ["time", "microstep", "token.time", "token.microstep"]
    assert list(signal().to_pandas().columns) == ["microstep"]
    ragged = signal([1.0], [1.0, 2.0]).to_pandas()
    assert np.isnan(ragged["[1]"].iloc[0])


def test_without_pandas_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(EpicycleError) as caught:
        signal(1.0).to_pandas()
    assert str(caught.value) == (
        "data frames need the package pandas, which is not installed: pip install 'epicycle[pandas]'"
    )


def test_a_signal_shows_its_beginning_and_end() -> None:
    assert repr(signal()) == "<Signal a.output: no tokens>"
    assert repr(signal(1)) == "<Signal a.output: 1 token (int) from 0 s to 0 s>"
    text = str(signal(*range(1000)))
    assert text.splitlines()[0] == "Signal a.output: 1,000 tokens (int) from 0 s to 249.75 s"
    assert [line.split() for line in text.splitlines()[2:5]] == [
        ["time", "(s)", "microstep", "token"],
        ["0", "1", "0"],
        ["0.25", "2", "1"],
    ]
    assert text.splitlines()[-1].split() == ["249.75", "2", "999"]
    assert len(text.splitlines()) == 20


def test_tables_are_cut_and_escaped() -> None:
    table = Table(("name",), [(f"<b>{index}",) for index in range(MAX_ROWS + 2)])
    html = as_html("a < b", [table, Table(("empty",), [])])
    assert html.startswith("<div><p>a &lt; b</p><table><thead><tr><th>name</th></tr></thead><tbody><tr><td>&lt;b&gt;0<")
    assert html.count("<tr>") == MAX_ROWS + 1
    assert html.endswith("</table><p>... and 2 more</p></div>")
    assert "empty" not in html
    assert re.fullmatch(r"a < b\n\nname\n(<b>\d+\n){40}\.\.\. and 2 more", as_text("a < b", [table]))


@pytest.mark.parametrize(
    "tokens",
    [
        [],
        [1.5, -0.0, float("inf")],
        [1, -(2**63), 2**63 - 1],
        [1, 2, 2**63, 3],
        [1, 2.5, 3],
        [2.5, 1, True],
        [True, 1, 2.0],
        [1.5, "text", None, (1, 2)],
        [1, np.float64(2.5), np.int64(3)],
    ],
)
def test_a_signal_keeps_what_was_sent_in_value_and_type(tokens: list[Any]) -> None:
    kept = signal(*tokens)
    assert [(type(token), token) for token in kept.tokens] == [(type(token), token) for token in tokens]
    assert kept.tags == [Tag(250_000_000 * index, index % 2 + 1) for index in range(len(tokens))]
    assert (len(kept), kept.times.tolist()) == (len(tokens), [0.25 * index for index in range(len(tokens))])
