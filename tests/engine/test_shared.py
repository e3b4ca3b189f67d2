"""Connections that are one channel for all their ends."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.runner.execution.engine import Simulation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.problems import ModelError

MODEL = """
model: m
composites:
  Inner:
    inputs: [in]
    outputs: [out]
DIRECTOR    actors: {join: {type: Recorder}, double: {type: Scale, factor: 2}}
    connections:
      - {from: in, to: [join.input, double.input], shared: true}
      - double.output -> out
actors:
  a: {type: Clock, period: 1 s, values: [1]}
  b: {type: Clock, period: 1 s, values: [10]}
  inner: {type: Inner}
  choice: {type: Clock, period: 1 s, values: [0, 1]}
  switch: {type: Switch}
  x: {type: Recorder}
  y: {type: Recorder}
  z: {type: Recorder}
connections:
  - {from: [a.output, b.output], to: inner.in, shared: true}
  - inner.out -> switch.input
  - choice.output -> switch.control
  - {from: switch.output, to: [x.input, y.input], shared: true}
  - switch.output -> z.input
run: {stop: 1 s}
"""


def simulate(tmp_path: Any, text: str) -> Simulation:
    file = tmp_path / "m.yaml"
    file.write_text(text)
    simulation = Simulation(load_model(file), keep_log=True)
    simulation.run()
    return simulation


def test_one_channel_at_each_port(tmp_path: Any) -> None:
    """Also through a composite, at a port that takes one connection, and for a sender that chooses channels."""
    found = simulate(tmp_path, MODEL.replace("DIRECTOR", ""))
    assert [found[path].input.width for path in ("inner.join", "inner.double", "x", "z")] == [1, 1, 1, 1]
    assert found["switch"].output.width == 2
    assert found["inner.join"].tokens == [1, 10, 1, 10]
    assert found["x"].tokens == found["y"].tokens == [2, 20]
    assert found["z"].tokens == [2, 20]


def test_at_the_border_of_a_composite_with_a_director(tmp_path: Any) -> None:
    """One token passes at a tag, for both come on one channel; without 'shared' both do."""
    text = MODEL.replace("DIRECTOR", "    director: {}\n")
    found = simulate(tmp_path, text)
    assert [(tag.seconds, tag.microstep) for tag in found["inner.join"].tags][:2] == [(0.0, 1), (0.0, 2)]
    apart = text.replace("to: inner.in, shared: true", "to: inner.in")
    found = simulate(tmp_path, apart)
    assert [(tag.seconds, tag.microstep) for tag in found["inner.join"].tags][:2] == [(0.0, 1), (0.0, 1)]


def test_without_it_a_single_port_takes_one(tmp_path: Any) -> None:
    text = MODEL.replace("DIRECTOR", "").replace(
        "to: [join.input, double.input], shared: true", "to: [join.input, double.input]"
    )
    with pytest.raises(ModelError) as caught:
        simulate(tmp_path, text)
    assert (
        str(caught.value).replace(f"{tmp_path}/", "")
        == """\
m.yaml:9:16: error: inner.double.input takes one connection, but 2 senders write to it: a.output, b.output
    9 |       - {from: in, to: [join.input, double.input]}
      |                ^^
   help: the first connection is at m.yaml:9:16
   help: connect only one of them, or send through an actor that merges them
   help: if they form one channel, write {from: [...], to: ..., shared: true}"""
    )


def test_what_is_no_truth_value(tmp_path: Any) -> None:
    with pytest.raises(ModelError) as caught:
        simulate(tmp_path, MODEL.replace("DIRECTOR", "").replace("inner.in, shared: true", "inner.in, shared: 1"))
    assert caught.value.problems[0].message == "'shared' of a connection is neither true nor false"
