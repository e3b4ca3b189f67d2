"""Bounds on expressions: they hold every value that the expression takes, and are no wider than need be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from epicycle.actors.core import EpicycleError
from epicycle.actors.expression import Formula
from epicycle.actors.expression.enclosure import EVERYTHING, bounds_of

X = {"x": (-1.0, 3.0), "y": (2.0, 4.0), "time": (100.0, 200.0)}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("x", (-1.0, 3.0)),
        ("-x + 2 * y", (1.0, 9.0)),
        ("x * y", (-4.0, 12.0)),
        ("x / y", (-0.5, 1.5)),
        ("y / x", EVERYTHING),
        ("x ** 2", (0.0, 9.0)),
        ("x ** 3", (-1.0, 27.0)),
        ("x ** 0.5", EVERYTHING),
        ("y ** 0.5", (math.sqrt(2.0), 2.0)),
        ("y ** -1", (0.25, 0.5)),
        ("abs(x)", (0.0, 3.0)),
        ("min(x, y)", (-1.0, 3.0)),
        ("max(x, y, 2.5)", (2.5, 4.0)),
        ("sqrt(y + 2)", (2.0, math.sqrt(6.0))),
        ("sqrt(x)", EVERYTHING),
        ("sin(time)", (-1.0, 1.0)),
        ("cos(x)", (math.cos(3.0), 1.0)),
        ("sin(y)", (math.sin(4.0), math.sin(2.0))),
        ("floor(x / 2)", (-1.0, 1.0)),
        ("y // 3", (0.0, 1.0)),
        ("y % 5", (2.0, 4.0)),
        ("time % 7", (0.0, 7.0)),
        ("1 if time > 250 else 0", (0.0, 0.0)),
        ("1 if 150 < time < 151 else x", (-1.0, 3.0)),
        ("x > 5 or y > 1", (1.0, 1.0)),
        ("not y", (0.0, 0.0)),
        ("x and y", (-1.0, 4.0)),
        ("y == 3", (0.0, 1.0)),
        ("y != x + 9", (1.0, 1.0)),
        ("pi * y", (math.pi * 2.0, math.pi * 4.0)),
        ("[1, 2][0] + x", EVERYTHING),
        ("x + unknown", EVERYTHING),
        ("inf - inf + x", EVERYTHING),
        ("log(0) + x", EVERYTHING),
    ],
)
def test_bounds_of_an_expression(text: str, wanted: tuple[float, float]) -> None:
    assert bounds_of(Formula(text), X) == pytest.approx(wanted, rel=1e-15)


SHAPES = (
    ["(A + A)", "(A - A)", "(A * A)", "(A / A)", "-A", "(not A)", "(A and A)", "(A or A)", "min(A, A)", "max(A, A)"]
    + [f"(A {sign} {other})" for sign in ("%", "//") for other in ("1", "2", "-3", "0.7", "A")]
    + [f"(A) ** {power}" for power in ("2", "3", "0", "-1", "-2", "0.5")]
    + [f"(A if A {sign} A else A)" for sign in ("<", "<=", ">", ">=", "==", "!=")]
    + ["sin(A)", "cos(A)", "abs(A)", "floor(A)", "ceil(A)", "int(A)", "round(A)", "sqrt(A)", "exp(A)", "log(A)"]
    + ["hypot(A, A)", "bool(A)"]
)
LEAVES = ["x", "y", "x", "y", "x", "y", "0", "1", "2", "3", "0.37", "-1.8", "4.1"]


def some_expression(draw: np.random.Generator, depth: int) -> str:
    """An expression of x and y."""
    if depth == 0 or draw.random() < 0.15:
        return str(draw.choice(LEAVES))
    first, *others = str(draw.choice(SHAPES)).split("A")
    return first + "".join(some_expression(draw, depth - 1) + other for other in others)


@pytest.mark.slow
def test_every_value_lies_within_the_bounds() -> None:
    draw, bounded = np.random.default_rng(13), 0
    for _ in range(1000):
        formula = Formula(some_expression(draw, 4))
        lows = {name: draw.uniform(-4, 4) for name in "xy"}
        bounds = {name: (low, low + float(draw.choice([0.0, 1e-3, 0.3, 2.0]))) for name, low in lows.items()}
        low, high = bounds_of(formula, bounds)
        if (low, high) == EVERYTHING:
            continue
        bounded += 1
        for _ in range(8):
            point = {name: float(draw.choice([*pair, draw.uniform(*pair)])) for name, pair in bounds.items()}
            try:
                value = float(formula(point))
            except EpicycleError:
                continue
            margin = 1e-12 * (1.0 + abs(value))
            assert low - margin <= value <= high + margin, (formula, bounds, point)
    assert bounded > 600
