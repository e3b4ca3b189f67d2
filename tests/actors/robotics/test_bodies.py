"""Clock, obstacle, vehicle and monitors."""

import math
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from epicycle.actors import (
    BodyState,
    CircularMotion,
    Clock,
    DistanceMonitor,
    GoalMonitor,
    ParameterError,
    SeparationMonitor,
    Vehicle,
)
from epicycle.actors.testing import Harness


def body(x: float, y: float, time: float = 0.0, velocity: tuple[float, float] = (0.0, 0.0)) -> BodyState:
    return BodyState(np.array([x, y]), np.array(velocity), time)


def test_clock_ticks_without_drift() -> None:
    harness = Harness(Clock("clock", period=0.1))
    harness.run(1000.0)
    times = [seconds for seconds, _ in harness.sent["output"]]
    assert harness.tokens("output") == list(range(10_001))
    assert times == [k * 100_000_000 / 1e9 for k in range(10_001)]


def test_clock_offset_and_first_tag() -> None:
    first = Harness(Clock("clock", period=1.0))
    assert first.wakes[0].tag == (0, 1)
    late = Harness(Clock("clock", period=1.0, offset="250 ms"))
    late.run(3.0)
    assert [seconds for seconds, _ in late.sent["output"]] == [0.25, 1.25, 2.25]


def test_clock_refuses_a_period_of_nothing() -> None:
    with pytest.raises(ParameterError, match="period"):
        Clock("clock", period=0.0)


def test_obstacle_goes_round() -> None:
    harness = Harness(CircularMotion("obstacle"))
    radius = 1.26 / 0.628
    centre = np.array([12.0, 2.0 - radius])
    for time in np.linspace(0.0, 40.0, 101):
        harness.fire(time, trigger=0)
        state = harness.last("state")
        arm = state.position - centre
        assert np.hypot(*arm) == pytest.approx(radius, abs=1e-12)
        assert np.hypot(*state.velocity) == pytest.approx(1.26, abs=1e-12)
        assert arm[0] * state.velocity[1] - arm[1] * state.velocity[0] == pytest.approx(1.26 * radius)  # left
        assert math.cos(0.628 * time + math.pi / 2) == pytest.approx(arm[0] / radius, abs=1e-7)
    assert harness.tokens("state")[0].position == pytest.approx([12.0, 2.0])


def test_obstacle_that_does_not_turn_goes_straight() -> None:
    harness = Harness(CircularMotion("obstacle", turn_rate=0, heading="90 deg", speed=2.0, start=[1, 1]))
    harness.fire(3.0, trigger=0)
    assert harness.last("state").position == pytest.approx([1.0, 7.0])


def test_vehicle_is_the_papers_recursion_exactly() -> None:
    harness = Harness(Vehicle("v", start=[30, 0], max_speed=100, max_acceleration=100))
    random = np.random.default_rng(3)
    position, velocity, held = np.array([30.0, 0.0]), np.zeros(2), np.zeros(2)
    now = 0
    for step in range(50):
        dt = int(random.integers(1, 300_000_000)) if step else 0
        now += dt
        control = random.normal(size=2)
        harness.fire(now / 1e9, trigger=step, acceleration=control)
        position, velocity = position + dt / 1e9 * velocity, velocity + dt / 1e9 * held
        held = control
        state = harness.last("state")
        assert state.position.tolist() == position.tolist()
        assert state.velocity.tolist() == velocity.tolist()


def test_vehicle_clips_acceleration_and_speed_by_their_norm() -> None:
    harness = Harness(Vehicle("v", start=[0, 0], max_speed=1.0, max_acceleration=5.0))
    harness.fire(0.0, trigger=0, acceleration=np.array([30.0, 40.0]))
    harness.fire(0.1, trigger=1)
    assert harness.last("state").velocity == pytest.approx([0.3, 0.4])
    for step in range(2, 20):
        harness.fire(step / 10, trigger=step)
    assert harness.last("state").velocity == pytest.approx([0.6, 0.8])


def test_vehicle_holds_a_control_that_comes_between_triggers_from_the_next_one() -> None:
    harness = Harness(Vehicle("v", start=[0, 0]))
    harness.fire(0.0, trigger=0)
    harness.fire(0.05, acceleration=np.array([1.0, 0.0]))
    assert len(harness.tokens("state")) == 1
    harness.fire(0.1, trigger=1)
    assert harness.last("state").velocity.tolist() == [0.0, 0.0]
    harness.fire(0.2, trigger=2)
    assert harness.last("state").velocity == pytest.approx([0.1, 0.0])


def test_vehicle_applies_a_control_one_microstep_late_at_once() -> None:
    harness = Harness(Vehicle("v", start=[0, 0]))
    harness.fire(0.0, trigger=0)
    harness.fire(0.0, microstep=2, acceleration=np.array([1.0, 0.0]))
    harness.fire(0.1, trigger=1)
    assert harness.last("state").velocity == pytest.approx([0.1, 0.0])


def test_vehicle_ignores_a_control_that_is_not_finite() -> None:
    harness = Harness(Vehicle("v", start=[0, 0]))
    harness.fire(0.0, trigger=0, acceleration=np.array([1.0, 0.0]))
    harness.fire(0.1, trigger=1, acceleration=np.array([np.nan, 0.0]))
    harness.fire(0.2, trigger=2, acceleration=np.array([np.inf, 0.0]))
    harness.fire(0.3, trigger=3)
    assert harness.last("state").velocity == pytest.approx([0.3, 0.0])


def test_tokens_cannot_be_changed() -> None:
    given = np.zeros(2)
    state = BodyState(given, given, 0.0)
    given[0] = 1.0
    assert state.position[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        state.position[0] = 1.0


def test_goal_monitor_tells_the_first_arrival_once() -> None:
    harness = Harness(GoalMonitor("m", tolerance=0.5))
    for step, x in enumerate([3.0, 1.0, 0.4, 2.0, 0.1]):
        harness.fire(step / 10 + 0.05, state=body(x, 0.0, time=step / 10))
    assert harness.sent["arrived"] == [(0.25, True)]
    assert harness.sent["time"] == [(0.25, 0.2)]  # the body was there then, though it is told later
    assert harness.tokens("path_length") == pytest.approx([0.0, 2.0, 2.6, 4.2, 6.1])
    assert harness.tokens("distance") == pytest.approx([3.0, 1.0, 0.4, 2.0, 0.1])


def test_distance_monitor_needs_both() -> None:
    harness = Harness(DistanceMonitor("m"))
    harness.fire(0.0, a=body(0, 0))
    harness.fire(0.1, a=body(0, 0, 0.1), b=body(3, 4, 0.1))
    assert harness.sent["distance"] == [(0.1, 5.0)]


def test_bodies_out_of_phase_have_a_distance() -> None:
    """Each state is compared with where the other body has gone since it was last seen."""
    harness = Harness(DistanceMonitor("m"))
    harness.fire(0.0, a=body(0, 0, 0.0, (10, 0)))
    harness.fire(0.05, b=body(3.5, 4, 0.05, (0, -20)))  # a is at (0.5, 0)
    harness.fire(0.1, a=body(1, 0, 0.1, (10, 0)))  # b is at (3.5, 3)
    assert harness.tokens("distance") == pytest.approx([5.0, math.hypot(2.5, 3.0)])
    harness.fire(0.12, a=body(9, 9, 0.08))  # overtaken by a later one
    assert harness.last("distance") == harness.tokens("distance")[1]


def test_separation_of_bodies_out_of_phase() -> None:
    harness = Harness(SeparationMonitor("m"))
    harness.fire(0.0, bodies=[body(0, 0, 0.0, (10, 0)), None, None])
    harness.fire(0.05, bodies=[None, body(3.5, 4, 0.05, (0, -20)), None])
    harness.fire(0.1, bodies=[None, None, body(1, 1.5, 0.1)])
    assert harness.sent["distance"] == [(0.05, pytest.approx(5.0)), (0.1, pytest.approx(1.5))]


def test_separation_monitor_takes_the_smallest_pair_and_no_duplicates() -> None:
    harness = Harness(SeparationMonitor("m"))
    harness.fire(0.0, bodies=[body(0, 0)])
    harness.fire(0.1, bodies=[body(0, 0, 0.1), body(3, 4, 0.1), body(3, 6, 0.1)])
    assert harness.sent["distance"] == [(0.1, 2.0)]
    port = harness.actor.inputs["bodies"]
    port.receive(body(9, 0, 0.2), 0)
    harness.fire(0.2, bodies=[body(9, 0, 0.2), body(0, 0, 0.2), body(90, 0, 0.2)])
    assert harness.last("distance") == 9.0


def test_the_public_face_offers_all_of_the_core_and_loads_nothing_heavy() -> None:
    script = """
        import importlib, sys
        actors, core = (importlib.import_module(f"epicycle.actors{name}") for name in ("", ".core"))
        assert set(core.__all__) <= set(actors.__all__), set(core.__all__) - set(actors.__all__)
        assert all(hasattr(actors, name) for name in actors.__all__)
        heavy = {"numba", "scipy", "filterpy", "casadi"} & set(sys.modules)
        assert not heavy, heavy
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
