"""The controller among several targets, as a tracker tells them."""

import math

import numpy as np
import pytest

from epicycle.actors import (
    Barrier,
    Casadi,
    Estimate,
    Inform,
    ReachGoal,
    RobustController,
    Tracks,
)
from epicycle.actors.testing import Harness
from tests.actors.robotics.scenario import _Recorder, state


def told(*places: tuple[float, float], time: float = 0.0) -> Tracks:
    estimates = tuple(Estimate((x, y, -1.0, 0.5), 0.1 * np.eye(4), time) for x, y in places)
    return Tracks(tuple(range(1, 1 + len(places))), estimates, time)


def problem_of(objective: object, **tokens: object) -> object:
    recorder = _Recorder()
    harness = Harness(RobustController("main.controller", solver=recorder, objective=objective))
    harness.fire(0.3, trigger=0, state=state(8.0, time=0.3), **tokens)
    return recorder.records[0][0]


@pytest.mark.parametrize("objective", [ReachGoal(), Inform()])
def test_the_controller_takes_all_tracks(objective: object) -> None:
    """Each as it takes an estimate, brought to the time of its own state."""
    places = [(3.0, 1.0), (-2.0, 5.0), (9.0, -4.0)]
    together = problem_of(objective, tracks=told(*places, time=0.1))
    size = len(together.sigma_weights)
    for k, place in enumerate(places):
        alone = problem_of(objective, estimate=told(place, time=0.1).estimates[0])
        assert together.obstacle_mean[k].tolist() == alone.obstacle_mean[0].tolist()
        assert together.obstacle_covariance[k].tolist() == alone.obstacle_covariance[0].tolist()
        rows = slice(k * size, (k + 1) * size)
        assert together.sigma_positions[rows].tolist() == alone.sigma_positions.tolist()
        assert together.others_distance[rows].tolist() == alone.others_distance.tolist()
    assert len(together.obstacle_mean) == 3


def test_one_track_is_an_estimate() -> None:
    """To the bit; and no track is no estimate."""
    known = told((3.0, 1.0))
    one, other = problem_of(Inform(), tracks=known), problem_of(Inform(), estimate=known.estimates[0])
    assert [np.array(each).tolist() for each in one] == [np.array(each).tolist() for each in other]
    assert len(problem_of(Inform(), tracks=told()).obstacle_mean) == 0
    both = problem_of(Inform(), tracks=known, estimate=told((9.0, 9.0)).estimates[0])
    assert len(both.obstacle_mean) == 2


def test_old_tracks_and_those_that_are_not_finite_are_ignored() -> None:
    recorder = _Recorder()
    harness = Harness(RobustController("main.controller", solver=recorder))
    bad = Tracks((1,), (Estimate((math.nan, 0.0, 0.0, 0.0), np.eye(4), 0.3),), 0.3)
    for time, tracks in ((0.1, told((3.0, 1.0), (5.0, 5.0), time=0.1)), (0.2, told((3.0, 1.0), time=0.0)), (0.3, bad)):
        harness.fire(time, trigger=0, state=state(8.0, time=time), tracks=tracks)
    assert [len(problem.obstacle_mean) for problem, _, _ in recorder.records] == [2, 2, 2]


def test_it_keeps_away_from_all_of_them_and_informs_itself_about_all() -> None:
    """CasADi, an independent program, finds no better plan."""
    pytest.importorskip("casadi")
    for objective in (ReachGoal(), Inform(range=6.0, penalty=0.05)):
        tracks, starts = told((4.5, 1.2), (5.0, -3.0), (12.0, 2.0)), np.zeros((2, 10, 2))
        harness = Harness(RobustController("main.controller", objective=objective))
        harness.fire(0.3, trigger=0, state=state(8.0, time=0.3), tracks=tracks)
        posed, _ = harness.actor._problem(state(8.0, time=0.3))
        ours, theirs = Barrier().solve(posed, starts), Casadi().solve(posed, starts)
        assert ours.violation == theirs.violation == 0.0
        assert ours.objective <= theirs.objective + 1e-3 * max(1.0, abs(theirs.objective))
