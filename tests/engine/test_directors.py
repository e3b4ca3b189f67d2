"""Composites with their own director: one actor outside, their own order and time inside."""

from __future__ import annotations

from collections.abc import Generator
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
import pytest
import simpy
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors import Actor, InputPort, OutputPort, Parameter, Process, Tag
from epicycle.aspects import JoinPoint, PortAspect
from epicycle.runner.execution.engine import ActorError
from epicycle.runner.model.graph.clock import Clock
from epicycle.runner.model.text.problems import ModelError
from tests.engine.engine_parts import Plan, Repeat, load, seen, sends, simulate


class Time(Actor):
    """Sends the present time and microstep at every token."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        self.output.send((self.now, self.tag.microstep))


class Sampler(Actor):
    """Sends what is at its input when it is triggered."""

    input: InputPort[Any] = InputPort(Any, required=False)
    trigger: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        if self.trigger.present and self.input.present:
            self.output.send(self.input.value)


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


class Twofold(PortAspect):
    """Lets every token through twice at once."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.forward(token)
        point.forward(token)


TYPES = [FixedWait, Repeat, Time, Sampler, Nap]
REPEATS = """
composites:
  Source:
    outputs: [out]
    director: {}
    actors: {t: {type: Ticker, limit: 1}, twice: {type: Repeat}}
    connections: [t.output -> twice.input, twice.output -> out]
  Twice:
    inputs: [in]
    outputs: [out]
    director: {}
    actors: {twice: {type: Repeat}}
    connections: [in -> twice.input, twice.output -> out]
actors: {source: {type: Source}, twice: {type: Twice}, probe: {type: Probe}, middle: {type: Probe}}
connections: [source.out -> twice.in, source.out -> middle.input, twice.out -> probe.input]
"""


def test_one_token_of_each_channel_passes_a_border_at_a_tag() -> None:
    """As Ptolemy's transferInputsandOutputs: what is left follows at the next microsteps."""
    simulation, results = simulate(REPEATS, types=TYPES)
    assert seen(simulation, "middle") == [(0.0, 1, (0,)), (0.0, 2, (0,))]
    assert seen(simulation) == [(0.0, microstep, (0,)) for microstep in (1, 2, 3, 4)]
    assert [row[1:3] for row in sends(results)] == [
        (1, "source.t.output"),
        *[(1, "source.twice.output")] * 2,
        *[(1, "twice.twice.output")] * 2,
        *[(2, "twice.twice.output")] * 2,
    ]


def test_aspects_at_a_port_of_a_composite_stand_outside_of_its_border() -> None:
    """What one doubles at an input passes the border one by one; at an output, it has passed it already."""
    simulation, _ = simulate(
        """
composites:
  C:
    inputs: [in]
    outputs: [out]
    director: {}
    actors: {inner: {type: Probe}, later: {type: Scale}}
    connections: [in -> inner.input, in -> later.input, later.output -> out]
actors: {t: {type: Ticker, limit: 1}, u: {type: Ticker, limit: 1}, c: {type: C}, d: {type: C}, probe: {type: Probe},
         other: {type: Probe}}
connections: [t.output -> c.in, c.out -> probe.input, u.output -> d.in, d.out -> other.input]
aspects: {first: {type: Twofold, at: c.in}, second: {type: Twofold, at: d.out}}
""",
        types=[*TYPES, Twofold],
    )
    assert seen(simulation, "c.inner") == [(0.0, 1, (0,)), (0.0, 2, (0,))]
    assert seen(simulation, "d.inner") == [(0.0, 1, (0,))]
    assert seen(simulation, "other") == [(0.0, 1, (0.0, 0.0))]


def test_channels_pass_a_border_side_by_side() -> None:
    simulation, _ = simulate(
        """
composites:
  C:
    inputs: [in]
    outputs: [out]
    director: {}
    actors: {join: {type: Join}, spread: {type: Spread}}
    connections: [in -> join.input, join.output -> spread.input, spread.output -> out]
actors: {a: {type: Ticker}, b: {type: Ticker, limit: 1}, twice: {type: Repeat}, c: {type: C},
         one: {type: Probe}, two: {type: Probe}}
connections: [a.output -> c.in, b.output -> twice.input, twice.output -> c.in, c.out -> one.input, c.out -> two.input]
""",
        until=1,
        types=TYPES,
    )
    # The second token of b, which a border holds back, comes at microstep 2; the channels keep their numbers inside.
    joined = [(0.0, 1, "[[0], [0]]"), (0.0, 2, "[[], [0]]"), (1.0, 1, "[[1], []]")]
    for channel, probe in enumerate(("one", "two")):
        assert seen(simulation, probe) == [(t, m, (f"{text}/{channel}",)) for t, m, text in joined]


PLANT = """
composites:
  Gain:
    inputs: [in]
    outputs: [out]
    {director}
    actors: {{a: {{type: Scale, factor: 2}}, b: {{type: Scale, factor: 3}}}}
    connections: [in -> a.input, a.output -> b.input, b.output -> out]
  Pair:
    inputs: [in]
    outputs: [out, raw]
    {director}
    actors: {{inner: {{type: Gain}}, t: {{type: Ticker, period: 0.5}}, join: {{type: Join}}}}
    connections:
      - in -> inner.in
      - inner.out -> out, join.input
      - t.output -> join.input
      - {{from: join.output, to: raw, delay: 0.25}}
actors:
  t: {{type: Ticker, period: 0.3}}
  pair: {{type: Pair}}
  other: {{type: Scale}}
  join: {{type: Join}}
  probe: {{type: Probe}}
connections:
  - t.output -> pair.in, other.input
  - pair.out, other.output -> join.input
  - join.output, pair.raw -> probe.input
aspects: {{loss: {{type: PacketLoss, probability: 0.3, at: "**.inner.in"}}}}
"""


def test_without_a_clock_of_its_own_nothing_is_received_otherwise() -> None:
    """Where no token is held back, only the order of firing may differ from that of a transparent composite."""
    plain, bordered = (
        simulate(PLANT.format(director=director), until=5, seed=3) for director in ("doc: transparent", "director: {}")
    )
    assert seen(plain[0]) == seen(bordered[0])
    assert sorted(map(repr, sends(plain[1]))) == sorted(map(repr, sends(bordered[1])))
    assert plain[1].aspects == bordered[1].aspects
    assert plain[1].aspects["loss"]["dropped"] > 0


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
        types=TYPES,
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


def test_random_streams_do_not_depend_on_directors() -> None:
    text = "aspects: {loss: {type: PacketLoss, probability: 0.5, at: '*.in'}}\n" + REPEATS
    counts = [
        simulate(text.replace("director: {}", director).replace("limit: 1", "limit: 40"), types=TYPES, seed=5)[
            1
        ].aspects
        for director in ("director: {}", "director: {drift: 2}")
    ]
    assert counts[0] == counts[1]
    assert 20 < counts[0]["loss"]["dropped"] < 60


LOOP = """
composites:
  C1:
    inputs: [port]
    outputs: [s, tick]
    director: {}
    actors: {sampler: {type: Sampler}, clock: {type: Ticker}}
    connections: [port -> sampler.input, sampler.output -> s, clock.output -> tick, clock.output -> sampler.trigger]
actors: {c1: {type: C1}, probe: {type: Probe}}
connections:
  - c1.tick -> c1.port
  - c1.s -> probe.input
"""


def test_a_composite_cannot_feed_itself_within_the_tag() -> None:
    """As Ptolemy's DEFixedPointLimitation: it fires as one, so the clock would have to fire before the clock."""
    with pytest.raises(ModelError) as caught:
        load(LOOP, types=TYPES)
    text = str(caught.value)
    assert text.replace(text.partition("m.yaml")[0], "") == (
        "m.yaml:12:5: error: a loop without delay: c1 -> c1\n"
        "   12 |   - c1.tick -> c1.port\n"
        "      |     ^^^^^^^\n"
        "   help: c1.tick -> c1.port (m.yaml:12)\n"
        "   help: c1 has its own director: it fires as one actor, when all inputs that act in the tag have come\n"
        "   help: give one of these connections a delay, preferably the one that leads back: "
        "{from: c1.tick, to: c1.port, delay: ...}"
    )
    simulation, _ = simulate(LOOP.replace("    director: {}\n", ""), until=1, types=TYPES)  # transparent, it can
    assert seen(simulation) == [(0.0, 1, (0,)), (1.0, 1, (1,))]


def test_a_composite_that_delays_may_stand_in_a_loop() -> None:
    """Its output does not depend on the input within the tag: it fires to send, and again when its input is there."""
    text = """
composites:
  Hold:
    inputs: [in]
    outputs: [out]
    DIRECTOR
    actors: {hold: {type: Register}, other: {type: Register}, same: {type: Scale}}
    connections: [in -> hold.input, in -> other.input, hold.output -> same.input, same.output -> out]
actors: {hold: {type: Hold}, more: {type: Add}, probe: {type: Probe}}
connections: [hold.out -> more.input, more.output -> hold.in, more.output -> probe.input]
"""

    class Add(Actor):
        input = InputPort(float)
        output = OutputPort(float)

        def fire(self) -> None:
            self.output.send(self.input.value + 1)

    plain = simulate(text.replace("DIRECTOR", ""), until=3, types=[Add])
    bordered = simulate(text.replace("DIRECTOR", "director: {}"), until=3, types=[Add])
    assert seen(plain[0]) == seen(bordered[0]) == [(float(t), 1, (t + 1.0,)) for t in range(4)]


def test_processes_inside_send_at_the_first_open_microstep() -> None:
    inside = "    actors: {nap: {type: Nap}}\n    connections: [nap.output -> out]"
    simulation, results = local(inside, "start: 1", until=2)
    assert [row[:2] for row in sends(results, "c.nap")] == [(1.0, 1), (2.0, 1)]
    assert [row[:2] for row in seen(simulation)] == [(1.0, 1), (2.0, 1)]


def test_watching_a_border() -> None:
    """Signals, metrics and the stop rule hear what leaves a composite when it leaves."""
    text = REPEATS + "run: {record: [source.out], stop_when: twice.out}\nmetrics: {n: {of: twice.out, take: count}}\n"
    _, results = simulate(text.replace("limit: 1", "limit: 9"), types=TYPES)
    assert (results.stopped, results.end, results.metrics["n"]) == ("stop_when", 1.0, 5)
    assert results.signals["source.out"].tags == [Tag(0, 1), Tag(0, 2), Tag(10**9, 1)]


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


@pytest.mark.parametrize("seed", range(5))
def test_priority_orders_equal_depths(seed: int) -> None:
    numbers = list(range(-3, 4))
    np.random.default_rng(seed).shuffle(numbers)
    _, results = simulate(
        "actors:\n  t: {type: Ticker, limit: 1}\n"
        + "".join(f"  a{index}: {{type: Scale, priority: {number}}}\n" for index, number in enumerate(numbers))
        + "  same: {type: Scale, count: 3, priority: '${-index}'}\n"
        + "  c: {type: C, priority: -9}\n"
        + "composites:\n  C: {inputs: [in], director: {}, actors: {a: {type: Scale}, b: {type: Scale, priority: -1}},"
        + " connections: ['in -> a.input, b.input']}\n"
        + "connections: ['t.output -> "
        + ", ".join(f"a{index}.input" for index in range(7))
        + ", same[*].input, c.in']\n"
    )
    rank = {f"a{index}": number for index, number in enumerate(numbers)} | {f"same[{i}]": -i for i in range(3)}
    expected = ["t", "c.b", "c.a", *sorted(rank, key=rank.__getitem__)]
    assert [row[2].rpartition(".")[0] for row in sends(results)] == expected


DRIFTS = "is out of bounds, expected a number from 1e-06 to 1000000"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("director: {}", "director: {strat: 1}"), "the director of 'C' has no key 'strat', did you mean 'start'?"),
        (("director: {}", "director: {start: 1 m}"), "c: director.start: '1 m' is a length, expected a time in s"),
        (
            ("director: {}", "director: {drift: 0}"),
            "c: director.drift: 0 is out of bounds, expected a number from 1e-06 to 1000000",
        ),
        (
            ("director: {}", "director: {drift: -1}"),
            "c: director.drift: -1 is out of bounds, expected a number from 1e-06 to 1000000",
        ),
        (("director: {}", "director: 3"), "the director of 'C' is not a mapping"),
        (("    director: {}\n", ""), "c: C has no priority, because its actors fire one by one"),
        (("priority: 2", "priority: first"), "c: priority: 'first' is not an integer"),
        (("priority: 2", "priority: 0.5"), "c: priority: 0.5 is not an integer"),
    ],
)
def test_wrong_directors_and_priorities(change: tuple[str, str], message: str) -> None:
    text = "composites:\n  C:\n    director: {}\n    actors: {a: {type: Ticker}}\nactors: {c: {type: C, priority: 2}}\n"
    load(text)
    with pytest.raises(ModelError) as caught:
        load(text.replace(*change))
    assert str(caught.value).splitlines()[0].partition("error: ")[2] == message
