"""Tokens of robots: nobody changes them, and they tell whether they can be used."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest

from epicycle.actors import BodyState, Detections, Estimate, Measurement, Plan, Pose
from epicycle.runner.execution.results.encoding import canonical


def state(**changes: Any) -> BodyState:
    return BodyState(**{"position": [1.0, 2.0], "velocity": [3.0, 4.0], "time": 0.5, **changes})


def measurement(**changes: Any) -> Measurement:
    given = {"robot": "a", "observer": [0.0, 1.0], "kind": "relative_position", "value": [2.0, 3.0]}
    return Measurement(**{**given, "along": 0.2, "across": 2.0, "time": 0.5, **changes})


def scan(**changes: Any) -> Detections:
    given = {"robot": "a", "observer": [0.0, 1.0], "kind": "relative_position", "values": [[2.0, 3.0]], "along": 0.2}
    usual = {"across": 2.0, "probability": 0.9, "clutter": 0.0, "max_range": 30.0, "time": 0.5}
    return Detections(**{**given, **usual, **changes})


def estimate(**changes: Any) -> Estimate:
    return Estimate(**{"mean": np.arange(4.0), "covariance": np.eye(4), "time": 0.5, "sources": ("a",), **changes})


def plan(**changes: Any) -> Plan:
    return Plan(**{"robot": "a", "time": 0.5, "state": state(), "controls": np.ones((3, 2)), **changes})


@pytest.mark.parametrize("make", [state, measurement, estimate, plan])
def test_a_token_is_what_it_was_when_it_was_sent(make: Any) -> None:
    token = make()
    with pytest.raises(FrozenInstanceError):
        token.time = 3.0
    with pytest.raises((AttributeError, TypeError)):
        token.colour = "red"
    assert not hasattr(token, "__dict__")
    assert token != make()  # arrays are not compared: it is itself, and no other
    assert token == token  # noqa: PLR0124
    assert len({token, token, make()}) == 2
    assert token.finite


def test_arrays_are_copies_that_nobody_writes_to() -> None:
    given = np.array([1.0, 2.0])
    token = state(position=given)
    given[0] = 9.0
    assert token.position.tolist() == [1.0, 2.0]
    for array in (token.position, token.velocity, measurement().value, estimate().covariance, plan().controls):
        assert (array.dtype, array.flags.writeable) == (np.dtype(float), False)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_cannot_be_used(bad: float) -> None:
    tokens = [
        state(position=[bad, 0.0]), state(velocity=[0.0, bad]), state(time=bad),
        measurement(observer=[0.0, bad]), measurement(value=[bad, 0.0]), measurement(time=bad),
        measurement(along=bad), measurement(across=bad), measurement(kind="range", value=[bad]),
        estimate(mean=[0.0, 0.0, bad, 0.0]), estimate(covariance=bad * np.eye(4)), estimate(time=bad),
        plan(time=bad), plan(state=state(position=[0.0, bad])), plan(controls=[[0.0, bad]]),
    ]  # fmt: skip
    assert [token.finite for token in tokens] == [False] * len(tokens)


@pytest.mark.parametrize(
    ("token", "usable"),
    [
        (measurement(along=0.0), False),
        (measurement(across=0.0), False),
        (measurement(along=-1.0), False),
        (measurement(along=1e-300, across=1e300), True),
        (measurement(value=[1.0]), False),
        (measurement(kind="range", value=[1.0]), True),
        (measurement(kind="range", value=[1.0], across=0.0), True),
        (measurement(kind="range", value=[1.0], along=0.0), False),
        (measurement(kind="range", value=[1.0, 2.0]), False),
        (state(position=[1e308, 1e308], velocity=[1e308, 1e308]), True),  # whose sum is not finite
        (scan(), True),
        (scan(along=0.0), False),
        (scan(across=0.0), False),
        (scan(kind="range", values=[[2.0]], across=0.0), True),
        (scan(probability=0.0), True),
        (scan(probability=-0.1), False),
        (scan(probability=1.0), True),
        (scan(probability=1.1), False),
        (scan(clutter=-0.1), False),
        (scan(clutter=math.inf), False),
        (scan(max_range=0.0), False),
        (scan(max_range=math.inf), False),
        (plan(controls=np.ones((1, 2))), True),
        (plan(controls=np.ones((0, 2))), False),
        (plan(controls=np.ones((3, 1))), False),
        (plan(controls=np.ones((3, 3))), False),
        (plan(controls=np.ones(2)), False),
        (plan(controls=np.ones((1, 2, 2))), False),
    ],
)
def test_what_can_be_used(token: Any, usable: bool) -> None:
    assert token.finite is usable


@pytest.mark.parametrize("make", [state, measurement, estimate, plan])
def test_a_token_travels_between_processes(make: Any) -> None:
    token = make()
    for other in (pickle.loads(pickle.dumps(token)), copy.deepcopy(token)):
        assert type(other) is type(token)
        assert canonical(other) == canonical(token)
        assert other.finite


def test_a_token_that_extends_another_has_the_fields_of_both() -> None:
    pose = Pose([1.0, 2.0], [3.0, 4.0], 0.5, 0.1)
    assert replace(pose, position=(5.0, 6.0)).position.tolist() == [5.0, 6.0]
    assert (pose.time, pose.heading, pose.finite) == (0.5, 0.1, True)
    assert [name for name, _, _ in pose.shapes(2)] == ["position", "velocity"]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"position": (1.0, 2.0)}, "missing 2 required positional arguments: 'velocity' and 'time'"),
        ({"position": 0, "velocity": 0, "time": 0, "colour": 0}, "got an unexpected keyword argument 'colour'"),
    ],
)
def test_what_a_token_is_made_of(given: dict[str, Any], expected: str) -> None:
    with pytest.raises(TypeError) as caught:
        BodyState(**given)
    assert str(caught.value) == f"BodyState.__init__() {expected}"


def test_where_the_shape_is_wrong_is_said_of_a_part() -> None:
    wrong = plan(state=state(velocity=[1.0]))
    assert [wrong.fits(d) for d in (1, 2, 3)] == [False, False, False]
    assert [(name, array.shape, shape) for name, array, shape in wrong.shapes(2)] == [
        ("state.position", (2,), (2,)),
        ("state.velocity", (1,), (2,)),
        ("controls", (3, 2), ("n > 0", 2)),
    ]
