"""Superdense order: which actor fires when, and with what."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import pytest

from epicycle.actors import Tag
from epicycle.runner.execution.engine import LoopError, Simulation, errors
from tests.engine.engine_parts import Plan, Probe, load, seen, sends, simulate


@pytest.mark.parametrize("order", list(permutations(["clock", "double", "join", "probe"])))
def test_declaration_order_does_not_matter(order: tuple[str, ...]) -> None:
    declared = {
        "clock": "{type: Ticker}",
        "double": "{type: Scale, factor: 2}",
        "join": "{type: Join}",
        "probe": "{type: Probe}",
    }
    simulation, results = simulate(
        "actors:\n"
        + "".join(f"  {name}: {declared[name]}\n" for name in order)
        + "connections:\n  - join.output -> probe.input\n  - clock.output, double.output -> join.input\n"
        "  - clock.output -> double.input\n",
        until=1,
    )
    # The join of the diamond fires once a tag, with both tokens.
    assert seen(simulation) == [(0.0, 1, ([[0], [0.0]],)), (1.0, 1, ([[1], [2.0]],))]
    assert results.firings == 8


def test_delays_and_microsteps() -> None:
    simulation, _ = simulate(
        """
actors: {clock: {type: Ticker, limit: 1}, now: {type: Probe}, zero: {type: Probe}, some: {type: Probe}}
connections:
  - clock.output -> now.input
  - {from: clock.output, to: zero.input, delay: 0}
  - {from: clock.output, to: some.input, delay: 250 ms}
"""
    )
    assert seen(simulation, "now") == [(0.0, 1, (0,))]
    assert seen(simulation, "zero") == [(0.0, 2, (0,))]
    assert seen(simulation, "some") == [(0.25, 1, (0,))]


def plan(monkeypatch: pytest.MonkeyPatch, begin: Any = None, act: Any = None, until: float = 10) -> list[Tag]:
    """Run one Plan actor; the tags at which it fired."""
    tags: list[Tag] = []

    def fire(actor: Plan) -> None:
        tags.append(actor.tag)
        if act is not None:
            act(actor)

    monkeypatch.setattr(Plan, "begin", begin)
    monkeypatch.setattr(Plan, "act", fire)
    simulate("actors: {a: {type: Plan}}", until=until)
    return tags


def test_wakes_asked_for_in_initialize(monkeypatch: pytest.MonkeyPatch) -> None:
    def begin(actor: Plan) -> None:
        actor.wake_in(0)
        actor.wake_at(2)
        actor.wake_in(2)  # the same tag: one firing
        actor.wake_at(-3)  # the past: at once

    assert plan(monkeypatch, begin) == [Tag(0, 1), Tag(2 * 10**9, 1)]


def test_wakes_asked_for_in_fire(monkeypatch: pytest.MonkeyPatch) -> None:
    def act(actor: Plan) -> None:
        if actor.tag == Tag(0, 1):
            actor.wake_at(0)
            actor.wake_in(0)
            actor.wake_in(1)
        elif actor.tag == Tag(10**9, 1):
            actor.wake_at(0.5)

    assert plan(monkeypatch, lambda actor: actor.wake_in(0), act) == [
        Tag(0, 1), Tag(0, 2), Tag(10**9, 1), Tag(10**9, 2)
    ]  # fmt: skip


def test_cancelled_wakes(monkeypatch: pytest.MonkeyPatch) -> None:
    wakes: list[Any] = []

    def begin(actor: Plan) -> None:
        wakes.extend([actor.wake_in(1), actor.wake_in(2), actor.wake_in(2), actor.wake_in(3)])
        wakes[0].cancel()
        wakes[1].cancel()

    def act(actor: Plan) -> None:
        wakes[3].cancel()

    assert plan(monkeypatch, begin, act) == [Tag(2 * 10**9, 1)]
    assert [wake.due for wake in wakes] == [False, False, True, False]


def test_a_cancelled_wake_does_not_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Plan, "begin", lambda actor: (actor.wake_in(1), actor.wake_in(9).cancel()))
    monkeypatch.setattr(Plan, "act", None)
    _, results = simulate("actors: {a: {type: Plan}}")
    assert (results.end, results.stopped, results.firings) == (1.0, "no events left", 1)


def test_several_tokens_keep_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Plan, "begin", lambda actor: actor.wake_in(0))
    monkeypatch.setattr(Plan, "act", lambda actor: [actor.output.send(item) for item in "abc"])
    simulation, _ = simulate(
        """
actors: {a: {type: Plan}, now: {type: Probe}, later: {type: Probe}}
connections:
  - a.output -> now.input
  - {from: a.output, to: later.input, delay: 1 ns}
"""
    )
    assert seen(simulation, "now") == [(0.0, 1, ("a", "b", "c"))]
    assert seen(simulation, "later") == [(1e-9, 1, ("a", "b", "c"))]


def test_an_output_that_does_not_depend_on_the_input() -> None:
    simulation, results = simulate(
        """
actors: {scale: {type: Scale, factor: 3}, hold: {type: Register}, probe: {type: Probe}}
connections: [hold.output -> scale.input, scale.output -> hold.input, hold.output -> probe.input]
""",
        until=1,
    )
    assert sends(results) == [
        (0.0, 1, "hold.output", 0.0),
        (0.0, 1, "scale.output", 0.0),
        (1.0, 1, "hold.output", 0.0),
        (1.0, 1, "scale.output", 0.0),
    ]
    # It fires first to send, and again when its input is there: three actors, two tags, one of them twice.
    assert results.firings == 8
    assert [row[:2] for row in seen(simulation)] == [(0.0, 1), (1.0, 1)]


def test_a_loop_through_a_zero_delay_takes_one_microstep_a_lap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(errors, "MAX_MICROSTEPS", 50)
    model = load(
        "actors: {one: {type: Later}, two: {type: Scale}, probe: {type: Probe}}\n"
        "connections: [one.output -> two.input, two.output -> one.input, one.output -> probe.input]\n"
    )

    def carry_on(actor: Any) -> None:
        for token in actor.input.tokens:
            actor.output.send(token)

    monkeypatch.setattr(type(model.graph.actors["two"]), "fire", carry_on)
    simulation = Simulation(model)
    with pytest.raises(LoopError) as caught:
        simulation.run()
    assert str(caught.value) == (
        "time stands still at 0 s: more than 50 microsteps; the last actors that fired: one, two, probe; "
        "give their loop a delay above zero"
    )
    assert [row[1] for row in seen(simulation)] == list(range(2, 51))
    assert isinstance(simulation["probe"], Probe)
    assert simulation["probe"].wrapped == 1


def test_a_process_that_waits_for_no_time_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    def begin(actor: Plan) -> None:
        def spin() -> Any:
            while True:
                yield actor.context.environment.timeout(0)

        actor.context.environment.process(spin())

    monkeypatch.setattr(errors, "MAX_STEPS", 1000)
    monkeypatch.setattr(Plan, "begin", begin)
    with pytest.raises(LoopError, match="more than 1,000 SimPy events"):
        simulate("actors: {a: {type: Plan}}")


@pytest.mark.parametrize(
    ("until", "ticks", "stopped", "end"),
    [
        (2.0, 3, "stop time", 2.0),
        (1.999999999, 2, "stop time", 1.0),
        (None, 4, "no events left", 3.0),
        (9, 4, "no events left", 3.0),
    ],
)
def test_the_stop_time_is_part_of_the_run(until: float | None, ticks: int, stopped: str, end: float) -> None:
    _, results = simulate("actors: {a: {type: Ticker, limit: 4}}", until=until)
    assert (len(sends(results)), results.stopped, results.end) == (ticks, stopped, end)


def test_stop_when_finishes_the_tag() -> None:
    simulation, results = simulate(
        """
actors: {a: {type: Ticker}, b: {type: Scale}, c: {type: Probe}, d: {type: Probe}}
connections: [a.output -> b.input, b.output -> c.input, {from: a.output, to: d.input, delay: 0}]
run: {stop_when: a.output, stop: 9}
"""
    )
    assert (results.stopped, results.end) == ("stop_when", 1.0)
    assert seen(simulation, "c") == [(0.0, 1, (0.0,)), (1.0, 1, (1.0,))]
    assert seen(simulation, "d") == [(0.0, 2, (0,))]  # the next microstep is another tag


def test_a_simulation_runs_once_and_a_model_often() -> None:
    model = load("actors: {a: {type: Ticker}, b: {type: Probe}}\nconnections: [a.output -> b.input]\nrun: {stop: 3}")
    first, second = Simulation(model), Simulation(model)
    assert first.run().digest == second.run().digest == Simulation(model).run().digest
    with pytest.raises(RuntimeError, match="runs once"):
        first.run()
    with pytest.raises(ValueError, match="a seed is a whole number of at least 0"):
        Simulation(model, seed=-1)
