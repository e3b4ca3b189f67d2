"""Quantity: a number that keeps its unit through calculations that have one."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from .elementary import power as power_of
from .units import UnitError, between, is_compound, parse_unit

MAX_DEPTH = 100  # of nested lists and mappings, in files and in values of expressions


def _compared(compare: Callable[[float, float], bool]) -> Callable[[Quantity, float], bool]:
    return lambda quantity, other: compare(float(quantity), quantity._beside(other))


class Quantity(float):
    """A float in ``unit``.

    Sums, differences, remainders and comparisons convert the other side; products, quotients and whole powers make a
    new unit; a plain number takes the other side's unit.  Where no unit is required, ``si`` is the number. Raises
    ``UnitError`` if units do not fit together.
    """

    __slots__ = ("unit",)
    unit: str

    def __new__(cls, value: float, unit: str) -> Quantity:
        made = super().__new__(cls, value)
        made.unit = unit
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return Quantity, (float(self), self.unit)

    def __repr__(self) -> str:
        return f"{float(self)!r} {self.unit}"

    __str__ = float.__repr__

    def to(self, unit: str) -> float:
        """The number in another unit."""
        number = float(self)
        if unit == self.unit:
            return number
        return _times(number, *between(self.unit, unit, f"{number:g} {self.unit}"), self.unit, unit)

    @property
    def si(self) -> float:
        """The number in SI units."""
        unit = parse_unit(self.unit)
        return _times(float(self), unit.scale, unit.pi_power, self.unit, "SI units")

    def _beside(self, other: float) -> float:
        """The other side of a sum or comparison, in this unit."""
        return other.to(self.unit) if isinstance(other, Quantity) else float(other)

    def __add__(self, other: float) -> Quantity:
        return Quantity(float(self) + self._beside(other), self.unit)

    __radd__ = __add__

    def __sub__(self, other: float) -> Quantity:
        return Quantity(float(self) - self._beside(other), self.unit)

    def __rsub__(self, other: float) -> Quantity:
        return Quantity(self._beside(other) - float(self), self.unit)

    def __mul__(self, other: float) -> float:
        return _in(float(self) * float(other), self.unit, "*", other)

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> float:
        return _in(float(self) / float(other), self.unit, "/", other)

    def __rtruediv__(self, other: float) -> float:
        return _in(float(other) / float(self), "1", "/", self)  # other is not a Quantity here

    def __mod__(self, other: float) -> Quantity:
        return Quantity(float(self) % self._beside(other), self.unit)

    def __rmod__(self, other: float) -> Quantity:
        return Quantity(self._beside(other) % float(self), self.unit)

    def __floordiv__(self, other: float) -> float:
        if isinstance(other, Quantity):  # how many times the other goes into it
            return float(self) // self._beside(other)
        return Quantity(float(self) // float(other), self.unit)

    def __rfloordiv__(self, other: float) -> float:
        return self._beside(other) // float(self)

    def __pow__(self, exponent: float, modulus: None = None) -> Any:
        power = exponent.to("1") if isinstance(exponent, Quantity) else exponent
        if not float(power).is_integer():
            return power_of(self.si, power)
        unit = f"{self.unit if self.unit.isalpha() else f'({self.unit})'}^{int(power)}"
        return (
            Quantity(power_of(float(self), int(power)), unit) if _is_readable(unit) else power_of(self.si, int(power))
        )

    def __rpow__(self, base: float, modulus: None = None) -> Any:
        return power_of(base, self.to("1"))

    def __neg__(self) -> Quantity:
        return Quantity(-float(self), self.unit)

    def __pos__(self) -> Quantity:
        return self

    def __abs__(self) -> Quantity:
        return Quantity(abs(float(self)), self.unit)

    __lt__ = _compared(operator.lt)
    __le__ = _compared(operator.le)
    __gt__ = _compared(operator.gt)
    __ge__ = _compared(operator.ge)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, (int, float)) and float(self) == self._beside(other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    # As for all floats: two that are equal as plain numbers have equal hashes.
    __hash__ = float.__hash__


def _times(number: float, factor: Fraction, pi_power: int, unit: str, wanted: str) -> float:
    if not math.isfinite(number) or (factor == 1 and not pi_power):
        return number
    exact = Fraction(number) * factor
    try:
        return float(exact * Fraction(math.pi) ** pi_power if pi_power else exact)
    except OverflowError:
        raise UnitError(f"{number:g} {unit} is too large for a number in {wanted}") from None


def _in(number: float, unit: str, sign: str, other: float) -> float:
    """A product or quotient with its unit; a plain number if that is 1 or too long, then in SI units."""
    if not isinstance(other, Quantity):
        return Quantity(number, unit)
    if unit == other.unit and sign == "/":
        return number
    text = f"{unit}{sign}({other.unit})" if is_compound(other.unit) else f"{unit}{sign}{other.unit}"
    if _is_readable(text):
        return Quantity(number, text)
    whole = parse_unit(unit) * parse_unit(other.unit) ** (1 if sign == "*" else -1)
    return _times(number, whole.scale, whole.pi_power, text, "SI units")


def _is_readable(unit: str) -> bool:
    try:
        parse_unit(unit)
    except UnitError:  # powers, or a text, that grow without end
        return False
    return True


def is_too_deep(value: object) -> bool:
    """Whether lists and mappings are nested more than ``MAX_DEPTH`` levels deep."""
    level: list[Any] = [value]
    for _ in range(MAX_DEPTH + 1):
        # Shared values are visited once: a few lists could otherwise hold too many to count.
        holders = {id(each): each for each in level if isinstance(each, (list, tuple, dict))}.values()
        if not holders:
            return False
        level = [inner for each in holders for inner in (each.values() if isinstance(each, dict) else each)]
    return True


def plain(value: object) -> object:
    """The value with every ``Quantity`` in it, at any depth, as a plain float."""
    return _each_quantity(float, value)


def counted_in_si(value: object) -> object:
    """The value with every ``Quantity`` in it, at any depth, as a plain float in SI units."""
    return _each_quantity(lambda quantity: quantity.si, value)


def _each_quantity(change: Callable[[Quantity], float], value: object) -> object:
    if isinstance(value, Quantity):
        return change(value)
    if isinstance(value, list):
        return [_each_quantity(change, item) for item in value]
    if isinstance(value, dict):
        return {key: _each_quantity(change, item) for key, item in value.items()}
    return value
