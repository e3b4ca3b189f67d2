"""The kit for tests of an actor by itself: its runs are those of a model."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy

from epicycle.actors import (
    Actor,
    AddSubtract,
    Clock,
    InputPort,
    MostRecent,
    OutputPort,
    Process,
    Scale,
    Server,
    Station,
    Stop,
    TimeDelay,
)
from epicycle.actors.testing import Harness
from tests.actors.feeding import feed


def test_tokens_come_at_their_times() -> None:
    harness = Harness(Scale("scale", factor=3))
    harness.run(until=2.0, input=[(0.5, 1.0), (1.5, 2.0), (2.5, 3.0)])
    assert harness.sent["output"] == [(0.5, 3.0), (1.5, 6.0)]
    assert (harness.tokens("output"), harness.last("output"), harness.stopped) == ([3.0, 6.0], 6.0, None)


def test_a_run_is_that_of_a_model() -> None:
    given = {"input": [(0.0, "a"), (0.5, "b"), (0.5, "c"), (2.0, "d")]}
    for kind, parameters in ((TimeDelay, {"delay": 0.25}), (Server, {"service_time": 1.0, "capacity": 2})):
        harness = Harness(kind("it", **parameters))
        harness.run(10.0, **given)
        _, sent, _ = feed({"type": kind.__name__, **parameters}, given)
        assert harness.sent == sent


def test_a_wake_up_and_a_token_of_one_tag_are_one_firing() -> None:
    class Both(Actor):
        input = InputPort()
        output = OutputPort()

        def initialize(self) -> None:
            self.wake = self.wake_at(1.0)

        def fire(self) -> None:
            self.output.send((self.input.present, self.wake.due))

    harness = Harness(Both("both"))
    harness.run(2.0, input=[(1.0, "x")])
    assert harness.sent["output"] == [(1.0, (True, True))]


def test_channels_and_ports_that_nothing_is_connected_to() -> None:
    harness = Harness(AddSubtract("sum"), widths={"plus": 3})
    harness.run(1.0, plus=[(0.0, [1, None, 3]), (1.0, [None, 5])])
    assert harness.sent["output"] == [(0.0, 4), (1.0, 5)]
    latest = Harness(MostRecent("latest"), widths={"input": 2, "output": 2})
    latest.run(1.0, input=[(0.0, ["a", "b"])], trigger=[(0.5, 0)])
    assert list(zip(latest.channels["output"], latest.tokens("output"), strict=True)) == [(0, "a"), (1, "b")]


def test_an_actor_that_wakes_itself_goes_on_where_it_was() -> None:
    harness = Harness(Clock("clock", period=0.5))
    harness.run(0.5)
    harness.run(1.4)
    assert harness.sent["output"] == [(0.0, 0), (0.5, 1), (1.0, 2)]
    assert [wake.tag.seconds for wake in harness.wakes] == [1.5]


def test_who_ends_the_run() -> None:
    harness = Harness(Stop("stop"))
    harness.run(9.0, input=[(1.0, [False]), (2.0, [True]), (3.0, [True])])
    assert (harness.stopped, harness.tag.seconds) == ("actor stop", 2.0)


class Patient(Process):
    """Reads, waits, and uses SimPy's own time."""

    input = InputPort()
    output = OutputPort()

    def run(self) -> Generator[simpy.Event, Any, None]:
        while True:
            token = yield self.read(self.input)
            yield self.wait(0.5)
            self.output.send(token)
            yield self.environment.timeout(1)
            self.output.send(token)


def test_a_process_runs_too() -> None:
    harness = Harness(Patient("patient"))
    harness.run(5.0, input=[(0.0, "a"), (1.0, "b")])
    assert harness.sent["output"] == [(0.5, "a"), (1.5, "a"), (2.0, "b"), (3.0, "b")]
    station = Harness(Station("station", service_time={"type": "Constant", "value": 2}))
    station.run(9.0, input=[(0.0, "a"), (0.0, "b")], urgent=[(1.0, "c")])
    assert station.sent["output"] == [(2.0, "a"), (4.0, "c"), (6.0, "b")]
