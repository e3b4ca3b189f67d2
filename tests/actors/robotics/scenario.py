"""The paper's scenario as a plain loop over actors, and a single controller whose problems are recorded, for tests that
need real problems but no engine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from epicycle.actors import (
    Barrier,
    BodyState,
    CircularMotion,
    Estimate,
    Inform,
    Plan,
    Problem,
    ReachGoal,
    RobustController,
    Sensor,
    Solver,
    UnscentedEstimator,
    Vehicle,
)
from epicycle.actors.robotics.numerics.horizon import numbers_of
from epicycle.actors.testing import Harness

if TYPE_CHECKING:
    from numpy.typing import NDArray

STARTS = ((30, 0), (20, 2), (20, -2), (20, -6), (20, 6))


class _Recorder(Barrier):
    """Barrier that remembers what it was asked and what it answered; hidden from YAML by its underscore."""

    def __init__(self, solver: Solver | None = None) -> None:
        super().__init__()
        self.inner = solver or Barrier()
        self.problems: list[Problem] = []
        self.records: list[tuple[Any, NDArray[np.float64], Any]] = []  # with the problem as the kernels take it

    def solve(self, problem: Problem, starts: NDArray[np.float64]) -> Any:
        solution = self.inner.solve(problem, starts)
        self.problems.append(problem)
        self.records.append((numbers_of(problem), starts.copy(), solution))
        return solution


def state(x: float = 30.0, y: float = 0.0, vx: float = 0.0, vy: float = 0.0, *, time: float = 0.0) -> BodyState:
    return BodyState(np.array([x, y]), np.array([vx, vy]), time)


def estimate(x: float = 12.0, y: float = 2.0, spread: float = 0.1, *, time: float = 0.0) -> Estimate:
    return Estimate(np.array([x, y, -1.0, 0.0]), spread * np.eye(4), time, ("main",))


def plan(robot: str, time: float, x: float = 20.0, y: float = 2.0, controls: object = None) -> Plan:
    return Plan(robot, time, state(x, y, time=time), np.zeros((11, 2)) if controls is None else np.array(controls))


def make(**parameters: object) -> tuple[Harness, _Recorder]:
    """A controller whose problems are recorded; steps are counted from now, so that row s - 1 is step s."""
    recorder = _Recorder()
    parameters = {"horizon_from": "now", **parameters}
    return Harness(RobustController("main.controller", solver=recorder, **parameters)), recorder


def play(
    observers: int, reach: float, disturbance: float, seed: int, steps: int = 60, solver: Solver | None = None
) -> tuple[list[Any], NDArray[np.float64]]:
    """Records (problem, starts, solution) of all robots, and positions (steps, robots + 1, 2), the target last."""
    names = ["main", *(f"observer[{i}]" for i in range(observers))]
    lost = np.random.default_rng([seed, 99])
    target = Harness(CircularMotion("obstacle"))
    vehicles, sensors, estimators, controllers = [], [], [], []
    recorder = _Recorder(solver)
    for name, start in zip(names, STARTS, strict=False):
        limits = {"max_speed": 8 if name == "main" else 16, "max_acceleration": 8 if name == "main" else 16}
        vehicles.append(Harness(Vehicle(f"{name}.vehicle", start=start, **limits)))
        sensors.append(Harness(Sensor(f"{name}.sensor"), seed=seed))
        estimators.append(Harness(UnscentedEstimator(f"{name}.estimator")))
        objective = ReachGoal() if name == "main" else Inform(range=reach)
        path = f"{name}.controller"
        controllers.append(Harness(RobustController(path, objective=objective, solver=recorder, **limits)))
    plans: list[Any] = []
    places = np.empty((steps, observers + 2, 2))
    for k in range(steps):
        now = k / 10
        target.fire(now, trigger=k)
        there = target.last("state")
        places[k, -1] = there.position
        measured = []
        for i, (vehicle, sensor) in enumerate(zip(vehicles, sensors, strict=True)):
            control = {"acceleration": controllers[i].last("control")} if k else {}
            vehicle.fire(now, trigger=k, **control)
            places[k, i] = vehicle.last("state").position
            sensor.fire(now, robot=vehicle.last("state"), target=there)
            failed = k > 0 and lost.random() < disturbance
            if not failed:
                measured.append(sensor.last("measurement"))
        heard = plans
        plans = []
        for name, vehicle, estimator, controller in zip(names, vehicles, estimators, controllers, strict=True):
            received = [m for m in measured if m.robot == name or k == 0 or lost.random() >= disturbance]
            estimator.fire(now, trigger=k, measurements=received)
            known = [p for p in heard if p.robot != name and (k == 1 or lost.random() >= disturbance)]
            controller.fire(
                now,
                trigger=k,
                state=vehicle.last("state"),
                estimate=estimator.last("estimate"),
                peer_plans=known,
            )
            plans.append(controller.last("plan"))
    asked = zip(recorder.problems, recorder.records, strict=True)
    return [(problem, *answered) for problem, (_, *answered) in asked], places
