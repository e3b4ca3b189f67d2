"""Clocks that are wrong, to the nanosecond: against integers, and against composites with a director of that drift."""

from __future__ import annotations

import math
from collections.abc import Generator
from fractions import Fraction
from typing import Any

import pytest
from scipy import stats

from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort
from epicycle.aspects import ClockAspect, ClockDrift, ClockOffset
from epicycle.runner import ModelError, Simulation, load_model
from epicycle.runner.execution.engine import Results
from epicycle.runner.model.catalogue.packaged import packaged_models
from tests.engine.engine_parts import Script, load, sends, simulate


class Teller(Actor):
    """Sends the time that it sees, for every token, and at 1.5 s on its clock."""

    is_source = True
    input: InputPort[Any] = InputPort(Any, required=False)
    output: OutputPort[Any] = OutputPort(Any)

    def initialize(self) -> None:
        self.wake_at(1.5)

    def fire(self) -> None:
        self.output.send(self.tag.time)


TEXT = """
actors:
  t: {{type: Clock, period: 0.3 s}}
  teller: {{type: Teller}}
  late: {{type: TimeDelay, delay: 0.7 s}}
connections: [t.output -> teller.input, teller.output -> late.input]
aspects:
{}
run: {{stop: 100 s}}
"""


def run(*aspects: str, text: str = TEXT, **options: Any) -> Results:
    return simulate(
        text.format("".join(f"  a{n}: {{{each}}}\n" for n, each in enumerate(aspects))), types=[Teller], **options
    )[1]


def times(results: Results, actor: str) -> list[int]:
    return [r.tag.time for r in results.log.records if r.event == "send" and r.actor == actor]


@pytest.mark.parametrize("gain", ["50e-6", "-50e-6", "0.1", "-0.3", "1e-9", "2"])
def test_wake_ups_come_at_drifted_times(gain: str) -> None:
    rate = 1 + Fraction(gain)
    results = run(f"type: ClockDrift, gain: {gain}, at: t")
    ticks = times(results, "t")
    # The first nanosecond of the model at which the clock shows the time of the tick.
    assert ticks == [math.ceil(k * 300_000_000 / rate) for k in range(len(ticks))]
    assert ticks[-1] > 99e9
    # The others know the right time.
    assert {value for *_, value in sends(results, "teller")} == {*ticks, 1_500_000_000}


@pytest.mark.parametrize("gain", ["50e-6", "-0.3"])
def test_an_actor_sees_its_own_time(gain: str) -> None:
    rate = 1 + Fraction(gain)
    results = run(f"type: ClockDrift, gain: {gain}, at: teller")
    seen = list(zip(times(results, "teller"), [value for *_, value in sends(results, "teller")], strict=True))
    assert all(value == math.floor(rate * time) for time, value in seen)
    assert (math.ceil(1_500_000_000 / rate), 1_500_000_000) in seen
    # Who delays its tokens, and has a right clock, delays them by the right time.
    assert times(results, "late")[:100] == [time + 700_000_000 for time, _ in seen][:100]


@pytest.mark.parametrize(("offset", "first"), [("400 ms", 1_100_000_000), ("-400 ms", 1_900_000_000), ("2 s", 1)])
def test_an_offset(offset: str, first: int) -> None:
    ahead = {"400 ms": 400_000_000, "-400 ms": -400_000_000, "2 s": 2_000_000_000}[offset]
    results = run(f"type: ClockOffset, offset: {offset}, at: '**'")
    assert times(results, "t") == [k * 300_000_000 for k in range(334)]  # its clock counts from when it was started
    seen = list(zip(times(results, "teller"), [value for *_, value in sends(results, "teller")], strict=True))
    assert all(value == time + ahead for time, value in seen)
    alone = [time for time, _ in seen if time % 300_000_000]
    assert alone == ([first] if first > 1 else [])  # 1.5 s on a clock that is past it is at once


def test_errors_of_one_clock_add_up() -> None:
    results = run("type: ClockDrift, gain: 0.5, at: teller", "type: ClockOffset, offset: 1 s, at: teller",
                  "type: ClockDrift, gain: 0.1, at: ['**', '!t', '!late']")  # fmt: skip
    seen = zip(times(results, "teller"), [value for *_, value in sends(results, "teller")], strict=True)
    assert all(value == 1_000_000_000 + math.floor(Fraction("1.65") * time) for time, value in seen)


COMPOSITE = """
composites:
  Robot:
    inputs: [go]
    outputs: [said]
    {}
    actors: {{t: {{type: Clock, period: 0.3 s}}, teller: {{type: Teller}}, late: {{type: TimeDelay, delay: 0.7 s}},
              script: {{type: Script}}}}
    connections: [t.output -> teller.input, teller.output -> late.input, late.output -> said, go -> script.input]
actors: {{t: {{type: Ticker, period: 1.7 s}}, robot: {{type: Robot}}}}
connections: [t.output -> robot.go]
aspects:
  lag: {{type: ExecutionTime, time: 0 s, at: t}}
  {}
run: {{stop: 50 s}}
"""


@pytest.mark.parametrize("gain", ["0.0001", "-0.25", "0.5"])
def test_a_composite_is_as_one_with_a_director_of_that_drift(gain: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def behaviour(self: Script) -> Generator[Any, Any, None]:
        while True:
            token = yield self.read(self.input)
            yield self.wait(0.1) | self.environment.timeout(0.3)
            yield self.environment.timeout(0.2)
            self.output.send((token, self.now, self.environment.now))

    monkeypatch.setattr(Script, "behaviour", behaviour)
    rate = repr(float(1 + Fraction(gain)))
    found, expected = (
        sorted((r.tag.time, r.actor, repr(r.value)) for r in simulate(text, types=[Teller])[1].log.records)
        for text in (
            COMPOSITE.format("", f"wrong: {{type: ClockDrift, gain: {gain}, at: robot}}"),
            COMPOSITE.format(f"director: {{drift: {rate}}}", ""),
        )
    )
    assert len(found) > 300
    assert found == expected


@pytest.mark.parametrize(
    ("aspect", "law"),
    [
        ("type: ClockDrift, gain: 0.01, deviation: 0.002", stats.norm(0.01, 0.002)),
        ("type: ClockOffset, offset: 0.01 s, deviation: 2 ms", stats.norm(0.01, 0.002)),
    ],
)
def test_each_clock_has_an_error_of_its_own(aspect: str, law: Any) -> None:
    text = """
composites:
  Pair:
    inputs: [go]
    actors: {{a: {{type: Teller}}, b: {{type: Teller}}}}
    connections: [go -> a.input, go -> b.input]
actors: {{t: {{type: SingleEvent, time: 1000 s}}, pair: {{type: Pair, count: 300}}}}
connections: ["t.output -> pair[*].go"]
aspects:
{}
run: {{stop: 1000 s}}
"""
    results = run(f'{aspect}, at: "pair[*]"', text=text, seed=3)
    shown = {(r.actor, r.value) for r in results.log.records if r.actor != "t" and r.tag.time == 1_000_000_000_000}
    by_actor = dict(shown)
    errors = [(by_actor[f"pair[{i}].a"] - 1_000_000_000_000) / 1e9 for i in range(300)]
    assert [by_actor[f"pair[{i}].b"] for i in range(300)] == [by_actor[f"pair[{i}].a"] for i in range(300)]
    scale = 1000 if "Drift" in aspect else 1
    assert stats.kstest([error / scale for error in errors], law.cdf).pvalue > 0.001
    same = run(f'{aspect}, at: "pair[7]"', text=text, seed=3)
    assert [r.value for r in same.log.records if r.actor == "pair[7].a"][-1] == by_actor["pair[7].a"]


@pytest.mark.slow
@pytest.mark.parametrize("aspect", [ClockDrift(), ClockOffset()])
def test_strength_zero_changes_no_bit(aspect: ClockAspect) -> None:
    for name in packaged_models():
        model = load_model(name, set=["observers=1"] if name == "collision_avoidance" else [])
        until = model.stop / 50 if model.stop else 1.0
        bare = Simulation(model).run(until=until).digest
        model.weave("zero", aspect, at="**")
        assert Simulation(model).run(until=until).digest == bare


def test_a_crash_and_a_delay_beside_a_wrong_clock() -> None:
    """A crash goes by the time of the model, and so does the way to the actor."""
    results = run(
        "type: ClockDrift, gain: 1, at: teller", "type: Latency, delay: 0.1 s, at: teller.input",
        "type: CrashRestart, times: [10.05 s], repair: 2 s, at: teller",
    )  # fmt: skip
    seen = times(results, "teller")
    assert seen[:3] == [100_000_000, 400_000_000, 700_000_000]
    assert [r.tag.seconds for r in results.log.records if r.event in ("crashed", "restarted")] == [10.05, 12.05]
    assert not any(10_050_000_000 < time < 12_050_000_000 for time in seen)


WHOLE = "a clock is wrong for the whole run; leave out "


@pytest.mark.parametrize(
    ("aspect", "message"),
    [
        ("type: ClockDrift, gain: 0.1, at: t, until: 3 s", WHOLE + "'until'"),
        ("type: ClockOffset, at: t, when: t.output > 2", WHOLE + "'when'"),
        ("type: ClockDrift, gain: 0.1, at: t.output", "ClockDrift attaches to actors, but t.output is a port"),
    ],
)
def test_what_is_wrong(aspect: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        load(TEXT.format(f"  it: {{{aspect}}}\n"), types=[Teller])
    assert [problem.message for problem in caught.value.problems] == [f"aspect it: {message}"]


def test_bounds() -> None:
    with pytest.raises(EpicycleError) as caught:
        ClockDrift(gain=-1)
    assert str(caught.value) == "ClockDrift.gain: -1 is out of bounds, expected a number from -0.999999 to 1000000"


class Fixed:
    """A stream that always draws the same."""

    def __init__(self, draw: float) -> None:
        self.draw = draw

    def standard_normal(self) -> float:
        return self.draw


@pytest.mark.parametrize(
    ("aspect", "draw", "error"),
    [
        (ClockDrift(gain=0.1), 2.0, (0, Fraction(11, 10))),
        (ClockDrift(gain=0.25, deviation=0.5), -2.0, (0, Fraction(1, 4))),
        (ClockDrift(gain=0.25, deviation=0.5), 0.5, (0, Fraction(3, 2))),
        (ClockDrift(gain=-0.5, deviation=1.0), -3.0, (0, Fraction(1, 1_000_000))),  # it never stands still
        (ClockDrift(gain=-0.5, deviation=0.499999), -1.0, (0, Fraction(1, 1_000_000))),
        (ClockDrift(gain=-0.5, deviation=0.4999), -1.0, (0, Fraction(1, 10_000))),
        (ClockOffset(offset=1.5), 3.0, (1_500_000_000, Fraction(1))),
        (ClockOffset(offset=1.5, deviation=0.25), -2.0, (1_000_000_000, Fraction(1))),
        (ClockOffset(offset=-1.0, deviation=0.5), 4.0, (1_000_000_000, Fraction(1))),
    ],
)
def test_the_error_of_a_clock(aspect: ClockAspect, draw: float, error: tuple[int, Fraction]) -> None:
    assert aspect.error(Fixed(draw)) == error  # type: ignore[arg-type]
