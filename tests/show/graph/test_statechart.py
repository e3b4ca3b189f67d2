"""Statecharts: what is drawn of a machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.actors import EpicycleError
from epicycle.runner import load_model
from epicycle.runner.show.graph import draw, mermaid, statechart, write_graph
from epicycle.runner.show.graph.chart import WIDEST
from tests.actors.feeding import load

MODEL = """
model: m
composites:
  Ticking:
    outputs: [tick]
    actors: {clock: {type: Clock, period: 1 s}}
    connections: [clock.output -> tick]
  It:
    inputs: [go]
    outputs: [tick, said]
    variables: {n: 0, m: 0}
    modes:
      on: {refinement: Ticking, flow: {n: 0.5}, exit: said = n}
      off: {entry: n = 0}
      gone: {final: true}
    transitions:
      - on -> off preemptive on go
      - off -> on history priority 2 after 3 s when mode_time < 10 do said = 1; m = 2
      - "* -> gone when n > 4"
actors: {clock: {type: Clock, period: 1 s}, it: {type: It}}
connections: [clock.output -> it.go]
"""


def test_text_of_a_machine() -> None:
    assert (
        mermaid(statechart(load(MODEL), "it"))
        == """\
---
title: "m"
---
flowchart LR
    subgraph it["it: modes"]
        it_machine((" "))
        it_machine_on("on<br/>n' = 0.5<br/>exit / said = n<br/>refinement Ticking")
        it_machine_off("off<br/>entry / n = 0")
        it_machine_gone((("gone")))
        it_machine --> it_machine_on
        it_machine_on -->|"preemptive go"| it_machine_off
        it_machine_off -->|"history priority 2 after 3.0 s<br/>[mode_time #lt; 10] / said = 1; m = 2"| it_machine_on
        it_machine_on -->|"[n > 4]"| it_machine_gone
        it_machine_off -->|"[n > 4]"| it_machine_gone
    end
"""
    )


@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
def test_the_same_machine_gives_the_same_picture(tmp_path: Path, ending: str) -> None:
    files = [tmp_path / f"{number}.{ending}" for number in range(2)]
    for file in files:
        write_graph(statechart(load(MODEL), "it"), file)
    assert files[0].read_bytes() == files[1].read_bytes()
    assert files[0].stat().st_size > 5_000


def test_labels_and_modes_keep_clear_of_each_other() -> None:
    """No two modes or labels of the packaged machines lie on each other."""
    for name, path in (("bouncing_modes", "ball"), ("traffic_light", "cars"), ("thermostat", "room")):
        drawing = draw(statechart(load_model(name), path))
        spaces = [(each.x, each.y, each.width, each.height) for each in drawing.boxes if not each.box.is_composite]
        spaces += [(each.x, each.y - each.height / 2, each.width, each.height) for each in drawing.badges]
        assert len(spaces) > 4
        for place, (x, y, width, height) in enumerate(spaces):
            for left, top, across, down in spaces[place + 1 :]:
                assert x + width < left or left + across < x or y + height < top or top + down < y


def test_what_a_mode_does_goes_over_several_lines() -> None:
    """No line is wider than a label."""
    chart = statechart(load_model("lift_group"), "lift[0]")
    (machine,) = chart.root.children
    (deciding,) = [box for box in machine.children if box.name == "deciding"]
    assert 10 < len(deciding.kind.splitlines()) < 16
    assert max(map(len, deciding.kind.splitlines())) <= WIDEST
    (line,) = [line for line in mermaid(chart).splitlines() if "deciding<br/>" in line]
    assert line.count("<br/>") == len(deciding.kind.splitlines())


def test_probabilities_and_rates_are_shown() -> None:
    text = MODEL.replace("variables: {n: 0, m: 0}", "variables: {n: 0, m: 0, rest: 0.25}").replace(
        "transitions:", "transitions:\n      - on -> off probability rest on go\n      - off -> on rate 2 * rest"
    )
    found = mermaid(statechart(load(text), "it"))
    assert '    it_machine_on -->|"go probability rest<br/>preemptive go"| it_machine_off\n' in found
    assert '    it_machine_off -->|"rate 2 * rest<br/>history priority 2 after 3.0 s<br/>' in found


def test_what_has_no_modes_is_told() -> None:
    with pytest.raises(EpicycleError) as caught:
        statechart(load(MODEL), "itt")
    assert str(caught.value) == "itt has no modes, did you mean 'it'?; machines: it"
