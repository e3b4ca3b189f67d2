"""The expression language of Ptolemy II: what it comes to, and how it is said here."""

from __future__ import annotations

import math
from typing import Any

import pytest

from epicycle.actors.expression import evaluate as own_evaluate
from epicycle.ptolemy.importing.entities import Property
from epicycle.ptolemy.importing.operators import Rows, java_text
from epicycle.ptolemy.importing.scope import Scope
from epicycle.ptolemy.importing.syntax import ExpressionError, parse
from epicycle.ptolemy.importing.translate import translated
from epicycle.ptolemy.importing.values import evaluate

PARAMETERS: dict[str, Any] = {
    "n": 3,
    "x": 0.5,
    "name": "joe",
    "items": [1, 2, 3],
    "rec": {"a": 1, "b": [4, 5]},
    "yes": True,
}
for _name, _text in (
    ("endless", "function(x) endless(x)"),
    ("twice", "function(x) x * 2"),
    ("factorial", "function(k) k < 2 ? 1 : k * factorial(k - 1)"),
):
    PARAMETERS[_name] = evaluate(parse(_text), lambda name: PARAMETERS[name])


def value(text: str) -> Any:
    def scope(name: str) -> object:
        return PARAMETERS[name]

    return evaluate(parse(text), scope)


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
        ("0x1F", 31),
        ("5ub", 5),
        ("2.5d", 2.5),
        ("-7 % 3", -1),
        ("7.5 % 2", 1.5),
        ("1 > 2 ? 3 : 4", 4),
        ("true && !false", True),
        ("true || false", True),
        ("n == 3.0", True),
        ("1 != 1", False),
        ("3 & 5", 1),
        ("3 | 5", 7),
        ("3 # 5", 6),
        ("1 << 4", 16),
        ("32 >> 2", 8),
        ("~0", -1),
        ('"a" + 1 + 2.0', "a12.0"),
        ("'a' + true", "atrue"),
        ("{1, 2.0}", [1.0, 2.0]),
        ("{}", []),
        ('{a = 1, b = "x"}', {"a": 1, "b": "x"}),
        ("{|a = 1 | 2|}", {"a": 3}),
        ("{1, 2} + {3, 4}", [4, 6]),
        ("2 * {1, 2}", [2, 4]),
        ("[1, 2; 3, 4]", Rows([[1, 2], [3, 4]])),
        ("[0 : 2 : 5]", Rows([[0, 2, 4]])),
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
        ("cast(int, 2.7)", 2),
        ("cast(double, 2)", 2.0),
        ("cast(string, 2.5)", "2.5"),
        ("repeat(3, 0)", [0, 0, 0]),
        ("x * n", 1.5),
        ("append({1}, {2})", [1, 2]),
        ("subarray(items, 1, 2)", [2, 3]),
        ("1.0 / 0.0", math.inf),
        ('1E10 + ""', "1.0E10"),
        ('0.0001 + ""', "1.0E-4"),
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
        ("-1 >>> 28", 15),
        # elements have one type
        ('{1, "a", true}', ["1", "a", "true"]),
        ("{{1}, {2.0}}", [[1.0], [2.0]]),
        ("{{a = 1, b = 2}, {a = 2.0}}", [{"a": 1.0}, {"a": 2.0}]),
        ("[1, 2.0]", Rows([[1.0, 2.0]])),
        ('1 == "1"', True),
        # matrices
        ("[1, 2; 3, 4] * [1; 1]", Rows([[3], [7]])),
        ("2 * [1, 2]", Rows([[2, 4]])),
        ("[1, 2; 3, 4](1, 0)", 3),
        ("identityMatrixInt(2)", Rows([[1, 0], [0, 1]])),
        ('"" + [1, 2; 3, 4]', "[1, 2; 3, 4]"),
        ("transpose([1, 2])", Rows([[1], [2]])),
        # doubles in texts have up to 13 decimals, and an exponent from a million on
        ('"" + (0.1 + 0.2)', "0.3"),
        ('"" + 1234567.0', "1.234567E6"),
        ('"" + 0.001', "1.0E-3"),
        ('"" + 100.0', "100.0"),
        # functions
        ("(function(x:int, y) x + 2 * y)(1, 2)", 5),
        ("twice(4)", 8),
        ("map(twice, items)", [2, 4, 6]),
        ("map(function(x, y) x * y, {1, 2}, {3, 4})", [3, 8]),
        ("filter(function(x) x > 1, items)", [2, 3]),
        ("fold(function(x, y) x + y, 0, items)", 6),
        ("iterate(function(x) x + n, 3, 0)", [0, 3, 6]),
        ('eval("n + 1")', 4),
        ("factorial(5)", 120),
        ("toRadians(180.0)", math.pi),
        ("signum(-2)", -1.0),
        ("hypot(3, 4)", 5.0),
        ("log(0.0)", -math.inf),
        ("find({true, false, true})", [0, 2]),
        ("merge({a = 1}, {a = 2, b = 3})", {"a": 1, "b": 3}),
        ("items.subarray(1)", [2, 3]),
        ("items.extract({true, false, true})", [1, 3]),
        ("items.reverse()", [3, 2, 1]),
        ("name.toUpperCase()", "JOE"),
        ('"a,b".split(",")', ["a", "b"]),
        ("x.isCloseTo(0.6, 0.2)", True),
        ("cast({double}, items)", [1.0, 2.0, 3.0]),
        ('cast(boolean, "true")', True),
        ("max(1, 2.0)", 2.0),
        ("n(0)", 3),
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
        ("2i + 1", "2i: complex numbers are not supported"),
        (
            "map(function(x) map(function(y) y, repeat(400, 1)), repeat(400, 1))",
            "a list of more than 100,000 elements is too long",
        ),
        ("endless(1)", "the expression is nested too deeply"),
        ("(function(x) x)(1, 2)", "it cannot be evaluated: wrong number of arguments: the function takes 1, not 2"),
        ("function(1) 2", "'function(1) 2' cannot be read: expected the name of an argument"),
        ("unheard", "unknown name 'unheard'"),
        ("random()", "the function 'random' is not supported"),
        ("items(7)", "there is no element at index 7"),
        ("1 / 0", "it cannot be evaluated: division by zero"),
        ("9^9^9^9^9", "a whole number must be at least -2^63 and less than 2^63"),
        ("true + 1", "it cannot be evaluated: True is not a number"),
        ("repeat(1000000, 1)", "it has more than the maximum of 10,000 elements"),
        ("[0 : 1 : 1000000]", "it has more than the maximum of 10,000 elements"),
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
        ("a > 1 && !t", "a > 1 and not t"),
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
        ("a % 2", "(a % 2 if a >= 0 else -(-a % 2))"),
        ("a % 2 == 0", "a % 2 == 0"),
        ("-a % 2", "((-a) % 2 if (-a) >= 0 else -(-(-a) % 2))"),
        ("7 % b", "7 % abs(b)"),
        ("twice(a + 1)", "(a + 1) * 2"),
        ("(function(x) x + b)(a)", "a + b"),
        ("map(function(x) x + a, array)", "[x + a for x in array]"),
        ("filter(function(a) a > 7, array)", "[a_ for a_ in array if a_ > 7]"),
        ("atan(a)", "atan2(a, 1)"),
        ("array.equals({7, 8, 9})", "((array) == ([7, 8, 9]))"),
        ("a * -1", "a * -1"),
        ("Infinity * a", "inf * a"),
        ("cast(int, a)", "int(a)"),
        ("log10(a)", "log(a, 10)"),
    ],
)
def test_how_it_is_said(text: str, expected: str) -> None:
    names = {name: name for name in ("a", "b", "t", "r", "array")}

    def scope(name: str) -> object:
        return PARAMETERS[name]

    found = translated(parse(text), names, scope)
    assert found == expected
    given = {"a": 2, "b": 5, "t": True, "r": {"f": 1.5}, "array": [7, 8, 9]}
    ours = own_evaluate(found, given)
    theirs = evaluate(parse(text), lambda name: given[name] if name in given else PARAMETERS[name])
    assert (ours, type(ours)) == (theirs, type(theirs))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("$n and ${n}.5", "3 and 3.5"),
        ("$(n + max(n, 7))!", "10!"),
        ("$$5, $unheard, $(1 +)", "$5, $unheard, $(1 +)"),
        ("$x: $items", "0.5: {1, 2, 3}"),
    ],
)
def test_texts_with_names_in_them(text: str, expected: str) -> None:
    said = {
        name: Property(name, "ptolemy.data.expr.Parameter", java_text(PARAMETERS[name])) for name in ("n", "x", "items")
    }
    assert Scope(Property("m", properties=said)).filled(text) == expected
