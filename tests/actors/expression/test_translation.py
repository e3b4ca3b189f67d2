"""Expressions as functions of tokens give what the evaluator gives, or leave it to that."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.actors import EpicycleError
from epicycle.actors.expression import ExpressionError, Formula, TokenFormula, evaluate, operand
from epicycle.actors.expression.budget import MAX_TEXT
from epicycle.actors.expression.translation import UNDECIDED


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
OTHERS: tuple[Any, ...] = (
    "x", "", "a text of more than ten characters", None, [1.0], [], [[1], [2, "x"]], (1, 2), {"x": 1, "y": 2.5}, {},
    {"x": {"x": [3]}, "y": "x"}, {1: 2, "x": 3}, [{"x": 1.0}, {"x": 2.0}], np.float64(0.5), np.int64(3), np.bool_(True),
    np.array([1.0, float("nan")]), np.array(2.0), np.array([[1, 2], [3, 4]]), Position(1.0, [2.0]),
    [Position(0.5, "y"), {"x": 1}], {"x": (1, 2)}, 2**70, [2**70], [float("nan")], {"x": np.array([1])},
)  # fmt: skip
FUNCTIONS = (
    "abs({})", "sqrt({})", "exp({})", "log({})", "max({}, {})", "min({}, {})", "hypot({}, {})", "round({})",
    "floor({})",
    "len({})", "sum({})", "sorted({})", "str({})", "bool({})", "int({})", "float({})", "range({})", "max({})",
)  # fmt: skip
OF_LISTS = (
    "[{}, {}]", "[{}]", "({})[0]", "({})[-1]", "({})['x']", "({})[{}]", "({})[1:]", "({})[{}:{}]",
    "{{'x': {}, 'y': {}}}",
    "[i for i in {}]", "[i + {} for i in {} if i]", "[[i, j] for i in {} for j in {}]", "[e['x'] for e in {}]",
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


@pytest.mark.slow
@settings(max_examples=500)
@given(numbers=st.randoms(use_true_random=False))
def test_the_evaluator_gives_the_same(numbers: Any) -> None:
    formula = Formula(some(numbers, numbers.randint(0, 4)))
    tokens = numbers.choice((TOKENS, WHOLE, OTHERS, TOKENS + WHOLE + OTHERS))
    for _ in range(10):
        names = {name: numbers.choice(tokens if numbers.random() < 0.9 else OTHERS) for name in "abc"}
        assert outcome(formula, names) == by_the_evaluator(formula, names)


PATIENT = {"came": 1.5, "severity": 2, "name": "Ada", "goals": [1, 2.0]}


@pytest.mark.parametrize(
    ("text", "values", "found"),
    [
        ("a - b", (3.0, 1.5), 1.5),
        ("a - b", (3, 1.5), 1.5),
        ("1 / (a * b)", (8.0, 0.25), 0.5),
        ("a > b and not b > 1", (3.0, 1.0), True),
        ("a ** 2 + sqrt(b) * pi / 180", (3.0, 4.0), 9.034906585039887),
        ("max(a, 0.0) * b", (-1.0, 2.0), 0.0),
        ("(a > b) + (b > a)", (1.0, 2.0), 1),
        ("-a", (0.0,), -0.0),
        ("a[0]['came'] + b", ([PATIENT], 2), 3.5),
        ("a['name'] in ['Ada', 'Bob'] and a['severity'] == 2", (PATIENT,), True),
        ("a['x'] - a['y'][0]", (Position(2.0, np.array([0.5])),), 1.5),
        ("[each['came'] for each in a if each['severity'] > 1] + [b]", ([PATIENT], "x"), [1.5, "x"]),
        ("a", ([PATIENT],), [PATIENT]),
        ("{'of': a}", (PATIENT,), {"of": PATIENT}),
        ("a[1:]", ((1, 2, 3),), [2, 3]),
        ("a", (np.array([1, 2]),), [1, 2]),
    ],
)
def test_what_functions_decide(text: str, values: tuple[Any, ...], found: object) -> None:
    assert repr(Formula(text).function(*values)) == repr(found)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a - b", (float("inf"), float("inf"))),
        ("a - b", (1e308, -1e308)),  # beyond all floats
        ("1 / (a * b)", (1e308, 1e308)),  # where the result does not show it
        ("a * b * 0", (2**62, 4)),
        ("a / b", (1.0, 0.0)),
        ("a", ("x" * (MAX_TEXT + 1),)),
        ("a['y']", ({"x": 1},)),
        ("a == a", (np.array([float("nan")]),)),  # is one list with itself
    ],
)
def test_what_is_left_to_the_evaluator(text: str, values: tuple[Any, ...]) -> None:
    with pytest.raises(UNDECIDED):
        Formula(text).function(*values)


def test_what_is_handed_out_is_a_copy() -> None:
    tokens = [dict(PATIENT)]
    found = Formula("a[0]").function(tokens)
    found["goals"].append(3)
    assert tokens == [PATIENT]


@pytest.mark.parametrize(
    ("text", "items", "told"),
    [
        ("[i for i in a if i in a]", 1_000, "a: this takes more than 100,000 steps"),
        ("[[i + j for j in a] for i in a]", 400, "this takes more than 100,000 steps"),
        ("a + a", 50_001, "a + a: a list of more than 100,000 elements is too long"),
    ],
)
def test_budgets_are_those_of_the_evaluator(text: str, items: int, told: str) -> None:
    tokens = [float(each) for each in range(items)]
    with pytest.raises(UNDECIDED):
        Formula(text).function(tokens)
    with pytest.raises(ExpressionError) as raised:
        evaluate(text, {"a": tokens})
    assert str(raised.value).endswith(told)


def test_the_fields_of_a_token() -> None:
    formula = TokenFormula("time - came if severity < 3 else token['came']", ("time", "channel"))
    assert formula(PATIENT, 4.0, 0) == 2.5
    assert formula.call.__code__.co_filename == "<expression>"  # so the evaluator is not needed
    assert formula({"came": 1.0, "severity": 3}, 4.0, 0) == 1.0
    assert TokenFormula("x + y[0]")(Position(1.0, [2.0])) == 3.0
    assert TokenFormula("came + token", ("token", "time"))(PATIENT, 1, 0.0) == 2.5  # of which the token is another
    assert pickle.loads(pickle.dumps(formula))(PATIENT, 4.0, 0) == 2.5
    with pytest.raises(EpicycleError) as raised:
        formula({"came": 1.0, "severe": 3}, 4.0, 0)
    assert str(raised.value) == (
        "\"time - came if severity < 3 else token['came']\": the token {'came': 1.0, 'severe': 3} has no field "
        "'severity', did you mean 'severe'? it has came, severe, and token, time, channel are known"
    )


def test_a_text_goes_before_other_keys_with_that_text() -> None:
    tokens = {"1": "a", 1: "b"}
    assert Formula("a['1']")({"a": tokens}) == operand(tokens)["1"] == "a"


def test_fields_that_are_not_asked_for_must_be_there() -> None:
    with pytest.raises(EpicycleError, match="has no field 'b'"):
        TokenFormula("a if a else b")({"a": 1})


def test_the_deepest() -> None:
    deep = "a"
    for _ in range(48):
        deep = f"(1 / {deep})"
    assert Formula(deep)({"a": 2.0}) == evaluate(deep, {"a": 2.0}) == 2.0


def test_a_constant_of_that_name_is_told() -> None:
    with pytest.raises(EpicycleError) as raised:
        Formula("a * e")({"a": 1.0, "e": 2.0})
    assert (
        str(raised.value)
        == "'a * e': 'e' is a constant and cannot be the name of something else: rename it, with a = 1.0"
    )


def test_a_formula_can_be_sent() -> None:
    assert pickle.loads(pickle.dumps(Formula("a + 1")))({"a": 2.0}) == 3.0
