"""The time inside of a composite whose director has a clock of its own."""

from __future__ import annotations

from collections.abc import Generator
from fractions import Fraction
from typing import Any, ClassVar

import pytest
import simpy
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors import Actor, InputPort, OutputPort, Parameter, Process, Tag
from epicycle.aspects import JoinPoint, PortAspect
from epicycle.runner.execution.engine import ActorError
from epicycle.runner.model.graph.clock import Clock
from tests.engine.engine_parts import Plan, seen, sends, simulate


class Time(Actor):
    """Sends the present time and microstep at every token."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        self.output.send((self.now, self.tag.microstep))


class Nap(Process):
    """Counts with a SimPy timeout of 1 s, and sends SimPy's time."""

    is_source: ClassVar[bool] = True
    output: OutputPort[Any] = OutputPort(Any)
    nap = Parameter(float, 1.0)

    def run(self) -> Generator[Any, Any, None]:
        desk = simpy.Resource(self.environment)
        while True:
            with desk.request() as request:
                yield request | self.environment.timeout(7)
                yield self.environment.timeout(self.nap)
            self.output.send((self.environment.now, self.tag.time))


class FixedWait(PortAspect):
    """Holds every token back for a time."""

    seconds = Parameter(float, 1.0, unit="s")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.forward(token, self.seconds)


def local(inside: str, values: str, until: float = 3) -> tuple[Any, Any]:
    """Run a composite with a clock of its own beside a clock of the model."""
    return simulate(
        f"""
composites:
  Clocked:
    parameters: {{drift: 1.0, start: {{value: 0, unit: s}}}}
    inputs: [in]
    outputs: [out]
    director: {{start: "${{start}}", drift: "${{drift}}"}}
{inside}
actors: {{t: {{type: Ticker, period: 1}}, c: {{type: Clocked, {values}}}, probe: {{type: Probe}}}}
connections: [t.output -> c.in, c.out -> probe.input]
""",
        until=until,
        types=[FixedWait, Nap, Time],
    )


TICKS = """
    actors: {tick: {type: Ticker}, time: {type: Time}}
    connections: [tick.output -> time.input, time.output -> out]
"""


def test_local_time_starts_where_it_is_told_to() -> None:
    """As Ptolemy's DEinDEwithStartTimes; the log keeps the time of the model."""
    simulation, results = local(TICKS, "start: 2", until=2)
    assert sends(results, "c.time") == [(t, 1, "c.time.output", (t + 2, 1)) for t in (0.0, 1.0, 2.0)]
    assert seen(simulation) == [(t, 1, ((t + 2, 1),)) for t in (0.0, 1.0, 2.0)]
    local_tag = simulation.model.local_tag
    assert local_tag("c.time", Tag(10**9, 5)) == Tag(3 * 10**9, 5)
    assert local_tag("c", Tag(10**9, 5)) == local_tag("probe", Tag(10**9, 5)) == Tag(10**9, 5)


def test_local_time_drifts() -> None:
    simulation, _ = local(TICKS, "drift: 1.25, start: -1", until=2)
    assert [row[0] for row in seen(simulation)] == [0.0, 0.8, 1.6]
    assert [row[2][0] for row in seen(simulation)] == [(-1.0, 1), (0.0, 1), (1.0, 1)]


def test_delays_aspects_and_simpy_inside_go_by_local_time() -> None:
    inside = """
    actors: {nap: {type: Nap}, time: {type: Time}, join: {type: Join}, late: {type: Scale}}
    connections:
      - {from: in, to: late.input, delay: 0.5}
      - late.output -> time.input
      - time.output, nap.output -> join.input
      - join.output -> out
    aspects: {wait: {type: FixedWait, at: late.output, seconds: 1}}
"""
    simulation, _ = local(inside, "drift: 2, start: 10", until=1.75)
    nap = [(t / 2, (t + 10.0, (t + 10) * 10**9)) for t in (1, 2, 3)]
    joined = [(time, delayed, napped) for time, _, ([delayed, napped],) in seen(simulation)]
    assert [(time, token) for time, _, tokens in joined for token in tokens] == nap
    # Sent at 0 s and 1 s, local 10 s and 12 s; half a second on the way and one more by the aspect, both local.
    assert [(time, token) for time, tokens, _ in joined for token in tokens] == [(0.75, (11.5, 1)), (1.75, (13.5, 1))]


def test_clocks_within_clocks() -> None:
    inside = """
    actors: {inner: {type: Inner, drift: 0.5}}
    connections: [inner.out -> out]
  Inner:
    parameters: {drift: 1.0}
    outputs: [out]
    director: {drift: "${drift}"}
    actors: {tick: {type: Ticker}, time: {type: Time}}
    connections: [tick.output -> time.input, time.output -> out]
"""
    simulation, _ = local(inside, "drift: 4, start: 3", until=1)
    assert [(row[0], row[2][0]) for row in seen(simulation)] == [(0.0, (3.0, 1)), (0.5, (4.0, 1)), (1.0, (5.0, 1))]


def test_wakes_for_now_and_the_past_come_at_the_next_microstep(monkeypatch: pytest.MonkeyPatch) -> None:
    tags: list[tuple[float, int]] = []

    def act(actor: Any) -> None:
        tags.append((actor.now, actor.tag.microstep))
        if len(tags) < 3:
            assert actor.wake_at(actor.now - 0.5 * (len(tags) - 1)).tag == Tag(actor.tag.time, len(tags) + 1)
        elif len(tags) == 3:
            assert actor.wake_in(1).tag == Tag(actor.tag.time + 10**9, 1)

    monkeypatch.setattr(Plan, "begin", lambda actor: actor.wake_in(1))
    monkeypatch.setattr(Plan, "act", act)
    local("    actors: {plan: {type: Plan}}\n    connections: [plan.output -> out]", "drift: 0.7, start: 5")
    assert tags == [(6.0, 1), (6.0, 2), (6.0, 3), (7.0, 1)]


@given(
    start=st.integers(-(10**18), 10**18),
    drift=st.floats(1e-6, 1e6),
    time=st.integers(0, 10**18),
    ahead=st.integers(1, 10**15),
)
def test_a_clock_shows_each_time_at_the_first_moment_it_can(start: int, drift: float, time: int, ahead: int) -> None:
    clock = Clock().inside(start, drift)
    assert clock.local(0) == start
    wanted = clock.local(time) + ahead
    moment = clock.outer(wanted)
    assert moment > time
    assert clock.local(moment) >= wanted > clock.local(moment - 1)
    assert clock.local(moment) - wanted < max(1, clock.rate)
    if clock.rate <= 1:
        assert clock.local(moment) == wanted
    assert clock.span(time, ahead) == moment - time
    assert Clock().inside(None, 0.1).rate == Fraction(1, 10)


def test_processes_inside_send_at_the_first_open_microstep() -> None:
    inside = "    actors: {nap: {type: Nap}}\n    connections: [nap.output -> out]"
    simulation, results = local(inside, "start: 1", until=2)
    assert [row[:2] for row in sends(results, "c.nap")] == [(1.0, 1), (2.0, 1)]
    assert [row[:2] for row in seen(simulation)] == [(1.0, 1), (2.0, 1)]


def test_an_error_inside_names_the_actor_and_the_time_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Time, "fire", lambda actor: actor.input.nothing)
    with pytest.raises(ActorError) as caught:
        local(TICKS, "start: 2")
    first, at, line, carets, second = str(caught.value).splitlines()
    assert first == "c.time failed in fire() at (0 s, 1): AttributeError: 'InputPort' object has no attribute 'nothing'"
    assert at.startswith("   raised at ")
    assert line.endswith('monkeypatch.setattr(Time, "fire", lambda actor: actor.input.nothing)')
    assert line[carets.index("^") :] == "actor.input.nothing)"
    assert second.startswith("   declared at ")
    assert second.endswith("m.yaml:10:36")
