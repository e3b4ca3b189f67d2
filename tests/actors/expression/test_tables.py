"""Tables in expressions: ``interpolate``."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors.expression import ExpressionError, Formula, evaluate

LINE = "interpolate(x, [0, 1, 3], [10, 20, 0])"
PLANE = "interpolate(x, y, [0, 2], [0, 1, 10], [[1, 2, 3], [5, 8, 1]])"


@pytest.mark.parametrize(
    ("text", "names", "value"),
    [
        (LINE, {"x": 0}, 10.0), (LINE, {"x": 1}, 20.0), (LINE, {"x": 2.5}, 5.0), (LINE, {"x": -1}, 0.0),
        (LINE, {"x": 4}, -10.0), (PLANE, {"x": 1, "y": 0.5}, 4.0), (PLANE, {"x": 2, "y": 10}, 1.0),
        (PLANE, {"x": 4, "y": 0}, 9.0), ("interpolate(x, at, at)", {"x": 1.5, "at": [1, 2]}, 1.5),
    ],
)  # fmt: skip
def test_values(text: str, names: dict[str, Any], value: float) -> None:
    assert evaluate(text, names) == value
    assert Formula(text)(names) == value
    floats = {name: float(each) if isinstance(each, int) else each for name, each in names.items()}
    assert Formula(text)(floats) == value


@given(st.floats(-10, 10), st.floats(-10, 20))
def test_it_is_linear_between_points_and_beyond_the_ends(x: float, y: float) -> None:
    at, values = [-5.0, 0.0, 0.5, 7.0], [3.0, -1.0, 4.0, 4.0]
    if at[0] <= x <= at[-1]:
        assert evaluate(f"interpolate({x}, {at}, {values})", {}) == pytest.approx(np.interp(x, at, values), abs=1e-12)
    plane = evaluate("interpolate(x, y, [0, 1], [0, 1], [[0, 3], [2, 5]])", {"x": x, "y": y})
    assert plane == pytest.approx(2 * x + 3 * y, abs=1e-9)


def test_a_formula_gives_the_bits_of_the_evaluator() -> None:
    formula = Formula(PLANE)
    for step in range(200):
        names = {"x": step / 37 - 1.3, "y": step / 11 - 2.2}
        assert formula(names) == evaluate(PLANE, names)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("interpolate(1, 2)", "interpolate takes 3 to 5 values, not 2"),
        ("interpolate(1, 2, [0, 1], [1, 2])", "interpolate takes 3 values, or 5 for a table of two arguments, not 4"),
        ("interpolate(1, [0, 0], [1, 2])", "interpolate needs at least two rising numbers in at"),
        ("interpolate(1, [0], [1])", "interpolate needs at least two rising numbers in at"),
        ("interpolate(1, [0, 1], [1])", "interpolate needs as many numbers in values as in at: 2, not 1"),
        ("interpolate(1, 3, [1])", "interpolate needs a list of numbers in at"),
        ("interpolate(1, [0, 'a'], [1, 2])", "interpolate needs numbers, not a text"),
        ("interpolate('a', [0, 1], [1, 2])", "interpolate needs numbers, not a text"),
        (
            "interpolate(1, 1, [0, 1], [0, 1], [[1, 2]])",
            "interpolate needs a row for each of the 2 numbers in at_x",
        ),
        (
            "interpolate(1, 1, [0, 1], [0, 1], [[1, 2], [1]])",
            "interpolate needs as many numbers in each row as in at_y: 2, not 1",
        ),
    ],
)
def test_what_is_no_table(text: str, message: str) -> None:
    with pytest.raises(ExpressionError) as told:
        evaluate(text, {})
    assert message in str(told.value)
