"""Robots of one's own, written as in docs/extending.md: a car, a bearing sensor, an objective, a filter, a solver."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors import (
    Barrier,
    BodyState,
    Casadi,
    Dynamics,
    Estimate,
    ExtendedEstimator,
    FilterPyEstimator,
    Inform,
    Measurement,
    ParameterError,
    ParticleEstimator,
    Plan,
    ReachGoal,
    RobustController,
    SampledEstimate,
    Sensor,
    StayNear,
    UnscentedEstimator,
    Vehicle,
    symbolic,
)
from epicycle.actors.testing import Harness
from epicycle.runner import Model, Results, Simulation, load_model
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.catalogue.types import types_of_file

OWN = Path(__file__).parent / "own"
OWN_ROBOT = """composites:
  OwnRobot:
    extends: MobileRobot
"""
LINES = {"car.py": 60, "car.yaml": 40, "bearing.py": 20, "sight.py": 25, "particles.py": 60, "slsqp.py": 25}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One's own folder, with a copy of the packaged robots."""
    shutil.copytree(OWN, tmp_path, dirs_exist_ok=True)
    shutil.copytree(Path(str(packaged_models()["collision_avoidance"])).parent / "robots", tmp_path / "robots")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def types(name: str) -> list[type]:
    return types_of_file(OWN / f"{name}.py")


def play(model: Model, seed: int = 1, until: float | None = None) -> Results:
    return Simulation(model, seed=seed, keep_log=True).run(until=until)


def error_of_the_estimate(results: Results, robot: str = "main") -> float:
    """How far the last estimate is from the obstacle."""
    last = {f"{each.actor}.{each.port}": each.value for each in results.log.records}
    return float(np.hypot(*(last[f"{robot}.estimator.estimate"].mean[:2] - last["obstacle.state"].position)))


def team_with(folder: Path, estimator: str) -> Path:
    """The model of the car with a robot of the paper in its place, and with another estimator in all robots."""
    text = (folder / "car.yaml").read_text(encoding="utf-8")
    for old, new in (
        ("    dynamics: {type: Bicycle, heading: 180 deg}\n", ""),
        ("    solver: {type: Casadi}\n", ""),
        ("type: MobileRobot\n", "type: OwnRobot\n"),
        ("parameters:\n", f"{OWN_ROBOT}    actors: {{estimator: {{type: {estimator}}}}}\nparameters:\n"),
    ):
        assert old in text
        text = text.replace(old, new)
    (folder / "team.yaml").write_text(text, encoding="utf-8")
    return folder / "team.yaml"


@pytest.mark.parametrize("name", LINES)
def test_it_is_short(name: str) -> None:
    assert len((OWN / name).read_text(encoding="utf-8").splitlines()) <= LINES[name]


def test_nothing_is_left_out() -> None:
    assert {path.name for path in OWN.iterdir() if path.is_file()} == set(LINES)


# --- a car ----------------------------------------------------------------------------------------------


def test_a_car_drives_as_its_bicycle_model_says(folder: Path) -> None:
    (bicycle,) = types("car")
    vehicle = Harness(Vehicle("v", dynamics=bicycle(heading=0.0, wheelbase=2.0), start=[1, 2]))
    expected = [1.0, 2.0, 0.0, 0.0]
    for k in range(20):
        vehicle.fire(k / 10, trigger=k, acceleration=np.array([2.0, 0.3]))
        body = vehicle.last("state")
        assert [*body.position, *body.rest] == pytest.approx(expected)
        assert body.velocity == pytest.approx(
            [expected[3] * math.cos(expected[2]), expected[3] * math.sin(expected[2])]
        )
        x, y, heading, speed = expected
        expected = [
            x + 0.1 * speed * math.cos(heading), y + 0.1 * speed * math.sin(heading),
            heading + 0.1 * speed * math.tan(0.3) / 2.0, speed + 0.2,
        ]  # fmt: skip


def test_a_car_arrives_and_others_know_where_it_goes(folder: Path) -> None:
    """What it announces, taken as a double integrator's plan, is where it plans to be, and nearly where it gets to."""
    pytest.importorskip("casadi")
    results = play(load_model(folder / "car.yaml", types=types("car")))
    assert results.metrics["arrival"] < 8.0
    assert results.metrics["nearest"] > 2.0
    states = {round(10 * each.time): each for each in results.signals["main.state"].tokens}
    for state in states.values():
        assert -2.0 <= state.rest[1] <= 8.0
    plans = [each.value for each in results.log.records if each.actor == "main.controller" and each.port == "plan"]
    assert len(plans) > 40
    for plan in plans[5:-5]:
        place, velocity, ahead = plan.state.position.copy(), plan.state.velocity.copy(), []
        for control in plan.controls:
            place, velocity = place + 0.1 * velocity, velocity + 0.1 * control
            ahead.append(place)
        then = round(10 * plan.time)
        assert ahead[0] == pytest.approx(states[then + 1].position, abs=1e-9)
        assert ahead[1] == pytest.approx(states[then + 2].position, abs=0.1)


class _Sliding(Dynamics):
    """Says no more of itself than how it moves."""

    def step(self, state: Any, control: Any, period: float) -> Any:
        x, y, vx, vy = state
        return [x + period * vx, y + period * vy, vx + period * control[0], vy + period * control[1]]


def test_a_velocity_is_what_follows_the_position_unless_it_is_said() -> None:
    body = _Sliding().body([1.0, 2.0, 3.0, 4.0], 0.5)
    assert (body.position.tolist(), body.velocity.tolist(), body.time) == ([1.0, 2.0], [3.0, 4.0], 0.5)


def test_the_car_from_the_command_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "car.yaml", "--types", str(OWN / "car.py")]) == 0
    assert main(["describe", "Vehicle", "--types", str(OWN / "car.py")]) == 0
    assert "Bicycle" in capsys.readouterr().out


def test_a_car_that_is_too_fast_brakes_and_still_steers(folder: Path) -> None:
    """Beyond its limits it keeps no plan within them; it once went straight on for ever."""
    pytest.importorskip("casadi")
    (bicycle,) = types("car")
    vehicle = Vehicle("v", dynamics=bicycle(heading=math.pi), start=[30, 0])
    controller = RobustController("main.c", dynamics=bicycle(), objective=ReachGoal(goal=(30, 20)), solver=Casadi())
    car, driver, control, speeds = Harness(vehicle), Harness(controller), np.zeros(2), []
    for k in range(20):
        car.fire(k / 10, trigger=k, acceleration=control)
        if k == 1:
            vehicle._state = [30.0, 0.0, math.pi, 12.0]  # a push, from outside
        driver.fire(k / 10, trigger=k, state=car.last("state"))
        control = driver.last("control")
        speeds.append(float(car.last("state").rest[1]))
    assert np.diff(speeds[3:12]) == pytest.approx(-0.39, abs=0.011)  # as hard as it can
    assert max(speeds[16:]) <= 8.0
    assert car.last("state").velocity[1] > 5.0  # towards the goal, which was to its right


def test_a_solver_that_cannot_is_named(folder: Path) -> None:
    (bicycle,) = types("car")
    with pytest.raises(ParameterError) as caught:
        RobustController("main.controller", dynamics=bicycle())
    assert str(caught.value) == (
        "solver: Barrier solves the objectives ReachGoal, StayNear, Inform for a DoubleIntegrator, and not ReachGoal "
        "for a Bicycle; write 'solver: {type: Casadi}'"
    )
    with pytest.raises(ParameterError) as caught:
        Vehicle("v", dynamics=bicycle(), start=[1, 2, 3])
    assert str(caught.value) == "start: it has 3 numbers; expected 2 for a Bicycle"
    with pytest.raises(ParameterError) as caught:
        Vehicle("v", dynamics=bicycle(), start=[1, 2], start_velocity=[1, 0])
    assert str(caught.value) == "start_velocity: a Bicycle starts as its parameters say; leave it out"


@pytest.mark.slow
def test_the_car_is_safe(folder: Path) -> None:
    """In 100 runs in which a quarter of all messages and measurements are lost, with two observers."""
    pytest.importorskip("casadi")
    model = load_model(folder / "car.yaml", types=types("car"))
    runs = [Simulation(model, seed=seed).run().metrics for seed in range(100)]
    assert min(run["nearest"] for run in runs) >= 2.0
    assert max(run["arrival"] for run in runs) < 30.0


# --- a sensor -------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    "estimator", ["UnscentedEstimator", "ExtendedEstimator", "FilterPyEstimator", "ParticleEstimator"]
)
def test_a_bearing_only_sensor_in_every_filter(estimator: str, folder: Path) -> None:
    """Four robots that see directions know where the obstacle is; late and lost messages included."""
    model = load_model(
        team_with(folder, estimator),
        types=types("bearing"),
        set={"*.sensor.model": {"type": "Bearing", "deviation": "2 deg"}, "disturbance": 0.1},
    )
    results = play(model, seed=3, until=3.0)
    assert error_of_the_estimate(results) < 1.0


def test_an_angle_has_no_beginning(folder: Path) -> None:
    """The target behind the robot, where bearings jump by a whole turn."""
    (bearing,) = types("bearing")
    sensors = [Harness(Sensor(f"r{i}.s", model=bearing(deviation=0.02)), seed=i) for i in range(2)]
    for kind in (UnscentedEstimator, ExtendedEstimator, FilterPyEstimator):
        estimator = Harness(kind("e", prior_mean=(-9, 0, 0, 0), prior_variance=(4, 4, 1, 1)))
        for k in range(30):
            measured = []
            for sensor, y in zip(sensors, (3.0, -3.0), strict=True):
                there = BodyState((-10.0, 0.3 * (-1) ** k * 0.1), (0.0, 0.0), k / 10)
                sensor.fire(k / 10, robot=BodyState((0.0, y), (0.0, 0.0), k / 10), target=there)
                measured.append(sensor.last("measurement"))
            estimator.fire(k / 10, trigger=k, measurements=measured)
        assert estimator.last("estimate").mean[:2] == pytest.approx([-10.0, 0.0], abs=1.0)


# --- an objective ---------------------------------------------------------------------------------------


@pytest.mark.slow
def test_an_observer_that_keeps_the_obstacle_in_sight(folder: Path) -> None:
    pytest.importorskip("casadi")
    pillars = [[16.0, 4.0, 1.0]]
    seen = {}
    for name, objective in (
        ("theirs", {"type": "StayNear", "to": {"target": 1}, "offset": [6, 6]}),
        ("own", {"type": "KeepSight", "pillars": pillars, "away": "8 m"}),
    ):
        model = load_model(
            "collision_avoidance",
            types=types("sight"),
            set={
                "observers": 1, "observer[*].controller.objective": objective,
                "observer[*].controller.solver": {"type": "Casadi"},
            },
        )  # fmt: skip
        results = play(model, until=4.0)
        robots, targets = (results.signals[each].tokens for each in ("observer[0].state", "obstacle.state"))
        shares = np.linspace(0.0, 1.0, 200)[:, np.newaxis]
        lines = [a.position + shares * (b.position - a.position) for a, b in zip(robots, targets, strict=True)]
        seen[name] = [float(np.hypot(*(line - pillars[0][:2]).T).min()) > 1.0 for line in lines[20:]]
    assert all(seen["own"])
    assert not all(seen["theirs"])


# --- a filter -------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_inform_uses_the_samples_of_a_particle_filter(folder: Path) -> None:
    model = load_model(team_with(folder, "OwnParticles"), types=types("particles"))
    asked: list[Any] = []
    inner = type(model.graph.actors["observer[0].controller"].solver).solve

    def note(self: Any, problem: Any, starts: Any) -> Any:
        asked.append(problem)
        return inner(self, problem, starts)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(model.graph.actors["observer[0].controller"].solver), "solve", note)
        results = play(model, until=3.0)
    informed = [each for each in asked if len(each.weights) == 20]
    assert len(informed) >= 58  # two observers, and all but the first tick
    assert error_of_the_estimate(results, "observer[0]") < 1.5
    states = [each for each in results.log.records if (each.actor, each.port) == ("observer[0].vehicle", "state")]
    moved = [each.value.position for each in states]
    assert np.hypot(*(moved[-1] - moved[0])) > 3.0


def test_particles_that_are_drawn_again_count_the_same() -> None:
    """One measurement that nearly all of them contradict, and the belief is where it says."""
    harness = Harness(ParticleEstimator("e", particles=2000, prior_mean=(10, 0, 0, 0), prior_variance=(4, 4, 1, 1)))
    seen = Measurement("a", np.zeros(2), "relative_position", np.array([11.0, 1.0]), 0.2, 0.2, 0.0)
    harness.fire(0.0, trigger=0, measurements=[seen])
    found = harness.last("estimate")
    assert found.weights.sum() == pytest.approx(1.0)
    assert found.mean[:2] == pytest.approx([11.0, 1.0], abs=0.1)
    assert np.diag(found.covariance)[:2] == pytest.approx([0.04, 0.04], rel=0.3)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("size", [4, 6])
def test_samples_move_on_to_the_end_of_the_horizon(size: int, dimensions: int) -> None:
    """In the plane and in space, whatever the robot's own space is."""
    controller = RobustController("main.a", objective=Inform(), dimensions=dimensions, horizon_from="now")
    samples = np.arange(1.0, 1.0 + 2 * size).reshape(2, size)
    told = SampledEstimate(np.zeros(size), np.eye(size), 0.1, samples=samples, weights=[0.25, 0.75])
    own = BodyState((30.0, 0.0, 5.0)[:dimensions], np.zeros(dimensions), 0.3)
    harness = Harness(controller)
    harness.fire(0.3, trigger=0, state=own, estimate=told)
    problem, _ = controller._problem(own)
    places, velocities = samples[:, : size // 2], samples[:, size // 2 :]
    expected = np.zeros((2, 3))
    expected[:, : size // 2] = places + 1.2 * velocities
    assert problem.samples == pytest.approx(expected[:, :dimensions])
    assert problem.weights.tolist() == [0.25, 0.75]


# --- a solver -------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("objective", [ReachGoal(), StayNear(to={"target": 1.0}), Inform()])
def test_scipy_finds_the_plan_of_the_barrier_method(objective: Any, folder: Path) -> None:
    (slsqp,) = types("slsqp")
    harness = Harness(RobustController("main.a", objective=objective, solver=slsqp()))
    there = BodyState((30.0, 0.0), (-2.0, 0.5), 0.0)
    estimate = Estimate((22, 1, 0, 0), 0.1 * np.eye(4), 0.0)
    harness.fire(0.0, trigger=0, state=there, estimate=estimate)
    assert harness.last("violation") < 1e-5
    problem, starts = harness.actor._problem(there)
    ours, theirs = Barrier().solve(problem, starts), slsqp().solve(problem, starts)
    assert theirs.violation < 1e-5
    assert theirs.objective == pytest.approx(ours.objective, rel=1e-3, abs=1e-3)
    if not isinstance(objective, Inform):  # whose optimum is flat
        assert theirs.controls[:8] == pytest.approx(ours.controls[:8], abs=0.1)


def test_a_flying_body_without_a_height_to_stay_above() -> None:
    harness = Harness(RobustController("main.a", objective=Inform(), dimensions=3, lowest=None))
    own = BodyState((30.0, 0.0, 5.0), np.zeros(3), 0.0)
    harness.fire(0.0, trigger=0, state=own, estimate=Estimate(np.zeros(4), np.eye(4), 0.0))
    numbers, _ = harness.actor._problem(own)
    assert numbers.lowest == -np.inf
    assert np.isfinite(harness.last("control")).all()


# --- the protocols and the kernels ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "objective",
    [ReachGoal(goal=(3, 4)), StayNear(to={"b": 2.0, "target": 1.0}), Inform(), Inform(across=9.0)],
)
@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_problem_is_what_the_kernels_solve(objective: Any, dimensions: int, random: np.random.Generator) -> None:
    """What they report of a plan is what dynamics and objective say of it."""
    controller = RobustController("a.c", objective=objective, dimensions=dimensions)
    harness, d = Harness(controller), dimensions
    place = random.normal(size=d) + 5.0
    other = BodyState(random.normal(size=d), np.zeros(d), 0.0)
    covariance = np.diag([1.0, 2.0, 0.5, 0.5])
    harness.fire(
        0.0, trigger=0, state=BodyState(place, np.ones(d), 0.0), estimate=Estimate((9, 1, 0, 0), covariance, 0.0),
        peer_plans=[Plan("b", 0.0, other, np.zeros((11, d)))],
    )  # fmt: skip
    problem, starts = harness.actor._problem(BodyState(place, np.ones(d), 0.1))
    found = Barrier().solve(problem, starts)
    assert found.objective == pytest.approx(problem.cost(found.controls), rel=1e-9)
    assert found.violation == pytest.approx(max(0.0, problem.constraints(found.controls).max()), abs=1e-6)
    assert problem.limits(found.controls).max() <= 1e-9


def test_problems_of_the_same_form_are_compiled_once() -> None:
    """The form is what their dynamics and objectives are, with all parameters, and not who holds them."""

    def key(**changed: float) -> object:
        own = BodyState((9.0, 0.0), np.zeros(2), 0.0)
        harness = Harness(RobustController("a", objective=Inform(**changed)))
        harness.fire(0.0, trigger=0, state=own)
        return harness.actor._problem(own)[0].key

    assert key() == key() == key(range=30.0)
    assert key() != key(range=31.0)
    assert hash(key()) == hash(key())


def test_the_length_of_a_vector() -> None:
    assert symbolic.norm([3.0, 4.0]) == pytest.approx(5.0)
    assert symbolic.norm(np.array([2.0, 3.0, 6.0])) == pytest.approx(7.0)
