"""The expression language of Ptolemy II: what it comes to, and how it is said here."""

from __future__ import annotations

import math
from typing import Any

import pytest

from epicycle.actors.expression import evaluate
from epicycle.ptolemy.importing.document import Property
from epicycle.ptolemy.importing.scope import Scope
from epicycle.ptolemy.importing.syntax import ExpressionError, parse
from epicycle.ptolemy.importing.translation import Code, Meaning, Value, meaning_of, named

KINDS = {"w": int, "f": float, "s": str, "array": list}
PARAMETERS: dict[str, Any] = {
    "n": 3,
    "x": 0.5,
    "name": "joe",
    "items": [1, 2, 3],
    "rec": {"a": 1, "b": [4, 5]},
    "yes": True,
}


CANNOT, TOO_LONG = "it cannot be evaluated: ", "a list of more than 100,000 elements is too long"


def meaning(text: str, names: dict[str, Meaning] | None = None) -> Meaning:
    """What an expression means over the parameters, and over names that have another meaning."""
    known: dict[str, Meaning] = {name: Value(each) for name, each in PARAMETERS.items()} | (names or {})
    return meaning_of(parse(text), known.__getitem__)


def value(text: str) -> Any:
    found = meaning(text)
    assert isinstance(found, Value)
    return found.value


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + 2 * 3", 7),
        ("2^3^2", 64),
        ("-2^2", 4),
        ("7 / 2", 3),
        ("-7 / 2", -3),
        ("7 / 2.0", 3.5),
        ("6 / 2", 3),
        ("1.0", 1.0),
        ("1e3", 1000.0),
        ("7L", 7),
        ("5ub", 5),
        ("2.5d", 2.5),
        ("-7 % 3", -1),
        ("7.5 % 2", 1.5),
        ("1 > 2 ? 3 : 4", 4),
        ("true && !false", True),
        ("true || false", True),
        ("n == 3.0", True),
        ("1 != 1", False),
        ('"a" + 1 + 2.0', "a12.0"),
        ("'a' + true", "atrue"),
        ("{1, 2.0}", [1.0, 2.0]),
        ("{}", []),
        ('{a = 1, b = "x"}', {"a": 1, "b": "x"}),
        ("{1, 2} + {3, 4}", [4, 6]),
        ("2 * {1, 2}", [2, 4]),
        ("[1, 2; 3, 4]", [[1, 2], [3, 4]]),
        ("[0 : 2 : 5]", [[0, 2, 4]]),
        ("items(1)", 2),
        ("items.get(2)", 3),
        ("items.length()", 3),
        ("rec.a", 1),
        ("rec.b(0)", 4),
        ('rec.get("a")', 1),
        ("max(items)", 3),
        ("min(4, 2)", 2),
        ("sum(items)", 6),
        ("abs(-x)", 0.5),
        ("floor(2.7)", 2.0),
        ("ceil(2.1)", 3.0),
        ("round(2.5)", 3),
        ("PI", math.pi),
        ("Infinity", math.inf),
        ("MaxInt", 2147483647),
        ("sqrt(16)", 4.0),
        ("repeat(3, 0)", [0, 0, 0]),
        ("x * n", 1.5),
        ("append({1}, {2})", [1, 2]),
        ("subarray(items, 1, 2)", [2, 3]),
        ('(n > 2 && yes) ? name : ""', "joe"),
        ("1 // one\n + 2", 3),
        ("1 /* one */ + 2", 3),
        ('"a\\n\\"b\\""', 'a\n"b"'),
        ("neighborhood(1.0, 1.1, 0.2)", True),
        ("contains(items, 2)", True),
        # literals
        ("010", 8),
        ("1L", 1),
        ("7s", 7),
        ("2.5p", 2.5),
        ("TRUE && !False", True),
        ("1f", 1.0),
        # a sign holds tighter than a power, and a rest has the sign of the first operand
        ("2 - -2^2", -2),
        ("-7 % -3", -1),
        ("7 % -3", 1),
        # a text has a number as the model language writes it
        ('1E10 + ""', "10000000000.0"),
        ('"" + 2.50', "2.5"),
        # elements have one type
        ('{1, "a", true}', ["1", "a", "true"]),
        ("[1, 2.0]", [[1.0, 2.0]]),
        # matrices
        ("[1, 2; 3, 4](1, 0)", 3),
        ("toRadians(180.0)", math.pi),
        ("signum(-2)", -1.0),
        ("hypot(3, 4)", 5.0),
        ("find({true, false, true})", [0, 2]),
        ("items.subarray(1)", [2, 3]),
        ("items.extract({0, 2})", [1, 3]),
        ("items.reverse()", [3, 2, 1]),
        ("x.isCloseTo(0.6, 0.2)", True),
        ("max(1, 2.0)", 2.0),
    ],
)
def test_values(text: str, expected: Any) -> None:
    found = value(text)
    assert (found, type(found)) == (expected, type(expected))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "'' cannot be read: it ends too early"),
        ("1 +", "'1 +' cannot be read: it ends too early"),
        ("(1", "'(1' cannot be read: expected ')'"),
        ("1 2", "'1 2' cannot be read: unexpected 2"),
        ("1 ` 2", "'1 ` 2' cannot be read at '` 2'"),
        ("2i + 1", "'2i + 1' cannot be read: unexpected 'i'"),
        ("function(1) 2", "'function(1) 2' cannot be read: functions that a model defines are not supported"),
        ("unheard", "unknown name 'unheard'"),
        ("random()", "the function 'random' is not supported"),
        ("{7}(1)", f"{CANNOT}a[b]: there is no element 1 in a list of 1 element, counted from 0, with a = [7], b = 1"),
        ("1 / 0", "it cannot be evaluated: a / b divides by zero, with a = 1, b = 0"),
        ("1.0 / 0.0", "it cannot be evaluated: a / b divides by zero, with a = 1.0, b = 0.0"),  # as in the run
        ("log(0.0)", "it cannot be evaluated: log(a): log is not defined for 0.0, with a = 0.0"),
        ("9^9^9^9^9", "it cannot be evaluated: the result of a ** b is too large, with a = 387420489, b = 9"),
        ("99999999999999999999", "a whole number must be at least -2^63 and less than 2^63"),
        ("true + 1", "the operator '+' of truth values is not supported"),
        ("3 & 5", "the operator '&' is not supported"),
        ("[1, 2] * [3, 4]", "operators of matrices, and of arrays that are not constant, are not supported"),
        ("{1, 2} + {1, 2, 3}", "the arrays have different lengths"),
        ("parseInt('1', 2)", "wrong number of arguments: parseInt does not take 2"),
        ("nil + 1", "nothing cannot be a value here"),
        ("1 ? 2 : 3", "1 is not a truth value"),
        ("1" + "+1" * 2000, "the expression is nested too deeply"),
        ("repeat(1000000, 1)", f"{CANNOT}[b] * a: {TOO_LONG}, with a = 1000000, b = 1"),
        (
            "[0 : 1 : 1000000]",
            f"{CANNOT}range(floor((c - a) / b + 1e-09) + 1): {TOO_LONG}, with a = 0, b = 1, c = 1000000",
        ),
        ("(" * 70 + "1" + ")" * 70, f"{'(' * 57 + '...'!r} cannot be read: nested deeper than 40 levels"),
    ],
)
def test_what_has_no_value(text: str, message: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        value(text)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a + n", "a + 3"),
        ("a * (b + 1)", "a * (b + 1)"),
        ("a - (b - 1)", "a - (b - 1)"),
        ("a - b - 1", "a - b - 1"),
        ("a > 1 && !t", "a > 1 and (not t)"),
        ("t || a == b", "t or a == b"),
        ("t ? a : b", "a if t else b"),
        ("(t ? a : b) + 1", "(a if t else b) + 1"),
        ("a^2", "a ** 2"),
        ("-a^2", "(-a) ** 2"),
        ("(-a)^2", "(-a) ** 2"),
        ("items(0) + a", "1 + a"),
        ("array(a)", "array[a]"),
        ("array.length()", "len(array)"),
        ("r.f", "r['f']"),
        ("{a, b}", "[a, b]"),
        ("{v = a, w = 2}", "{'v': a, 'w': 2}"),
        ("max(a, n)", "max(a, 3)"),
        ("floor(a)", "float(floor(a))"),
        ('"t = " + a', "'t = ' + str(a)"),
        ("a % 2", "a % abs(2) if a >= 0 else -(-a % abs(2))"),
        ("7 % b", "7 % abs(b) if 7 >= 0 else -(-7 % abs(b))"),
        ("atan(a)", "atan2(a, 1)"),
        ("array.equals({7, 8, 9})", "array == [7, 8, 9]"),
        ("a * -1", "a * -1"),
        ("Infinity * a", "inf * a"),
        ("log10(a)", "log(a, 10)"),
    ],
)
def test_how_it_is_said(text: str, expected: str) -> None:
    """And what is said has the value that it has before the run, of the same names."""
    given = {"a": 2, "b": 5, "t": True, "r": {"f": 1.5}, "array": [7, 8, 9]}
    found = meaning(text, {name: named(name) for name in given})
    assert isinstance(found, Code)
    assert found.text == expected
    ours = evaluate(found.text, given)
    before = meaning(text, {name: Value(each) for name, each in given.items()})
    assert isinstance(before, Value)
    assert (ours, type(ours)) == (before.value, type(before.value))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("w / 2", "int(w / 2)"),
        ("f / 2", "f / 2"),
        ("w + 1 / w", "w + int(1 / w)"),
        ("'is ' + s + w", "'is ' + s + str(w)"),
        ("{w, f}", "[float(w), f]"),
        ("sum(array) / w", "sum(array) / w"),
        ("length(array) / w", "int(len(array) / w)"),
    ],
)  # fmt: skip
def test_what_is_known_of_the_kinds_of_values(text: str, expected: str) -> None:
    found = meaning(text, {name: named(name, kind) for name, kind in KINDS.items()})
    assert isinstance(found, Code)
    assert found.text == expected


def test_arrays_of_a_run_are_not_combined() -> None:
    with pytest.raises(ExpressionError) as caught:
        meaning("array * 2", {name: named(name, kind) for name, kind in KINDS.items()})
    assert str(caught.value) == "operators of matrices, and of arrays that are not constant, are not supported"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("$n and ${n}.5", "3 and 3.5"),
        ("$(n + max(n, 7))!", "10!"),
        ("$$5, $unheard, $(1 +)", "$5, $unheard, $(1 +)"),
        ("$x: $yes", "0.5: true"),
    ],
)
def test_texts_with_names_in_them(text: str, expected: str) -> None:
    values = {"n": "3", "x": "0.5", "yes": "true"}
    said = {name: Property(name, "ptolemy.data.expr.Parameter", each) for name, each in values.items()}
    assert Scope(Property("m", properties=said)).filled(text) == expected


def test_the_own_name_of_a_parameter_is_one_further_out() -> None:
    def entity(**values: str) -> Property:
        said = {name: Property(name, "ptolemy.data.expr.Parameter", each) for name, each in values.items()}
        return Property("m", properties=said)

    inner = Scope(entity(delay="delay * 2", a="b", b="a"), Scope(entity(delay="3")))
    assert inner("delay") == 6
    with pytest.raises(ExpressionError) as caught:
        inner("a")
    assert str(caught.value) == "'a' is defined in terms of itself"
