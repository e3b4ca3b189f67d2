"""Runs limited to a simulated wall clock."""

from __future__ import annotations

import time

import pytest

from epicycle.runner.execution.engine import SLOWEST, Pace, Simulation
from tests.engine.engine_parts import Plan, load

START = 128.0


class Wall:
    """A clock that only sleep and work advance."""

    def __init__(self) -> None:
        self.now = START

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.mark.parametrize(
    ("factor", "work", "starts", "end", "behind"),
    [
        (1.0, [0.0] * 4, [0.0, 1.0, 2.0, 3.0], 3.5, (0.0, 0.0)),
        (4.0, [0.0] * 4, [0.0, 0.25, 0.5, 0.75], 0.875, (0.0, 0.0)),
        (0.5, [1.5] * 4, [0.0, 2.0, 4.0, 6.0], 7.5, (0.5, 0.5)),
        (2.0, [0.75] * 4, [0.0, 0.75, 1.5, 2.25], 3.0, (1.25, 1.25)),
        (1.0, [2.5, 0.0, 0.0, 0.0], [0.0, 2.5, 2.5, 3.0], 3.5, (0.0, 1.5)),  # catches up
    ],
)
def test_model_time_waits_for_the_wall_clock(
    factor: float,
    work: list[float],
    starts: list[float],
    end: float,
    behind: tuple[float, float],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wall = Wall()
    seen: list[float] = []

    def act(actor: Plan) -> None:
        seen.append(wall.now - START)
        actor.output.send(actor.now)
        wall.now += work[len(seen) - 1]
        actor.wake_in(1)

    monkeypatch.setattr(Plan, "begin", lambda actor: actor.wake_in(0))
    monkeypatch.setattr(Plan, "act", act)
    model = load("actors: {a: {type: Plan}}\nrun: {stop: 3.5}")
    pace = Pace(factor, clock=lambda: wall.now, sleep=wall.sleep)
    paced = Simulation(model).run(pace=pace)
    assert seen == starts
    assert wall.now - START == end  # the run waits for its stop time, too
    assert (pace.behind, pace.worst) == behind
    seen.clear()
    assert Simulation(model).run().digest == paced.digest


def test_the_real_clock() -> None:
    model = load("actors: {a: {type: Ticker, period: 50 ms}}")
    began = time.perf_counter()
    Simulation(model).run(until=0.4, pace=Pace(2.0))
    assert time.perf_counter() - began >= 0.2


@pytest.mark.parametrize("factor", [0.0, -1.0, 9e-10, 1e-320, float("inf"), float("nan")])
def test_a_pace_that_is_none(factor: float) -> None:
    with pytest.raises(ValueError, match="a pace is") as caught:
        Pace(factor)
    message = f"a pace is a number of model seconds per second, at least 1e-09, not {factor:g}"
    assert str(caught.value) == message


def test_a_wait_of_years_is_slept_in_pieces() -> None:
    now, slept = 0.0, []

    def sleep(seconds: float) -> None:
        nonlocal now
        now += seconds
        slept.append(seconds)

    pace = Pace(SLOWEST, clock=lambda: now, sleep=sleep)
    pace.wait_for(0)
    pace.wait_for(100_000)  # ns, of which one takes a second
    assert slept == [3_600.0] * 27 + [2_800.0]


def test_progress_is_told_now_and_then_and_never_runs_back() -> None:
    told: list[float] = []
    Simulation(load("actors: {t: {type: Ticker}}")).run(until=99.0, progress=told.append)
    assert 1 < len(told) < 100
    assert told == sorted(set(told))
    assert 0.0 <= told[0] < told[-1] <= 99.0
