"""The robustness of a monitor while a run goes on, and pauses at what it has come to."""

from __future__ import annotations

import math
from typing import Any

import pytest

from epicycle.actors import EpicycleError
from epicycle.runner.execution.engine import Simulation
from tests.engine.test_monitors import model

RISING = [[0, 1], [2, 3], [4, 7], [7, 2]]


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("{property: always a.output < 8}", [math.inf, 7.0, 7.0, 5.0, 1.0, 1.0]),
        ("{property: always a.output < 5}", [math.inf, 4.0, 4.0, 2.0, -2.0, -2.0]),
        # What comes between 4 s and 7 s may be less.
        ("{property: always a.output < 8, between: linear}", [math.inf, 7.0, 7.0, 5.0, 1.0, 1.0]),
        ("{property: eventually a.output > 6}", [math.inf] * 6),
        ("{property: eventually within 3 s a.output > 6}", [math.inf] * 3 + [-3.0] * 3),
        # At 4 s it is known what was there until 2 s later than 0 s.
        ("{property: always eventually within 2 s a.output > 6}", [math.inf] * 3 + [-3.0, -3.0, -3.0]),
        ("{property: always (a.output > 0 for 3 s)}", [math.inf] * 3 + [1.0] * 3),
        ("{property: always a.output < 8 and always a.output > 0}", [math.inf, 1.0, 1.0, 1.0, 1.0, 1.0]),
        ("{property: always a.output < 8 or always a.output > 0}", [math.inf, 7.0, 7.0, 5.0, 1.0, 1.0]),
        ("{property: always a.output < 8 or eventually a.output > 9}", [math.inf] * 6),
        ("{property: always a.output != 'x'}", [math.inf] * 6),
    ],
)
def test_what_the_robustness_is_at_most(source: str, expected: list[float]) -> None:
    simulation, found = Simulation(model(RISING, f"m: {source}")), []
    for time in (0.0, 1.0, 2.0, 4.0, 7.0, 10.0):
        simulation.advance(time)
        found.append(simulation.robustness("m"))
    assert found == expected
    final = simulation.finish().monitors["m"].robustness
    assert final is None or final <= found[-1]


def test_a_run_pauses_where_a_monitor_has_come_to_something() -> None:
    text = "m: {property: always a.output < 8}\n  n: {property: always b.output < 15}"
    simulation, undisturbed = (Simulation(model(RISING, text), keep_log=True) for _ in range(2))
    seen: list[Any] = []
    for robustness in (6.0, 5.0, 4.0):
        assert simulation.reach({"m": robustness})
        seen.append((simulation.tag.seconds, simulation.robustness("m"), simulation.verdict("n").holds))
    assert seen == [(2.0, 5.0, True), (2.0, 5.0, True), (4.0, 1.0, True)]
    fork = simulation.fork()
    for each in (simulation, fork):
        assert each.reach({"m": 0.0, "n": 0.0})
        assert (each.tag.seconds, each.robustness("n")) == (6.0, -5.0)
        assert not each.reach({"m": 0.0})
    expected = undisturbed.run()
    for each in (simulation, fork):
        found = each.finish()
        assert found.digest == expected.digest
        assert (found.stopped, found.monitors) == (expected.stopped, expected.monitors)
        assert [record.encoded() for record in each.log.records] == [
            record.encoded() for record in undisturbed.log.records
        ]


def test_a_paused_run_is_not_over() -> None:
    simulation = Simulation(model(RISING, "m: {property: always a.output < 8}"))
    assert simulation.reach({"m": 1.0}, until=8.0)
    assert simulation.finish().stopped == "the program"
    simulation = Simulation(model(RISING, "m: {property: always a.output < 8}"))
    assert not simulation.reach({"m": 0.5}, until=5.0)
    found = simulation.finish()
    assert (found.stopped, found.end, found.monitors["m"].robustness) == ("stop time", 4.0, 1.0)


def test_the_last_instant_counts() -> None:
    simulation = Simulation(model([[0, 1], [10, 9]], "m: {property: always a.output < 8}"))
    simulation.advance(10.0)
    assert (simulation.robustness("m"), simulation.verdict("m").robustness) == (7.0, -1.0)
    assert simulation.reach({"m": 0.0})
    assert (simulation.robustness("m"), simulation.verdict("m").robustness) == (-1.0, -1.0)
    assert simulation.finish().monitors["m"].time == 10.0


def test_a_run_that_its_monitor_ends() -> None:
    simulation = Simulation(model(RISING, "m: {property: always a.output < 6, stop: true}"))
    assert simulation.reach({"m": 4.0})
    assert simulation.tag.seconds == 2.0
    found = simulation.run()
    assert (found.stopped, found.end) == ("monitor m", 4.0)


def test_there_is_no_such_monitor() -> None:
    simulation = Simulation(model(RISING, "speed: {property: always a.output < 8}"))
    for ask in (simulation.robustness, simulation.verdict, lambda name: simulation.reach({name: 0.0})):
        with pytest.raises(EpicycleError) as caught:
            ask("sped")
        assert str(caught.value) == ("m has no monitor 'sped', did you mean 'speed'?\n   help: its monitors: speed")
