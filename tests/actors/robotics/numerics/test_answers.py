"""The solver's answers to some problems, to eight digits, with the Newton steps that they take.

Whether an answer is right, ``test_solver.py`` asks of another solver; here nothing may move unnoticed, the way to the
answer included.  ``python -m tests.actors.robotics.numerics.test_answers`` writes the answers of today.
"""

from __future__ import annotations

import importlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import as_problem, violations

PREFIX = "epicycle.actors.robotics.numerics."
barrier = importlib.import_module(PREFIX + "barrier")
horizon = importlib.import_module(PREFIX + "horizon")
information = importlib.import_module(PREFIX + "mutual_information")

FILE = Path(__file__).parent / "answers.json"
STEPS, PERIOD = 6, 0.1
AHEAD = np.arange(STEPS)[:, np.newaxis]  # periods after step 1


def moving(x: float, y: float, vx: float, vy: float) -> np.ndarray:
    """Where something with a constant velocity is at all steps."""
    return np.array([x, y]) + PERIOD * AHEAD * np.array([vx, vy])


def peers(*bodies: tuple[float, float, float, float], distance: float = 2.0) -> dict[str, Any]:
    """Who is to be kept away from, a little more at each step."""
    apart = distance + 0.05 * AHEAD[:, 0]
    return {
        "peer_mean": np.array([moving(*body) for body in bodies]),
        "peer_distance": np.array([apart for _ in bodies]),
    }


def obstacle(x: float, y: float, vx: float, vy: float, xx: float, xy: float, yy: float) -> dict[str, Any]:
    """The target, whose covariance grows."""
    growth = 1.0 + 0.1 * AHEAD
    return {
        "obstacle_mean": moving(x, y, vx, vy)[np.newaxis],
        "obstacle_covariance": (growth * np.array([xx, xy, yy]))[np.newaxis],
    }


def informed(others: list[tuple[float, float]], gamma: float, reach: float) -> dict[str, Any]:
    """Eq. (5) with five sigma points."""
    points = np.array([[0.3, 0.1], [1.2, 0.4], [-0.6, -0.2], [0.1, 1.0], [0.5, -0.9]])
    ends = np.array(others).reshape(len(others), 2)
    return {
        "ends": ends,
        "objective": horizon.INFORM,
        "sigma_positions": points,
        "sigma_weights": np.array([0.0, 0.25, 0.25, 0.25, 0.25]),
        "others_distance": information.pairwise_distance(points, ends[:, np.newaxis], 2.0),
        "measurement_variance": 2.0,
        "range_penalty": gamma,
        "measurement_range": reach,
    }


def tube(x: float, y: float, vx: float, vy: float, radius: float, bound: int = STEPS) -> dict[str, Any]:
    """The standing plan, which binds at so many steps."""
    radii = np.where(AHEAD[:, 0] < bound, radius + 0.1 * AHEAD[:, 0], math.inf)
    return {"tube_centre": moving(x, y, vx, vy), "tube_radius": radii}


NEAR = obstacle(3.0, 0.5, -1.0, 0.2, 0.04, 0.01, 0.09)
FAST = {"velocity": np.array([7.9, 0.5])}
PROBLEMS: dict[str, dict[str, Any]] = {
    "nothing in the way": {},
    "at full speed": {**FAST, "goal": np.array([60.0, 0.0])},
    "goal close by": {"goal": np.array([0.2, 0.1])},
    "an obstacle ahead": {**NEAR, "goal": np.array([9.0, 0.0])},
    "an obstacle without margin": {**NEAR, "margin": 0.0, "goal": np.array([9.0, 0.0])},
    "two peers": {**peers((3.2, 0.2, -1.0, 0.0), (0.5, 3.2, 0.5, -1.0)), "goal": np.array([9.0, 3.0])},
    "a tube": {**tube(0.0, 0.0, 2.0, 0.5, 0.05), "goal": np.array([-20.0, 0.0])},
    "a tube that ends": {**tube(0.1, 0.0, 1.0, 1.0, 0.2, 4), **NEAR, "goal": np.array([20.0, 0.0])},
    "inside a peer": {**peers((0.3, 0.1, 0.0, 0.0)), "goal": np.array([9.0, 0.0])},
    "inside the obstacle": {**obstacle(0.2, -0.1, 0.1, 0.0, 0.5, 0.2, 0.3), "goal": np.array([9.0, 0.0])},
    "a tube and a peer that contradict": {**tube(1.0, 0.0, 0.0, 0.0, 0.1), **peers((1.0, 0.2, 0.0, 0.0))},
    "in a ring": {**peers(*((2.2 * math.cos(a), 2.2 * math.sin(a), 0.0, 0.0) for a in range(6)), distance=2.5)},
    "in a crowd": {
        **peers(*((3.0 * math.cos(a), 3.0 * math.sin(a), -math.cos(a), 0.0) for a in range(20)), distance=15.0)
    },
    "in a crowd that keeps away nearly": {
        **peers(*((4.0 * math.cos(a), 4.0 * math.sin(a), -math.cos(a), 0.0) for a in range(20)), distance=4.5)
    },
    "an obstacle and a peer": {**NEAR, **peers((1.0, -3.0, 0.0, 2.0)), "goal": np.array([9.0, -3.0])},
    "at the goal": {"velocity": np.zeros(2), "goal": np.array([0.001, 0.0])},
    "a start that pushes too hard": {"max_acceleration": 3.0},
    "a start that gets too fast": {"max_speed": 2.6, "goal": np.array([8.0, 4.0])},
    "too fast": {"velocity": np.array([9.5, 3.0]), **NEAR},
    "too fast, alone": {"velocity": np.array([9.5, 3.0])},
    "much too fast": {"velocity": np.array([0.0, -30.0]), **peers((0.0, -5.0, 0.0, 0.0))},
    "informed": {**obstacle(0.3, 0.1, 1.0, 0.5, 0.3, 0.1, 0.2), **informed([], 0.001, 3.0), "position": [6.0, 5.0]},
    "informed with others": {
        **obstacle(0.3, 0.1, 1.0, 0.5, 0.3, 0.1, 0.2),
        **informed([(3.0, -2.0), (-4.0, 1.0)], 0.5, 6.0),
        "position": [5.0, -4.0],
    },
    "informed without a penalty": {
        **obstacle(0.3, 0.1, 1.0, 0.5, 0.3, 0.1, 0.2),
        **informed([(3.0, -2.0)], 0.0, 1.0),
        "position": [4.0, 3.0],
    },
    "informed within reach": {
        **obstacle(0.3, 0.1, 1.0, 0.5, 0.3, 0.1, 0.2),
        **informed([(3.0, -2.0)], 0.5, 9.0),
        "position": [5.0, -4.0],
    },
    "informed of nobody": {**informed([], 0.001, 3.0), "obstacle_mean": np.empty((0, STEPS, 2))},
}


def posed(ends: np.ndarray | None = None, **changes: Any) -> Any:
    """A problem: at rest nearly, 8 m from the goal, with nobody around; ``ends`` only say where others measure."""
    fields: dict[str, Any] = {
        "period": PERIOD,
        "position": np.zeros(2),
        "velocity": np.array([2.0, 0.5]),
        "max_speed": 8.0,
        "max_acceleration": 6.0,
        "tube_centre": np.zeros((STEPS, 2)),
        "tube_radius": np.full(STEPS, math.inf),
        "safe_distance": 1.0,
        "margin": 2.0,
        "obstacle_mean": np.empty((0, STEPS, 2)),
        "obstacle_covariance": np.empty((0, STEPS, 3)),
        "peer_mean": np.empty((0, STEPS, 2)),
        "peer_distance": np.empty((0, STEPS)),
        **({} if "objective" in changes else {"goal": np.array([8.0, 0.0])}),
        **changes,
    }
    shapes = {"position": (2,), "goal": (1, 2)}
    shaped = {
        name: np.array(fields[name], dtype=float).reshape(shape) for name, shape in shapes.items() if name in fields
    }
    return horizon.HorizonProblem(**{**fields, **shaped})


def starts() -> np.ndarray:
    """A push, none, and one aside."""
    return np.array([[[3.0, -2.0]] * STEPS, [[0.0, 0.0]] * STEPS, [[-1.0, 2.5]] * STEPS])


def answer(name: str) -> dict[str, Any]:
    """What the solver says."""
    found = barrier.solve(posed(**PROBLEMS[name]), starts())
    return {
        "controls": found.controls.tolist(),
        "violation": found.violation,
        "objective": found.objective,
        "iterations": found.iterations,
    }


@pytest.mark.parametrize("name", PROBLEMS)
def test_answer(name: str) -> None:
    expected, found = json.loads(FILE.read_text(encoding="utf-8"))[name], answer(name)
    assert found["iterations"] == expected["iterations"]
    assert found["violation"] == pytest.approx(expected["violation"], rel=1e-8, abs=1e-9)
    assert found["objective"] == pytest.approx(expected["objective"], rel=1e-8, abs=1e-9)
    assert np.array(found["controls"]) == pytest.approx(np.array(expected["controls"]), rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("name", [name for name in PROBLEMS if "too fast" not in name and "crowd" not in name])
def test_ipopt_says_the_same(name: str) -> None:
    """To what the barriers leave; crowds are solved roughly, and who is too fast just brakes."""
    ipopt = importlib.import_module("epicycle.actors.robotics.casadi_solver")
    problem, ours = posed(**PROBLEMS[name]), answer(name)
    theirs = ipopt.solve(as_problem(problem, PROBLEMS[name].get("ends")), starts())
    assert theirs.violation == pytest.approx(ours["violation"], abs=2e-5)
    assert theirs.objective == pytest.approx(ours["objective"], rel=2e-5, abs=2e-6)
    assert np.hypot(*theirs.controls.T).max() <= problem.max_acceleration
    worst = max(0.0, float(violations(problem, theirs.controls).max()))
    assert theirs.violation == pytest.approx(worst, abs=1e-6)
    assert theirs.iterations > 5


def test_ipopt_stops_a_runaway_as_far_as_it_can() -> None:
    ipopt = importlib.import_module("epicycle.actors.robotics.casadi_solver")
    problem = posed(**PROBLEMS["much too fast"])
    theirs = ipopt.solve(as_problem(problem), starts())
    assert theirs.violation == pytest.approx(float(violations(problem, theirs.controls).max()))
    assert np.isfinite(theirs.controls).all()


def test_all_kinds_of_answers_are_there() -> None:
    answers = json.loads(FILE.read_text(encoding="utf-8"))
    assert list(answers) == list(PROBLEMS)
    assert sum(each["violation"] > 0.0 for each in answers.values()) >= 4
    assert sum(each["objective"] == math.inf for each in answers.values()) == 3  # which no restoration can help
    assert sum(each["violation"] == 0.0 for each in answers.values()) >= 10


if __name__ == "__main__":
    FILE.write_text(json.dumps({name: answer(name) for name in PROBLEMS}, indent=1) + "\n", encoding="utf-8")
