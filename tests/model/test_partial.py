"""Files with inputs to which a program connects something."""

from __future__ import annotations

from pathlib import Path

import pytest

import epicycle
from epicycle.actors import Const
from epicycle.runner.model.text.problems import ModelError

ROOM = """\
model: room
actors:
  clock: {type: Clock, period: 1 s}
  room: {type: ODE, initial: {heat: 20}, derivatives: {heat: 0.1 * power - 0.01 * (heat - 10)}}
connections:
  - clock.output -> room.trigger
run: {stop: 10 s, record: [room.heat]}
"""
MISSING = """\
room.yaml:4:3: error: room.power is not connected, but ODE needs it
    4 |   room: {type: ODE, initial: {heat: 20}, derivatives: {heat: 0.1 * power - 0.01 * (heat - 10)}}
      |   ^^^^
   help: it takes any: an input, held between tokens"""


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("room.yaml").write_text(ROOM, encoding="utf-8")


def test_a_program_connects_what_a_file_leaves_open() -> None:
    model = epicycle.load("room.yaml", partial=True)
    model.connect(model.add(Const("stove", value=1.0)).output, "room.power")
    assert epicycle.run(model)["room.heat"].values.tolist() == [20.0] * 11


def test_what_is_left_open_is_missed_when_it_runs() -> None:
    with pytest.raises(ModelError) as caught:
        epicycle.load("room.yaml")
    assert str(caught.value) == MISSING
    model = epicycle.load("room.yaml", partial=True)
    with pytest.raises(ModelError) as caught:
        epicycle.run(model)
    assert str(caught.value) == MISSING


def test_all_else_is_checked_in_a_partial_model() -> None:
    Path("room.yaml").write_text(ROOM.replace("room.trigger", "room.triger"), encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        epicycle.load("room.yaml", partial=True)
    assert [problem.message for problem in caught.value.problems] == [
        "room: ODE has no input port 'triger', did you mean 'trigger'?"
    ]
