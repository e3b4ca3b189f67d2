"""What the paper leaves open of its barrier method: how far it goes, over which controls, and what is infeasible."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from epicycle.actors import Barrier, Inform, ParameterError
from tests.actors.robotics.numerics.numerics_parts import as_problem, inform_problem, informing, violations
from tests.actors.robotics.numerics.test_answers import PROBLEMS, STEPS, posed, starts

barrier = importlib.import_module("epicycle.actors.robotics.numerics.barrier")
horizon = importlib.import_module("epicycle.actors.robotics.numerics.horizon")

FEASIBLE = ("nothing in the way", "at full speed", "an obstacle ahead", "two peers", "a tube", "a tube that ends")
INFEASIBLE = ("inside a peer", "inside the obstacle", "a tube and a peer that contradict", "in a ring")


def solved(name: str, **rules: Any) -> Any:
    return Barrier(**rules).solve(as_problem(posed(**PROBLEMS[name])), starts())


def velocities(problem: Any, controls: np.ndarray) -> np.ndarray:
    """At steps 2 to N."""
    return problem.velocity + problem.period * np.cumsum(controls, axis=0)[:-1]


@pytest.mark.parametrize("name", FEASIBLE)
def test_the_gap_bounds_how_far_the_plan_is_from_the_best(name: str) -> None:
    best = solved(name, gap=1e-9)
    missed = []
    for gap in (1e-5, 1e-3, 1e-2, 3e-2, 0.3):
        found = solved(name, gap=gap)
        assert found.violation == 0.0
        missed.append((found.objective - best.objective) / abs(best.objective))
        assert -1e-9 <= missed[-1] <= 1.3 * gap
    assert missed == sorted(missed)
    assert missed[-1] > 0.003  # it makes a difference
    assert solved(name, gap=3e-2).iterations < solved(name).iterations


@pytest.mark.parametrize("name", FEASIBLE)
def test_the_last_parameter_bounds_it_in_units_of_the_objective(name: str) -> None:
    """By the number of limits and constraints times the parameter, where problems are convex (Boyd & Vandenberghe)."""
    best = solved(name, gap=1e-9)
    most = 2 * STEPS + (1 + len(posed(**PROBLEMS[name]).peer_mean) + 1) * STEPS
    missed = [solved(name, last_parameter=last).objective - best.objective for last in (1e-4, 0.02, 1.0, 100.0)]
    assert missed == sorted(missed)
    for last, miss in zip((1e-4, 0.02, 1.0), missed, strict=False):
        assert -1e-6 <= miss <= most * last
    # The gap then says nothing.
    again = solved(name, last_parameter=0.02, gap=0.5)
    assert again.controls.tobytes() == solved(name, last_parameter=0.02).controls.tobytes()


@pytest.mark.parametrize("free", [1, 3, 5])
@pytest.mark.parametrize("name", FEASIBLE)
def test_the_last_free_control_is_held(name: str, free: int) -> None:
    problem, found = posed(**PROBLEMS[name]), solved(name, free_controls=free)
    assert (found.controls[free:] == found.controls[free - 1]).all()
    assert np.hypot(*found.controls.T).max() <= problem.max_acceleration
    assert np.hypot(*velocities(problem, found.controls).T).max() <= problem.max_speed
    if found.violation == 0.0:
        assert max(0.0, violations(problem, found.controls).max()) <= 1e-6
        assert found.objective >= solved(name).objective - 1e-4 * abs(found.objective)


def test_held_controls_are_the_best_of_their_kind() -> None:
    """Against SciPy's SLSQP, which knows nothing of barriers."""
    problem, free = posed(**PROBLEMS["at full speed"]), 3

    def spread(variables: np.ndarray) -> np.ndarray:
        return variables.reshape(free, 2)[np.minimum(np.arange(STEPS), free - 1)]

    def cost(variables: np.ndarray) -> float:
        ways = horizon.trajectory(problem.position, problem.velocity, spread(variables), problem.period, STEPS)
        return float(((ways - problem.goal) ** 2).sum())

    def room(variables: np.ndarray) -> np.ndarray:
        controls = spread(variables)
        speeds = (velocities(problem, controls) ** 2).sum(axis=1)
        return np.concatenate(
            [problem.max_speed**2 - speeds, problem.max_acceleration**2 - (controls[:free] ** 2).sum(axis=1)]
        )

    theirs = minimize(cost, np.zeros(2 * free), method="SLSQP", constraints={"type": "ineq", "fun": room})
    assert solved("at full speed", free_controls=free).objective == pytest.approx(theirs.fun, rel=1e-4)


def test_as_many_free_controls_as_there_are_or_more_are_all() -> None:
    bits = {solved("two peers", free_controls=free).controls.tobytes() for free in (0, STEPS, STEPS + 1, 10**6)}
    assert len(bits) == 1


@pytest.mark.parametrize("name", INFEASIBLE)
def test_what_answers_an_infeasible_problem(name: str) -> None:
    problem = posed(**PROBLEMS[name])

    def squared(found: Any) -> float:
        return float((np.maximum(violations(problem, found.controls), 0.0) ** 2).sum())

    progress, least, brake = (solved(name, infeasible=each) for each in ("progress", "least_violation", "brake"))
    assert min(progress.violation, least.violation) > 0.0
    # Progress is made within the least violation, but for a slack of 0.1 mm in each constraint.
    assert squared(progress) <= 1.01 * squared(least) + 1e-4
    assert progress.objective <= least.objective + 1e-6
    # Braking is against the motion, as hard as may be, and asks for no objective.
    along = problem.velocity / math.hypot(*problem.velocity)
    assert brake.controls[0] == pytest.approx(-0.999 * problem.max_acceleration * along, rel=1e-6)
    assert brake.objective == math.inf
    assert squared(brake) >= squared(least) - 1e-9


def test_what_is_feasible_needs_no_answer_of_that_kind() -> None:
    bits = {
        solved("two peers", infeasible=each).controls.tobytes() for each in ("progress", "least_violation", "brake")
    }
    assert len(bits) == 1


def test_unknown_rules() -> None:
    with pytest.raises(ParameterError) as refused:
        Barrier(infeasible="give up")
    assert str(refused.value) == ("Barrier.infeasible: 'give up' is not one of progress, least_violation, brake")
    with pytest.raises(ParameterError) as refused:
        Barrier(gap=0.0)
    assert str(refused.value) == "Barrier.gap: 0 is out of bounds, expected a number from 1e-09 to 1"


def test_bits_weigh_the_penalty_against_the_information(random: np.random.Generator) -> None:
    """-I in bits and gamma f6 have the optimum of -I in nats and gamma f6 log 2."""
    problem = inform_problem(random)
    in_nats, in_bits = (informing(problem, Inform(unit=unit, penalty=0.5)) for unit in ("nat", "bit"))
    assert in_nats.range_penalty == 0.5
    assert in_bits.range_penalty == pytest.approx(0.5 * math.log(2.0))
