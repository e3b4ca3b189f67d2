"""Actors by themselves: outside of a run, entering one, starting again."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from epicycle.actors import (
    Actor,
    Clock,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    PortError,
    PortParameter,
    declared_ports,
)
from epicycle.actors.testing import Harness


class Gauge(Actor):
    """Sends a factor that may change."""

    trigger = InputPort(object)
    output = OutputPort(float)
    factor = PortParameter(float, 2.0)

    def fire(self) -> None:
        if self.trigger.present:
            self.output.send(self.factor)


class Odd(Actor):
    """Has what ports a test wants."""

    names: tuple[str, ...] = ()

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        return {name: InputPort(float) if number % 2 else OutputPort(float) for number, name in enumerate(self.names)}


def test_outside_of_a_run_there_is_no_time() -> None:
    gauge = Gauge("site.gauge")
    for ask in (lambda: gauge.now, lambda: gauge.tag, lambda: gauge.random, lambda: gauge.wake_in(1.0)):
        with pytest.raises(RuntimeError) as caught:
            ask()
        assert str(caught.value) == "site.gauge is not part of a running model"
    # Python may ask for what there is not, and copy.
    assert not hasattr(gauge.context, "__array__")
    assert copy.copy(gauge.context).__dict__ == gauge.context.__dict__


def test_who_says_nothing_of_firing_cannot_fire() -> None:
    with pytest.raises(NotImplementedError) as caught:
        Odd("a").fire()
    assert str(caught.value) == "Odd has no fire()"


def test_nobody_is_taken_to_go_on_for_ever_who_does_not_say_so() -> None:
    assert not Odd("a").is_endless
    assert Clock("clock", period=1).is_endless


@pytest.mark.parametrize("begin_anew", ["restart", "enter"])
def test_whoever_begins_anew_forgets_what_came(begin_anew: str) -> None:
    harness = Harness(Gauge("gauge"), widths={"factor": 1})
    harness.fire(0.0, trigger=0)
    harness.fire(1.0, trigger=0, factor=5)
    harness.fire(2.0, trigger=0)
    if begin_anew == "restart":
        harness.actor.restart()
    else:
        harness.actor.enter(harness)
    harness.fire(3.0, trigger=0)
    assert harness.sent["output"] == [(0.0, 2.0), (1.0, 5.0), (2.0, 5.0), (3.0, 2.0)]


def test_a_stream_goes_on_within_a_run_and_begins_anew_in_the_next() -> None:
    harness = Harness(Gauge("gauge"), seed=3)
    actor = harness.actor
    drawn = [actor.random.random(), actor.random.random(), actor.random_stream("b").random()]
    assert actor.random is actor.random_stream("")
    actor.restart()  # its streams go on
    drawn.append(actor.random.random())
    assert len(set(drawn)) == 4
    actor.enter(harness)
    assert [actor.random.random(), actor.random.random(), actor.random_stream("b").random()] == drawn[:3]
    assert Harness(Gauge("gauge"), seed=4).actor.random.random() != drawn[0]
    assert Harness(Gauge("other"), seed=3).actor.random.random() != drawn[0]


def test_wake_ups_are_counted_from_now_or_from_the_start() -> None:
    harness = Harness(Gauge("gauge"))
    harness.fire(2.5)
    asked = [harness.actor.wake_in(0.25).tag, harness.actor.wake_at(3.0).tag, harness.actor.wake_in(0.0).tag]
    assert [(tag.time, tag.microstep) for tag in asked] == [(2_750_000_000, 1), (3_000_000_000, 1), (2_500_000_000, 2)]


def test_a_wake_up_is_called_off() -> None:
    harness = Harness(Gauge("gauge"))
    wake = harness.actor.wake_in(1.0)
    assert (wake.due, wake.cancelled) == (False, False)
    wake.cancel()
    assert (wake.due, wake.cancelled) == (False, True)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("1a",), "'1a' cannot be the name of a port: use letters, digits and _, and no digit first"),
        (("ä",), "'ä' cannot be the name of a port: use letters, digits and _, and no digit first"),
    ],
)
def test_names_of_own_ports(monkeypatch: pytest.MonkeyPatch, names: tuple[str, ...], message: str) -> None:
    monkeypatch.setattr(Odd, "names", names)
    with pytest.raises(PortError) as caught:
        Odd("a")
    assert str(caught.value) == message


def test_own_ports_beside_those_of_the_class(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Odd, "names", ("out", "put"))
    odd = Odd("a")
    assert (list(odd.inputs), list(odd.outputs)) == (["put"], ["out"])
    assert (odd.inputs["put"].path, odd.outputs["out"].path) == ("a.put", "a.out")
    odd.move("b.c")
    assert (odd.path, odd.inputs["put"].path, odd.outputs["out"].path) == ("b.c", "b.c.put", "b.c.out")
    assert not hasattr(odd, "put")

    class Twice(Odd):
        put = InputPort(float)
        names = ("out", "put")

    with pytest.raises(PortError) as caught:
        Twice("a")
    assert str(caught.value) == "there would be two ports named 'put'"


class Band(Actor):
    """Says whether a token lies between two levels."""

    input = InputPort()
    output = OutputPort()
    low = Parameter(float, 0.0)
    high = Parameter(float, 1.0)

    def check(self) -> None:
        if self.low > self.high:
            raise ParameterError(f"low is {self.low:g} and high is {self.high:g}: low must not be above high")
        self.output.type = bool


def test_check_sees_parameters_and_ports_of_an_instance() -> None:
    band = Band("band", low=0.5)
    assert (band.input.type, band.output.type, Band("b").outputs["output"].type) == (Any, bool, bool)
    assert declared_ports(Band)["output"].type is Any  # of the class, as it was
    with pytest.raises(ParameterError) as caught:
        Band("band", low=2.0)
    assert str(caught.value) == "low is 2 and high is 1: low must not be above high"


def test_what_has_no_input_beside_parameters_is_a_source() -> None:
    class Source(Actor):
        output = OutputPort(float)
        rate = PortParameter(float, 1.0)

    class Filter(Source):
        input = InputPort(float, required=False)

    class Oscillator(Filter):
        is_source = True

    kinds = (Source, Filter, Oscillator, Odd, Band)
    assert (
        [each.is_source for each in kinds]
        == [each("a").is_source for each in kinds]
        == [True, False, True, False, False]
    )
