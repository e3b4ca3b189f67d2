"""The text of properties: what it means, and what is said of mistakes."""

from __future__ import annotations

import math

import pytest

from epicycle.actors import EpicycleError
from epicycle.runner.model.temporal import TINY, Condition, PropertyError, Sends, property_of
from epicycle.runner.model.temporal.property import Junction, Not, Property, Quantified, Until

S = 1_000_000_000
A, B, C = Sends("a.x"), Sends("b.x"), Sends("c.x")


@pytest.mark.parametrize(
    ("source", "tree"),
    [
        ("always sends a.x", Quantified(False, A)),
        ("eventually within 3 s sends a.x", Quantified(True, A, 0, 3 * S)),
        ("eventually within 250ms sends a.x", Quantified(True, A, 0, S // 4)),
        ("always after 1 min sends a.x", Quantified(False, A, 60 * S, None)),
        ("always from 1 to 2.5 sends a.x", Quantified(False, A, S, 5 * S // 2)),
        ("eventually (sends a.x for 2 s)", Quantified(True, Quantified(False, A, 0, 2 * S))),
        ("eventually not sends a.x for 2 s", Quantified(True, Not(Quantified(False, A, 0, 2 * S)))),
        ("sends a.x until sends b.x", Until(A, B)),
        ("sends a.x until within 1 s sends b.x", Until(A, B, 0, S)),
        ("always sends a.x and always sends b.x", Junction(False, Quantified(False, A), Quantified(False, B))),
        (
            "always (sends a.x and sends b.x or sends c.x)",
            Quantified(False, Junction(True, Junction(False, A, B), C)),
        ),
        ("always (sends a.x implies sends b.x)", Quantified(False, Junction(True, Not(A), B))),
        (
            "always (sends a.x implies sends b.x implies sends c.x)",
            Quantified(False, Junction(True, Not(A), Junction(True, Not(B), C))),
        ),
        ("always eventually sends a.x", Quantified(False, Quantified(True, A))),
        ("always ((sends robot[1].arm[0].x))", Quantified(False, Sends("robot[1].arm[0].x"))),
    ],
)
def test_a_text_says(source: str, tree: Property) -> None:
    assert property_of(source) == tree


@pytest.mark.parametrize(
    ("source", "values", "margin"),
    [
        ("a.x >= 2 m", [3.0], 1.0),
        ("a.x >= 2", [2.0], TINY),
        ("a.x > 2", [2.0], -TINY),
        ("a.x < 200 cm", [0.5], 1.5),
        ("a.x <= 36 km/h", [11.0], -1.0),
        ("a.x < 50 %", [0.25], 0.25),
        ("a.x < 5e-1", [0.25], 0.25),
        ("a.x < 5e2 cm", [1.0], 4.0),
        ("a.x % 3 < 2", [4], 1.0),
        ("(a.x + b.x) / 2 >= 1", [2.0, 4.0], 2.0),
        ("1 <= a.x < 4", [3.0], 1.0),
        ("1 <= a.x < 4", [4.5], -0.5),
        ("a.x == 3", [3], TINY),
        ("a.x == 3", [5], -2.0),
        ("a.x != 3", [5], 2.0),
        ("a.mode == 'on'", ["on"], math.inf),
        ("a.mode != 'on'", ["on"], -math.inf),
        ("a.mode in ['on', 'off']", ["on"], math.inf),
        ("a.x", [True], math.inf),
        ("a.x", [0], -math.inf),
        ("abs(a.x - b.x) < 2", [1.0, 4.0], -1.0),
        ("max(a.x, b.x) <= 3", [math.inf, 1.0], -math.inf),
        ("a.x.y[1] > 0", [[1.0, 2.0]], 2.0),
        ("a.x > 1 if b.x else a.x > 2", [3.0, 0.0], math.inf),
    ],
)
def test_the_margin_of_a_condition(source: str, values: list[object], margin: float) -> None:
    tree = property_of(f"always {source}")
    assert isinstance(tree, Quantified)
    assert isinstance(tree.of, Condition)
    assert tree.of.margin(values) == margin
    assert tree.of.source == source


@pytest.mark.parametrize(
    ("source", "values", "message"),
    [
        ("a.x < 3", ["three"], "'a.x < 3' cannot be judged: 'three' < 3"),
        ("a.x", ["on"], "'a.x' is neither true nor false: it is 'on'"),
        ("a.x < b.x", [math.nan, 1.0], "'a.x < b.x' cannot be judged, with a.x = nan, b.x = 1.0"),
    ],
)
def test_conditions_that_cannot_be_judged(source: str, values: list[object], message: str) -> None:
    tree = property_of(f"always {source}")
    assert isinstance(tree, Quantified)
    assert isinstance(tree.of, Condition)
    with pytest.raises(EpicycleError) as raised:
        tree.of.margin(values)
    assert str(raised.value) == message


@pytest.mark.parametrize(
    ("source", "part", "message", "hint"),
    [
        ("", "", "a condition is missing at the end", "write one such as 'actor.port >= 2 m'"),
        ("always", "s", "a condition is missing at the end", "write one such as 'actor.port >= 2 m'"),
        ("always and a.x", "and", "a condition is missing before 'and'", "write one such as 'actor.port >= 2 m'"),
        ("always (a.x > 2", "(", "this parenthesis is not closed", ""),
        (
            "always a.x > 2)",
            ")",
            "')' is not expected here",
            "and, or, implies and until join two properties",
        ),
        ("always within a.x", "a.x", "a time is missing here", "write one such as '3 s' or '100 ms'"),
        ("always within 3 kg a.x", "3 kg", "a time is missing here", "write one such as '3 s' or '100 ms'"),
        (
            "always within 1e9 s a.x",
            "1e9 s",
            "this time is not between 0 and 1e9 s",
            "write one such as '3 s' or '100 ms'",
        ),
        (
            "always from 3 s a.x > 2",
            "a.x",
            "'from' has no 'to'",
            "write 'from 1 s to 3 s', or 'after 1 s'",
        ),
        ("always from 3 s to 1 s a.x > 2", "3 s to 1 s", "the window ends before it begins", ""),
        ("always sends 3", "3", "'sends' names no port", "write 'sends actor.port'"),
        (
            "a.x > 2",
            "a.x > 2",
            "'a.x > 2' would only be judged at the beginning of the run",
            "write 'always a.x > 2' or 'eventually a.x > 2'",
        ),
        (
            "always a.x > 2 implies b.x > 2",
            "b.x > 2",
            "'b.x > 2' would only be judged at the beginning of the run",
            "write 'always b.x > 2' or 'eventually b.x > 2'",
        ),
        ("always a.x > 2 mice", "a.x > 2 mice", "unknown unit 'mice'", ""),
        ("always x > 2", "x", "unknown name 'x': a port is written 'actor.port'", ""),
        ("always 1 > 2", "1 > 2", "it names no port: write a port as 'actor.port'", ""),
        ("always foo(a.x) > 2", "foo(a.x)", "there is no function 'foo'", ""),
        ("always __import__('os').x", "__import__('os').x", "", ""),
    ],
)
def test_mistakes(source: str, part: str, message: str, hint: str) -> None:
    with pytest.raises(PropertyError) as raised:
        property_of(source)
    error = raised.value
    assert source[error.offset : error.offset + error.length] == part
    assert str(error).startswith(message)
    assert error.hint == hint


def test_nesting_and_length_are_limited() -> None:
    for source in (
        "(" * 60 + "always a.x > 2" + ")" * 60,
        "not " * 60 + "always a.x",
        "sends a.x until " * 60 + "sends a.x",
    ):
        with pytest.raises(PropertyError, match="the property is nested deeper than 50 levels"):
            property_of(source)
    with pytest.raises(PropertyError, match="the property is longer than 10,000 characters"):
        property_of("always a.x > 2 " + " " * 10_000)
