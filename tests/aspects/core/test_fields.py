"""Fields of tokens that aspects alter, those inside of others, and times, which they leave alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from epicycle.aspects import FieldError
from epicycle.aspects.core import altered


def twice(numbers: Any) -> Any:
    return 2.0 * numbers


@dataclass(frozen=True)
class Pose:
    position: tuple[float, float]
    time: float


TOKEN = {"header": {"stamp": {"sec": 5}, "sequence": 7}, "pose": Pose((1.0, 2.0), 3.0), "speed": 4.0}


def test_fields_inside_of_others_have_dots() -> None:
    assert altered(TOKEN, ("pose.position", "speed"), twice) == {**TOKEN, "pose": Pose((2.0, 4.0), 3.0), "speed": 8.0}
    assert altered(TOKEN, ("pose.position", "pose"), twice)["pose"] == Pose((2.0, 4.0), 3.0)
    assert altered(TOKEN, ("pose.position", "pose.time"), twice)["pose"] == Pose((2.0, 4.0), 6.0)
    with pytest.raises(FieldError) as caught:
        altered(TOKEN, ("pose.velocity",), twice)
    assert str(caught.value) == "Pose has no field 'velocity'; its fields: position, time"
    with pytest.raises(FieldError) as caught:
        altered(TOKEN, ("speed.x",), twice)
    assert str(caught.value) == ("a token of type float has no fields; leave out 'fields' to alter all its numbers")


def test_without_fields_all_numbers_are_altered_but_times() -> None:
    header = {"stamp": {"sec": 5}, "sequence": 14}
    assert altered(TOKEN, (), twice) == {"header": header, "pose": Pose((2.0, 4.0), 3.0), "speed": 8.0}
