"""Numbers with units in arithmetic, against numbers counted in SI units by hand."""

from __future__ import annotations

import copy
import math
import operator
import pickle
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors import (
    Exponential,
    Parameter,
    ParameterError,
    Quantity,
    Server,
    UnitError,
    counted_in_si,
    parse_unit,
    plain,
)
from epicycle.actors.distributions import Distribution
from epicycle.actors.expression import ExpressionError, evaluate, interpolate

LENGTHS = {"m": 1.0, "km": 1000.0, "mm": 0.001}
TIMES = {"s": 1.0, "ms": 0.001, "h": 3600.0}
numbers = st.floats(-1e6, 1e6).filter(lambda x: x == 0 or abs(x) > 1e-6)


def close(found: float, expected: float) -> bool:
    return math.isclose(found, expected, rel_tol=1e-12, abs_tol=1e-12 * max(1.0, abs(expected)))


@given(numbers, st.sampled_from(sorted(LENGTHS)), numbers, st.sampled_from(sorted(LENGTHS)))
def test_sums_and_comparisons_of_the_same_kind(a: float, unit: str, b: float, other: str) -> None:
    one, two = Quantity(a, unit), Quantity(b, other)
    x, y = a * LENGTHS[unit], b * LENGTHS[other]
    scale = abs(x) + abs(y) + 1
    for sign in (operator.add, operator.sub):
        found = sign(one, two)
        assert isinstance(found, Quantity)
        assert abs(found.to("m") - sign(x, y)) <= 1e-12 * scale
    if abs(x - y) > 1e-9 * scale:
        for compare in (operator.lt, operator.le, operator.gt, operator.ge, operator.eq, operator.ne):
            assert compare(one, two) is compare(x, y)


@given(numbers, st.sampled_from(sorted(LENGTHS)), numbers.filter(bool), st.sampled_from(sorted(TIMES)))
def test_products_and_quotients(a: float, unit: str, b: float, other: str) -> None:
    x, y = a * LENGTHS[unit], b * TIMES[other]
    length, time = Quantity(a, unit), Quantity(b, other)
    speed: Any = length / time
    assert close(speed.to("m/s"), x / y)
    assert close((speed * time).to("m"), x)
    assert close((1 / time).to("Hz"), 1 / y)
    assert close((length * length).to("m^2"), x * x)
    assert type(length / length if a else 1.0) is float


@given(numbers, numbers.filter(bool))
def test_a_plain_number_counts_in_the_unit_beside_it(a: float, b: float) -> None:
    quantity = Quantity(a, "km")
    found: list[tuple[Any, float]] = [
        (quantity + b, a + b), (b + quantity, a + b), (quantity - b, a - b), (b - quantity, b - a),
        (quantity * b, a * b), (b * quantity, a * b), (quantity / b, a / b), (-quantity, -a), (+quantity, a),
        (abs(quantity), abs(a)), (sum([quantity, quantity]), a + a), (max(quantity, -1e9), a),
    ]  # fmt: skip
    for value, expected in found:
        assert (float(value), value.unit) == (expected, "km")


@given(numbers.filter(bool), numbers.filter(bool), st.integers(-3, 3))
def test_remainders_and_powers(a: float, b: float, n: int) -> None:
    length, step = Quantity(a, "km"), Quantity(b, "m")
    assert close((length**n).to(f"m^{n}") if n else length**n, (a * 1000) ** n)
    times: Any = length // step
    remainder: Any = length % step
    assert type(times) is float
    assert times * b + remainder.to("m") == pytest.approx(a * 1000, rel=1e-9, abs=1e-9 * abs(b))
    assert abs(length) ** 0.5 == pytest.approx(math.sqrt(abs(a) * 1000))
    whole: list[tuple[Any, float]] = [(length // b, a // b), (length % b, a % b)]
    assert [(float(value), value.unit) for value, _ in whole] == [(number, "km") for _, number in whole]
    assert (b // length, b % length) == (b // a, b % a)


# Quantities in expressions, and what they are in SI units.
NAMES = {
    "t": Quantity(25.4, "min"), "x": Quantity(3, "km"), "y": Quantity(-4, "m"), "a": Quantity(90, "deg"),
    "p": Quantity(50, "%"), "v": Quantity(36, "km/h"), "area": Quantity(9, "km^2"), "n": 7.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("round(t)", 1500), ("floor(-t)", -1560), ("ceil(t)", 1560), ("round(t, 1)", 1524), ("abs(y)", 4),
        ("sqrt(area)", 3000), ("x ** 2", 9e6), ("x ** 0.5", math.sqrt(3000)), ("x // y", -750), ("x % 2", 1000),
        ("hypot(x, y)", math.hypot(3000, 4)), ("atan2(y, x)", math.atan2(-4, 3000)), ("sin(a)", 1),
        ("cos(a / 3)", 0.75**0.5), ("radians(a)", math.pi / 2), ("degrees(a)", 90), ("radians(180)", math.pi),
        ("exp(p)", math.exp(0.5)),
        ("log(p)", math.log(0.5)), ("float(t)", 1524), ("int(x)", 3000), ("v * t", 15240), ("x / v", 300),
        ("max(x, y)", 3000), ("sum([x, y])", 2996), ("[t, n][1]", 7), ("str(x)", "3000.0"), ("2 ** p", 2**0.5),
    ],
)  # fmt: skip
def test_what_has_no_unit_counts_in_si(expression: str, expected: float | str) -> None:
    found = evaluate(expression, NAMES)
    if isinstance(expected, str):
        assert found == expected
    else:
        assert counted_in_si(found) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("sin(x)", "sin(x): '3 km' is a length, expected an angle in rad"),
        ("log(t)", "log(t): '25.4 min' is a time, expected a number"),
        ("2 ** t", "2 ** t: '25.4 min' is a time, expected a number"),
        ("x % t", "x % t: '25.4 min' is a time, expected a length in km"),
        ("hypot(x, t)", "hypot(x, t): '25.4 min' is a time, expected a length in km"),
    ],
)
def test_functions_refuse_what_they_are_not_for(expression: str, message: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        evaluate(expression, NAMES)
    assert caught.value.message == message


def test_in_texts() -> None:
    shown = interpolate("${t} min, ${t} s, ${t}, ${x} far, ${x} m. ${x}${t} (${v} m/s) ${n} km", NAMES)
    assert shown == "25.4 min, 1524.0 s, 1524.0, 3000.0 far, 3000.0 m. 3000.01524.0 (10.0 m/s) 7.0 km"


@pytest.mark.parametrize("sign", [operator.add, operator.sub, operator.lt, operator.eq])
def test_what_does_not_go_together(sign: Callable[[Any, Any], object]) -> None:
    with pytest.raises(UnitError, match=r"^'3 s' is a time, expected a length in m$"):
        sign(Quantity(2, "m"), Quantity(3, "s"))


def test_parameters_convert_and_refuse() -> None:
    quantity = Quantity(1.5, "km")
    assert Parameter(float, unit="m").convert(quantity) == 1500.0
    assert type(Parameter(float, unit="km").convert(quantity)) is float
    assert Parameter(float).convert(quantity) == Parameter(float).convert("1.5 km") == 1500.0
    assert Parameter(object).convert([quantity, "1.5 km"]) == [1500.0, "1.5 km"]
    assert Parameter(float, unit="1").convert("50 %") == 0.5
    assert Parameter(float, unit="deg").convert(Quantity(math.pi, "rad")) == 180.0
    assert Parameter(float, unit="m").convert(Quantity(math.inf, "km")) == math.inf
    with pytest.raises(ParameterError, match=r"^'1.5 km' is a length, expected a time in s$"):
        Parameter(float, unit="s").convert(quantity)
    with pytest.raises(ParameterError, match=r"^'1.5 km' is a length, expected a number$"):
        Parameter(int).convert(quantity)
    with pytest.raises(ParameterError, match=r"^'1.5 mile' has the unknown unit 'mile'"):
        Parameter(float).convert("1.5 mile")
    for text in ("fast", "2", "1,5", "1.5 5"):
        with pytest.raises(ParameterError, match=rf"^'{text}' is not a number$"):
            Parameter(float).convert(text)


def test_a_unit_may_not_grow_without_end() -> None:
    value: float = Quantity(1.0, "kg")
    for _ in range(40):
        value = value * Quantity(1.0, "kg")
        assert parse_unit(getattr(value, "unit", "1"))  # what stands in a message can be written into a model
    assert value == 1.0


def test_quantities_travel_and_can_be_laid_off() -> None:
    quantity = Quantity(2.5, "m/s")
    for rebuilt in (pickle.loads(pickle.dumps(quantity)), copy.deepcopy(quantity)):
        assert (type(rebuilt), float(rebuilt), rebuilt.unit) == (Quantity, 2.5, "m/s")
    assert repr(quantity) == "2.5 m/s"
    assert str(quantity) == "2.5"
    assert hash(quantity) == hash(2.5)
    laid_off: Any = plain({"a": [quantity, 1], "b": "x"})
    assert laid_off == {"a": [2.5, 1], "b": "x"}
    assert type(laid_off["a"][0]) is float


def test_what_is_drawn_counts_in_the_unit_of_the_parameter() -> None:
    given: Any = {"type": "Exponential", "mean": Quantity(25, "min")}
    for mean in (Quantity(25, "min"), "25 min", 1500):
        found: Any = Parameter(Distribution, unit="s").convert({"type": "Exponential", "mean": mean})
        assert found.mean == 1500.0
    assert Parameter(Distribution).convert(given).mean == 1500.0  # type: ignore[attr-defined]
    assert Exponential(mean="25 min").mean == 1500.0
    assert Server("s", distribution={"type": "Gamma", "mean": "2 min", "shape": 3}).distribution.mean == 120.0


def test_quantities_that_are_equal() -> None:
    one, same, more = Quantity(1.0, "km"), Quantity(1000.0, "m"), Quantity(1.5, "km")
    assert (one <= same, one >= same, one < same, one > same, one == same, one != same) == (
        True, True, False, False, True, False,
    )  # fmt: skip
    assert (one <= more, one < more, one >= more, one > more, one == more) == (True, True, False, False, False)
    assert (abs(-one).to("m"), abs(one).to("m"), (-one).to("m"), (+one).to("m")) == (1000.0, 1000.0, -1000.0, 1000.0)
    assert (more // one, more % one, divmod(more, one)) == (1.0, Quantity(0.5, "km"), (1.0, Quantity(0.5, "km")))
