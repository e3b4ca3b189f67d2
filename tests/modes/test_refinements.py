"""Composites with modes: refinements that are active in one mode, in a time that stands still in all others."""

from __future__ import annotations

import re
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import InputPort, OutputPort, Process
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.execution.engine.errors import ActorError
from epicycle.runner.model.text.problems import ModelError
from tests.actors.feeding import load
from tests.cases import read, write

PARTS = """
model: m
composites:
  Ticking:
    outputs: [tick]
    actors: {clock: {type: Clock, period: 1 s}}
    connections: [clock.output -> tick]
  Delaying:
    inputs: [x]
    outputs: [y]
    actors: {delay: {type: TimeDelay, delay: 1 s}}
    connections: [x -> delay.input, delay.output -> y]
"""


def sends(text: str, actor: str, port: str = "", types: tuple[type, ...] = ()) -> list[tuple[float, int, Any]]:
    """What an actor sends."""
    log = Simulation(load(text, types), keep_log=True).run().log
    return [
        (record.tag.seconds, record.tag.microstep, record.value)
        for record in log.records
        if record.event == "send" and record.actor == actor and port in ("", record.port)
    ]


def switching(modes: str, transitions: str, more: str = "", *, stop: float = 10, parts: str = "") -> str:
    """A model with one composite with modes, ``it``, and tokens of the clock ``go`` each 2.5 s."""
    said = f"    modes: {{{modes}}}\n    transitions: [{transitions}]"
    return (
        f"{PARTS}{parts.lstrip(chr(10))}  It:\n    inputs: [go]\n    outputs: [tick]\n{said}\n"
        "actors:\n  go: {type: Clock, period: 2.5 s, offset: 2.5 s}\n  it: {type: It}\n"
        f"connections: [go.output -> it.go]\n{more}\nrun: {{stop: {stop} s}}\n"
    )


TICKING = "on: {refinement: Ticking}, off: "


def test_time_stands_still_in_a_refinement_that_is_not_active() -> None:
    text = switching(TICKING, "on -> off on go, off -> on history on go")
    # Half a second of the period is over at 2.5 s, so the next tick comes half a second after 5 s.
    assert sends(text, "it.on.clock") == [(0, 1, 0), (1, 1, 1), (2, 1, 2), (5.5, 1, 3), (6.5, 1, 4), (7.5, 1, 5)]


def test_a_refinement_that_is_entered_anew_begins_at_the_next_microstep() -> None:
    text = switching(TICKING, "on -> off on go, off -> on on go")
    assert sends(text, "it.on.clock") == [
        (0, 1, 0), (1, 1, 1), (2, 1, 2), (5, 2, 0), (6, 1, 1), (7, 1, 2), (10, 2, 0),
    ]  # fmt: skip


TELLING = """
  Telling:
    outputs: [tick]
    actors: {clock: {type: Clock, period: 1 s}, time: {type: CurrentTime}}
    connections: [clock.output -> time.trigger, time.output -> tick]
"""


@pytest.mark.parametrize(("way", "wanted"), [("", [5.0, 6.0, 7.0]), ("history", [3.0, 4.0, 5.0])])
def test_local_time_begins_with_that_around_it_or_is_behind(way: str, wanted: list[float]) -> None:
    text = switching("on: {refinement: Telling}, off: ", f"on -> off on go, off -> on {way} on go", parts=TELLING)
    assert [value for time, _, value in sends(text, "it.on.time") if 5 <= time < 8] == wanted


def test_the_refinement_fires_before_the_transition_and_the_machine_hears_it() -> None:
    text = switching(TICKING, "on -> off when tick == 2")
    assert sends(text, "it.on.clock") == [(0, 1, 0), (1, 1, 1), (2, 1, 2)]
    assert sends(text, "it.machine") == [(0, 1, "on"), (2, 1, "off")]


def test_a_preemptive_transition_keeps_the_refinement_from_firing() -> None:
    text = switching(TICKING, "on -> off preemptive after 2 s")
    assert sends(text, "it.on.clock") == [(0, 1, 0), (1, 1, 1)]
    text = switching(TICKING, "on -> off preemptive when go_is_present").replace("2.5 s", "2 s")
    assert sends(text, "it.on.clock") == [(0, 1, 0), (1, 1, 1)]


def test_a_machine_that_looks_before_its_refinement_loses_no_token() -> None:
    """Two come together by two connections: each is for a reaction of its own."""
    text = switching("on: {refinement: Ticking}, off: ", "on -> off preemptive on go, off -> on preemptive on go")
    text = text.replace("[go.output -> it.go]", "[go.output -> it.go, go.output -> it.go]")
    assert sends(text, "it.machine")[:5] == [(0, 1, "on"), (2.5, 1, "off"), (2.5, 2, "on"), (5, 1, "off"), (5, 2, "on")]


def test_inputs_reach_the_active_refinement_alone() -> None:
    text = switching("on: {refinement: Delaying}, off: ", "on -> off after 2 s, off -> on history after 2 s")
    for old, new in (("[go]", "[x]"), ("[tick]\n    modes", "[y]\n    modes"), ("it.go", "it.x")):
        text = text.replace(old, new)
    found = sends(text.replace("period: 2.5 s, offset: 2.5 s", "period: 700 ms"), "it.on.delay")
    # Tokens of 0, 0.7 and 1.4 s come in before 2 s; that of 1.4 s waits until 4 s for the rest of its second.
    assert [value for _, _, value in found] == [0, 1, 2, 6, 7, 8, 12]
    assert [time for time, _, _ in found][:4] == pytest.approx([1.0, 1.7, 4.4, 5.2])


ADDING = """
  Adding:
    inputs: [n]
    outputs: [tick]
    actors: {gain: {type: Scale, factor: 10}}
    connections: [n -> gain.input, gain.output -> tick]
"""


def test_variables_are_handed_to_refinements() -> None:
    modes = "a: {refinement: Adding}, b: {refinement: Adding}"
    text = switching(modes, "'a -> b on go do n = n + 1', 'b -> a on go do n = n * 5'", parts=ADDING)
    text = text.replace("    modes:", "    variables: {n: 1}\n    modes:")
    assert sends(text, "it.a.gain") == [(0, 2, 10), (5, 2, 100), (10, 2, 550)]
    assert sends(text, "it.b.gain") == [(2.5, 2, 20), (7.5, 2, 110)]


def inner(transitions: str) -> str:
    """A machine that is a refinement."""
    return f"""
  Inner:
    inputs: [go]
    outputs: [tick]
    modes: {{one: {{refinement: Ticking}}, two: }}
    transitions: [{transitions}]
"""


def test_machines_nest() -> None:
    parts = inner("one -> two after 1500 ms, two -> one history after 1 s")
    text = switching("on: {refinement: Inner}, off: ", "on -> off on go, off -> on history on go", parts=parts)
    # Inside: one from 0 to 1.5, two to 2.5 of its own time, which is 5 outside: one again, its clock half a second on.
    assert sends(text, "it.on.one.clock") == [(0, 1, 0), (1, 1, 1), (5.5, 1, 2), (6.5, 1, 3)]
    modes = [(0, 1, "one"), (1.5, 1, "two"), (2.5, 1, "one"), (6.5, 1, "two"), (7.5, 1, "one")]
    assert sends(text, "it.on.machine") == modes


def test_nested_machines_begin_anew_with_what_is_around_them() -> None:
    parts = inner("one -> two after 1500 ms")
    text = switching("on: {refinement: Inner}, off: ", "on -> off on go, off -> on on go", parts=parts)
    modes = [(0, 1, "one"), (1.5, 1, "two"), (5, 2, "one"), (6.5, 1, "two"), (10, 2, "one")]
    assert sends(text, "it.on.machine") == modes
    assert sends(text, "it.on.one.clock") == [(0, 1, 0), (1, 1, 1), (5, 2, 0), (6, 1, 1), (10, 2, 0)]


FAILING = """
  Failing:
    outputs: [tick]
    actors: {clock: {type: Clock, period: 1 s}, inverse: {type: Expression, expression: "1 / (2 - n)"}}
    connections: [clock.output -> inverse.n, inverse.output -> tick]
"""
FAILURE = "'1 / (2 - n)': 1 / (2 - n) divides by zero, with n = 2"


def test_an_error_in_a_refinement_leads_to_a_transition() -> None:
    transitions = "'on -> off error do said = error', off -> on on go"
    text = switching("on: {refinement: Failing}, off: ", transitions, parts=FAILING)
    found = sends(text.replace("[tick]\n    modes", "[tick, said]\n    modes"), "it.machine")
    assert found[:5] == [(0, 1, "on"), (2, 1, FAILURE), (2, 1, "off"), (2.5, 1, "on"), (4.5, 1, FAILURE)]


@pytest.mark.parametrize(
    "transitions", ["on -> off on go", "off -> on error, on -> off on go", "on -> off error when 1 > 2"]
)
def test_an_error_that_no_transition_takes_ends_the_run(transitions: str) -> None:
    with pytest.raises(ActorError) as caught:
        sends(switching("on: {refinement: Failing}, off: ", transitions, parts=FAILING), "it.machine")
    assert str(caught.value).splitlines()[0] == f"it.on.inverse failed in fire() at (2 s, 1): {FAILURE}"


class Waiting(Process):
    """Sends a number each 1.5 s, as a process."""

    output = OutputPort(int)
    input = InputPort(required=False)

    def run(self) -> Generator[Any, Any, None]:
        number = 0
        while True:
            yield self.environment.timeout(1)
            yield self.wait(0.5)
            self.output.send(number)
            number += 1


@pytest.mark.parametrize(("way", "wanted"), [("history", [(1.5, 0), (5.5, 1), (7, 2)]), ("", [(1.5, 0), (6.5, 0)])])
def test_processes_stand_still_too_and_begin_anew(way: str, wanted: list[tuple[float, int]]) -> None:
    parts = "\n  Of:\n    outputs: [tick]\n    actors: {it: {type: Waiting}}\n    connections: [it.output -> tick]\n"
    text = switching("on: {refinement: Of}, off: ", f"on -> off on go, off -> on {way} on go", parts=parts)
    assert [(time, value) for time, _, value in sends(text, "it.on.it", types=(Waiting,))] == wanted


SCALED = """
  Scaled:
    outputs: [tick]
    actors: {clock: {type: Clock, period: 1 s}, scale: {type: Scale, factor: 1}}
    connections: [clock.output -> scale.input, scale.output -> tick]
"""


def test_aspects_stand_in_refinements_and_go_by_the_mode() -> None:
    more = """aspects:
  loss: {type: PacketLoss, probability: 1, at: seen.input, when: it.mode == 'off'}
  inner: {type: Latency, delay: 250 ms, at: it.on.scale.input}
"""
    transitions = "on -> off on go, off -> on history on go"
    text = switching("on: {refinement: Scaled}, off: ", transitions, more, parts=SCALED)
    text = text.replace("  it: {type: It}\n", "  it: {type: It}\n  seen: {type: Recorder}\n")
    text = text.replace("[go.output -> it.go]", "[go.output -> it.go, go.output -> seen.input]")
    simulation = Simulation(load(text), keep_log=True)
    simulation.run()
    wanted = [(0.25, 1, 0), (1.25, 1, 1), (2.25, 1, 2), (5.75, 1, 3), (6.75, 1, 4)]
    assert sends(text, "it.on.scale") == wanted
    assert simulation["seen"].times.tolist() == [2.5, 7.5]


def test_a_snapshot_goes_on_as_the_run_would_have() -> None:
    model = load(switching(TICKING, "on -> off on go, off -> on history after 1 s, off -> on on go", stop=20))
    whole = Simulation(model).run().digest
    simulation = Simulation(model)
    for time in (0.0, 2.5, 3.1, 7.6):
        simulation.advance(time)
        snapshot = simulation.snapshot()
        assert simulation.fork().run().digest == whole
        simulation.restore(snapshot)
    assert simulation.run().digest == whole


def test_a_copy_of_a_composite_with_modes_is_one_of_its_own() -> None:
    text = switching(TICKING, "on -> off on go, off -> on on go")
    text = text.replace("it: {type: It}", "it: {type: It, count: 3}").replace(
        "[go.output -> it.go]", '["go.output -> it[*].go"]'
    )
    assert sends(text, "it[1].on.clock") == sends(text, "it[2].on.clock") != []


# -- what is said of wrong ones -----------------------------------------------------------------------------------


def wrong(text: str) -> str:
    """The messages of a wrong model, without the file's path."""
    with pytest.raises(ModelError) as caught:
        load(text)
    return re.sub(r"/\S*?m\.yaml", "m.yaml", str(caught.value))


CASES = {case.name: case for case in read(Path(__file__).with_name("wrong.txt"))}


@pytest.mark.parametrize("name", CASES)
def test_what_is_wrong_is_told(name: str) -> None:
    """``python -m tests.modes.test_refinements`` writes all messages anew; read the difference before you keep it."""
    assert wrong(CASES[name].text) + "\n" == CASES[name].message


def test_an_input_that_is_read_in_no_mode_is_told() -> None:
    model = load(switching(TICKING, "on -> off after 1 s, off -> on after 1 s"))
    assert [str(each).partition(": ")[2].splitlines()[0] for each in model.warnings] == [
        "warning: it: no mode reads the input 'go' of It"
    ]


if __name__ == "__main__":
    write(Path(__file__).with_name("wrong.txt"), lambda case: wrong(case.text))
