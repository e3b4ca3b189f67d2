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

from epicycle.actors import Parameter, ParameterError, Quantity, UnitError, plain

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
    assert type(quantity**2) is type(quantity // 2) is type(math.sqrt(abs(quantity))) is float


@pytest.mark.parametrize("sign", [operator.add, operator.sub, operator.lt, operator.eq])
def test_what_does_not_go_together(sign: Callable[[Any, Any], object]) -> None:
    with pytest.raises(UnitError, match=r"^'3 s' is a time, expected a length in m$"):
        sign(Quantity(2, "m"), Quantity(3, "s"))


def test_parameters_convert_and_refuse() -> None:
    quantity = Quantity(1.5, "km")
    assert Parameter(float, unit="m").convert(quantity) == 1500.0
    assert type(Parameter(float, unit="km").convert(quantity)) is float
    assert type(Parameter(float).convert(quantity)) is float  # no unit: as counted
    assert Parameter(float, unit="deg").convert(Quantity(math.pi, "rad")) == 180.0
    assert Parameter(float, unit="m").convert(Quantity(math.inf, "km")) == math.inf
    with pytest.raises(ParameterError, match=r"^'1.5 km' is a length, expected a time in s$"):
        Parameter(float, unit="s").convert(quantity)


def test_a_unit_may_not_grow_without_end() -> None:
    value: float = Quantity(1.0, "kg")
    for _ in range(40):
        value = value * Quantity(1.0, "kg")
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
