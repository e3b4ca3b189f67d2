"""State machines: what a reaction is, flows and guards that are events, and what is said of wrong ones."""

from __future__ import annotations

import math
from typing import Any

import pytest

from epicycle.actors import (
    InputPort,
    ModalActor,
    OutputPort,
    ParameterError,
    StateMachine,
    on_entry,
    on_exit,
    transition,
)
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.execution.engine.errors import ActorError
from tests.actors.feeding import Events, feed, load, model_of
from tests.modes.machines import disagreement


def sent(
    machine: dict[str, Any], inputs: dict[str, Events] | None = None, until: float = 100.0
) -> list[tuple[float, int, str, Any]]:
    """What a machine sends: time, microstep, port and value."""
    model = model_of({"type": "StateMachine", **machine}, inputs or {})
    results = Simulation(model, keep_log=True).run(until=until)
    return [
        (record.tag.seconds, record.tag.microstep, record.port, record.value)
        for record in results.log.records
        if record.actor == "it" and record.event == "send"
    ]


# -- against the reference ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_random_machines_are_the_same_in_a_file_in_python_and_in_the_reference() -> None:
    found = {seed: disagreement(seed) for seed in range(50)}
    assert {seed: each for seed, each in found.items() if each is not None} == {}


@pytest.mark.slow
def test_ten_thousand_random_machines_are() -> None:
    found = {seed: disagreement(seed) for seed in range(50, 10_050)}
    assert {seed: each for seed, each in found.items() if each is not None} == {}


# -- reactions, clause by clause ----------------------------------------------------------------------------------


def test_it_begins_in_its_first_mode_or_in_the_initial_one() -> None:
    assert sent({"modes": ["a"]}) == [(0.0, 1, "mode", "a")]
    machine = {"modes": ["a", "b"], "initial": "b", "transitions": ["b -> a after 1 s"]}
    assert sent(machine) == [(0.0, 1, "mode", "b"), (1.0, 1, "mode", "a")]


def test_one_reaction_a_tag_and_the_next_one_microstep_later() -> None:
    machine = {"modes": ["a", "b", "c"], "transitions": ["a -> b", "b -> c"]}
    assert sent(machine) == [(0.0, 1, "mode", "b"), (0.0, 2, "mode", "c")]


def test_immediate_transitions_are_taken_in_the_same_reaction() -> None:
    machine = {"modes": ["a", "b", "c"], "transitions": ["a -> b do x = 1", "b -> c immediate do x = 2"]}
    assert sent(machine) == [(0.0, 1, "x", 1), (0.0, 1, "x", 2), (0.0, 1, "mode", "c")]


def test_immediate_transitions_that_never_end_are_an_error() -> None:
    machine = {"modes": ["a", "b"], "transitions": ["a -> b immediate", "b -> a immediate"]}
    with pytest.raises(ActorError) as caught:
        sent(machine)
    assert str(caught.value).splitlines()[0] == (
        "it failed in fire() at (0 s, 1): 1,000 immediate transitions in one reaction: b -> a -> ..."
    )


def test_tokens_that_come_together_are_for_one_reaction_each() -> None:
    machine = {"modes": ["a", "b"], "transitions": ["a -> b on x do y = x", "b -> a on x do y = -x"]}
    assert sent(machine, {"x": [(1.0, 5), (1.0, 6)]}) == [
        (0.0, 1, "mode", "a"),
        (1.0, 1, "y", 5),
        (1.0, 1, "mode", "b"),
        (1.0, 2, "y", -6),
        (1.0, 2, "mode", "a"),
    ]


def test_a_guard_that_asks_for_an_absent_input_does_not_hold() -> None:
    machine = {
        "modes": ["a", "b"],
        "transitions": ["a -> b on y when x > 1 or y > 1", "b -> a when not x_is_present and y > 1"],
    }
    events = {"x": [(2.0, 5)], "y": [(1.0, 5), (2.0, 0), (3.0, 2)]}
    assert sent(machine, events) == [(0.0, 1, "mode", "a"), (2.0, 1, "mode", "b"), (3.0, 1, "mode", "a")]


def test_held_inputs_count_with_their_latest_token() -> None:
    machine = {"modes": ["a", "b"], "held": {"x": None, "y": 1}, "transitions": ["a -> b when x > y"]}
    assert sent(machine, {"x": [(1.0, 1)], "y": [(2.0, 0)]}) == [(0.0, 1, "mode", "a"), (2.0, 1, "mode", "b")]


def test_a_delay_counts_from_the_entry_also_from_the_mode_itself() -> None:
    machine = {"modes": ["a", "b"], "transitions": ["a -> b after 3 s", "a -> a on x"]}
    assert sent(machine, {"x": [(2.0, 0)]})[1:] == [(2.0, 1, "mode", "a"), (5.0, 1, "mode", "b")]


def test_a_delay_may_be_computed_and_waits_for_its_guard() -> None:
    machine = {
        "modes": ["a", "b"],
        "variables": {"wait": 2},
        "transitions": ["a -> b after wait / 4 when x > 0", "b -> a after 1500 ms do wait = 2 * wait"],
    }
    events = {"x": [(0.25, 1), (1.0, 0), (2.0, 1), (4.25, 1), (4.5, 1)]}
    times = [(time, value) for time, _, port, value in sent(machine, events) if port == "mode"]
    assert times == [(0.0, "a"), (2.0, "b"), (3.5, "a"), (4.5, "b"), (6.0, "a")]


def test_the_lower_priority_goes_first_and_else_comes_last() -> None:
    machine = {
        "modes": ["a", "low", "high", "rest"],
        "transitions": [
            "a -> high priority 2 when x > 1",
            "a -> low priority 1 when x > 2",
            "a -> rest else when x_is_present",
            "low, high, rest -> a after 100 ms",
        ],
    }
    events = {"x": [(1.0, 2), (2.0, 3), (3.0, 0)]}
    modes = [value for _, _, port, value in sent(machine, events) if value != "a"]
    assert modes == ["high", "low", "rest"]


def test_two_that_are_enabled_at_once_are_an_error() -> None:
    machine = {"modes": ["a", "b", "c"], "transitions": ["a -> b when x > 1", "a -> c when x > 2"]}
    with pytest.raises(ActorError) as caught:
        sent(machine, {"x": [(1.0, 2.5)]})
    assert str(caught.value).splitlines()[0] == (
        "it failed in fire() at (1 s, 1): in mode 'a', a -> b and a -> c are enabled at once: give one a priority (the "
        "lower one goes first), or make all nondeterministic"
    )


def test_of_nondeterministic_ones_one_is_drawn_by_the_seed() -> None:
    machine = {
        "type": "StateMachine",
        "modes": ["a", "b", "c"],
        "transitions": ["a -> b nondeterministic on x", "a -> c nondeterministic on x", "b, c -> a after 100 ms"],
    }
    events: dict[str, Events] = {"x": [(float(time), 0) for time in range(1, 401)]}
    share = [value for _, value in feed(machine, events)[1]["mode"]].count("b") / 400
    assert abs(share - 0.5) < 4 * math.sqrt(0.25 / 400)
    assert feed(machine, events)[1] == feed(machine, events)[1]
    assert feed(machine, events, seed=1)[1] != feed(machine, events)[1]


def test_entry_and_exit_actions_stand_around_the_transition() -> None:
    machine = {
        "modes": {"a": {"exit": "x = 1; n = n + 1"}, "b": {"entry": "x = 3"}},
        "variables": {"n": 0},
        "transitions": ["a -> b after 1 s do x = 2; x = 10 * n"],
    }
    assert [value for _, _, port, value in sent(machine) if port == "x"] == [1, 2, 10, 3]


def test_in_a_final_mode_nothing_happens() -> None:
    machine = {"modes": {"a": {}, "b": {"final": True}}, "transitions": ["* -> b on x", "a -> a after 1 s"]}
    assert sent(machine, {"x": [(1.5, 0), (3.0, 0)]})[-1] == (1.5, 1, "mode", "b")


def test_preemptive_transitions_go_before_all_others() -> None:
    machine = {"modes": ["a", "b", "c"], "transitions": ["a -> b on x", "a -> c preemptive priority 9 on x"]}
    assert sent(machine, {"x": [(1.0, 0)]})[-1] == (1.0, 1, "mode", "c")


def test_an_input_is_handed_on_as_it_came() -> None:
    machine = {"modes": ["a"], "transitions": ["a -> a on x do y = x; z = x['n'] + 1"]}
    tokens = [value for _, _, port, value in sent(machine, {"x": [(1.0, {"n": 3})]}) if port in "yz"]
    assert tokens == [{"n": 3}, 4]


def test_types_of_outputs_follow_from_the_actions() -> None:
    machine = StateMachine(
        "it",
        modes=["a"],
        variables={"n": 0, "on": True, "name": "x", "list": []},
        transitions=["a -> a on go do s = 'x'; t = n > 1; f = n + go; u = go; v = name; w = str(n)"],
    )
    types = {name: port.type for name, port in machine.outputs.items()}
    assert types == {
        "mode": str, "n": float, "on": bool, "name": str, "list": Any, "s": str, "t": bool, "f": float, "u": Any,
        "v": str, "w": str,
    }  # fmt: skip


# -- flows, and guards that are events ----------------------------------------------------------------------------

THERMOSTAT: dict[str, Any] = {
    "variables": {"temperature": 20},
    "modes": {
        "heating": {"flow": {"temperature": "3 - 0.1 * temperature"}},
        "idle": {"flow": {"temperature": "-0.1 * temperature"}},
    },
    "transitions": ["heating -> idle when temperature >= 22", "idle -> heating when temperature <= 18"],
}


def test_a_thermostat_switches_when_the_formula_says() -> None:
    times = [time for time, _, _, _ in sent(THERMOSTAT, until=40)]
    first = 10 * math.log((30 - 20) / (30 - 22))
    down, up = 10 * math.log(22 / 18), 10 * math.log((30 - 18) / (30 - 22))
    wanted = [0.0, first]
    while wanted[-1] < 40:
        wanted.append(wanted[-1] + (down if len(wanted) % 2 == 0 else up))
    assert times == pytest.approx(wanted[:-1], abs=1e-7)


def test_a_ball_bounces_when_the_formula_says_and_comes_to_rest() -> None:
    ball = {
        "variables": {"height": 10, "speed": 0},
        "modes": {"falling": {"flow": {"height": "speed", "speed": -9.81}}, "resting": {}},
        "transitions": [
            "falling -> resting priority -1 when height <= 0 and speed > -0.5 do speed = 0; height = 0",
            "falling -> falling when height <= 0 and speed < 0 do speed = -0.8 * speed; bounce = speed",
        ],
    }
    time = math.sqrt(20 / 9.81)
    speed, wanted = 9.81 * time, []
    while speed > 0.5:
        speed *= 0.8
        wanted.append((time, speed))
        time += 2 * speed / 9.81
    found = sent(ball)
    bounces = [each for at, _, port, value in found if port == "bounce" for each in (at, value)]
    assert bounces == pytest.approx([each for pair in wanted for each in pair], rel=1e-8)
    assert found[-1][2:] == ("mode", "resting")
    assert found[-1][0] == pytest.approx(time, abs=2e-9)


def test_a_comparison_that_a_transition_leaves_on_its_border_is_no_event_again() -> None:
    saw = {
        "variables": {"x": 0},
        "modes": {"up": {"flow": {"x": 1}}},
        "transitions": ["up -> up when x >= 2 do x = 0; top = time"],
    }
    assert [value for _, _, port, value in sent(saw, until=9) if port == "top"] == pytest.approx([2, 4, 6, 8])


def test_a_flow_goes_by_held_inputs_and_by_what_other_modes_left() -> None:
    tank = {
        "variables": {"level": 0},
        "held": {"inflow": 0.5},
        "modes": {"open": {"flow": {"level": "inflow - 0.25 * 2"}}, "closed": {"flow": {"level": "inflow"}}},
        "initial": "closed",
        "transitions": ["closed -> open when level > 3", "open -> closed when level < 1"],
    }
    events = {"inflow": [(1.0, 1.0), (10.0, 0.0)]}
    times = [time for time, _, _, _ in sent(tank, events, until=40)]
    # 0.5 after 1 s, 3 after another 2.5 s; up by 0.5 in each second until 10 s, then down by as much.
    assert times == pytest.approx([0.0, 3.5, 10 + (3 + 0.5 * 6.5 - 1) / 0.5], abs=2e-9)


def test_times_are_events_without_a_solver() -> None:
    machine = {
        "modes": ["a", "b"],
        "held": {"limit": 5},
        "transitions": ["a -> b when mode_time > limit", "b -> a when time >= 12 and 2 < mode_time"],
    }
    found = sent(machine, {"limit": [(4.0, 8), (7.5, 7)]})
    times = [(time, value) for time, _, _, value in found]
    assert times[:5] == [(0.0, "a"), (7.5, "b"), (12.0, "a"), (19.0, "b"), (21.0, "a")]


def test_variables_are_told_when_they_are_asked_for() -> None:
    machine = {**THERMOSTAT, "transitions": []}
    machine["modes"] = {"heating": machine["modes"]["heating"]}
    found = sent(machine, {"trigger": [(1.0, 0), (2.0, 0)]})
    assert [value for _, _, port, value in found if port == "temperature"] == pytest.approx(
        [30 - 10 * math.exp(-0.1), 30 - 10 * math.exp(-0.2)], rel=1e-10
    )


def test_a_guard_that_is_at_once_at_its_border_again_is_told() -> None:
    ball = {
        "variables": {"height": 1, "speed": 0},
        "modes": {"falling": {"flow": {"height": "speed", "speed": -9.81}}},
        "transitions": ["falling -> falling when height <= 0 and speed < 0 do speed = -0.1 * speed"],
    }
    with pytest.raises(ActorError) as caught:
        sent(ball)
    assert str(caught.value).splitlines()[0].partition("): ")[2] == (
        "in mode 'falling', 'speed < 0' returned to its border at once after a transition had moved it off: it may "
        "repeat without end (Zeno); leave the mode earlier"
    )


# -- in Python ----------------------------------------------------------------------------------------------------


class Door(ModalActor):
    """Opens for a while."""

    modes = ("closed", "open")
    button = InputPort(required=False)
    lamp = OutputPort(str)

    def initialize(self) -> None:
        super().initialize()
        self.opened = 0

    @transition("closed", "open", on="button", when=lambda self: self.opened < 2)
    @transition("open", "open", on="button")
    def opens(self) -> None:
        self.opened += 1

    @transition("open", "closed", after="5 s")
    def closes(self) -> None:
        """Nothing more."""

    @on_entry("open")
    def light(self) -> None:
        self.lamp.send("green")

    @on_exit("open")
    def darken(self) -> None:
        self.lamp.send("red")


def test_transitions_may_be_methods() -> None:
    events: Events = [(1.0, 0), (3.0, 0), (20.0, 0)]
    _, found, _ = feed({"type": "Door"}, {"button": events}, types=[Door])
    assert found["mode"] == [(0.0, "closed"), (1.0, "open"), (3.0, "open"), (8.0, "closed")]
    assert found["lamp"] == [(1.0, "green"), (3.0, "red"), (3.0, "green"), (8.0, "red")]


def test_a_class_with_a_wrong_trigger_is_refused() -> None:
    class Wrong(ModalActor):
        modes = ("a",)
        button = InputPort(required=False)

        @transition("a", "a", on="buton")
        def again(self) -> None:
            """Nothing."""

    with pytest.raises(ParameterError) as caught:
        Wrong("it")
    assert str(caught.value) == "a -> a: there is no input 'buton', did you mean 'button'? inputs: button"


# -- snapshots, crashes, traces -----------------------------------------------------------------------------------


def test_a_snapshot_of_a_machine_goes_on_as_it_would_have() -> None:
    model = model_of({"type": "StateMachine", **THERMOSTAT}, {"trigger": [(float(each), 0) for each in range(1, 40)]})
    whole = Simulation(model).run(until=40).digest
    simulation = Simulation(model)
    for time in (0.5, 4.0, 11.3, 25.0):
        simulation.advance(time)
        snapshot = simulation.snapshot()
        assert simulation.fork().run(until=40).digest == whole
        simulation.restore(snapshot)
    assert simulation.run(until=40).digest == whole


def test_a_machine_that_crashes_begins_anew() -> None:
    model = load(
        """
model: m
actors:
  it: {type: StateMachine, modes: [a, b], transitions: [a -> b after 2 s, b -> a after 2 s]}
  seen: {type: Recorder}
connections: [it.mode -> seen.input]
aspects:
  crash: {type: CrashRestart, at: it, times: [3 s], repair: 1 s}
run: {stop: 7 s}
"""
    )
    results = Simulation(model, keep_log=True).run()
    found = [(each.tag.seconds, each.value) for each in results.log.records if each.port == "mode"]
    assert found == [(0.0, "a"), (2.0, "b"), (4.0, "a"), (6.0, "b")]


def test_a_variable_may_be_called_error() -> None:
    machine: dict[str, Any] = {
        "type": "StateMachine",
        "variables": {"error": 3},
        "modes": {"a": None, "b": {"entry": "y = error + 1"}},
        "transitions": ["a -> b on x"],
    }
    assert [value for *_, port, value in sent(machine, {"x": [(1.0, 1)]}) if port == "y"] == [4]
