"""Variables that change by events, and the parameters that go by them."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.runner.execution.engine import Simulation
from epicycle.runner.model.text.problems import ModelError
from tests.actors.feeding import load

MODEL = """
model: m
director: {like: DIRECTOR}
parameters: {p: 7}
actors:
  clock: {type: Clock, period: 1 s, values: [1, 2, 3]}
  set: {type: SetVariable, value: "${p}", delayed: DELAYED}
  v: {type: Variable, priority: -1000, delayed: DELAYED}
  again: {type: TimeDelay, delay: 0}
  const: {type: Const, value: "${p}"}
  text: {type: Const, value: none}
  delay: {type: TimeDelay, delay: 0.5 s}
aspects:
  in_set: {type: Replace, to: v.value, at: set.value}
  in_const: {type: Replace, to: 10 * v.value, at: const.value}
  in_text: {type: Replace, to: "str(v.value) + '!'", at: text.value}
connections:
  - clock.output -> set.input, const.trigger, text.trigger, again.input, delay.input
  - again.output -> const.trigger
  - set.variable -> v.input
  - v.value -> delay.delay
run: {stop: 4 s}
"""


def sends(text: str, *actors: str, until: float = 2.0) -> list[Any]:
    simulation = Simulation(load(text), keep_log=True)
    records = simulation.run(until=until).log.records
    return [
        (r.tag.seconds, r.tag.microstep, r.actor, r.value) for r in records if r.event == "send" and r.actor in actors
    ]


def model(delayed: bool = True, director: str = "epicycle") -> str:
    return MODEL.replace("DELAYED", str(delayed).lower()).replace("DIRECTOR", director)


def test_a_new_value_counts_from_the_next_microstep_on() -> None:
    assert sends(model(), "set", "const", "text", "v") == [
        (0.0, 1, "set", 1), (0.0, 1, "set", 7), (0.0, 1, "const", 7), (0.0, 1, "text", "none"),
        (0.0, 2, "v", 1), (0.0, 2, "const", 10),
        (1.0, 1, "set", 2), (1.0, 1, "set", 1), (1.0, 1, "const", 10), (1.0, 1, "text", "1!"),
        (1.0, 2, "v", 2), (1.0, 2, "const", 20),
        (2.0, 1, "set", 3), (2.0, 1, "set", 2), (2.0, 1, "const", 20), (2.0, 1, "text", "2!"),
        (2.0, 2, "v", 3), (2.0, 2, "const", 30),
    ]  # fmt: skip


def test_a_variable_that_is_not_delayed() -> None:
    """Who fires behind it at the same tag finds the new value."""
    found = sends(model(delayed=False), "set", "v", "again", until=1.0)
    assert [each for each in found if each[2] != "again"] == [
        (0.0, 1, "set", 1), (0.0, 1, "set", 1), (0.0, 1, "v", 1),
        (1.0, 1, "set", 2), (1.0, 1, "set", 2), (1.0, 1, "v", 2),
    ]  # fmt: skip


def test_a_port_parameter_takes_it_over_a_connection() -> None:
    """The delay of what comes at (0 s, 1) is the model's, of what comes at 1 s the first value."""
    assert [(time, value) for time, _, _, value in sends(model(), "delay", until=4.0)] == [(0.5, 1), (2.0, 2), (4.0, 3)]


def test_several_set_one_variable_in_the_order_in_which_they_fire() -> None:
    """As in Ptolemy's Priority1: the one with the lower priority first, so the other decides."""
    text = """
model: m
actors:
  event: {type: SingleEvent}
  one: {type: Const, value: 1}
  two: {type: Const, value: 3}
  second: {type: SetVariable, value: 2}
  first: {type: SetVariable, value: 2, priority: -1}
  v: {type: Variable, priority: -1000}
  later: {type: TimeDelay}
  told: {type: Const, value: 2}
aspects:
  a: {type: Replace, to: v.value, at: [first.value, second.value, told.value]}
connections:
  - event.output -> one.trigger, two.trigger, later.input
  - one.output -> first.input
  - two.output -> second.input
  - first.variable, second.variable -> v.input
  - later.output -> told.trigger
"""
    assert sends(text, "told", "v") == [(0.0, 2, "v", 3), (1.0, 1, "told", 3)]
    assert [each[3] for each in sends(text, "first", "second")] == [1, 2, 3, 2]


def test_a_snapshot_keeps_what_is_to_come() -> None:
    whole = Simulation(load(model()), keep_log=True)
    digest = whole.run(until=3.0).digest
    cut = Simulation(load(model()), keep_log=True)
    cut.advance(1.0)
    fork = cut.fork()
    assert fork.run(until=3.0).digest == digest


def test_an_aspect_for_numbers_takes_no_other_parameter() -> None:
    with pytest.raises(ModelError) as caught:
        load(model().replace("in_text: {type: Replace, to: \"str(v.value) + '!'\"", "in_text: {type: Bias, by: 1"))
    assert caught.value.problems[0].message == "aspect in_text: Bias alters numbers, but text.value is any value"


@pytest.mark.parametrize("director", ["", "director: {}"])
def test_a_port_parameter_of_a_composite(director: str) -> None:
    """An input that sets a variable inside: what comes counts at its own tag, for all that fire behind it."""
    text = f"""
model: m
composites:
  Scaled:
    {director}
    parameters: {{gain: 2}}
    inputs: [gain_in, in]
    outputs: [out, told]
    actors:
      gain: {{type: Variable, delayed: false, priority: -1000}}
      scale: {{type: Scale, factor: "${{gain}}"}}
      const: {{type: Const, value: "${{gain}}"}}
    aspects: {{it: {{type: Replace, to: gain.value, at: const.value}}}}
    connections:
      - gain_in -> gain.input
      - gain.value -> scale.factor
      - in -> scale.input
      - scale.output -> const.trigger, out
      - const.output -> told
actors:
  clock: {{type: Clock, period: 1 s, values: [1]}}
  gains: {{type: Clock, period: 10 s, offsets: [1 s, 1.5 s], values: [5, 7]}}
  scaled: {{type: Scaled}}
connections: [clock.output -> scaled.in, gains.output -> scaled.gain_in]
"""
    assert [each[3] for each in sends(text, "scaled.scale", until=3.0)] == [2, 5, 7, 7]
    assert [each[3] for each in sends(text, "scaled.const", until=3.0)] == [2, 5, 7, 7]
