"""The bases of the aspects are none themselves."""

from __future__ import annotations

from typing import Any

import pytest

from epicycle.actors import EpicycleError
from epicycle.aspects import (
    Aspect,
    Bias,
    ClockAspect,
    ClockOffset,
    CrashRestart,
    ExecutionAspect,
    LossAspect,
    MeasurementAspect,
    Medium,
    ObservationAspect,
    PortAspect,
    RandomLoss,
)
from epicycle.aspects.measurement import Alteration
from tests.engine.engine_parts import sends, simulate


@pytest.mark.parametrize(
    ("base", "missing"),
    [
        (ClockAspect, "error"),
        (ExecutionAspect, "schedule"),
        (PortAspect, "pass_token"),
        (Medium, "pass_token"),
        (LossAspect, "loses"),
        (RandomLoss, "draw"),
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


def test_an_aspect_is_of_a_kind() -> None:
    with pytest.raises(TypeError) as caught:
        type("Odd", (Aspect,), {"pass_token": lambda self, token, point: None})
    assert str(caught.value) == "Odd has a pass_token(); derive it from PortAspect, not from Aspect"


def test_a_clock_has_no_window() -> None:
    with pytest.raises(EpicycleError) as caught:
        ClockOffset(until=3)
    assert str(caught.value) == (
        "a clock is wrong for the whole run; leave out 'until'; valid parameters: offset, deviation"
    )


@pytest.mark.parametrize(
    ("window", "message"),
    [
        ({"from": 2.0, "until": 5.0, "every": 3.0}, ""),
        ({"from": 2.0, "until": 2.5, "every": 0.5}, ""),
        ({"until": 3.0, "every": 4.0}, ""),
        (
            {"from": 2.0, "until": 5.0, "every": 2.9},
            "'every' (2.9 s) needs to be at least the time from 'from' to 'until'",
        ),
        ({"from": 2.0, "every": 2.9}, "'every' (2.9 s) needs 'until' as well"),
        ({"from": 2.0, "until": 2.0}, "it is never active: 'until' (2 s) must be after 'from' (2 s)"),
        ({"from": 2.0, "until": 1.5}, "it is never active: 'until' (1.5 s) must be after 'from' (2 s)"),
    ],
)
def test_windows(window: dict[str, float], message: str) -> None:
    if not message:
        assert not Bias(by=1.0, **window).is_always_active
        return
    with pytest.raises(EpicycleError) as caught:
        Bias(by=1.0, **window)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("window", "active"),
    [
        ({}, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]),
        ({"from": 3e-3}, [3, 4, 5, 6, 7, 8, 9]),
        ({"until": 3e-3}, [0, 1, 2]),
        ({"from": 1e-3, "until": 3e-3}, [1, 2]),
        ({"from": 1e-3, "until": 3e-3, "every": 4e-3}, [1, 2, 5, 6, 9]),
        ({"from": 1e-3, "until": 2e-3, "every": 1e-3}, [1, 2, 3, 4, 5, 6, 7, 8, 9]),
    ],
)
def test_when_an_aspect_is_active(window: dict[str, float], active: list[int]) -> None:
    given = ", ".join(f"{name}: {seconds} s" for name, seconds in window.items())
    _, results = simulate(
        "actors: {t: {type: Ticker, period: 1 ms}, p: {type: Probe}}\nconnections: [t.output -> p.input]\n"
        f"aspects: {{shift: {{type: Bias, by: 100, at: t.output{', ' * bool(given)}{given}}}}}",
        until=9e-3,
    )
    assert [token for *_, token in sends(results, "t")] == [tick + 100 * (tick in active) for tick in range(10)]
