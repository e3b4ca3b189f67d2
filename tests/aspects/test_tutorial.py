"""The aspect of the seventh tutorial keeps its word for every measurement."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors import Clock
from epicycle.runner import Model, Simulation

TUTORIAL = Path(__file__).parents[2] / "docs" / "tutorial" / "07_your_own_aspect.md"
(SAVING,) = re.findall(r"^```python\n(# saving.py\n.*?)^```", TUTORIAL.read_text(encoding="utf-8"), re.M | re.S)


def sent(values: list[float], delta: float) -> list[Any]:
    """What passes of some measurements."""
    names: dict[str, Any] = {"__name__": "saving"}
    exec(compile(SAVING, "saving.py", "exec"), names)
    model = Model("m", stop=len(values) - 1)
    clock = model.add(Clock("clock", period=1, values=values))
    model.weave("saver", names["SendOnDelta"](delta=delta), at=clock.output)
    model.record(clock.output)
    return Simulation(model).run()["clock.output"].tokens


# Of these, (value + delta) - value is less than delta as floats are rounded.
@pytest.mark.parametrize(("value", "delta"), [(0.7, 0.1), (1e9, 1e-8), (0.2, 0.02), (1e300, 1.0)])
def test_the_first_measurement_is_sent(value: float, delta: float) -> None:
    assert sent([value] * 5, delta) == [value]
    assert sent([value, value, value + 4 * max(delta, abs(value))], delta)[1:] == [value + 4 * max(delta, abs(value))]


def test_each_measurement_is_near_what_was_sent_last() -> None:
    values, delta = np.random.default_rng(1).uniform(-1, 1, 300).round(2).tolist(), 0.05
    passed = iter(sent(values, delta))
    last = next(passed)
    assert last == values[0]
    for value in values[1:]:
        if abs(value - last) >= delta:
            last = next(passed)
            assert last == value
    assert next(passed, None) is None
