"""Vehicles: their arcs in closed form and against SciPy's integration, and how they follow waypoints."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
import scipy.integrate
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.actors import Ackermann, BodyState, EpicycleError, ParameterError, Pose, Unicycle, WaypointFollower
from epicycle.actors.testing import Harness
from epicycle.runner import Simulation
from tests.actors.feeding import load


def pose(x: float, y: float, heading: float = 0.0, time: float = 0.0, speed: float = 0.0) -> Pose:
    return Pose((x, y), (speed * math.cos(heading), speed * math.sin(heading)), time, heading)


def states(harness: Harness) -> Any:
    """Time, x, y, heading of each pose."""
    return np.array([(p.time, *p.position, p.heading) for p in harness.tokens("pose")])


# -- arcs -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn_rate", [0.0, 1e-12, 0.5, -3.0])
def test_a_unicycle_goes_round_in_closed_form(turn_rate: float) -> None:
    harness = Harness(Unicycle("it", start=[1, 2], heading="30 deg", speed=2, turn_rate=turn_rate))
    times = [k / 4 for k in range(60)]
    harness.run(99.0, trigger=[(t, 0) for t in times])
    t, h = np.array(times), math.radians(30)
    if abs(turn_rate) < 1e-6:
        wanted = 1 + 2 * t * math.cos(h), 2 + 2 * t * math.sin(h), h + 0 * t
    else:
        r, turned = 2 / turn_rate, h + turn_rate * t
        wanted = 1 + r * (np.sin(turned) - math.sin(h)), 2 - r * (np.cos(turned) - math.cos(h)), turned
    assert states(harness)[:, 1:] == pytest.approx(np.transpose(wanted), abs=1e-9 if turn_rate == 1e-12 else 1e-13)
    for token in harness.tokens("pose"):
        assert token.speed == pytest.approx(2.0, rel=1e-14)
        assert token.velocity == pytest.approx([2 * math.cos(token.heading), 2 * math.sin(token.heading)])


@pytest.mark.parametrize("kind", ["Unicycle", "Ackermann"])
def test_vehicles_move_as_their_equations_say(kind: str) -> None:
    """Speeds and turns that change at any time, against the equations solved by SciPy."""
    random = np.random.default_rng(5)
    changes = np.round(np.sort(random.uniform(0, 9, size=12)), 9).tolist()
    speeds = dict(zip(changes[::2], random.normal(size=6).tolist(), strict=True))
    turns = dict(zip(changes[1::2], random.uniform(-0.5, 0.5, size=6).tolist(), strict=True))
    vehicle: Any = Unicycle("it") if kind == "Unicycle" else Ackermann("it", wheelbase=1.5)
    looks = np.round(np.sort(random.uniform(0, 10, size=30)), 9).tolist()
    harness = Harness(vehicle)
    turning = "turn_rate" if kind == "Unicycle" else "steering"
    harness.run(10.0, trigger=[(t, 0) for t in looks], speed=list(speeds.items()), **{turning: list(turns.items())})

    speed = turn = at = 0.0
    state, wanted = np.zeros(3), []
    for time in sorted([*changes, *looks]):

        def rates(_: float, s: Any, v: float = speed, w: float = turn) -> list[float]:
            return [v * math.cos(s[2]), v * math.sin(s[2]), w if kind == "Unicycle" else v * math.tan(w) / 1.5]

        state = scipy.integrate.solve_ivp(rates, (at, time), state, rtol=1e-12, atol=1e-13).y[:, -1]
        at, speed, turn = time, speeds.get(time, speed), turns.get(time, turn)
        if time in looks:
            wanted.append((time, *state))
    assert states(harness) == pytest.approx(np.array(wanted), abs=1e-9)


def test_looks_leave_no_trace() -> None:
    ends = set()
    for looks in ([7.0], [0.1 * k for k in range(71)]):
        harness = Harness(Ackermann("it", speed=1.5))
        harness.run(7.0, trigger=[(t, 0) for t in looks], steering=[(1.0, 0.2), (3.3, 0.2), (5.0, -0.4)])
        ends.add(tuple(each.hex() for each in states(harness)[-1].tolist()))
    assert len(ends) == 1


def test_what_is_asked_too_much_is_cut_off() -> None:
    fast = Harness(Unicycle("it", speed=-9, turn_rate=9, max_speed=2, max_turn_rate=0.5))
    fast.run(1.0, trigger=[(1.0, 0)])
    assert fast.last("pose").heading == 0.5
    assert fast.last("pose").speed == pytest.approx(-2.0)
    car = Harness(Ackermann("it", speed=1, steering=1.4, max_steering="30 deg", wheelbase=2))
    car.run(1.0, trigger=[(1.0, 0)])
    assert car.last("pose").heading == pytest.approx(math.tan(math.radians(30)) / 2)


def test_a_pose_is_a_body_state_and_knows_what_it_sees() -> None:
    token = pose(1.0, 2.0, math.pi / 2, time=3.0, speed=-4.0)
    assert isinstance(token, BodyState)
    assert token.finite
    assert (token.time, token.speed) == (3.0, pytest.approx(-4.0))
    assert token.seen((1.0, 5.0)) == pytest.approx((3.0, 0.0))
    assert token.seen((0.0, 2.0)) == pytest.approx((0.0, 1.0))  # to the left
    with pytest.raises(ValueError, match="read-only"):
        token.position[0] = 0.0


# -- waypoints --------------------------------------------------------------------------------------------------------


def follow(waypoints: list[list[float]], at: Pose, **parameters: Any) -> dict[str, Any]:
    harness = Harness(WaypointFollower("it", waypoints=waypoints, **parameters))
    harness.fire(0.0, pose=pose(0.0, 0.0))
    harness.fire(1.0, pose=at)
    return {port: harness.last(port) if harness.sent[port] else None for port in harness.sent}


@settings(deadline=None)
@given(x=st.floats(0.5, 8), y=st.floats(-3, 3), heading=st.floats(-3, 3), lookahead=st.floats(0.5, 5))
def test_the_arc_leads_through_the_point_ahead(x: float, y: float, heading: float, lookahead: float) -> None:
    """On the arc of the curvature that is asked for lies the point that is ``lookahead`` further along the line."""
    found = follow([[20, 0]], pose(x, y, heading), lookahead=lookahead, cruise=2)
    target = x + lookahead, 0.0
    ahead, across = pose(x, y, heading).seen(target)
    curvature = found["turn_rate"] / 2
    assert found["speed"] == 2
    assert found["deviation"] == pytest.approx(y, abs=1e-12)
    if ahead >= 0:  # x^2 + y^2 = 2 y / k for points of a circle through the origin, along the x axis
        assert curvature * (ahead * ahead + across * across) == pytest.approx(2 * across, abs=1e-9)
    else:
        assert abs(curvature) == pytest.approx(2 / math.hypot(ahead, across))
        assert curvature * across >= 0


def test_steering_is_that_of_the_curvature() -> None:
    found = follow([[20, 0]], pose(1, 0.5), lookahead=2, cruise=3, wheelbase=2.5)
    assert found["steering"] == pytest.approx(math.atan(2.5 * found["turn_rate"] / 3))
    assert follow([[20, 0]], pose(1, 0.5))["steering"] is None


def test_the_point_ahead_goes_round_corners_and_ends_at_the_last_waypoint() -> None:
    round_the_corner = follow([[4, 0], [4, 10]], pose(3, 0), lookahead=3, cruise=1)
    assert round_the_corner["turn_rate"] == pytest.approx(2 * 2 / (1 + 4))  # towards (4, 2)
    at_the_end = follow([[4, 0]], pose(3, 1), lookahead=9, cruise=1, deceleration=0.1)
    assert at_the_end["turn_rate"] == pytest.approx(math.sqrt(0.2) * 2 * -1 / 2)
    assert at_the_end["speed"] == pytest.approx(math.sqrt(2 * 0.1 * 1))


def test_waypoints_are_passed_beside_them_or_near_them_and_the_last_one_ends_it() -> None:
    harness = Harness(WaypointFollower("it", waypoints=[[5, 0], [5, 5]], tolerance=0.5))
    for time, at in enumerate([(0, 0), (4, 1), (5.2, 2), (5, 4.6), (9, 9)]):
        harness.fire(float(time), pose=pose(*map(float, at)))
    assert harness.sent["passed"] == [(2.0, 0), (3.0, 1)]
    assert harness.sent["arrived"] == [(3.0, True)]
    assert harness.tokens("speed") == [1.0, 1.0, 1.0, 0.0, 0.0]


def test_a_closed_path_has_no_end() -> None:
    square = [[4, 0], [4, 4], [0, 4], [0, 0]]
    harness = Harness(WaypointFollower("it", waypoints=square, closed=True, tolerance=0.1))
    corners = [(0.0, 0.0), *itertools.islice(itertools.cycle([tuple(map(float, each)) for each in square]), 9)]
    for time, at in enumerate(corners):
        harness.fire(float(time), pose=pose(*at))
    assert harness.tokens("passed") == [0, 1, 2, 3, 0, 1, 2, 3, 0]
    assert harness.tokens("arrived") == []
    assert set(harness.tokens("speed")) == {1.0}


def test_a_unicycle_converges_to_its_line() -> None:
    """Near a long line, pure pursuit is y'' = -2 v / L y' - 2 v^2 / L^2 y: it swings in within a few L / v."""
    text = """
model: m
actors:
  clock: {type: Clock, period: 5 ms}
  robot: {type: Unicycle, start: [0, 0.02]}
  follower: {type: WaypointFollower, waypoints: [[0.001, 0], [100, 0]], lookahead: 2 m, cruise: 1 m/s}
connections:
  - clock.output -> robot.trigger
  - robot.pose -> follower.pose
  - follower.speed -> robot.speed
  - follower.turn_rate -> robot.turn_rate
run: {stop: 12 s, record: [robot.pose]}
"""
    poses = Simulation(load(text)).run().signals["robot.pose"].tokens
    found = np.array([each.position[1] for each in poses])
    t = np.arange(len(found)) * 0.005
    wanted = 0.02 * np.exp(-t / 2) * (np.cos(t / 2) + np.sin(t / 2))
    assert np.abs(found - wanted).max() < 2e-4


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        ([], "waypoints: the list is empty; give at least one"),
        ([[1, 1], [1, 1], [2, 2]], "waypoints: 0 and 1 are the same, [1.0, 1.0]"),
        ([[1, 1], [2, 2], [1, 1]], "waypoints: 2 and 0 are the same, [1.0, 1.0]"),
        ([[1, 1]], "closed: a path of one waypoint cannot be closed; give two or more"),
        ([[1]], "it: WaypointFollower.waypoints: [[1]] is not a list of n x 2 numbers in m"),
    ],
)
def test_paths_that_are_none(waypoints: Any, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        WaypointFollower("it", waypoints=waypoints, closed=True)
    assert str(caught.value) == message


def test_a_speed_without_end_leads_nowhere() -> None:
    with pytest.raises(EpicycleError) as caught:
        Harness(Unicycle("it", speed=math.inf))
    assert str(caught.value) == "a speed of inf m/s and a turn rate of 0 rad/s are not finite numbers"
