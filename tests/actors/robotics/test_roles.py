"""Objectives that change during a run: roles of a controller, staying near others, and messages that are repeated."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
import pytest

from epicycle.actors import (
    BodyState,
    EpicycleError,
    Estimate,
    Flooding,
    Inform,
    Measurement,
    ParameterError,
    Plan,
    ReachGoal,
    RobustController,
    StayNear,
    Vehicle,
)
from epicycle.actors.testing import Harness
from tests.actors.robotics.numerics.numerics_parts import as_problem, ways
from tests.actors.robotics.scenario import _Recorder

NUMERICS = "epicycle.actors.robotics.numerics."
barrier = importlib.import_module(NUMERICS + "barrier")
definitions = importlib.import_module(NUMERICS + "definitions")
horizon = importlib.import_module(NUMERICS + "horizon")
FAR = {"driving": ReachGoal(goal=[50, 0]), "relaying": StayNear(to={"base": 1, "main": 3})}


def state(x: float = 0.0, y: float = 0.0, *, time: float = 0.0) -> BodyState:
    return BodyState([x, y], [0.0, 0.0], time)


def plan(robot: str, x: float, y: float, *, time: float = 0.0) -> Plan:
    """The plan to stay at a place."""
    return Plan(robot, time, state(x, y, time=time), np.zeros((11, 2)))


def make(**parameters: Any) -> tuple[Harness, list[Any]]:
    recorder = _Recorder()
    return Harness(RobustController("observer.controller", solver=recorder, **parameters)), recorder.records


def posed(objective: Any, **known: Any) -> Any:
    """The problem of a robot at the origin that knows this at its first trigger."""
    harness, records = make(objective=objective)
    harness.fire(0.0, trigger=0, state=state(), **known)
    return records[0][0]


# --- staying near others


def test_it_is_to_be_at_the_weighted_mean_of_those_it_knows() -> None:
    objective = StayNear(to={"target": 3, "main": 1}, offset=[0, 5])
    moving = Estimate([10.0, 0.0, 1.0, -2.0], np.eye(4), 0.0)
    heard = [plan("main", 30.0, 8.0), plan("base", 0.0, 90.0), plan("aside", 7.0, 7.0)]
    both = posed(objective, estimate=moving, peer_plans=heard)
    assert both.objective == horizon.REACH_GOAL
    steps = 0.1 * np.arange(1, 11)[:, np.newaxis]
    target = np.array([10.0, 0.0]) + steps * np.array([1.0, -2.0])
    assert both.goal == pytest.approx(0.75 * target + 0.25 * np.array([30.0, 8.0]) + np.array([0.0, 5.0]))
    assert posed(objective, estimate=moving).goal == pytest.approx(target + np.array([0.0, 5.0]))
    assert posed(objective, peer_plans=heard).goal == pytest.approx(np.tile([30.0, 13.0], (10, 1)))
    assert posed(objective).goal == pytest.approx(np.zeros((1, 2)))  # nobody is known: it stays
    assert posed(objective, peer_plans=heard[1:]).goal == pytest.approx(np.zeros((1, 2)))


def test_the_plan_is_optimal_by_the_definition() -> None:
    """No small step within the limits improves the weighted sum of squared distances itself."""
    random = np.random.default_rng(3)
    weights = {"a": 2.0, "b": 0.5, "c": 1.0}
    places = {"a": (9.0, -3.0), "b": (-5.0, 14.0), "c": (4.0, 40.0)}
    problem = posed(StayNear(to=weights), peer_plans=[plan(name, *place) for name, place in places.items()])
    problem = problem._replace(max_speed=1e3, max_acceleration=1e3, peer_distance=np.zeros((3, 10)))
    weight = np.array([weights[name] for name in sorted(weights)])

    def cost(controls: np.ndarray) -> float:
        positions = ways(problem, controls)[0]
        return float(definitions.f0_of_several(positions, problem.peer_mean, weight).sum())

    found = barrier.solve(problem, np.zeros((1, 10, 2))).controls
    for size in (1e-3, 1e-2, 0.1, 1.0):
        for _ in range(50):
            assert cost(found + size * random.normal(size=(10, 2))) > cost(found) * (1 - 1e-4)


def test_casadi_finds_the_same_plan() -> None:
    pytest.importorskip("casadi")
    ipopt = importlib.import_module("epicycle.actors.robotics.casadi_solver").solve
    moving = Estimate([10.0, 3.0, 2.0, -2.0], 0.1 * np.eye(4), 0.0)
    objective = StayNear(to={"target": 2, "main": 1})
    for place in ((30.0, 8.0), (-14.0, 20.0), (16.0, -16.0)):
        problem = posed(objective, estimate=moving, peer_plans=[plan("main", *place)])
        assert len(problem.goal) == 10
        start, same = np.zeros((1, 10, 2)), as_problem(problem, objective=objective)._replace(names=("main",))
        ours, theirs = barrier.solve(problem, start), ipopt(same, start)
        assert ours.objective == pytest.approx(theirs.objective, rel=1e-4)
        assert ours.controls[0] == pytest.approx(theirs.controls[0], abs=0.05)


def test_a_relay_comes_to_rest_where_the_weights_say() -> None:
    """A quarter of the way from the main robot to the base, on the straight line between them, which is known."""
    harness, _ = make(objective=StayNear(to={"base": 1, "main": 3}), max_speed=16, max_acceleration=16)
    vehicle = Harness(Vehicle("observer.vehicle", start=[5, -20], max_speed=16, max_acceleration=16))
    for k in range(80):
        now = k / 10
        vehicle.fire(now, trigger=k, **({"acceleration": harness.last("control")} if k else {}))
        heard = [plan("base", 0.0, 0.0, time=now - 0.1), plan("main", 48.0, 20.0, time=now - 0.1)]
        harness.fire(now, trigger=k, state=vehicle.last("state"), peer_plans=heard)
    assert vehicle.last("state").position == pytest.approx([36.0, 15.0], abs=0.01)
    assert vehicle.last("state").velocity == pytest.approx([0.0, 0.0], abs=0.01)


@pytest.mark.parametrize(
    ("to", "message"),
    [
        ({}, "StayNear.to: it names nobody; expected at least one robot, or 'target'"),
        ({"main": 0}, "StayNear.to: main: 0 is out of bounds, expected a number > 0"),
        ({"main": "near"}, "StayNear.to: main: 'near' is not a number > 0"),
        (["main"], "StayNear.to: ['main'] is not a mapping of names to number"),
    ],
)
def test_weights_that_are_none(to: object, message: str) -> None:
    with pytest.raises(ParameterError) as raised:
        StayNear(to=to)
    assert str(raised.value) == message


# --- roles


def test_a_role_changes_the_objective_and_nothing_else() -> None:
    """Of two robots with the same past, one gets a role: the tubes of the next plan, the peers and the target are the
    same."""
    problems = []
    for roles in ({}, {"role": "relaying"}):
        harness, records = make(objective=ReachGoal(goal=[50, 0]), objectives=FAR)
        heard = [plan("main", 40.0, 20.0), plan("base", -20.0, 0.0)]
        harness.fire(0.0, trigger=0, state=state(), peer_plans=heard, estimate=Estimate(np.zeros(4), np.eye(4), 0.0))
        harness.fire(0.1, trigger=1, state=state(time=0.1), **roles)
        problems.append(records[1])
    (before, starts, _), (after, new_starts, _) = problems
    assert (before.objective, after.objective) == (horizon.REACH_GOAL, horizon.REACH_GOAL)
    assert before.goal.tolist() == [[50.0, 0.0]]
    assert after.goal == pytest.approx(np.tile([25.0, 15.0], (10, 1)))
    assert starts.tolist() == new_starts.tolist()
    assert np.isfinite(after.tube_radius[:-1]).all()
    for name in set(before._fields) - {"goal"}:
        assert np.array_equal(getattr(before, name), getattr(after, name)), name


def test_a_role_holds_until_the_next() -> None:
    roles = {**FAR, "informing": Inform()}
    harness, records = make(objectives=roles)
    moving = Estimate([10.0, 0.0, 1.0, 0.0], np.eye(4), 0.0)
    for k, role in enumerate((None, "driving", None, "informing", "driving", None, "informing")):
        given = {} if role is None else {"role": role}
        harness.fire(k / 10, trigger=k, state=state(time=k / 10), estimate=moving, **given)
    harness.fire(0.65, role="driving")  # between two triggers
    harness.fire(0.7, trigger=7, state=state(time=0.7))
    found = ["informing" if each.objective == horizon.INFORM else each.goal[0].tolist() for each, _, _ in records]
    there = [50.0, 0.0]
    assert found == [[0.0, 0.0], there, there, "informing", there, there, "informing", there]


def test_a_role_without_an_objective() -> None:
    harness, _ = make(objectives=FAR)
    with pytest.raises(EpicycleError) as raised:
        harness.fire(0.0, trigger=0, state=state(), role="relayng")
    assert str(raised.value) == (
        "observer.controller has no objective for the role 'relayng', did you mean 'relaying'?; "
        "'objectives' has: driving, relaying"
    )
    harness, _ = make()
    with pytest.raises(EpicycleError) as raised:
        harness.fire(0.0, trigger=0, state=state(), role="relaying")
    assert str(raised.value) == ("observer.controller has no objective for the role 'relaying'; 'objectives' has: none")


# --- flooding


def measurement(robot: str, time: float) -> Measurement:
    return Measurement(robot, [0.0, 0.0], "range", [3.0], 1.0, 1.0, time)


def test_each_message_is_passed_on_once() -> None:
    harness = Harness(Flooding("a.plans"), widths={"heard": 2})

    def sent() -> list[tuple[str, float]]:
        return [(each.robot, each.time) for _, each in harness.sent["output"]]

    harness.fire(0.0, own=plan("a", 0.0, 0.0))
    first, other = plan("b", 1.0, 0.0, time=0.1), plan("c", 2.0, 0.0)
    harness.fire(0.1, heard=[first, first])
    harness.fire(0.15, heard=[None, other])
    harness.fire(0.2, heard=[plan("a", 0.0, 0.0), plan("b", 0.0, 0.0)])  # its own, and an old one
    assert sent() == [("a", 0.0), ("b", 0.1), ("c", 0.0)]
    harness.fire(0.3, own=plan("a", 0.0, 0.0, time=0.3), heard=[plan("b", 1.0, 0.0, time=0.3), None])
    assert sent()[3:] == [("a", 0.3), ("b", 0.3)]


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_finite_is_not_passed_on(bad: float) -> None:
    harness = Harness(Flooding("a.measurements"), widths={"heard": 2})
    harness.fire(0.0, heard=[measurement("b", bad), measurement("b", 0.1)])
    assert [each.time for _, each in harness.sent["output"]] == [0.1]


def test_what_is_no_message() -> None:
    harness = Harness(Flooding("a.plans"))
    with pytest.raises(EpicycleError) as raised:
        harness.fire(0.0, own=3.5)
    assert str(raised.value) == "a.plans takes plans and measurements, not 3.5"
