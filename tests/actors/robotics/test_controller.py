"""The controller: timing, memory, and that nothing makes it fail."""

import functools
import logging
import math
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from epicycle.actors import (
    BodyState,
    Casadi,
    EpicycleError,
    Estimate,
    Inform,
    Measurement,
    ParameterError,
    Plan,
    ReachGoal,
    RobustController,
    UnscentedEstimator,
)
from epicycle.actors.robotics.numerics import warm_up
from epicycle.actors.testing import Harness
from tests.actors.robotics.scenario import _Recorder, estimate, make, plan, play, state

COMPILING = "compiling the numeric kernels (once, about 20 s) ..."


def test_it_drives_to_the_goal_and_says_so() -> None:
    harness, _ = make()
    harness.fire(0.0, trigger=0, state=state())
    control = harness.last("control")
    assert control[0] == pytest.approx(-8.0, rel=0.01)
    assert abs(control[1]) < 1e-3
    sent = harness.last("plan")
    assert (sent.robot, sent.time, sent.controls.shape) == ("main", 0.0, (11, 2))
    assert sent.controls[0].tolist() == [0.0, 0.0]  # nothing was being applied yet
    assert sent.controls[1].tolist() == control.tolist()
    assert (harness.last("violation"), harness.last("infeasible")) == (0.0, 0)
    assert harness.last("iterations") > 0
    harness.fire(0.1, trigger=1, state=state(time=0.1))
    assert harness.last("plan").controls[0].tolist() == control.tolist()


def test_without_trigger_it_listens_only() -> None:
    harness, recorder = make()
    harness.fire(0.0, state=state(), estimate=estimate(), peer_plans=[plan("b", 0.0)])
    assert recorder.records == []
    harness.fire(0.1, trigger=1, state=state(time=0.1))
    problem = recorder.records[0][0]
    assert len(problem.obstacle_mean) == len(problem.peer_mean) == 1
    # The estimate is one period old, so step 1 lies two periods ahead of it.
    assert problem.obstacle_mean[0, 0] == pytest.approx([12.0 - 0.2, 2.0])


def test_before_anything_is_known_there_is_nobody_to_avoid() -> None:
    for objective in (ReachGoal(), Inform()):
        harness, recorder = make(objective=objective)
        harness.fire(0.0, trigger=0, state=state())
        problem = recorder.records[0][0]
        assert problem.obstacle_mean.shape == (0, 10, 2)
        assert problem.peer_mean.shape == (0, 10, 2)
        assert np.isfinite(harness.last("control")).all()


def test_first_state_of_the_problem_follows_the_applied_control() -> None:
    harness, recorder = make()
    harness.fire(0.0, trigger=0, state=state())
    applied = harness.last("control")
    harness.fire(0.1, trigger=1, state=state(29.0, 1.0, 2.0, 3.0, time=0.1))
    problem = recorder.records[1][0]
    assert problem.position == pytest.approx([29.2, 1.3])
    assert problem.velocity == pytest.approx(np.array([2.0, 3.0]) + 0.1 * applied)


def test_tube_binds_where_the_standing_plan_reaches() -> None:
    harness, recorder = make()
    harness.fire(0.0, trigger=0, state=state())
    harness.fire(0.1, trigger=1, state=state(time=0.1))
    harness.fire(0.4, trigger=4, state=state(time=0.4))
    first, second, third = (record[0] for record in recorder.records)
    assert np.isinf(first.tube_radius).all()
    assert second.tube_radius[:9] == pytest.approx(0.2 + 0.4 * np.arange(1, 10))
    assert np.isinf(second.tube_radius[9])
    assert np.isinf(third.tube_radius).tolist() == [False] * 7 + [True] * 3
    assert recorder.records[1][1][0, :9].tolist() == recorder.records[0][2].controls[1:].tolist()
    assert recorder.records[2][1][0, :7].tolist() == recorder.records[1][2].controls[3:].tolist()


def test_tube_time_in_seconds() -> None:
    harness, recorder = make(tube_time="seconds")
    harness.fire(0.0, trigger=0, state=state(), peer_plans=[plan("b", 0.0)])
    assert recorder.records[0][0].peer_distance[0, [0, 9]] == pytest.approx([2.0 + 0.48, 2.0 + 1.2])


def test_steps_counted_from_the_decision() -> None:
    from epicycle.actors.robotics.numerics.horizon import trajectory

    harness, recorder = make(horizon_from="decision")
    for tick in range(2):
        now = 0.1 * tick
        harness.fire(now, trigger=tick, state=state(time=now), estimate=estimate(), peer_plans=[plan("b", 0.0)])
    first, second = recorder.records[0][0], recorder.records[1][0]
    # One row more than N: tau is 0 at t + period, and N steps on at the last.
    assert first.peer_distance.shape == (1, 11)
    assert first.peer_distance[0, [0, 1, 10]] == pytest.approx([2.0 + 2 * 0.2, 2.0 + 2 * 0.6, 2.0 + 2 * 4.2])
    assert second.tube_radius[:10] == pytest.approx(0.2 + 0.4 * np.arange(10))
    assert np.isinf(second.tube_radius[10])
    assert harness.last("plan").controls.shape == (11, 2)  # U_t .. U_{t+N}, as ever
    # Every announced control but the last moves a position: U_{t+N-1} decides the last one.
    controls = recorder.records[0][2].controls
    positions = []
    for row in (8, 9):
        moved = controls.copy()
        moved[row] += 1.0
        positions.append(trajectory(first.position, first.velocity, moved, 0.1, 11)[-1])
    plain = trajectory(first.position, first.velocity, controls, 0.1, 11)[-1]
    assert (positions[0] != plain).all()
    assert (positions[1] == plain).all()


def test_covariance_noise_widens_the_prediction() -> None:
    plain, wide = make(covariance_noise=False), make()
    for harness, _ in (plain, wide):
        harness.fire(0.0, trigger=0, state=state(), estimate=estimate())
    a, b = (recorder.records[0][0].obstacle_covariance[0] for _, recorder in (plain, wide))
    assert a[0] == pytest.approx([0.1 + 0.01 * 0.1, 0.0, 0.1 + 0.01 * 0.1])
    assert b[0, 0] == pytest.approx(a[0, 0] + 0.002)
    assert b[9, 0] > a[9, 0] + 0.5


@pytest.mark.parametrize("noise", [False, True])
def test_kappa_and_process_noise_are_those_of_the_filter_in_eq_5_too(noise: bool) -> None:
    from epicycle.actors.robotics.numerics import ukf

    harness, recorder = make(objective=Inform(), kappa=1.0, covariance_noise=noise)
    known = estimate()
    harness.fire(0.0, trigger=0, state=state(), estimate=known)
    problem = recorder.records[0][0]
    mean, covariance = known.mean, known.covariance
    for _ in range(10):
        added = np.diag([0.002, 0.002, 0.4, 0.4]) if noise else np.zeros((4, 4))
        mean, covariance = ukf.predict(mean, covariance, ukf.constant_velocity(0.1), added)
    weights, points = problem.sigma_weights, problem.sigma_positions
    assert weights == pytest.approx([0.2, *[0.1] * 8])
    assert weights @ points == pytest.approx(mean[:2])
    spread = (points - mean[:2]).T @ np.diag(weights) @ (points - mean[:2])
    assert spread == pytest.approx(covariance[:2, :2])
    assert problem.obstacle_covariance[0, 9] == pytest.approx([spread[0, 0], spread[0, 1], spread[1, 1]])


def test_an_estimate_that_comes_late_counts_as_old() -> None:
    """0.4 s late: the controller plans with what the filter would have predicted for now, without a measurement."""
    filter_ = Harness(UnscentedEstimator("main.estimator"))
    seen = Measurement("main", np.array([30.0, 0.0]), "relative_position", np.array([-18.0, 2.0]), 0.2, 2.0, 0.0)
    filter_.fire(0.0, trigger=0, measurements=[seen])
    for tick in range(1, 5):
        filter_.fire(tick / 10, trigger=tick)
    problems = []
    for known in (filter_.tokens("estimate")[0], filter_.last("estimate")):
        harness, recorder = make(objective=Inform())
        harness.fire(0.4, trigger=0, state=state(time=0.4), estimate=known)
        problems.append(recorder.records[0][0])
    late, fresh = problems
    assert late.obstacle_mean == pytest.approx(fresh.obstacle_mean)
    assert late.obstacle_covariance == pytest.approx(fresh.obstacle_covariance)
    assert late.sigma_positions == pytest.approx(fresh.sigma_positions)


@pytest.mark.parametrize("age", [0.04, -0.03, 0.25])
def test_an_estimate_between_two_ticks_is_brought_to_the_time_of_the_state(age: float) -> None:
    harness, recorder = make()
    harness.fire(0.5, trigger=0, state=state(time=0.5), estimate=estimate(time=0.5 - age))
    problem = recorder.records[0][0]
    assert problem.obstacle_mean[0, 0] == pytest.approx([12.0 - (age + 0.1), 2.0])


def test_solving_late_and_hearing_late_change_no_age() -> None:
    """What the controller works with is of its own time, whenever it fires; what is overtaken is not taken up."""
    in_time, late = make(), make()
    for (harness, _), delay in ((in_time, 0.0), (late, 0.07)):
        harness.fire(0.1 + delay, trigger=0, state=state(time=0.1))
        harness.fire(0.15 + delay, estimate=estimate(11.0, time=0.2), peer_plans=[plan("b", 0.1)])
        harness.fire(0.16 + delay, estimate=estimate(19.0, time=0.1))
        harness.fire(0.2 + delay, trigger=1, state=state(time=0.2))
        sent = harness.tokens("plan")
        assert [each.time for each in sent] == [each.state.time for each in sent] == [0.1, 0.2]
    for one, other in zip(in_time[1].records, late[1].records, strict=True):
        for here, there in zip(one[0], other[0], strict=True):
            assert np.array_equal(here, there)
    assert late[1].records[1][0].obstacle_mean[0, 0] == pytest.approx([10.9, 2.0])


def test_inform_counts_the_others_only_if_joint() -> None:
    for joint in (True, False):
        harness, recorder = make(objective=Inform(joint=joint))
        harness.fire(0.0, trigger=0, state=state(), estimate=estimate(), peer_plans=[plan("b", 0.0)])
        problem = recorder.records[0][0]
        assert problem.others_distance.any() == joint
        # The points lie at the end of the horizon, one second on.
        assert problem.sigma_weights @ problem.sigma_positions == pytest.approx([11.0, 2.0])


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_ignored_and_the_last_good_stays(bad: float) -> None:
    harness, recorder = make()
    harness.fire(0.0, trigger=0, state=state(), estimate=estimate(), peer_plans=[plan("b", 0.0)])
    worse = [
        Plan("b", 0.1, state(bad), np.zeros((11, 2))),
        Plan("b", 0.1, state(), np.full((11, 2), bad)),
        Plan("b", bad, state(), np.zeros((11, 2))),
    ]
    harness.fire(0.1, trigger=1, state=state(time=0.1), estimate=estimate(bad), peer_plans=worse)
    problem = recorder.records[1][0]
    assert problem.obstacle_mean[0, 0] == pytest.approx([12.0 - 0.2, 2.0])
    assert problem.peer_mean[0, 0] == pytest.approx([20.0, 2.0])
    assert np.isfinite(harness.last("control")).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_without_a_finite_own_state_the_control_is_zero(bad: float) -> None:
    harness, _ = make()
    harness.fire(0.0, trigger=0, state=state())
    harness.fire(0.1, trigger=1, state=state(vx=bad, time=0.1))
    assert harness.last("control").tolist() == [0.0, 0.0]
    assert len(harness.tokens("plan")) == 1
    harness.fire(0.2, trigger=2)
    assert harness.last("control").tolist() == [0.0, 0.0]
    harness.fire(0.3, trigger=3, state=state(time=0.3))
    assert harness.last("plan").controls[0].tolist() == [0.0, 0.0]
    assert np.isfinite(harness.last("control")).all()


@pytest.mark.parametrize("objective", [ReachGoal(), Inform(range=5)])
def test_wild_but_finite_input_gives_a_finite_control_within_the_limit(objective: object) -> None:
    random = np.random.default_rng(23)
    for trial in range(60):
        harness, _ = make(objective=objective)
        for step in range(3):
            size = 10.0 ** random.uniform(-12, 12 if trial % 2 else 2, size=8)
            numbers = random.normal(size=8) * size
            root = random.normal(size=(4, 4)) * 10.0 ** random.uniform(-6, 4)
            harness.fire(
                step / 10,
                trigger=step,
                state=BodyState(numbers[:2], numbers[2:4], step / 10),
                estimate=Estimate(numbers[4:], root @ root.T, step / 10),
                peer_plans=[Plan("b", 0.0, BodyState(numbers[2:4], numbers[4:6], 0.0), random.normal(size=(11, 2)))],
            )
            control = harness.last("control")
            assert np.isfinite(control).all()
            assert np.hypot(*control) <= 8.0 * (1 + 1e-9)
            assert not np.isnan(harness.last("violation"))


def test_on_top_of_target_and_peer_it_stays_calm() -> None:
    harness, _ = make()
    there = state(12.0, 2.0)
    harness.fire(0.0, trigger=0, state=there, estimate=estimate(), peer_plans=[plan("b", 0.0, 12.0, 2.0)])
    assert np.isfinite(harness.last("control")).all()
    assert harness.last("violation") > 0.0
    assert harness.last("infeasible") == 1


def test_same_run_same_bits() -> None:
    first, second = (play(2, 10.0, 0.25, seed=4, steps=30) for _ in range(2))
    assert first[1].tobytes() == second[1].tobytes()
    for (_, _, a), (_, _, b) in zip(first[0], second[0], strict=True):
        assert a.controls.tobytes() == b.controls.tobytes()
    assert play(2, 10.0, 0.25, seed=5, steps=30)[1].tobytes() != first[1].tobytes()


class _Lost(_Recorder):
    """Finds nothing from the second time on."""

    said = math.nan  # its violation then

    def solve(self, problem: object, starts: np.ndarray) -> Any:
        found = super().solve(problem, starts)
        if len(self.records) == 1:
            return found
        return found._replace(controls=np.full_like(found.controls, np.nan), violation=self.said)


@pytest.mark.parametrize("said", [math.nan, math.inf, 0.0])
def test_if_the_solver_finds_nothing_it_brakes(said: float) -> None:
    recorder = _Lost()
    recorder.said = said
    harness = Harness(RobustController("main.controller", solver=recorder, horizon_from="now"))
    harness.fire(0.0, trigger=0, state=state())
    assert harness.last("control")[0] < -7.0
    harness.fire(0.1, trigger=1, state=state(vx=-0.8, vy=0.6, time=0.1))
    going_on, braking = recorder.records[1][1]
    assert going_on[0, 0] < -7.0
    assert harness.last("control").tolist() == braking[0].tolist()
    assert braking[0, 0] > 0.0 > braking[0, 1]
    assert harness.last("violation") == np.inf


def test_missing_casadi_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(EpicycleError, match=r"pip install 'epicycle\[casadi\]'"):
        Harness(RobustController("main.controller", solver=Casadi()))


def test_casadi_in_the_place_of_the_barrier_method(capfd: pytest.CaptureFixture[str]) -> None:
    _, ours = play(1, 30.0, 0.0, seed=2, steps=8)
    records, theirs = play(1, 30.0, 0.0, seed=2, steps=8, solver=Casadi())
    assert len(records) == 16
    assert theirs[:, 0] == pytest.approx(ours[:, 0], abs=0.05)  # the main robot has one way to go
    assert capfd.readouterr() == ("", "")  # IPOPT would say a page of each problem


def test_parts_can_be_given_as_mappings() -> None:
    made = RobustController("c", objective={"type": "Inform", "range": "10 m"}, solver={"type": "Barrier"})
    assert isinstance(made.objective, Inform)
    assert made.objective.range == 10.0
    with pytest.raises(ParameterError, match="horizon"):
        RobustController("c", horizon=2)


@pytest.mark.parametrize(("patience", "said"), [(0.001, [COMPILING]), (60.0, [])])
def test_compiling_is_announced_only_if_it_takes_long(
    patience: float, said: list[str], caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    caplog.set_level(logging.INFO, "epicycle")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    calls = []

    def work(dimensions: int) -> None:
        assert dimensions == 2
        calls.append(1)
        deadline = time.monotonic() + 10.0
        while patience < 1.0 and not caplog.messages and time.monotonic() < deadline:
            time.sleep(0.001)

    monkeypatch.setattr(warm_up, "_compile_all", work)
    monkeypatch.setattr(warm_up, "_PATIENCE", patience)
    monkeypatch.setattr(warm_up, "IS_READY", True)
    before = threading.active_count()
    compile_once = functools.cache(warm_up.compile_kernels.__wrapped__)
    compile_once()
    compile_once()  # is done
    assert (calls, caplog.messages) == ([1], said)
    while threading.active_count() > before:  # nobody is left who would speak later
        time.sleep(0.001)
    assert caplog.messages == said
    caplog.clear()
    warm_up.compile_kernels.__wrapped__()  # in a later process, which may be slow to load them
    assert caplog.messages == [each.replace("compiling", "loading").replace(" (once, about 20 s)", "") for each in said]


@pytest.mark.parametrize(
    ("ready", "allowed", "at_once"),
    [(True, True, True), (True, False, True), (False, False, True), (False, True, False)],
)
def test_kernels_are_made_ready_before_time_starts_unless_python_runs_them(
    ready: bool, allowed: bool, at_once: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """What is compiled is loaded at once; else it waits until Python has run kernels for long enough."""
    calls: list[int] = []
    ledger = SimpleNamespace(allows=lambda: allowed, prepared=[])
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(warm_up, "LEDGER", ledger)
    monkeypatch.setattr(warm_up, "IS_READY", ready)
    monkeypatch.setattr(warm_up, "_compile_all", calls.append)
    warm_up.compile_kernels.__wrapped__(3)
    assert (calls, len(ledger.prepared)) == (([3], 0) if at_once else ([], 1))
    for each in ledger.prepared:
        each()
    assert calls == [3]
