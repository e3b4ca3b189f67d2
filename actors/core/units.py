"""Units of measurement: converts `8 m/s`, `100 ms` or `90 deg` to a number in the unit of a parameter.

Factors are exact fractions (of pi, for degrees) and become a float once, at the end, so that `100 ms` is
0.1 s to the last bit.
"""

import functools
import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from .errors import FaultError
from .messages import brief, nearest

MAX_TEXT = 100
_MAX_EXPONENT = 20
_MAX_BITS = 1_000
_MAX_DECIMAL_EXPONENT = 400

_AXES: Final = ("m", "kg", "s", "A", "K", "bit")
_NONE: Final = (0,) * len(_AXES)


class UnitError(FaultError):
    """A unit that is unknown, or not of the required kind."""

    kind = "unit"


class _UnreadableError(UnitError):
    """Text that is no unit."""


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit as `scale * pi**pi_power` times a product of powers of m, kg, s, A, K and bit, in this order.

    An angle is a number: rad is 1.
    """

    scale: Fraction = Fraction(1)
    pi_power: int = 0
    dimension: tuple[int, ...] = _NONE

    @property
    def factor(self) -> float:
        """The size of the unit in SI units."""
        return _with_pi(self.scale, self.pi_power)

    def __mul__(self, other: "Unit") -> "Unit":
        dimension = tuple(a + b for a, b in zip(self.dimension, other.dimension, strict=True))
        return Unit(self.scale * other.scale, self.pi_power + other.pi_power, dimension)

    def __pow__(self, exponent: int) -> "Unit":
        dimension = tuple(power * exponent for power in self.dimension)
        return Unit(self.scale**exponent, self.pi_power * exponent, dimension)


def _with_pi(scale: Fraction, pi_power: int) -> float:
    return float(scale * Fraction(math.pi) ** pi_power if pi_power else scale)


# --- the known units --------------------------------------------------------------------------------


def _unit(scale: Fraction | int = 1, pi_power: int = 0, **powers: int) -> Unit:
    return Unit(Fraction(scale), pi_power, tuple(powers.get(axis, 0) for axis in _AXES))


_PREFIXES: Final = {
    "n": Fraction(1, 10**9),
    "u": Fraction(1, 10**6),
    "µ": Fraction(1, 10**6),  # the micro sign
    "\u03bc": Fraction(1, 10**6),  # the Greek letter, which looks the same
    "m": Fraction(1, 1000),
    "c": Fraction(1, 100),
    "k": Fraction(1000),
    "M": Fraction(10**6),
    "G": Fraction(10**9),
}
_PREFIXABLE: Final = {
    "m": _unit(m=1),
    "g": _unit(Fraction(1, 1000), kg=1),
    "s": _unit(s=1),
    "A": _unit(A=1),
    "K": _unit(K=1),
    "rad": _unit(),
    "Hz": _unit(s=-1),
    "N": _unit(m=1, kg=1, s=-2),
    "J": _unit(m=2, kg=1, s=-2),
    "W": _unit(m=2, kg=1, s=-3),
    "V": _unit(m=2, kg=1, s=-3, A=-1),
    "Ohm": _unit(m=2, kg=1, s=-3, A=-2),
    "Pa": _unit(m=-1, kg=1, s=-2),
    "L": _unit(Fraction(1, 1000), m=3),
    "bit": _unit(bit=1),
    "byte": _unit(8, bit=1),
}
_UNITS: Final = {
    "1": _unit(),
    "%": _unit(Fraction(1, 100)),
    "deg": _unit(Fraction(1, 180), 1),
    "°": _unit(Fraction(1, 180), 1),
    "min": _unit(60, s=1),
    "h": _unit(3600, s=1),
    "d": _unit(86_400, s=1),
    "day": _unit(86_400, s=1),
    "bar": _unit(100_000, m=-1, kg=1, s=-2),
    **_PREFIXABLE,
    **{
        prefix + name: Unit(factor * unit.scale, unit.pi_power, unit.dimension)
        for name, unit in _PREFIXABLE.items()
        for prefix, factor in _PREFIXES.items()
    },
}
_SUGGESTED: Final = (
    "m", "mm", "cm", "km", "kg", "g", "ns", "us", "ms", "s", "min", "h", "day", "A", "mA", "K", "N", "J",
    "kJ", "W", "kW", "V", "mV", "Ohm", "Pa", "kPa", "bar", "L", "mL", "Hz", "kHz", "MHz", "rad", "mrad", "deg",
    "bit", "kbit", "Mbit", "byte", "kbyte", "Mbyte", "m/s", "km/h", "m/s^2", "rad/s", "deg/s",
)  # fmt: skip
_OFTEN_WRITTEN: Final = {
    "m": "meter meters metre metres",
    "km": "kilometer kilometers kilometre kilometres",
    "g": "gram grams",
    "s": "sec secs second seconds",
    "ms": "msec msecs",
    "us": "usec usecs",
    "min": "mins minute minutes",
    "h": "hr hrs hour hours",
    "day": "days",
    "rad": "radian radians",
    "deg": "degree degrees",
    "N": "newton newtons",
    "J": "joule joules",
    "W": "watt watts",
    "V": "volt volts",
    "Ohm": "ohm ohms Ω",
    "Pa": "pascal pascals",
    "L": "l liter liters litre litres",
    "A": "amp amps",
    "K": "kelvin",
    "Hz": "hertz",
    "%": "percent",
    "bit": "bits",
    "byte": "bytes",
    "m/s": "mps",
    "km/h": "kph kmh kmph",
    "bit/s": "bps",
    "kbit/s": "kbps",
    "Mbit/s": "mbps",
}
_MEANT: Final = {word: unit for unit, words in _OFTEN_WRITTEN.items() for word in words.split()}

_ANGLES: Final = frozenset(("deg", "°", "rad", *(prefix + "rad" for prefix in _PREFIXES)))
_FREQUENCIES: Final = frozenset(("Hz", *(prefix + "Hz" for prefix in _PREFIXES)))
_KINDS: Final = {
    _unit(m=1).dimension: "a length",
    _unit(m=2).dimension: "an area",
    _unit(m=3).dimension: "a volume",
    _unit(s=1).dimension: "a time",
    _unit(m=1, s=-1).dimension: "a speed",
    _unit(m=1, s=-2).dimension: "an acceleration",
    _unit(m=1, s=-3).dimension: "a jerk",
    _unit(kg=1).dimension: "a mass",
    _unit(K=1).dimension: "a temperature",
    _unit(A=1).dimension: "a current",
    _unit(m=2, kg=1).dimension: "a moment of inertia",
    _unit(m=1, kg=1, s=-2).dimension: "a force",
    _unit(m=2, kg=1, s=-2).dimension: "an energy or a torque",
    _unit(m=2, kg=1, s=-3).dimension: "a power",
    _unit(m=2, kg=1, s=-3, A=-1).dimension: "a voltage",
    _unit(m=2, kg=1, s=-3, A=-2).dimension: "a resistance",
    _unit(m=-1, kg=1, s=-2).dimension: "a pressure",
    _unit(bit=1).dimension: "an amount of data",
    _unit(bit=1, s=-1).dimension: "a data rate",
}


# --- reading a unit -----------------------------------------------------------------------------------

_TOKEN: Final = re.compile(
    r"\s*(?:(?P<name>[A-Za-zµ\u03bc%°]+|1(?![0-9]))|(?P<times>[*·⋅](?!\*))|(?P<over>/)|(?P<open>\()|(?P<close>\))"
    r"|(?P<power>(?:\^|\*\*)\s*[-+]?[0-9]{1,3}|[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,3}))"
)
_SUPERSCRIPTS: Final = str.maketrans("⁺⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "+-0123456789")


@functools.lru_cache(maxsize=1024)  # a model has few units and many quantities
def parse_unit(text: str) -> Unit:
    """Return the unit that a text such as `m/s^2`, `m/s²`, `(m/s)^2`, `1/s` or `%` means."""
    if len(text) > MAX_TEXT:
        raise _UnreadableError(f"unreadable unit '{text[:20]}...': it is longer than {MAX_TEXT} characters")
    return _Reader(text).read()


class _Reader:
    """Reads one unit: factors with powers, joined by * and / from left to right."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens: list[tuple[str, str]] = []
        at, end = 0, len(text.rstrip())
        while at < end:
            token = _TOKEN.match(text, at)
            if token is None or token.lastgroup is None:
                raise self._unreadable(f"'{text[at:].strip()[0]}' is not allowed in a unit")
            self._tokens.append((token.lastgroup, token[token.lastgroup]))
            at = token.end()
        self._next = 0

    def read(self) -> Unit:
        unit = self._product()
        if self._next < len(self._tokens):
            kind, text = self._tokens[self._next]
            hint = ", write * between units" if kind in ("name", "open") else ""
            raise self._unreadable(f"'{text}' is not allowed there{hint}")
        return unit

    def _product(self) -> Unit:
        unit = self._power()
        while (kind := self._peek()) in ("times", "over"):
            self._next += 1
            factor = self._power()
            unit = self._bounded(unit * (factor if kind == "times" else factor**-1))
        return unit

    def _power(self) -> Unit:
        unit = self._atom()
        if self._peek() == "power":
            text = self._tokens[self._next][1].translate(_SUPERSCRIPTS).lstrip("^*")
            self._next += 1
            exponent = int(text.replace(" ", ""))
            if abs(exponent) > _MAX_EXPONENT:
                raise self._unreadable(f"the exponent {exponent} is too large")
            unit = self._bounded(unit**exponent)
        return unit

    def _atom(self) -> Unit:
        kind = self._peek()
        if kind == "name":
            name = self._tokens[self._next][1]
            self._next += 1
            if name not in _UNITS:
                meant = _meant(name)
                near = "" if meant is None else f", did you mean '{meant}'?"
                raise UnitError(f"unknown unit '{name}'{near}", meant=meant or "")
            return _UNITS[name]
        if kind == "open":
            self._next += 1
            unit = self._product()
            if self._peek() != "close":
                raise self._unreadable("a '(' is not closed")
            self._next += 1
            return unit
        place = f"before '{self._tokens[self._next][1]}'" if kind else "at the end"
        raise self._unreadable(f"a unit is missing {place}")

    def _peek(self) -> str | None:
        return self._tokens[self._next][0] if self._next < len(self._tokens) else None

    def _bounded(self, unit: Unit) -> Unit:
        """Return the unit if its powers are of reasonable size: powers of powers grow without end."""
        bits = max(unit.scale.numerator.bit_length(), unit.scale.denominator.bit_length())
        if bits > _MAX_BITS or max(map(abs, (unit.pi_power, *unit.dimension))) > _MAX_EXPONENT:
            raise self._unreadable("its powers are too large")
        return unit

    def _unreadable(self, reason: str) -> UnitError:
        return _UnreadableError(f"unreadable unit '{self._text}': {reason}")


def units_like(unit: str) -> tuple[str, ...]:
    """Units that people often write for what a unit measures, itself first; raises ``UnitError``."""
    dimension = parse_unit(unit).dimension
    return tuple(dict.fromkeys([unit, *(each for each in _SUGGESTED if parse_unit(each).dimension == dimension)]))


def _meant(name: str) -> str | None:
    return _MEANT.get(name.casefold()) or nearest(name, _SUGGESTED)


# --- quantities ---------------------------------------------------------------------------------------

_NUMBER: Final = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE]([-+]?[0-9]+))?"
_QUANTITY: Final = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*", re.DOTALL)


def quantity(text: str) -> tuple[float, str] | None:
    """Split `-1.5e3 ms` into the number and the text of the unit, which may be empty; None without a number.

    The unit is not read: `3 mice` gives (3.0, "mice").
    """
    found = _split(text)
    if found is None:
        return None
    try:
        return float(found[0]), found[1]
    except OverflowError:
        return None


def _split(text: str) -> tuple[Fraction, str] | None:
    if len(text) > MAX_TEXT or (found := _QUANTITY.fullmatch(text)) is None:
        return None
    if found[2] and abs(int(found[2])) > _MAX_DECIMAL_EXPONENT:  # a Fraction would write out all the zeros
        return None
    return Fraction(found[1]), found[3]


def convert(value: str | int | float, unit: str) -> float:
    """Return a value in `unit`: a bare number already is, a text may have another unit."""
    try:
        if isinstance(value, str):
            return _convert_text(value, unit)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise UnitError(f"{value!r} is not a number, {_expected(unit, parse_unit(unit))}")
        return float(value)
    except OverflowError:
        shown = brief(value) if isinstance(value, str) else "a number of more than 40 digits"
        raise UnitError(f"{shown} is too large for a float") from None


def in_si(text: str) -> float | None:
    """Return a text with a unit of any kind in SI units; None if it is not a number with a unit."""
    split = _split(text)
    if split is None or not (split[1][:1].isalpha() or split[1][:1] in ("%", "°", "(")):
        return None
    own = _unit_in(text, split[1])
    try:
        return _with_pi(split[0] * own.scale, own.pi_power)
    except OverflowError:
        raise UnitError(f"{brief(text)} is too large for a float") from None


@functools.lru_cache(maxsize=4096)  # the replicas of an actor have the same quantities
def _convert_text(text: str, unit: str) -> float:
    split, wanted = _split(text), parse_unit(unit)
    if split is None:
        raise UnitError(f"{brief(text)} is not a number with a unit, {_expected(unit, wanted)}")
    number, own_text = split
    if not own_text:
        return float(number)
    own = _unit_in(text, own_text)
    _check_kind(text, own_text, own, unit, wanted)
    return _with_pi(number * own.scale / wanted.scale, own.pi_power - wanted.pi_power)


def _unit_in(text: str, unit: str) -> Unit:
    """The unit in a text."""
    try:
        return parse_unit(unit)
    except UnitError as error:
        article = "an" if isinstance(error, _UnreadableError) else "the"
        raise UnitError(f"{brief(text)} has {article} {error}") from None


def between(own: str, wanted: str, shown: str) -> tuple[Fraction, int]:
    """The factor from one unit to another, and the power of pi to multiply it by.

    Raises ``UnitError`` about the quantity ``shown`` if the two do not measure the same.
    """
    from_unit, to_unit = parse_unit(own), parse_unit(wanted)
    _check_kind(shown, own, from_unit, wanted, to_unit)
    return from_unit.scale / to_unit.scale, from_unit.pi_power - to_unit.pi_power


def is_compound(unit: str) -> bool:
    """Whether a unit needs brackets in a denominator."""
    return any(sign in unit for sign in "*·⋅/")


def _check_kind(shown: str, own_text: str, own: Unit, unit: str, wanted: Unit) -> None:
    if own.dimension != wanted.dimension or _is_turns_for_radians(own_text, unit):
        raise UnitError(f"{brief(shown)} is {_kind(own_text, own)}, {_expected(unit, wanted)}")


def _is_turns_for_radians(first: str, second: str) -> bool:
    """Whether one counts turns (Hz) and the other angles: 1 Hz is 2 pi rad/s, but has the same dimension."""
    one, other = _symbols(first), _symbols(second)
    return bool((one & _FREQUENCIES and other & _ANGLES) or (one & _ANGLES and other & _FREQUENCIES))


def _expected(text: str, unit: Unit) -> str:
    kind = _kind(text, unit)
    if text == "1":
        return f"expected {kind}"
    return f"expected {kind}" if kind.endswith(f" in {text}") else f"expected {kind} in {text}"


def _symbols(text: str) -> set[str]:
    return set(re.findall(r"[^\W\d_]+|°", text))


def _kind(text: str, unit: Unit) -> str:
    """Return what a unit measures, in words; the text distinguishes what the dimension cannot."""
    symbols = _symbols(text)
    if not any(unit.dimension):
        return "an angle" if symbols & _ANGLES else "a number"
    if unit.dimension == _UNITS["Hz"].dimension:
        if symbols & _ANGLES:
            return "an angular speed"
        return "a frequency" if symbols & _FREQUENCIES else "a rate"
    if unit.dimension == (_UNITS["Hz"] ** 2).dimension and symbols & _ANGLES:
        return "an angular acceleration"
    return _KINDS.get(unit.dimension, f"a quantity in {text}")
