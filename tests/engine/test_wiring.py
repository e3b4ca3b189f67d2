"""Multiports, composites and what they send; errors of actors."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.actors import Actor, EpicycleError
from epicycle.runner.execution.engine import ActorError, Simulation
from tests.engine.engine_parts import Plan, load, seen, sends, simulate


def test_channels_are_in_the_order_of_the_connections() -> None:
    simulation, _ = simulate(
        """
actors:
  t: {type: Ticker, limit: 1}
  a: {type: Scale, factor: 1}
  b: {type: Scale, factor: 3}
  join: {type: Join}
  probe: {type: Probe}
  s: {type: Scale, count: 2, factor: "${index + 10}"}
connections:
  - from: t.output
    to: [a.input, b.input, "s[*].input"]
  - b.output -> join.input
  - from: ["s[*].output", a.output]
    to: join.input
  - b.output -> join.input
  - join.output -> probe.input
"""
    )
    assert seen(simulation) == [(0.0, 1, ([[0.0], [0.0], [0.0], [0.0], [0.0]],))]
    join = simulation["join"]
    assert [wire.source.path for wire in simulation.model.graph.wires_to(join.inputs["input"])] == [
        "b.output", "s[0].output", "s[1].output", "a.output", "b.output"
    ]  # fmt: skip


SPREAD = """
composites:
  Box:
    inputs: [in]
    outputs: [out]
    actors: {{spread: {{type: Spread, to: {to}}}}}
    connections: [in -> spread.input, spread.output -> out]
  Case:
    inputs: [in]
    actors: {{probe: {{type: Probe}}, other: {{type: Probe}}}}
    connections: [in -> probe.input, in -> other.input]
actors:
  t: {{type: Ticker, limit: 1}}
  box: {{type: Box}}
  one: {{type: Probe}}
  case: {{type: Case}}
  two: {{type: Probe}}
connections:
  - t.output -> box.in
  - box.out -> one.input, case.in
  - {{from: box.out, to: two.input, delay: 1 s}}
"""


def test_one_channel_through_composites() -> None:
    simulation, results = simulate(SPREAD.format(to=-1))
    spread = simulation["box.spread"]
    assert spread.outputs["output"].width == 4
    assert seen(simulation, "one") == [(0.0, 1, ("0/0",))]
    assert seen(simulation, "case.probe") == [(0.0, 1, ("0/1",))]
    assert seen(simulation, "case.other") == [(0.0, 1, ("0/2",))]
    assert seen(simulation, "two") == [(1.0, 1, ("0/3",))]
    assert [record.channel for record in results.log.records] == [None, 0, 1, 2, 3]


@pytest.mark.parametrize("to", [4, 99])
def test_a_channel_that_is_not_there(to: int) -> None:
    with pytest.raises(ActorError) as caught:
        simulate(SPREAD.format(to=to))
    assert str(caught.value).splitlines()[0] == (
        f"box.spread failed in fire() at (0 s, 1): box.spread.output has no channel {to}: "
        "it has 4 channels, counted from 0"
    )


def test_composites_three_deep_and_arrays() -> None:
    simulation, results = simulate(
        """
composites:
  Inner:
    parameters: {factor: 2.0}
    inputs: [in]
    outputs: [out]
    actors: {scale: {type: Scale, factor: "${factor}"}}
    connections: [in -> scale.input, scale.output -> out]
  Middle:
    parameters: {n: 2}
    inputs: [in]
    outputs: [out]
    actors: {inner: {type: Inner, count: "${n}", factor: "${index + 1.0}"}}
    connections: ["in -> inner[*].in", "inner[*].out -> out"]
  Outer:
    inputs: [in]
    outputs: [out]
    actors: {middle: {type: Middle, n: 3}}
    connections: [in -> middle.in, middle.out -> out]
actors:
  t: {type: Ticker, limit: 2}
  outer: {type: Outer, count: 2}
  after: {type: Scale, count: 0}
  probe: {type: Probe, count: 2}
connections:
  - "t.output -> outer[*].in"
  - "outer[*].out -> probe[*].input"
run: {record: ["outer[*].out", "outer[0].middle.inner[2].out"]}
metrics: {most: {of: "outer[*].out", take: max}, many: {of: "*.out", take: count}}
"""
    )
    assert seen(simulation, "probe[0]") == seen(simulation, "probe[1]") == [
        (0.0, 1, (0.0, 0.0, 0.0)), (1.0, 1, (1.0, 2.0, 3.0))
    ]  # fmt: skip
    assert results.signals["outer[1].out"].tokens == [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]
    assert results.signals["outer[0].middle.inner[2].out"].tokens == [0.0, 3.0]
    assert results.metrics == {"most": 3.0, "many": 12}
    assert results.table()["signal"][:2] == ["outer[0].out", "outer[0].out"]


def test_metrics() -> None:
    takes = ("last", "first", "min", "max", "sum", "mean", "count")
    _, results = simulate(
        "actors: {t: {type: Ticker}, never: {type: Scale}, s: {type: Scale, factor: -2}, z: {type: Ticker, count: 0}}\n"
        "connections: [t.output -> s.input, {from: s.output, to: never.input, delay: 99}]\nmetrics:\n"
        + "".join(f"  {take}: {{of: s.output, take: {take}}}\n" for take in takes)
        + "".join(f"  no_{take}: {{of: never.output, take: {take}}}\n" for take in takes)
        + '  empty: {of: "z[*].output", take: mean}\n',
        until=3,
    )
    assert results.metrics == {
        "last": -6.0, "first": 0.0, "min": -6.0, "max": 0.0, "sum": -12.0, "mean": -3.0, "count": 4,
        "no_last": None, "no_first": None, "no_min": None, "no_max": None, "no_sum": 0, "no_mean": None, "no_count": 0,
        "empty": None,
    }  # fmt: skip


def test_metrics_of_what_is_not_a_number() -> None:
    for factor, take in [("inf", "sum"), ("inf", "max"), ("-inf", "mean")]:
        _, results = simulate(
            f"actors: {{t: {{type: Ticker}}, s: {{type: Scale, factor: .{factor}}}}}\n".replace(".-", "-.")
            + f"connections: [t.output -> s.input]\nmetrics: {{x: {{of: s.output, take: {take}}}}}",
            until=2,
        )
        assert results.metrics["x"] is None
        assert results.outcomes["x"].missing == "s.output sent nan at 0 s"  # 0 * inf


def fails(monkeypatch: pytest.MonkeyPatch, error: Exception, **methods: Any) -> tuple[ActorError, list[str]]:
    """Run a model whose actor a fails; the error, and which actors were wrapped up."""

    def fail(actor: Actor) -> None:
        raise error

    wrapped: list[str] = []
    monkeypatch.setattr(Plan, "wrapup", lambda actor: wrapped.append(actor.path), raising=False)
    for name in methods:
        monkeypatch.setattr(Plan, name, lambda actor, name=name: fail(actor) if actor.path == "a" else actor.wake_in(0))
    model = load("actors:\n  z: {type: Plan}\n  a: {type: Plan}\n  y: {type: Plan}\n")
    with pytest.raises(ActorError) as caught:
        Simulation(model).run()
    assert caught.value.__cause__ is error
    return caught.value, wrapped


def test_an_exception_in_fire(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Plan, "begin", lambda actor: actor.wake_in(1.5))
    error, wrapped = fails(monkeypatch, ZeroDivisionError("division by zero"), act=True)
    message, _, line, carets, declared = str(error).splitlines()
    assert message == "a failed in fire() at (1.5 s, 1): ZeroDivisionError: division by zero"
    assert line[carets.index("^") :] == "raise error"
    assert declared == f"   declared at {error.where}"
    assert error.where.endswith("m.yaml:4:3")
    assert wrapped == ["z", "a", "y"]


def test_an_error_of_our_own_in_fire(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Plan, "begin", lambda actor: actor.wake_in(0))
    error, _ = fails(monkeypatch, EpicycleError("no such luck"), act=True)
    assert str(error).splitlines()[0] == "a failed in fire() at (0 s, 1): no such luck"


def test_an_exception_in_initialize(monkeypatch: pytest.MonkeyPatch) -> None:
    error, wrapped = fails(monkeypatch, KeyError("x"), begin=True)
    assert str(error).splitlines()[0] == "a failed in initialize() at (0 s, 1): KeyError: 'x'"
    assert wrapped == ["z"]  # the others were not initialized


def test_exceptions_in_wrapup(monkeypatch: pytest.MonkeyPatch) -> None:
    error, _ = fails(monkeypatch, OSError("disk full"), wrapup=True)
    assert str(error).splitlines()[0] == "a failed in wrapup() at (0 s, 1): OSError: disk full"


def test_an_exception_in_wrapup_does_not_hide_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    first = ValueError("first")

    def fail(actor: Plan) -> None:
        raise first if actor.context.tag.microstep == 1 else OSError("second")

    monkeypatch.setattr(Plan, "begin", lambda actor: actor.wake_in(0))
    monkeypatch.setattr(Plan, "act", fail)
    monkeypatch.setattr(Plan, "wrapup", fail, raising=False)
    with pytest.raises(ActorError, match="ValueError: first"):
        simulate("actors: {a: {type: Plan}}")


@pytest.mark.parametrize("method", ["initialize", "wrapup"])
def test_nothing_is_sent_before_and_after(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Plan, method, lambda actor: actor.output.send(1), raising=False)
    with pytest.raises(ActorError) as caught:
        simulate("actors: {a: {type: Plan}}")
    assert str(caught.value).splitlines()[0] == (
        f"a failed in {method}() at (0 s, 1): a.output cannot send now: "
        "send tokens only in fire() or run() of a running model"
    )


def test_recording_a_composite_with_a_delay_inside() -> None:
    _, results = simulate(
        """
composites:
  Slow: {outputs: [out], actors: {t: {type: Ticker}}, connections: [{from: t.output, to: out, delay: 0.5 s}]}
actors: {slow: {type: Slow}}
run: {record: [slow.out, slow.t.output], stop: 1.5}
"""
    )
    assert results.signals["slow.out"].times.tolist() == [0.5, 1.5]
    assert results.signals["slow.t.output"].times.tolist() == [0.0, 1.0]
    assert sends(results, "slow.t") == [(0.0, 1, "slow.t.output", 0), (1.0, 1, "slow.t.output", 1)]
