"""The bases of the aspects are none themselves."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.aspects import ClockAspect, CrashRestart, ExecutionAspect, MeasurementAspect, Medium, ObservationAspect
from epicycle.aspects.measurement import Alteration


@pytest.mark.parametrize(
    ("base", "missing"),
    [
        (ClockAspect, "error"),
        (ExecutionAspect, "schedule"),
        (Medium, "pass_token"),
        (ObservationAspect, "observe"),
        (Alteration, "alter"),
    ],
)
def test_a_base_cannot_stand_anywhere(base: Any, missing: str) -> None:
    with pytest.raises(TypeError, match=f"abstract method '?{missing}'?"):
        base()


def test_where_aspects_stand() -> None:
    found = {base: set(base.stands_at) for base in (ClockAspect, ExecutionAspect, MeasurementAspect, Medium)}
    assert found == {
        ClockAspect: {"actor"},
        ExecutionAspect: {"actor"},
        MeasurementAspect: {"output"},
        Medium: {"input", "output"},
    }
    assert set(CrashRestart.stands_at) == {"actor"}
