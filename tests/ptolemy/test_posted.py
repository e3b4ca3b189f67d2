"""PostedDirector: ties in the order of posting."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

from epicycle.actors import Actor, InputPort, OutputPort, Parameter, Pending
from epicycle.ptolemy.changing import Together
from epicycle.runner.execution.engine import Firing, Simulation, Tracer
from tests.engine.engine_parts import Repeat, load, sends, simulate


class Asker(Actor):
    """Asks in advance for all times at which it sends, at the times that it is given."""

    is_source: ClassVar[bool] = True
    output: OutputPort[Any] = OutputPort(Any)
    asks: Parameter[Any] = Parameter(object)  # [when, for when, ...], in s
    calls_off: Parameter[Any] = Parameter(object, [])  # [when, for when]

    def initialize(self) -> None:
        self.wakes: dict[float, Any] = {}
        for when, *_ in self.asks:
            self.wake_at(when)

    def fire(self) -> None:
        for when, wanted in self.calls_off:
            if when == self.now:
                self.wakes[wanted].cancel()
        for when, *wanted in self.asks:
            if when == self.now:
                self.wakes.update({each: self.wake_at(each) for each in wanted})
        if self.now in self.wakes:
            self.output.send(self.now)


class Delay(Actor):
    """Delays by a second, and sends in every firing how much it finds."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any, depends_on=())

    def initialize(self) -> None:
        self.held: Pending[Any] = Pending(self)

    def fire(self) -> None:
        due = self.held.due()
        self.output.send((len(due), len(self.input.tokens)))
        for token in self.input.tokens:
            self.held.put(token, 1.0)


class Pair(Together):
    """Takes the first token of each channel out, and sends them as a list, when all have one."""

    input: InputPort[Any] = InputPort(Any, multi=True)
    output: OutputPort[Any] = OutputPort(Any)

    def fire_once(self) -> None:
        if self.input.present:
            self.output.send(list(self.input.tokens))


TYPES = [Asker, Delay, Pair, Repeat]
HEAD = "director: {like: ptolemy}\n"


def order(text: str, time: float, until: float | None = None) -> list[str]:
    """The actors that send at a time, in order."""
    _, results = simulate(text, until=until, types=TYPES)
    return [port.partition(".")[0] for when, _, port, _ in sends(results) if when == time]


ASKERS = """
actors:
  a: {type: Asker, asks: [[1, 5]]}
  b: {type: Asker, asks: [[0, 5]]}
  c: {type: Asker, asks: [[1, 5]]}
  d: {type: Asker, asks: [[0, 4, 5]], priority: 1}
"""


def test_who_has_asked_first_fires_first() -> None:
    assert order(ASKERS, 5) == ["a", "b", "c", "d"]
    assert order(HEAD + ASKERS, 5) == ["b", "a", "c", "d"]


def test_what_was_called_off_was_not_posted() -> None:
    """The first one repeats its request for the same time, which takes its place in the order from then on."""
    text = """
actors:
  a: {type: Asker, asks: [[0, 5], [2, 5]], calls_off: [[2, 5]]}
  b: {type: Asker, asks: [[1, 5]]}
"""
    assert order(text, 5) == ["a", "b"]
    assert order(HEAD + text, 5) == ["b", "a"]
    assert order(HEAD + text.replace(", calls_off: [[2, 5]]", ""), 5) == ["a", "b"]


def test_tokens_are_posted_when_they_are_put() -> None:
    text = """
actors:
  late: {type: Scale}
  soon: {type: Scale}
  a: {type: Asker, asks: [[0, 1, 2]]}
  b: {type: Asker, asks: [[0, 1], [1.5, 2]], priority: -1}
connections: [a.output -> late.input, b.output -> soon.input]
"""
    assert order(text, 1) == ["b", "a", "late", "soon"]
    assert order(HEAD + text, 1) == ["b", "a", "soon", "late"]


def test_tokens_whose_delay_is_over_are_posted_before_anybody_fires() -> None:
    text = """
actors:
  now: {type: Scale}
  delayed: {type: Scale}
  a: {type: Asker, asks: [[0, 1, 2]]}
connections: [a.output -> now.input, {from: a.output, to: delayed.input, delay: 1 s}]
"""
    assert order(text, 2) == ["delayed", "a", "now"]
    assert order(HEAD + text, 2) == ["a", "delayed", "now"]  # to wake up was asked for before


COMPOSITES = """
composites:
  C:
    parameters: {when: }
    director: {DIRECTOR}
    outputs: [out]
    actors:
      first: {type: Asker, asks: [[1, 5]]}
      second: {type: Asker, asks: [["${when}", 5]]}
    connections: [first.output -> out]
actors:
  one: {type: C, when: 1}
  alone: {type: Asker, asks: [[0.5, 5]]}
  two: {type: C, when: 0}
"""


ONE = ["one.first", "one.second"]
IN_ORDER, POSTED = ["two.first", "two.second"], ["two.second", "two.first"]


@pytest.mark.parametrize(
    ("head", "director", "expected"),
    [
        ("", "", [*ONE, "alone", *IN_ORDER]),
        ("", "like: ptolemy", [*ONE, "alone", *POSTED]),
        (HEAD, "", ["alone", *ONE, *POSTED]),
        # Posted with the first request in it; all that is in it follows, in the order of its own director.
        (HEAD, "like: epicycle", [*IN_ORDER, "alone", *ONE]),
    ],
)
def test_each_composite_has_the_order_of_its_own_director(head: str, director: str, expected: list[str]) -> None:
    text = head + COMPOSITES.replace("DIRECTOR", director)
    got = [port.rpartition(".")[0] for when, _, port, _ in sends(simulate(text, types=TYPES)[1]) if when == 5]
    assert got == expected


def test_a_firing_takes_what_already_waits() -> None:
    """Who fires for a wake-up takes the tokens that are there, too; those that come later are for a later firing."""
    text = """
actors:
  a: {type: Asker, asks: [[0, 0.5, 1.5]]}
  delay: {type: Delay}
connections: [a.output -> delay.input]
"""

    def found(head: str) -> list[Any]:
        return [
            (when, token) for when, _, port, token in sends(simulate(head + text, types=TYPES)[1]) if port[0] == "d"
        ]

    # At 1.5 s the wake-up of the delay was asked for after that of the source, and both are of depth 0.
    assert found("") == [(0.5, (0, 1)), (1.5, (1, 0)), (1.5, (0, 1)), (2.5, (1, 0))]
    assert found(HEAD) == [(0.5, (0, 1)), (1.5, (1, 1)), (2.5, (1, 0))]
    # With another actor between the two turns, Ptolemy's director fires for what is not there any more.
    text += "  - a.output -> p.input\n"
    text = text.replace("connections: [a.output -> delay.input]\n", "  p: {type: Scale}\nconnections:\n")
    text += "  - a.output -> delay.input\n"
    assert found(HEAD) == [(0.5, (0, 1)), (1.5, (1, 1)), (1.5, (0, 0)), (2.5, (1, 0))]


def test_tokens_that_wait() -> None:
    text = """
actors:
  a: {type: Asker, asks: [[0, 1, 2]]}
  b: {type: Asker, asks: [[0, 3]]}
  twice: {type: Repeat}
  pair: {type: Pair}
connections: [a.output -> pair.input, b.output -> twice.input, twice.output -> pair.input]
"""
    _, results = simulate(text, types=TYPES)
    assert [(when, token) for when, _, _, token in sends(results, "pair")] == [(3, [1.0, 3.0]), (3, [2.0, 3.0])]


def test_snapshots_keep_posts_and_tokens() -> None:
    text = """
director: {like: ptolemy}
actors:
  a: {type: Asker, asks: [[0, 1, 2, 4, 5]]}
  b: {type: Asker, asks: [[0, 3], [1, 5]]}
  c: {type: Asker, asks: [[0.5, 5]]}
  pair: {type: Pair}
connections: [a.output -> pair.input, b.output -> pair.input]
"""
    simulation = Simulation(load(text, types=TYPES), keep_log=True)
    simulation.advance(until=2.0)
    snapshot = simulation.snapshot()
    fork = simulation.fork()
    digest = simulation.run().digest
    assert fork.run().digest == digest
    simulation.restore(snapshot)
    results = simulation.run()
    assert results.digest == digest
    assert [token for _, _, _, token in sends(results, "pair")] == [[1.0, 3.0], [2.0, 5.0]]
    assert [port for when, _, port, _ in sends(results) if when == 5] == [
        "a.output",
        "c.output",
        "b.output",
        "pair.output",
    ]


def test_a_traced_run_says_what_a_firing_takes() -> None:
    """The wake-up and the token that waits, in one; the log is that of a run that is not traced."""
    text = """
director: {like: ptolemy}
actors:
  a: {type: Asker, asks: [[0, 0.5, 1.5]]}
  delay: {type: Delay}
  p: {type: Scale}
connections: [a.output -> p.input, a.output -> delay.input]
"""
    model, found = load(text, types=TYPES), list[Firing]()
    tracer = Tracer({"delay": model.graph.actors["delay"]}, found.append)
    digest = Simulation(model, tracer=tracer).run().digest
    assert digest == Simulation(model).run().digest
    told = [(firing.tag.seconds, len(firing.wakes), [each.token for each in firing.arrivals]) for firing in found]
    assert told == [(0.5, 0, [0.5]), (1.5, 1, [1.5]), (1.5, 0, []), (2.5, 1, [])]
