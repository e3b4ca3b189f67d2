"""Expressions as functions of tokens give what the evaluator gives, or leave it to that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.actors import EpicycleError
from epicycle.actors.expression import ExpressionError, Formula, evaluate, operand


@dataclass(frozen=True)
class Position:
    x: float
    y: Any


CONSTANTS = (
    "2",
    "0",
    "0.0",
    "-1.5",
    "1e308",
    "9223372036854775807",
    "True",
    "pi",
    "(1 / 3)",
    "inf",
    "[1]",
    "'x'",
    "None",
)
TOKENS = (1.5, -2.0, 0.0, -0.0, 3.0, 1e308, 5e-324, float("inf"), float("-inf"), float("nan"))
WHOLE = (0, 1, 2, -7, 2**62, -(2**63), True, False)
OTHERS = (
    "x", "", "a text of more than ten characters", None, [1.0], [], [[1], [2, "x"]], (1, 2), {"x": 1, "y": 2.5}, {},
    {"x": {"x": [3]}, "y": "x"}, {1: 2, "x": 3}, [{"x": 1.0}, {"x": 2.0}], np.float64(0.5), np.int64(3), np.bool_(True),
    np.array([1.0, float("nan")]), np.array(2.0), np.array([[1, 2], [3, 4]]), Position(1.0, [2.0]),
    [Position(0.5, "y"), {"x": 1}], {"x": (1, 2)}, 2**70, [2**70], [float("nan")], {"x": np.array([1])},
)  # fmt: skip
FUNCTIONS = (
    "abs({})", "sqrt({})", "exp({})", "log({})", "max({}, {})", "min({}, {})", "hypot({}, {})", "round({})",
    "floor({})", "len({})", "sum({})", "sorted({})", "str({})", "bool({})", "int({})", "float({})", "range({})",
    "max({})",
)  # fmt: skip
OF_LISTS = (
    "[{}, {}]", "[{}]", "({})[0]", "({})[-1]", "({})['x']", "({})[{}]", "({})[1:]", "({})[{}:{}]",
    "{{'x': {}, 'y': {}}}", "[i for i in {}]", "[i + {} for i in {} if i]", "[[i, j] for i in {} for j in {}]",
    "[e['x'] for e in {}]",
    "[i for i in {} if i not in {}]", "({} in {})", "({} not in [1, 'x'])", "[k for k, v in {}]", "({} == 'x')",
    "({} != {{}})", "({} * 3)", "[[j for j in i] for i in {}]",
)  # fmt: skip


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
    elif numbers.random() < 0.3:
        shape = numbers.choice(OF_LISTS)
    parts = [some(numbers, depth - 1 if numbers.random() < 0.8 else 0) for _ in range(shape.count("{}"))]
    return str(shape.format(*parts))


def outcome(formula: Formula, names: dict[str, Any]) -> str:
    try:
        return repr(formula(names))
    except EpicycleError as error:
        return str(error)


def by_the_evaluator(formula: Formula, tokens: dict[str, Any]) -> str:
    names = {name: operand(token) for name, token in tokens.items()}
    try:
        return repr(evaluate(formula.source, names))
    except ExpressionError as error:
        given = ", ".join(f"{name} = {names[name]!r}" for name in formula.names)
        return f"{formula.source!r}: {error}{f', with {given}' if given else ''}"


@settings(max_examples=500)
@given(numbers=st.randoms(use_true_random=False))
def test_the_evaluator_gives_the_same(numbers: Any) -> None:
    formula = Formula(some(numbers, numbers.randint(0, 4)))
    tokens = numbers.choice((TOKENS, WHOLE, OTHERS, TOKENS + WHOLE + OTHERS))
    for _ in range(10):
        names = {name: numbers.choice(tokens if numbers.random() < 0.9 else OTHERS) for name in "abc"}
        assert outcome(formula, names) == by_the_evaluator(formula, names)
