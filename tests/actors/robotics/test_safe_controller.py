"""The safe controller: retreats keep what they promise, and the model runs in pairs with the paper's."""

import math

import numpy as np
import pytest

import epicycle
from epicycle.actors import BodyState, Estimate, IntegratedOUEstimator, ReachGoal, SafeController, Vehicle
from epicycle.actors.robotics.numerics import retreat
from epicycle.actors.testing import Harness
from epicycle.runner.interface.cli import main

PERIOD, SPEED, LIMIT = 0.1, 1.5, 8.0  # s; m/s of the target; m/s and m/s^2 of the robot
LIMITS = SPEED, LIMIT, LIMIT, PERIOD
AROUND = np.array([(math.cos(a), math.sin(a)) for a in np.arange(64) * (2 * math.pi / 64)])
MODEL = "safe_avoidance"


def drawn(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position and velocity at step 1, and the control of the next period, within the robot's limits."""
    velocity, control = (AROUND[random.integers(64)] * random.uniform(0, LIMIT) for _ in range(2))
    return random.uniform(-20, 20, 2), velocity, control


def driven(position: np.ndarray, velocity: np.ndarray, control: np.ndarray, away: np.ndarray, steps: int) -> np.ndarray:
    """Positions at steps 1, 2, ..., as ``Vehicle`` moves: under the control for a period, then under ``away``."""
    body = Vehicle("v", start=position, start_velocity=velocity, max_speed=LIMIT, max_acceleration=LIMIT)
    vehicle, found = Harness(body), []
    for k in range(steps):
        vehicle.fire(k * PERIOD, trigger=k, acceleration=control if k == 0 else away)
        found.append(vehicle.last("state").position)
    return np.array(found)


@pytest.mark.slow
def test_no_target_comes_nearer_than_a_retreat_promises() -> None:
    """Against targets that start on their bound and go anywhere at their largest speed, straight at the robot too."""
    random, nearest = np.random.default_rng(1), math.inf
    for _ in range(150):
        position, velocity, control = drawn(random)
        n, bound = AROUND[random.integers(64)], random.uniform(-20, 20)
        promised = retreat.kept_distance(*n, bound, position, velocity, control, *LIMITS)
        way = driven(position, velocity, control, LIMIT * n, 60)
        across = np.array([-n[1], n[0]])
        for chases in (True, False):
            for _ in range(10):
                there = bound * n + (across @ position + random.normal(0, 3)) * across + SPEED * PERIOD * n
                for k in range(1, 60):
                    there = there + SPEED * PERIOD * heading(random, way[k] - there, n, chases=chases)
                    if k >= retreat.FIRST - 1:
                        assert math.dist(way[k], there) >= promised - 1e-9
                        nearest = min(nearest, math.dist(way[k], there) - promised)
    assert nearest < 0.05  # the promise is no smaller than it has to be


def heading(random: np.random.Generator, towards: np.ndarray, n: np.ndarray, *, chases: bool) -> np.ndarray:
    if chases:
        return towards / max(math.hypot(*towards), 1e-9) if towards @ n > 0 else n
    return AROUND[random.integers(64)]


def test_a_retreat_stays_open_once_it_is() -> None:
    """A period later, it keeps at least as much, from a bound that has moved as fast as the target can."""
    random = np.random.default_rng(2)
    for _ in range(500):
        position, velocity, control = drawn(random)
        n, bound = AROUND[random.integers(64)], random.uniform(-20, 20)
        before = retreat.kept_distance(*n, bound, position, velocity, control, *LIMITS)
        then = velocity + PERIOD * control
        then *= min(1.0, LIMIT / max(math.hypot(*then), 1e-12))
        after = retreat.kept_distance(
            *n, bound + SPEED * PERIOD, position + PERIOD * velocity, then, LIMIT * n, *LIMITS
        )
        assert after >= before - 1e-9


def test_the_reach_of_a_target() -> None:
    """The support of its ellipse, and the way it can have gone since."""
    random = np.random.default_rng(3)
    root, mean = random.normal(size=(4, 4)), random.normal(size=4)
    found = retreat.support(AROUND, mean, root @ root.T, 0.4, 3.0, SPEED)
    ellipse = mean[:2] + 3.0 * np.array([p / math.hypot(*p) for p in random.normal(size=(20_000, 4))]) @ root.T[:, :2]
    for n, most in zip(AROUND, found, strict=True):
        assert (ellipse @ n).max() + 0.4 * SPEED <= most + 1e-9
        assert (ellipse @ n).max() + 0.4 * SPEED == pytest.approx(most, abs=0.2)


def test_the_best_retreat_is_the_best() -> None:
    random = np.random.default_rng(4)
    position, velocity, control = drawn(random)
    limits = random.uniform(-3, 3, 64)
    kept, row = retreat.best_retreat(AROUND, limits, position, velocity, control, *LIMITS)
    every = [
        retreat.kept_distance(*n, bound, position, velocity, control, *LIMITS)
        for n, bound in zip(AROUND, limits, strict=True)
    ]
    assert (kept, row) == (max(every), int(np.argmax(every)))


@pytest.mark.parametrize("jumpy", [False, True])
def test_a_target_that_hunts_the_robot_does_not_get_it(jumpy: bool) -> None:
    """As far as estimates are right: any at most 3.5 standard deviations off, drawn anew every period."""
    random = np.random.default_rng(5)
    controller = Harness(SafeController("main.controller", objective=ReachGoal()))
    vehicle = Harness(Vehicle("main.vehicle", start=(30.0, 0.0)))
    target, deviation, nearest = np.array([12.0, 0.5]), 0.3, math.inf
    for k in range(150):
        now = k * PERIOD
        vehicle.fire(now, trigger=k, **({"acceleration": controller.last("control")} if k else {}))
        own = vehicle.last("state")
        nearest = min(nearest, math.dist(own.position, target))
        off = AROUND[random.integers(64)] * (3.49 * deviation if jumpy else 0.0)
        mean = np.array([*(target + off), 0.0, 0.0])
        seen = Estimate(mean, np.diag([deviation**2, deviation**2, 1.0, 1.0]), now)
        controller.fire(now, trigger=k, state=own, estimate=seen)
        step = own.position - target
        target = target + SPEED * PERIOD * step / math.hypot(*step)
    assert nearest >= 2.0
    assert jumpy or controller.last("overrides") > 0


def test_without_a_state_it_stops_and_without_a_target_it_plans() -> None:
    controller = Harness(SafeController("main.controller", objective=ReachGoal()))
    controller.fire(0.0, trigger=0)
    assert controller.last("control") == pytest.approx([0, 0])
    controller.fire(0.1, trigger=1, state=BodyState((30.0, 0.0), (0.0, 0.0), 0.1))
    assert controller.last("control")[0] < -7
    assert controller.last("overrides") == 0


def test_between_what_is_planned_and_the_last_retreat() -> None:
    """As much of the plan as leaves a retreat is kept, in quarters; if none does, it is the last retreat."""
    controller = SafeController("main.controller", objective=ReachGoal())
    harness = Harness(controller)
    own, seen = BodyState((30.0, 0.0), (0.0, 0.0), 0.0), Estimate((12.0, 0.0, 0.0, 0.0), 0.1 * np.eye(4), 0.0)
    harness.fire(0.0, trigger=0, state=own, estimate=seen)
    problem, _ = controller._problem(own)
    planned, last, tried = np.array([-4.0, 2.0]), controller._retreat, []
    assert last is not None

    def best(directions: np.ndarray, *given: object) -> tuple[float, int]:
        tried.append(given[3])
        return (2.0 if len(tried) == enough else 1.0), 7

    controller._best, controller._kept = best, lambda *given: 1.0
    for enough in (1, 2, 3, 4, 5):
        tried.clear()
        controller._retreat = last
        found = controller._safe(0.0, problem, planned)
        shares = [1.0, 0.75, 0.5, 0.25, 0.0]
        assert np.array(tried) == pytest.approx(
            np.array([share * planned + (1.0 - share) * LIMIT * last.direction for share in shares[: min(enough, 4)]])
        )
        share = shares[enough - 1]
        assert found == pytest.approx(share * planned + (1.0 - share) * LIMIT * last.direction)


def test_the_estimator_of_a_roaming_target() -> None:
    """It predicts with the model: far ahead, the speed is the target's, in no direction."""
    estimator = IntegratedOUEstimator("e", prior_mean=(5, 5, 1, 1), prior_variance=(1, 1, 9, 9), target_speed=1.5)
    harness = Harness(estimator)
    harness.fire(0.0, trigger=0)
    harness.fire(60.0, trigger=1)
    last = harness.last("estimate")
    assert last.mean[2:] == pytest.approx([0, 0], abs=1e-9)
    assert np.diag(last.covariance)[2:] == pytest.approx([1.125, 1.125])


@pytest.mark.parametrize(("seed", "observers", "disturbance", "reach"), [(5, 0, 0.5, 30), (7, 2, 0.25, 10)])
def test_with_the_paper_s_parts_it_is_the_paper_s_scenario(
    seed: int, observers: int, disturbance: float, reach: float
) -> None:
    settings = {"observers": observers, "disturbance": disturbance, "measurement_range": reach}
    there = epicycle.run("collision_avoidance", seed=seed, set=settings, progress=False)
    here = epicycle.run(MODEL, seed=seed, set={**settings, "controller": "paper"}, progress=False)
    assert dict(here.metrics) == dict(there.metrics)


def test_a_controller_that_there_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", MODEL, "--set", "controller=careful"]) == 2
    assert capsys.readouterr().err == (
        "command line:1:18: error: controller: 'careful' is not one of paper, safe\n"
        "    1 | --set controller=careful\n"
        "      |                  ^^^^^^^\n"
        "   help: declared by SafeRobot.controller\n"
    )


@pytest.mark.slow
def test_two_hundred_runs_under_the_worst_conditions() -> None:
    """Without observers and with half of the measurements lost, where the paper's comes near in one run of 60."""
    for seed in range(200_000, 200_200):
        run = epicycle.run(MODEL, seed=seed, set={"observers": 0, "disturbance": 0.5}, progress=False)
        assert run.metrics["min_obstacle_distance"] >= 2, seed
        assert run.metrics["arrival_time"] < 30, seed
