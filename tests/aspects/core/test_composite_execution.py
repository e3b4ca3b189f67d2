"""Aspects at actors that are models: a composite decides when they fire."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.runner.model.build.model import Model
from epicycle.runner.show.reference import aspects_at
from tests.aspects.core.composite_parts import PAIR, acts, load, run, sends

CPU = """
  Cpu:
    inputs: [request]
    outputs: [response]
    actors:
      each: {type: Merge}
      cost: {type: Expression, expression: "job['execution_time']"}
      server: {type: Server}
    connections:
      - request -> each.input
      - each.output -> cost.job, server.input
      - cost.output -> server.service_time
      - server.output -> response
  Hub:
    inputs: [request]
    outputs: [response]
    actors: {join: {type: Merge}}
    connections: [request -> join.input, join.output -> response]
"""


def firing_pair(woven: str, **changes: Any) -> Model:
    text = PAIR.replace("actors:\n  t:", CPU.lstrip("\n") + "actors:\n  t:")
    return load(text.replace("{ASPECTS}", "{" + woven + "}"), **changes)


def test_firings_wait_for_a_model() -> None:
    """A processor for which both compute: at each second a for 0.1 s, then b for 0.2 s."""
    woven = "cpu: {type: Cpu, at: [{at: a, time: 100 ms}, {type: Scale, time: 0.2}]}".replace("type: Scale", "at: b")
    results = run(firing_pair(woven))
    assert acts(results, "requested", "executed")[:4] == [
        (0.0, "requested", "a.", 0.1),
        (0.0, "requested", "b.", 0.2),
        (0.1, "executed", "a.", 0.1),
        (pytest.approx(0.3), "executed", "b.", 0.3),
    ]
    assert [(tag.seconds, value) for tag, _, value in sends(results, "b.output")] == [(0.3, 0), (1.3, 3), (2.3, 6)]
    assert results.aspects["cpu"] == {"requested": 6, "executed": 6}
    changed = run(firing_pair(woven, set=["cpu.server.servers=2"]))
    assert [tag.seconds for tag, *_ in sends(changed, "b.output")] == [0.2, 1.2, 2.2]


def test_a_wire_lets_actors_fire_as_ever() -> None:
    places = "[{type: Scale, time: 0}, {at: j, time: 1 s}, {at: t, time: 0}]"
    assert sends(run(firing_pair(f"net: {{type: Wire, at: {places}}}"))) == sends(run(firing_pair("")))


def test_what_fires_inside_takes_a_microstep() -> None:
    """An actor has its turn before the model that it asks, so the answer counts at the next microstep."""
    results = run(firing_pair("hub: {type: Hub, at: {at: a, time: 0}}"))
    assert [(tag.seconds, tag.microstep) for tag, *_ in sends(results, "a.output")] == [(0, 2), (1, 2), (2, 2)]
    assert [(tag.seconds, tag.microstep) for tag, *_ in sends(results, "b.output")] == [(0, 1), (1, 1), (2, 1)]


def test_a_firing_that_is_not_answered_does_not_happen() -> None:
    results = run(
        firing_pair("net: {type: Hub, at: {at: a, time: 0}}, loss: {type: PacketLoss, probability: 1, at: net.request}")
    )
    assert results.aspects["net"] == {"requested": 3, "executed": 0}
    assert not sends(results, "a.output")


def test_the_list_of_aspects_says_where_each_comes_in() -> None:
    crossing = "net: {type: Crossing, at: [{at: a.input, request: east}, {at: t.output -> b.input, request: west}]}"
    model = firing_pair(f"{crossing}, cpu: {{type: Cpu, at: {{at: b, time: 5 ms}}}}")
    assert aspects_at(model) == {
        "a.input": [("net", "Crossing", "request: east")],
        "b": [("cpu", "Cpu", "time: 0.005")],
        "t.output -> b.input": [("net", "Crossing", "request: west")],
    }
