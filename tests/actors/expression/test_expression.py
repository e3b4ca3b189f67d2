"""Expressions compute what they say, cheaply, and nothing else."""

import contextlib
import math
import pickle
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors.core.errors import EpicycleError
from epicycle.actors.expression import FUNCTIONS, ExpressionError, evaluate, interpolate, names_in

NAMES: dict[str, object] = {
    "n": 3,
    "x": 2.5,
    "flag": True,
    "starts": [[1, 2], [3, 4]],
    "robot": {"speed": 8, "name": "r1"},
    "pair": (1, 2),
    "thing": object(),
    "nan": math.nan,
}
KNOWN = "flag, n, nan, pair, robot, starts, thing, x"
ALLOWED = (
    "allowed are numbers, texts, names, lists, dicts with text keys, arithmetic, comparisons, and/or/not, "
    "'a if b else c', x[i], list comprehensions and the functions " + ", ".join(sorted(FUNCTIONS))
)


def fault(source: str) -> tuple[str, str]:
    """The message of an expression that fails, and the part that is blamed."""
    with pytest.raises(ExpressionError) as caught:
        evaluate(source, NAMES)
    error = caught.value
    assert isinstance(error, EpicycleError)
    return error.message, source[error.offset : error.offset + error.length]


@pytest.mark.parametrize(
    ("source", "value"),
    [
        ("1 + 2 * 3", 7), ("7 // 2", 3), ("7 % 4", 3), ("7 / 2", 3.5), ("2 ** 10", 1024), ("-n", -3),
        ("+x", 2.5),
        ("2 ** 63", 2**63), ("-2 ** 63", -(2**63)), ("2 ** -1", 0.5), ("0 ** 0", 1),
        ("(-1) ** 101", -1),
        ("'a' + \"b\"", "ab"), ("'ab' * 2", "abab"), ("2 * [0]", [0, 0]), ("[1] + [2]", [1, 2]),
        ("(1, 2)", [1, 2]),
        ("pair", [1, 2]), ("pair == [1, 2]", True), ("[]", []), ("{}", {}), ("{'a': 1}", {"a": 1}),
        ("None", None),
        ("1 < 2 < 3", True), ("1 < 2 > 3", False), ("n == 3", True), ("n != 3", False),
        ("'a' < 'b'", True),
        ("[1, 2] < [1, 3]", True), ("2 in [1, 2]", True), ("'e' not in 'abc'", True),
        ("'speed' in robot", True),
        ("1 in robot", False), ("0 or 'a'", "a"), ("1 and 0", 0), ("not n", False), ("0 and 1 / 0", 0),
        ("1 if flag else 1 / 0", 1), ("starts[1][-1]", 4), ("robot['speed']", 8), ("'abc'[1]", "b"),
        ("starts[1:]", [[3, 4]]), ("[1, 2, 3][::-1]", [3, 2, 1]), ("'abc'[:2]", "ab"),
        ("pair[:1]", [1]),
        ("[i * i for i in range(3)]", [0, 1, 4]), ("[a + b for a, b in starts]", [3, 7]),
        ("[a for a in range(9) if a % 2 if a > 2]", [3, 5, 7]),
        ("[a * b for a in [1, 2] for b in range(a)]", [0, 0, 2]), ("[[n for n in [1]], n]", [[1], 3]),
        ("[e for e in [1]]", [1]), ("abs(-2)", 2), ("min(2, 1)", 1), ("max([1, 2])", 2),
        ("sum([1, 2.5])", 3.5),
        ("len('abc')", 3), ("range(3)", [0, 1, 2]), ("range(5, 0, -2)", [5, 3, 1]),
        ("range(0, 10, 3)", [0, 3, 6, 9]),
        ("range(3, 0)", []), ("round(2.567, 1)", 2.6), ("round(2.5)", 2), ("floor(-1.5)", -2),
        ("ceil(1.2)", 2),
        ("sqrt(4)", 2.0), ("exp(0)", 1.0), ("log(e)", 1.0), ("log(8, 2)", 3.0), ("hypot(3, 4)", 5.0),
        ("atan2(0, 1)", 0.0), ("radians(180) == pi", True), ("degrees(pi)", 180.0),
        ("cos(0) + sin(0) + tan(0)", 1.0),
        ("int('12')", 12), ("int(2.9)", 2), ("float('1e3')", 1000.0), ("float('inf')", math.inf),
        ("-inf", -math.inf),
        ("str(2.0)", "2.0"), ("str([1, 'a', None])", "[1, 'a', null]"),
        ("str({'a': True})", "{'a': true}"),
        ("bool([])", False), ("sorted([3, 1, 2])", [1, 2, 3]), ("sorted(['b', 'a'])", ["a", "b"]),
        ("  n\n +\t1 ", 4), ("0x10", 16), ("1_000", 1000), ("'é' + 'ü'", "éü"), ("inf > 1", True),
    ],
)  # fmt: skip
def test_values(source: str, value: object) -> None:
    result = evaluate(source, NAMES)
    assert result == value
    assert type(result) is type(value)


def test_a_name_may_hold_anything() -> None:
    assert evaluate("thing", NAMES) is NAMES["thing"]


@pytest.mark.parametrize(
    ("source", "construct", "part"),
    [
        ("().__class__", "'.__class__' is not allowed in an expression", "().__class__"),
        (
            "x.real",
            "'.real' is not allowed in an expression (an entry of a dict is written d['real'])",
            "x.real",
        ),
        ("1 + x._y()", "'._y' is not allowed in an expression", "x._y()"),
        ("lambda: 1", "'lambda' is not allowed in an expression", "lambda: 1"),
        ("f'{x}'", "an f-string is not allowed in an expression", "f'{x}'"),
        ("(y := 1)", "':=' is not allowed in an expression", "y := 1"),
        (
            "sum(i for i in starts)",
            "a generator (write a list: [... for ... in ...]) is not allowed in an expression",
            "(i for i in starts)",
        ),
        ("{1, 2}", "a set (write a list: [...]) is not allowed in an expression", "{1, 2}"),
        ("{i for i in pair}", "a set comprehension is not allowed in an expression", "{i for i in pair}"),
        (
            "{'a': i for i in pair}",
            "a dict comprehension is not allowed in an expression",
            "{'a': i for i in pair}",
        ),
        ("[*pair]", "'*' before a value is not allowed in an expression", "*pair"),
        ("max(*pair)", "'*' before a value is not allowed in an expression", "*pair"),
        ("{**robot}", "'**' before a value is not allowed in an expression", "{**robot}"),
        ("max(1, key=2)", "an argument by name is not allowed in an expression", "key=2"),
        ("1j", "a complex number is not allowed in an expression", "1j"),
        ("b'a'", "a bytes text is not allowed in an expression", "b'a'"),
        ("...", "'...' is not allowed in an expression", "..."),
        ("await x", "'await' is not allowed in an expression", "await x"),
        ("(yield)", "'yield' is not allowed in an expression", "yield"),
        (
            "0 and x.real",
            "'.real' is not allowed in an expression (an entry of a dict is written d['real'])",
            "x.real",
        ),
    ],
)
def test_what_is_not_on_the_list_is_refused(source: str, construct: str, part: str) -> None:
    assert fault(source) == (f"{construct}: {ALLOWED}", part)


FUNCTION_LIST = ", ".join(sorted(FUNCTIONS))


@pytest.mark.parametrize(
    ("source", "message", "part"),
    [
        ("", "the expression is empty", ""),
        ("2 + observrs", f"unknown name 'observrs', known names: {KNOWN}", "observrs"),
        ("robt", f"unknown name 'robt', did you mean 'robot'? known names: {KNOWN}", "robt"),
        ("'é' + y", f"unknown name 'y', known names: {KNOWN}", "y"),
        (
            "__import__('os')",
            f"there is no function '__import__', known functions: {FUNCTION_LIST}",
            "__import__('os')",
        ),
        (
            "sqr(2)",
            f"there is no function 'sqr', did you mean 'sqrt'? known functions: {FUNCTION_LIST}",
            "sqr(2)",
        ),
        ("__debug__", "the name '__debug__' is not allowed: it starts with '__'", "__debug__"),
        ("[1 for __a in pair]", "the name '__a' is not allowed: it starts with '__'", "__a"),
        ("starts[0]()", "only a function can be called, by its name", "starts[0]()"),
        ("min", "'min' is a function: write min(...)", "min"),
        ("2 ^ 3", "the operator '^' is not allowed in an expression (a power is written **)", "2 ^ 3"),
        ("1 << 2", "the operator '<<' is not allowed in an expression", "1 << 2"),
        ("~1", "the operator '~' is not allowed in an expression", "~1"),
        ("x is None", "the operator 'is' is not allowed in an expression (write ==)", "x is None"),
        ("1 / 0", "1 / 0 divides by zero", "1 / 0"),
        ("2 * (1 % 0)", "1 % 0 divides by zero", "1 % 0"),
        ("0 ** -1", "0 ** -1 divides by zero", "0 ** -1"),
        ("(-8) ** 0.5", "(-8) ** 0.5: the result is not a real number", "(-8) ** 0.5"),
        ("inf - inf", "inf - inf: the result is not a number (NaN)", "inf - inf"),
        ("nan", "nan: the result is not a number (NaN)", "nan"),
        ("[[nan]]", "[[nan]]: the result is not a number (NaN)", "[[nan]]"),
        ("float('nan')", "float('nan'): the result is not a number (NaN)", "float('nan')"),
        ("1e308 * 10", "the result of 1e308 * 10 is too large", "1e308 * 10"),
        ("exp(1000)", "the result of exp(1000) is too large", "exp(1000)"),
        ("floor(inf)", "the result of floor(inf) is too large", "floor(inf)"),
        ("1e999", "this number is too large", "1e999"),
        ("2 ** 63 + 1", "the result of 2 ** 63 + 1 is too large", "2 ** 63 + 1"),
        ("9" * 30, "this number is too large", "9" * 30),
        ("'\\ud800'", "this text contains half a character (a lone surrogate)", "'\\ud800'"),
        (
            "1 + 'a'",
            "1 + 'a': + needs two numbers, two texts or two lists, not a number and a text",
            "1 + 'a'",
        ),
        ("'%s' % n", "'%s' % n: % needs two numbers, not a text and a number", "'%s' % n"),
        ("-'a'", "-'a': - needs a number, not a text", "-'a'"),
        ("'a' < 1", "'a' < 1: < cannot compare a text with a number", "'a' < 1"),
        ("1 in 1", "1 in 1: 'in' needs a list, dict or text on its right, not a number", "1 in 1"),
        ("1 in 'a'", "1 in 'a': 'in' looks for a text in a text, not for a number", "1 in 'a'"),
        ("starts[2]", "starts[2]: there is no element 2 in a list of 2 elements, counted from 0", "starts[2]"),
        ("starts['a']", "starts['a']: a list is indexed by a whole number, not by a text", "starts['a']"),
        (
            "starts[flag]",
            "starts[flag]: a list is indexed by a whole number, not by a truth value",
            "starts[flag]",
        ),
        ("robot[0]", "robot[0]: a dict is indexed by a text, not by a number", "robot[0]"),
        (
            "robot['sped']",
            "robot['sped']: there is no key 'sped', did you mean 'speed'? known keys: name, speed",
            "robot['sped']",
        ),
        ("n[0]", "n[0]: a number has no elements", "n[0]"),
        ("starts[0:1, 0]", "a slice stands alone between [ and ]: of a list of lists, write rows[0:1][0]", "0:1, 0"),
        ("n[1:]", "only a list or a text can be sliced, not a number", "n[1:]"),
        ("starts[x:]", "a slice needs whole numbers, not a number", "starts[x:]"),
        ("starts[::0]", "starts[::0]: slice step cannot be zero", "starts[::0]"),
        ("[i for i in n]", "'for' needs a list, not a number", "n"),
        ("[1 for a, b in pair]", "each element must be a list of 2, not a number", "pair"),
        (
            "[1 for robot['a'] in pair]",
            "a list comprehension needs plain names between 'for' and 'in'",
            "robot['a']",
        ),
        ("{1: 2}", "a key must be a text, but this one is a number", "1"),
        ("{'a': 1, 'a': 2}", "duplicate key 'a'", "'a'"),
        ("abs(1, 2)", "abs(1, 2): abs takes 1 value, not 2", "abs(1, 2)"),
        ("max()", "max(): max takes at least 1 value, not 0", "max()"),
        ("range()", "range(): range takes 1 to 3 values, not 0", "range()"),
        ("max([])", "max([]): max needs at least one element", "max([])"),
        ("max(3)", "max(3): max needs a list, not a number", "max(3)"),
        (
            "sorted([1, 'a'])",
            "sorted([1, 'a']): sorted cannot compare a number with a text",
            "sorted([1, 'a'])",
        ),
        ("sum(['a'])", "sum(['a']): sum needs a list of numbers, but this one contains a text", "sum(['a'])"),
        ("sqrt(-1)", "sqrt(-1): sqrt is not defined for -1", "sqrt(-1)"),
        ("sqrt('a')", "sqrt('a'): sqrt needs numbers, not a text", "sqrt('a')"),
        ("int('q')", "int('q'): 'q' is not a whole number", "int('q')"),
        ("int([])", "int([]): a list cannot become a whole number", "int([])"),
        ("len(1)", "len(1): a number has no length", "len(1)"),
        ("range(1.5)", "range(1.5): range needs whole numbers, not 1.5", "range(1.5)"),
        ("range(0, 9, 0)", "range(0, 9, 0): range needs a step other than 0", "range(0, 9, 0)"),
        (
            "thing + 1",
            "thing + 1: + needs two numbers, two texts or two lists, not a value of type object and a number",
            "thing + 1",
        ),
    ],
)
def test_faults(source: str, message: str, part: str) -> None:
    assert fault(source) == (message, part)


LONG_LIST = "a list of more than 100,000 elements is too long"
LONG_TEXT = "a text of more than 10,000 characters is too long"
STEPS = "this takes more than 100,000 steps"


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("[0]*10**9", f"[0]*10**9: {LONG_LIST}"),
        ("[0]*10**18", f"[0]*10**18: {LONG_LIST}"),
        ('"a"*10**9', f'"a"*10**9: {LONG_TEXT}'),
        ("'a'*9999 + 'bb'", f"'a'*9999 + 'bb': {LONG_TEXT}"),
        ("9**9**9", "the result of 9**9**9 is too large"),
        ("9.0**9**9", "the result of 9.0**9**9 is too large"),
        ("2**-(10**18) + 10**30", "the result of 10**30 is too large"),
        ("range(10**9)", f"range(10**9): {LONG_LIST}"),
        ("range(2**63)", "the result of range(2**63) is too large"),
        (
            "round(1, 10**9)",
            "round(1, 10**9): round takes a whole number of decimals up to 30, not 1000000000",
        ),
        ("[[0]*90000 for i in range(10000)]", f"[0]*90000: {STEPS}"),
        ("['a'*9999 for i in range(10000)]", f"'a'*9999: {STEPS}"),
        (
            "[1 for i in range(1000) for j in range(1000)]",
            f"[1 for i in range(1000) for j in range(1000)]: {STEPS}",
        ),
        ("str(['a'*9999, 'b'])", f"str(['a'*9999, 'b']): {LONG_TEXT}"),
        ("[y for y in [['a'*9999]*100]][0]*101", None),
        ("sorted([0]*100000) == sorted([0]*100000) == sorted([0]*100000)", None),
        ("-" * 1_900 + "1", "nested deeper than 50 levels"),
        ("[" * 60 + "]" * 60, "nested deeper than 50 levels"),
        ("[" + "1," * 600 + "]", "the expression has more than 500 parts"),
        ("1" + "+1" * 1_000, "the expression is longer than 2,000 characters"),
    ],
)
def test_bombs_are_refused_at_once(source: str, message: str | None) -> None:
    start = time.process_time()
    found, _ = fault(source)
    assert time.process_time() - start < 1.0
    assert message in (None, found)


def test_shared_elements_count_as_often_as_they_appear() -> None:
    source = "[1]"
    for level in range(18):
        source = f"[[v{level}, v{level}] for v{level} in {source}]"
    assert fault(source)[0].endswith(LONG_LIST)


@pytest.mark.parametrize(
    "source",
    ["1 +", "(1", "1 2", "x = 1", "1if x else 2", "'\\d'", "\x00", "'a", "(" * 900, "import os", "x;x"],
)
def test_syntax_errors_are_explained(source: str) -> None:
    message, _ = fault(source)
    assert message.startswith("this is not an expression: ")
    assert ":=" not in message


def test_constants_cannot_be_hidden() -> None:
    with pytest.raises(ExpressionError) as caught:
        evaluate("2 * e", {"e": 1})
    assert str(caught.value) == "'e' is a constant and cannot be the name of something else: rename it"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("${n}", 3), ("${ [n] }", [3]), ("plain", "plain"), ("", ""), ("a ${n} b", "a 3 b"),
        ("${x}${n}", "2.53"),
        ("${n / 1}!", "3.0!"), ("$${n}", "${n}"), ("$$${n}", "$${n}"), ("$${${n}", "${3"),
        ("$ {n} } {", "$ {n} } {"),
        ("${{'a': '}'}['a']}", "}"), ("${'it\\'s}'}", "it's}"), ("it's ${n} it's", "it's 3 it's"),
        ("${flag} ${None}", "true null"), (" ${n}", " 3"), ("${'${n}'}", "${n}"), ('${"""}"""}', "}"),
    ],
)  # fmt: skip
def test_interpolate(text: str, value: object) -> None:
    result = interpolate(text, NAMES)
    assert result == value
    assert type(result) is type(value)


@pytest.mark.parametrize(
    ("text", "message", "offset", "length"),
    [
        ("ab ${n", "this '${' has no closing '}'", 3, 3),
        ("${'}'", "this '${' has no closing '}'", 0, 5),
        ("a ${} b", "the expression is empty", 4, 0),
        ("${n} ${ 1 / 0 }", "1 / 0 divides by zero", 8, 5),
        ("é ${y}", f"unknown name 'y', known names: {KNOWN}", 4, 1),
        ("${'a' * 9999} ${'b' * 9999}", "the text becomes longer than 10,000 characters", 0, 27),
        ("-${['a' * 9999, 'bb']}", LONG_TEXT, 3, 18),
    ],
)
def test_interpolate_says_where(text: str, message: str, offset: int, length: int) -> None:
    with pytest.raises(ExpressionError) as caught:
        interpolate(text, NAMES)
    error = caught.value
    assert (str(error), error.offset, error.length) == (message, offset, length)


def test_names_in() -> None:
    assert names_in("plain $${a}") == set()
    assert names_in("${[a * k for a in xs if b] + [pi, min(q)]} and ${z['w']}") == {"k", "xs", "b", "q", "z"}
    assert names_in("${[[a for a in a], c] if d else 1}") == {"a", "c", "d"}
    with pytest.raises(ExpressionError):
        names_in("${a b}")


def test_errors_can_be_pickled() -> None:
    error = ExpressionError("no", 3, 4)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.offset, again.length) == (ExpressionError, "no", 3, 4)


@given(st.text(alphabet="nx01.+-*/%()[]{}'\"<>=, forinifelseandtpi:\n\\é", max_size=30))
def test_only_expression_errors_come_out(source: str) -> None:
    for action in (evaluate, interpolate):
        with contextlib.suppress(ExpressionError):
            action(source, NAMES)
