"""Quantity: a number that remembers its unit, as long as it is calculated with in ways that keep one."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

from .units import UnitError, between, is_compound, parse_unit


class Quantity(float):
    """A float that is counted in ``unit``.

    Sums, differences and comparisons convert the other side, products and quotients make a new unit, a plain number
    counts in whatever unit is beside it; all else (``**``, ``round``, ``math``) gives a plain float.  Raises
    ``UnitError`` where units do not go together.
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
        """The number counted in another unit."""
        number = float(self)
        if unit == self.unit:
            return number
        factor, pi_power = between(self.unit, unit, f"{number:g} {self.unit}")
        if not math.isfinite(number):
            return number
        return float(Fraction(number) * factor * Fraction(math.pi) ** pi_power)

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
        return _in(float(other) / float(self), "1", "/", self)  # other is no Quantity here

    def __neg__(self) -> Quantity:
        return Quantity(-float(self), self.unit)

    def __pos__(self) -> Quantity:
        return self

    def __abs__(self) -> Quantity:
        return Quantity(abs(float(self)), self.unit)

    def __lt__(self, other: float) -> bool:
        return float(self) < self._beside(other)

    def __le__(self, other: float) -> bool:
        return float(self) <= self._beside(other)

    def __gt__(self, other: float) -> bool:
        return float(self) > self._beside(other)

    def __ge__(self, other: float) -> bool:
        return float(self) >= self._beside(other)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, (int, float)) and float(self) == self._beside(other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    # As for all floats: of two that are equal as plain numbers, the hashes are equal.
    __hash__ = float.__hash__


def _in(number: float, unit: str, sign: str, other: float) -> float:
    """A product or quotient with its unit; plain if that is none, or gets too long."""
    if not isinstance(other, Quantity):
        return Quantity(number, unit)
    if unit == other.unit and sign == "/":
        return number
    text = f"{unit}{sign}({other.unit})" if is_compound(other.unit) else f"{unit}{sign}{other.unit}"
    try:
        parse_unit(text)
    except UnitError:  # powers, or a text, without end
        return number
    return Quantity(number, text)


def plain(value: object) -> object:
    """The value with every ``Quantity`` in it, at any depth, as a plain float."""
    if isinstance(value, Quantity):
        return float(value)
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return value
