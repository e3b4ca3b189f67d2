"""What the solver's plans are worth by definition."""

import importlib

import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import (
    PREFIX,
    crowded_problem,
    inform_problem,
    objective_by_definition,
    solve,
)

horizon, newton, task = (importlib.import_module(PREFIX + name) for name in ("horizon", "newton", "task"))


@pytest.mark.parametrize(
    ("v", "step", "share"),
    [
        ((0.0, 0.0), (2.0, 0.0), 0.5),
        ((-0.5, 0.0), (1.0, 0.0), 1.5),
        ((-0.5, 0.0), (-1.0, 0.0), 0.5),
        ((1.0, 0.0), (-1.0, 0.0), 2.0),  # on the sphere, through it
        ((3.0, 0.0), (-4.0, 0.0), 0.5),  # from outside, the nearer crossing
    ],
)
def test_the_share_of_a_step_to_a_sphere(v: tuple[float, ...], step: tuple[float, ...], share: float) -> None:
    assert task._share(v, step, 1.0) == pytest.approx(share)


def test_an_observer_gains_information(random: np.random.Generator) -> None:
    """The sign of I in eq. (5): a plan must not know less in the end than standing still does."""
    for _ in range(10):
        problem = inform_problem(random)
        still = objective_by_definition(problem, np.zeros((10, 2)))
        assert objective_by_definition(problem, solve(problem).controls) < still


@pytest.mark.parametrize("kind", ["goal", "inform"])
def test_solution_is_stationary(random: np.random.Generator, kind: str) -> None:
    """The whole objective by finite differences: no small step within the limits improves the plan found."""
    problem = inform_problem(random, steps=6)._replace(max_speed=1e3, max_acceleration=1e3)
    if kind == "goal":
        problem = problem._replace(objective=horizon.REACH_GOAL, goal=np.array([[8.0, 5.0]]))
    solution = solve(problem)
    value = objective_by_definition(problem, solution.controls)
    gap = 1e-4 * max(1.0, abs(value))
    for _ in range(200):
        step = random.normal(size=(6, 2))
        trial = solution.controls + step * random.choice([1e-3, 1e-2, 0.1])
        assert objective_by_definition(problem, trial) > value - gap


def moved(posed: "task.Task", length: float, mu: float) -> float:
    """What is minimised, so far along a step."""
    task.move(posed, length)
    return float(task.evaluate(posed, task.Phase.OPTIMISE, mu, mu, np.inf))


@pytest.mark.parametrize("mu", [1.0, 0.01])
def test_a_step_begins_with_its_slope(random: np.random.Generator, mu: float) -> None:
    """What is minimised, with f6 smoothed, changes along a Newton step as its derivatives say."""
    zero = (0.0, 0.0)
    for _ in range(10):
        problem = inform_problem(random)._replace(max_speed=1e3, max_acceleration=1e3)
        room = np.zeros(task.room_for(problem, 10, 2))  # so that all bounds are 0
        posed = task.new_task(problem, 10, 10, np.inf, room, zero)
        moved(posed, 0.0, mu)
        slope = newton.newton_step(posed.stages, posed.period, posed.free, zero)
        difference = moved(posed, 1e-6, mu) - moved(posed, -1e-6, mu)
        assert difference / 2e-6 == pytest.approx(slope, rel=1e-4)


def test_a_start_that_is_too_fast_on_the_way_is_left_out(random: np.random.Generator) -> None:
    """It is slow enough at the end, and the plan is to be so all the way."""
    problem = crowded_problem(random)._replace(velocity=np.array([6.0, 0.0]))
    fast = np.zeros((10, 2))
    fast[:4, 0], fast[4:, 0] = 7.0, -7.0  # 8.8 m/s after the fourth, and 4.6 at the end
    found = solve(problem, fast)
    assert found.controls[:, 0].max() < 0.0
    assert (found.objective, found.iterations) == (np.inf, 0)
