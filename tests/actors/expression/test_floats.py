"""Expressions as functions of floats give what the evaluator gives, or leave it to that."""

from __future__ import annotations

import pickle
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.actors import EpicycleError
from epicycle.actors.expression import ExpressionError, Formula, evaluate

CONSTANTS = ("2", "0", "0.0", "-1.5", "1e308", "9223372036854775807", "True", "pi", "(1 / 3)", "inf", "[1]", "'x'")
TOKENS = (1.5, -2.0, 0.0, -0.0, 3.0, 1e308, 5e-324, float("inf"), float("-inf"), float("nan"))
OTHERS = (0, 2, -7, 2**62, True, False, "x", [1.0], None)
FUNCTIONS = ("abs({})", "sqrt({})", "exp({})", "log({})", "max({}, {})", "min({}, {})", "hypot({}, {})", "round({})")


def some(numbers: Any, depth: int) -> str:
    """An expression over the names a, b and c."""
    if depth == 0:
        return str(numbers.choice(("a", "b", "c", "a", "b", numbers.choice(CONSTANTS))))
    signs = ["+", "-", "*", "/", "//", "%", "**", "<", "<=", "==", "!=", ">", " and ", " or "]
    shape = numbers.choice(
        [f"({{}}{sign}{{}})" for sign in signs] + ["(-{})", "(not {})", "({} if {} else {})", "({} < {} <= {})"]
    )
    if numbers.random() < 0.15:
        shape = numbers.choice(FUNCTIONS)
    parts = [some(numbers, depth - 1 if numbers.random() < 0.8 else 0) for _ in range(shape.count("{}"))]
    return str(shape.format(*parts))


def outcome(formula: Formula, names: dict[str, Any]) -> str:
    try:
        return repr(formula(names))
    except EpicycleError as error:
        return str(error)


def by_the_evaluator(formula: Formula, names: dict[str, Any]) -> str:
    try:
        return repr(evaluate(formula.source, names))
    except ExpressionError as error:
        given = ", ".join(f"{name} = {names[name]!r}" for name in formula.names)
        return f"{formula.source!r}: {error}{f', with {given}' if given else ''}"


@settings(max_examples=500)
@given(numbers=st.randoms(use_true_random=False))
def test_the_evaluator_gives_the_same(numbers: Any) -> None:
    formula = Formula(some(numbers, numbers.randint(0, 4)))
    for _ in range(10):
        names = {name: numbers.choice(TOKENS if numbers.random() < 0.9 else OTHERS) for name in "abc"}
        assert outcome(formula, names) == by_the_evaluator(formula, names)


@pytest.mark.parametrize(
    ("text", "values", "found"),
    [
        ("a - b", (3.0, 1.5), 1.5),
        ("a - b", (3, 1.5), None),  # a whole number
        ("a - b", (float("inf"), 1.5), None),
        ("a - b", (1e308, -1e308), None),  # beyond all floats
        ("1 / (a * b)", (1e308, 1e308), None),  # where the result does not show it
        ("a / b", (1.0, 0.0), None),
        ("a > b and not b > 1", (3.0, 1.0), True),
        ("a * b if a > b else -a", (1.0, 2.0), -1.0),
        ("a ** 2 + sqrt(b) * pi / 180", (3.0, 4.0), 9.034906585039887),
        ("max(a, 0.0) * b", (-1.0, 2.0), 0.0),
        ("(2 + 3) * a", (1.0,), 5.0),
        ("a[0] + b", (1.0, 2.0), None),
        ("(a > b) + (b > a)", (1.0, 2.0), None),  # of whole numbers
        ("-a", (0.0,), -0.0),
    ],
)
def test_what_floats_give(text: str, values: tuple[float, ...], found: object) -> None:
    assert repr(Formula(text).of_floats(*values)) == repr(found)


def test_the_deepest() -> None:
    deep = "a"
    for _ in range(48):
        deep = f"(1 / {deep})"
    assert Formula(deep).of_floats(2.0) == evaluate(deep, {"a": 2.0}) == 2.0


def test_a_constant_of_that_name_is_told() -> None:
    with pytest.raises(EpicycleError) as raised:
        Formula("a * e")({"a": 1.0, "e": 2.0})
    assert (
        str(raised.value)
        == "'a * e': 'e' is a constant and cannot be the name of something else: rename it, with a = 1.0"
    )


def test_a_formula_can_be_sent() -> None:
    assert pickle.loads(pickle.dumps(Formula("a + 1"))).of_floats(2.0) == 3.0
