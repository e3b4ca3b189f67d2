"""Composites with their own director: one actor outside, their own order and time inside."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from epicycle.actors import Actor, InputPort, OutputPort, Tag
from epicycle.aspects import JoinPoint, PortAspect
from epicycle.runner.model.text.problems import ModelError
from tests.engine.engine_parts import Repeat, load, seen, sends, simulate


class Sampler(Actor):
    """Sends what is at its input when it is triggered."""

    input: InputPort[Any] = InputPort(Any, required=False)
    trigger: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        if self.trigger.present and self.input.present:
            self.output.send(self.input.value)


class Twofold(PortAspect):
    """Lets every token through twice at once."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.forward(token)
        point.forward(token)


TYPES = [Repeat, Sampler]
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


def test_watching_a_border() -> None:
    """Signals, metrics and the stop rule hear what leaves a composite when it leaves."""
    text = REPEATS + "run: {record: [source.out], stop_when: twice.out}\nmetrics: {n: {of: twice.out, take: count}}\n"
    _, results = simulate(text.replace("limit: 1", "limit: 9"), types=TYPES)
    assert (results.stopped, results.end, results.metrics["n"]) == ("stop_when", 1.0, 5)
    assert results.signals["source.out"].tags == [Tag(0, 1), Tag(0, 2), Tag(10**9, 1)]


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
