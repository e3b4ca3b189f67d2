"""Machines and composites with modes under ``like: ptolemy``: each clause of what is another way there."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.actors import ParameterError
from epicycle.ptolemy.machine import StateMachine
from epicycle.runner.execution.engine import Simulation
from tests.actors.feeding import load
from tests.modes.machines import UNTIL, as_entry, random_machine, sends_of
from tests.modes.reference import interpret

HEAD = "model: m\ndirector: {like: ptolemy}\n"
Sent = list[tuple[float, int, Any]]


def sends(text: str, *ports: str) -> Sent:
    """What leaves these ports, ``actor.port``, in its order."""
    log = Simulation(load(text), keep_log=True).run().log
    return [
        (record.tag.seconds, record.tag.microstep, record.value)
        for record in log.records
        if record.event == "send" and f"{record.actor}.{record.port}" in ports
    ]


def fed(machine: str, tokens: str, *, head: str = HEAD, stop: float = 0) -> str:
    """A machine ``it`` that gets these tokens at 0 s at ``x``, all at once."""
    return (
        f"{head}actors:\n  start: {{type: Clock, period: 1 s, values: [[{tokens}]]}}\n"
        f"  each: {{type: Unbatch}}\n  it: {{type: StateMachine, {machine}}}\n"
        f"connections: [start.output -> each.input, each.output -> it.x]\nrun: {{stop: {stop} s}}\n"
    )


TURNS = "modes: [a, b], transitions: [a -> b on x do y = x, b -> a on x do y = -x]"


@pytest.mark.parametrize(
    ("head", "wanted"),
    [
        (HEAD, [(0.0, 1, 1), (0.0, 1, -2), (0.0, 1, 3)]),
        ("model: m\n", [(0.0, 1, 1), (0.0, 2, -2), (0.0, 3, 3)]),
    ],
)
def test_tokens_that_come_together_are_for_a_firing_each(head: str, wanted: Sent) -> None:
    assert sends(fed(TURNS, "1, 2, 3", head=head), "it.y") == wanted


def test_a_firing_takes_a_token_of_each_channel_and_the_last_counts() -> None:
    text = fed(TURNS, "1, 2, 3").replace("each.output -> it.x]", "each.output -> it.x, each.output -> late.input]")
    text = text.replace("connections: [", "  late: {type: Scale, factor: 10}\nconnections: [late.output -> it.x, ")
    assert sends(text, "it.y") == [(0.0, 1, 1), (0.0, 1, -2), (0.0, 1, 3)]
    text = text.replace("connections: [late.output -> it.x, ", "connections: [").replace(
        "each.output -> it.x,", "each.output -> it.x, late.output -> it.x,"
    )
    assert sends(text, "it.y") == [(0.0, 1, 10), (0.0, 1, -20), (0.0, 1, 30)]


def test_behind_each_transition_it_reacts_again_also_by_else() -> None:
    machine = "modes: [a, b], transitions: [a -> b on x do y = x, b -> a else do y = 0]"
    # The second token is for ``else`` too, and the third leads back: what is behind that comes a microstep later.
    assert sends(fed(machine, "1, 2, 3"), "it.y") == [(0.0, 1, 1), (0.0, 1, 0), (0.0, 1, 3), (0.0, 2, 0)]
    assert sends(fed(machine, "1, 2, 3", head="model: m\n"), "it.y") == [(0.0, 1, 1), (0.0, 2, 0), (0.0, 3, 3)]


def test_immediate_transitions_of_the_first_mode_come_before_its_first_reaction() -> None:
    machine = "modes: [a, b, c], transitions: [a -> b immediate do y = 1, b -> c do y = 2, c -> a on x after 1 s]"
    assert sends(fed(machine, "1"), "it.y") == [(0.0, 1, 1), (0.0, 1, 2)]
    assert sends(fed(machine, "1", head="model: m\n"), "it.y") == [(0.0, 1, 1), (0.0, 2, 2)]


def test_variables_are_set_when_all_transitions_have_sent() -> None:
    machine = """variables: {n: 0}, modes: [a, b, c, d], transitions: [
      a -> b on x do n = n + x; y = n,
      b -> c immediate when n == 5 do y = -1,
      b -> c immediate when n == 0 do n = n * 2; y = n + 0.5,
      c -> d after n / 4 do y = n]"""
    assert sends(fed(machine, "5", stop=9), "it.y") == [(0.0, 1, 0), (0.0, 1, 0.5), (2.5, 1, 10)]
    assert sends(fed(machine, "5", head="model: m\n", stop=9), "it.y") == [(0.0, 1, 5), (0.0, 1, -1), (1.25, 1, 5)]


def test_variables_are_set_last_at_entry_and_exit_too_and_borders_know_it() -> None:
    machine = (
        "variables: {n: 1}, modes: {a: {entry: n = 2; y = n, exit: n = n + 1; y = n}, b: {entry: n = n * 10; y = n}}, "
        "transitions: [a -> b on x do n = n + 100, b -> a when mode_time >= n / 515]"
    )
    # At first it is 1, then 2, which is sent as it leaves, then (2 + 1 + 100) * 10; b lasts 2 s.
    assert sends(fed(machine, "5", stop=2), "it.y") == [(0.0, 1, 1), (0.0, 1, 2), (0.0, 1, 2), (2.0, 1, 1030)]


MODAL = """composites:
  Scaling:
    inputs: [x]
    outputs: [y]
    actors: {scale: {type: Scale, factor: 10}, begin: {type: Clock, period: 1 s, values: [7]}}
    connections: [x -> scale.input, scale.output -> y]
  Modal:
    inputs: [x]
    outputs: [y]
    modes: {MODES}
    transitions: [TRANSITIONS]
actors:
  start: {type: Clock, period: 1 s, values: [[TOKENS]]}
  each: {type: Unbatch}
  it: {type: Modal}
  seen: {type: Recorder}
connections: [start.output -> each.input, each.output -> it.x, it.y -> seen.input]
run: {stop: 0 s}
"""


def modal(modes: str, transitions: str, tokens: str, *, head: str = HEAD) -> str:
    """A composite with modes that gets tokens at once."""
    said = MODAL.replace("MODES", modes).replace("TRANSITIONS", transitions).replace("TOKENS", tokens)
    return head + said


def seen(text: str) -> Sent:
    """What has left a composite with modes."""
    simulation = Simulation(load(text))
    simulation.run()
    sink: Any = simulation["seen"]
    return [(tag.seconds, tag.microstep, token) for tag, token in zip(sink.tags, sink.tokens, strict=True)]


ONE_TWO = "one: , two: {refinement: Scaling}"


def test_a_composite_with_modes_fires_again_for_tokens_that_come_together() -> None:
    text = modal(ONE_TWO, "one -> two when x == 2 do y = x, two -> one when x == 4", "1, 2, 3, 4, 5, 2")
    assert seen(text) == [(0.0, 1, 2), (0.0, 1, 30), (0.0, 1, 40), (0.0, 1, 2)]
    # What is entered begins in the next firing: at the same tag for 3, and one microstep later for lack of a token.
    assert [each[:2] for each in sends(text, "it.two.begin.output")] == [(0.0, 1), (0.0, 2)]
    default = text.replace(HEAD, "model: m\n")
    assert seen(default) == [(0.0, 2, 2), (0.0, 3, 30), (0.0, 4, 40), (0.0, 6, 2)]


def test_of_what_leaves_together_the_last_counts_and_all_is_one_channel() -> None:
    text = modal(ONE_TWO.replace("one: ", "one: {refinement: Scaling}"),
                 "one -> two when x == 2 do y = x, two -> one when x == 4 do y = -x", "1, 2, 3, 4")  # fmt: skip
    assert seen(text) == [(0.0, 1, 10), (0.0, 1, 2), (0.0, 1, 30), (0.0, 1, -4)]
    widths = {}
    for head in (HEAD, "model: m\n"):
        simulation = Simulation(load(text.replace(HEAD, head)))
        simulation.run()
        widths[head] = simulation["seen"].inputs["input"].width
    assert widths == {HEAD: 1, "model: m\n": 3}


def test_a_preemptive_transition_is_for_one_firing() -> None:
    text = modal(ONE_TWO, "one -> two on x, two -> one preemptive when x == 3 do y = x", "1, 2, 3, 4, 5")
    assert seen(text) == [(0.0, 1, 20), (0.0, 1, 3), (0.0, 1, 50)]


def test_the_refinement_of_a_final_mode_does_not_fire() -> None:
    text = modal("one: , two: {refinement: Scaling, final: true}", "one -> two on x do y = x", "1, 2, 3")
    assert seen(text) == [(0.0, 1, 1)]
    assert sends(text, "it.two.begin.output") == []
    assert sends(text.replace(HEAD, "model: m\n"), "it.two.begin.output") == [(0.0, 2, 7)]


def test_machines_in_machines_fire_again_with_what_is_around_them() -> None:
    text = modal("one: {refinement: Inner}, two: {refinement: Scaling}",
                 "one -> two when x == 3, two -> one when x == 4", "1, 2, 3, 4, 5, 6")  # fmt: skip
    inner = "  Inner:\n    inputs: [x]\n    outputs: [y]\n    modes: {a: , b: {refinement: Scaling}}\n"
    inner += "    transitions: ['a -> b on x do y = -x', 'b -> a when x == 6']\n"
    text = text.replace("  Modal:", f"{inner}  Modal:")
    assert seen(text) == [(0.0, 1, each) for each in (-1, 20, 30, 40, -5, 60)]


def test_a_refinement_that_sends_twice_lets_the_second_go_at_the_next_microstep() -> None:
    text = modal("one: {refinement: Scaling}", "'one -> one when x == 99'", "1").replace(
        "{type: Scale, factor: 10}", "{type: Repeat, times: 3}"
    )
    assert seen(text) == [(0.0, microstep, 1) for microstep in (1, 2, 3)]


def test_a_snapshot_goes_on_as_the_run_would_have() -> None:
    text = modal(ONE_TWO, "one -> two when x == 2 do y = x, two -> one when x == 4", "1, 2, 3, 4, 5, 2")
    model = load(text.replace("stop: 0 s", "stop: 5 s"))
    whole = Simulation(model).run().digest
    simulation = Simulation(model)
    for time in (0.0, 1.0, 3.5):
        simulation.advance(time)
        snapshot = simulation.snapshot()
        assert simulation.fork().run().digest == whole
        simulation.restore(snapshot)
    assert simulation.run().digest == whole


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 100, 50))
def test_random_machines_are_those_of_the_reference(first: int) -> None:
    for seed in range(first, first + 50):
        machine, events = random_machine(seed)
        entry = as_entry(machine, in_lines=seed % 2 == 0)
        try:
            inputs = StateMachine("it", **{key: value for key, value in entry.items() if key != "type"}).inputs
        except ParameterError:
            continue
        events = [event for event in events if event[1] in inputs]
        wanted = interpret({**machine, "as_in_ptolemy": True}, events, UNTIL * 10**9)
        entry["ports"] = [port for port in ("a", "b") if port in inputs]
        if wanted != "endless":
            assert sends_of(entry, events, [StateMachine]) == wanted, seed
