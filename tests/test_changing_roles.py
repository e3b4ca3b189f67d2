"""The model ``changing_roles`` against its rules, written down a second time in plain Python."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from epicycle.runner import Simulation, load_model
from epicycle.runner.execution.engine import Results

LINK, WATCH, VAGUE, SURE, SLACK, PATIENCE = 27.0, 20.0, 0.6, 0.3, 3.0, 1.0
REACH, HOP, PERIOD = 30.0, 0.01, 0.1
KNOWN = ("of_main.output", "estimator.estimate", "role")


@cache
def played(disturbance: float, until: float) -> Results:
    model = load_model("changing_roles", set=[f"disturbance={disturbance}"])
    model.record(*(f"observer[*].{name}" for name in KNOWN), "news.output")
    return Simulation(model, seed=4).run(until=until)


def rounded(times: Any) -> list[float]:
    return [round(float(time), 6) for time in times]


def by_time(results: Results, name: str) -> dict[float, Any]:
    signal = results.signals[name]
    return dict(zip(rounded(signal.times), signal.values, strict=True))


def next_role(number: int, role: str, far: float, near: float, spread: float, age: float) -> str:
    """The rules in words: the chain first, then how near the obstacle is, then how well it is known."""
    joins, another = LINK * (number + 1), LINK * (number + 2)
    if role in ("driving", "informing", "guarding"):
        if far > joins or age > PATIENCE:
            return "relaying"
        if role == "driving":
            return "informing" if near < WATCH else role
        if near > WATCH + SLACK:
            return "driving"
        if role == "informing" and spread < SURE:
            return "guarding"
        if role == "guarding" and spread > VAGUE:
            return "informing"
    if role == "relaying":
        if far > another:
            return "chaining"
        return "driving" if far < joins - SLACK and age < PATIENCE else role
    return "relaying" if role == "chaining" and far < another - SLACK else role


@pytest.mark.slow
@pytest.mark.parametrize("disturbance", [0.0, 0.5])
def test_roles_follow_from_what_each_observer_knows(disturbance: float) -> None:
    """From the plans of the main robot that it has heard and its own estimate alone, after every one of them."""
    results, seen = played(disturbance, 12.0), set()
    for number in range(3):
        plans, estimates, sent = (by_time(results, f"observer[{number}].{name}") for name in KNOWN)
        role, far, near, spread, age = "driving", 0.0, 1000.0, 1000.0, 0.0
        expected: dict[float, str] = {}
        plan: Any = None
        estimate: Any = None
        for time in sorted({*plans, *estimates}):
            estimate = estimates.get(time, estimate)
            plan = plans.get(time, plan)
            covariance = np.array(estimate.covariance)
            spread = float(np.sqrt(covariance[0, 0] + covariance[1, 1]))
            if plan is not None:
                place, velocity = np.array(plan.state.position), np.array(plan.state.velocity)
                far = float(np.linalg.norm(place + velocity))
                near = float(np.linalg.norm(place - np.array(estimate.mean[:2]))) - 2.0 * spread
                age = estimate.time - plan.time
            while (following := next_role(number, role, far, near, spread, age)) != role:
                role = expected[time] = following
        assert sent == {0.0: "driving", **expected}, number
        seen |= {*expected.values()}
    assert seen >= {"informing", "guarding", "relaying", "chaining"}


def test_the_base_hears_whom_the_chain_reaches() -> None:
    """Without losses, a plan of the main robot comes to the base exactly if there is a way of hops within reach,
    as many hops later as the shortest one has."""
    results = played(0.0, 12.0)
    names = ["main", "base", *(f"observer[{i}]" for i in range(3))]
    places = [by_time(results, f"{name}.state") for name in names]
    expected, hops = [], set()
    for time in sorted(places[0]):
        at = np.array([states[time].position for states in places])
        near = np.linalg.norm(at[:, np.newaxis] - at, axis=2) <= REACH
        reached, count = near[0], 1  # of the main robot
        while not reached[1] and count < len(names):
            reached, count = near[reached].any(axis=0), count + 1
        if reached[1] and time + count * HOP < 12.0:
            expected.append(round(time + count * HOP, 6))
            hops.add(count)
    assert rounded(results.signals["news.output"].times) == expected
    assert hops == {1, 2, 3}


def test_who_has_one_duty_keeps_it() -> None:
    model = load_model("changing_roles", set=["observer_roles=[chaining, relaying, informing]"])
    results = Simulation(model, seed=1).run(until=4.0)
    roles = [set(results.signals[f"observer[{i}].role"].values) for i in range(3)]
    assert roles == [{"chaining"}, {"relaying"}, {"informing"}]


@pytest.mark.slow
def test_the_whole_tour() -> None:
    """The base hears the main robot all the time, with changing roles, and not if all inform."""
    results = Simulation(load_model("changing_roles"), seed=2).run()
    found = results.metrics
    assert 20.0 < found["arrival_time"] < 30.0
    assert found["in_contact"]
    assert found["keeps_off"]
    assert found["contact"] > 95.0  # %
    assert 0.0 < found["informing"] < found["guarding"]
    assert found["relaying"] > 0.5
    fixed = load_model("changing_roles", set=["observer_roles=[informing, informing, informing]"])
    alone = Simulation(fixed, seed=2).run(until=20.0).metrics
    assert not alone["in_contact"]
    assert alone["contact"] < 50.0
