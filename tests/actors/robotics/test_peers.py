"""What a controller knows of its peers: the latest plan of each, and how far to keep away from one that is silent."""

import math

import numpy as np
import pytest

from epicycle.actors import (
    Plan,
)
from tests.actors.robotics.scenario import make, plan, state


def test_peers_present_at_the_very_first_firing_count() -> None:
    harness, recorder = make()
    harness.fire(0.0, trigger=0, state=state(), peer_plans=[plan("b", 0.0), plan("a", 0.0, y=5.0)])
    problem = recorder.records[0][0]
    assert problem.peer_mean[:, 0, 1].tolist() == [5.0, 2.0]  # sorted by name
    assert problem.peer_distance[0] == pytest.approx(2.0 + 2.0 * (0.2 + 0.4 * np.arange(1, 11)))


def test_plans_of_any_length_are_heard_and_the_latest_of_each_counts() -> None:
    harness, recorder = make()
    for now, count in ((0.0, 3), (0.1, 11), (0.2, 2), (0.3, 20)):
        heard = [plan("b", now, x=20.0 + 10.0 * now, controls=np.full((count, 2), 1.0)), plan("c", 0.0, y=9.0)]
        harness.fire(now, trigger=0, state=state(time=now), peer_plans=heard)
        place, speed, driven = np.array([20.0 + 10.0 * now, 2.0]), np.zeros(2), []
        for k in range(10):
            place, speed = place + 0.1 * speed, speed + 0.1 * (k < count)
            driven.append(place)
        problem = recorder.records[-1][0]
        assert problem.peer_mean[0] == pytest.approx(np.array(driven))
        assert problem.peer_mean[1] == pytest.approx(np.tile([20.0, 9.0], (10, 1)))
    assert problem.obstacle_covariance.shape == (0, 10, 3)


def test_who_stands_where_at_the_start_may_be_known_before_a_plan_comes() -> None:
    harness, recorder = make(peers_at_start=[[20.0, 2.0], [20.0, -2.0]])

    def peers(now: float, *heard: Plan) -> tuple[list[list[float]], list[float]]:
        """Places at step 1, and the distances to keep then beyond those of a fresh plan."""
        harness.fire(now, trigger=0, state=state(time=now), peer_plans=list(heard))
        problem = recorder.records[-1][0]
        return problem.peer_mean[:, 0].tolist(), (problem.peer_distance[:, 0] - 3.2).round(9).tolist()

    assert peers(0.0) == ([[20.0, 2.0], [20.0, -2.0]], [0.0, 0.0])
    # It is as old as a plan of then would be, and a first plan takes the place of the nearest.
    assert peers(0.2) == ([[20.0, 2.0], [20.0, -2.0]], [0.8, 0.8])
    assert peers(0.3, plan("b", 0.3, y=-2.5)) == ([[20.0, 2.0], [20.0, -2.5]], [1.6, 0.0])
    assert peers(0.4, plan("a", 0.4, y=-1.0), plan("b", 0.4, y=-3.0)) == ([[20.0, -1.0], [20.0, -3.0]], [0.0, 0.0])
    assert peers(0.5, plan("c", 0.5, y=9.0))[0] == [[20.0, -1.0], [20.0, -3.0], [20.0, 9.0]]


def test_a_first_plan_takes_the_place_of_the_nearest() -> None:
    harness, recorder = make(peers_at_start=[[20.0, 2.0], [2.0, 20.0]])
    harness.fire(0.0, trigger=0, state=state(), peer_plans=[plan("b", 0.0, x=3.0, y=19.0)])
    assert recorder.records[-1][0].peer_mean[:, 0].tolist() == [[20.0, 2.0], [3.0, 19.0]]


def test_a_robot_is_none_of_those_who_stand_somewhere_at_the_start() -> None:
    harness, recorder = make(start=[20.0, -2.0], peers_at_start=[[20.0, 2.0], [20.0, -2.0], [30.0, 0.0]])
    harness.fire(0.0, trigger=0, state=state())
    assert recorder.records[-1][0].peer_mean[:, 0].tolist() == [[20.0, 2.0], [30.0, 0.0]]
    harness, recorder = make(start=[20.0, -2.0], peers_at_start=[[20.0, -2.0]])
    harness.fire(0.0, trigger=0, state=state())
    assert recorder.records[-1][0].peer_mean.shape[0] == 0


def test_a_plan_from_before_the_start_counts_until_there_is_another() -> None:
    harness, recorder = make()
    harness.fire(0.0, trigger=0, state=state(), peer_plans=[plan("b", -0.2, y=7.0)])
    assert recorder.records[-1][0].peer_mean[0, :, 1].tolist() == [7.0] * 10


@pytest.mark.parametrize(("now", "lost"), [(0.0, 0), (0.1, 0), (0.2, 1), (0.3, 2), (1.5, 14)])
def test_distance_to_a_silent_peer_grows_from_the_second_period_on(now: float, lost: int) -> None:
    harness, recorder = make()
    controls = np.tile([[1.0, 0.0]], (11, 1))
    harness.fire(now, trigger=0, state=state(time=now), peer_plans=[plan("b", 0.0, controls=controls)])
    problem = recorder.records[0][0]
    assert problem.peer_distance[0] == pytest.approx(2.0 + 2.0 * (0.2 + 0.4 * np.arange(1, 11) + 0.4 * lost))
    place, speed, driven = np.array([20.0, 2.0]), np.zeros(2), []
    for k in range(30):
        place, speed = place + 0.1 * speed, speed + 0.1 * (controls[k] if k < 11 else np.zeros(2))
        driven.append(place)
    age = round(now * 10)
    assert problem.peer_mean[0] == pytest.approx(np.array(driven[age : age + 10]))


@pytest.mark.parametrize("age", [0.03, 0.08, 0.24, -0.04])
def test_a_peer_between_two_of_its_steps_is_on_its_way(age: float) -> None:
    harness, recorder = make()
    controls = np.array([[1.0, 0.0], [0.0, 3.0], *[[2.0, 1.0]] * 9])
    known = Plan("b", 1.0 - age, state(20.0, 2.0, 5.0, -1.0, time=1.0 - age), controls)
    harness.fire(1.0, trigger=0, state=state(time=1.0), peer_plans=[known])
    place, speed, steps = np.array([20.0, 2.0]), np.array([5.0, -1.0]), []
    for k in range(20):
        steps.append((place, speed))
        place, speed = place + 0.1 * speed, speed + 0.1 * (controls[k] if k < 11 else np.zeros(2))
    expected = []
    for step in range(1, 11):
        whole = math.floor((age + 0.1 * step) / 0.1 + 1e-9)
        expected.append(steps[whole][0] + (age + 0.1 * step - 0.1 * whole) * steps[whole][1])
    assert recorder.records[0][0].peer_mean[0] == pytest.approx(np.array(expected))


def test_the_latest_plan_counts_whatever_the_order_of_arrival() -> None:
    harness, recorder = make()
    harness.fire(0.2, trigger=0, state=state(time=0.2), peer_plans=[plan("b", 0.1, y=7.0), plan("b", 0.0, y=2.0)])
    assert recorder.records[0][0].peer_mean[0, 0, 1] == 7.0


def test_its_own_plan_is_ignored() -> None:
    harness, recorder = make()
    harness.fire(0.1, trigger=0, state=state(time=0.1), peer_plans=[plan("main", 0.0)])
    assert len(recorder.records[0][0].peer_mean) == 0
