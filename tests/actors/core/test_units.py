"""Units: what a text with a unit is worth, to the last bit, and what is said when it does not fit."""

import math
import pickle
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors.core.errors import EpicycleError
from epicycle.actors.core.messages import counted
from epicycle.actors.core.units import Unit, UnitError, convert, parse_unit, quantity


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (8, "m/s", 8.0), (2.5, "m/s", 2.5), ("8", "m/s", 8.0), ("8 m/s", "m/s", 8.0),
        ("8m/s", "m/s", 8.0),
        ("100 ms", "s", 0.1), ("0.1 ms", "s", 1e-4), ("3 us", "s", 3e-6), ("7 ns", "s", 7e-9),
        ("2 min", "s", 120.0),
        ("1 h", "s", 3600.0), ("1 day", "s", 86400.0), ("3 d", "h", 72.0), ("36 km/h", "m/s", 10.0),
        ("180 deg", "rad", math.pi),
        ("90 deg/s", "rad/s", math.pi / 2), ("5 °", "rad", math.radians(5)), ("50 %", "1", 0.5),
        ("2 rad", "1", 2.0),
        ("5 1/s", "Hz", 5.0), ("5 Hz", "1/s", 5.0), ("2 kHz", "Hz", 2000.0), ("8 µm", "m", 8e-6),
        ("8 μm", "m", 8e-6),
        ("9.81 m/s²", "m/s^2", 9.81), ("9.81 m/s**2", "m/s²", 9.81), ("9.81 m·s⁻²", "m/s^2", 9.81),
        ("4 (m/s)^2", "m^2/s^2", 4.0), ("3 kg*m^2", "kg*m^2", 3.0), ("8 N*m", "J", 8.0),
        ("1 V", "W/A", 1.0), ("2 Ohm", "V/A", 2.0), ("3 kPa", "N/m^2", 3000.0), ("2 bar", "Pa", 2e5),
        ("3 L/min", "m^3/s", 5e-5), ("20 mL", "L", 0.02),
        ("250 g", "kg", 0.25), ("20 cm", "m", 0.2), ("1 kbyte/s", "bit/s", 8000.0),
        ("300 K", "K", 300.0),
        ("-1.5e3 ms", "s", -1.5), (" +.5 m ", "m", 0.5), ("5. m", "m", 5.0), ("1 m/s/s", "m/s^2", 1.0),
        ("1 m / s ^ 2", "m/s^2", 1.0), (math.inf, "m", math.inf), ("3 s", "ms", 3000.0),
        ("1 m^-1", "1/m", 1.0),
    ],
)  # fmt: skip
def test_convert(value: str | int | float, unit: str, expected: float) -> None:
    result = convert(value, unit)
    assert result == expected
    assert type(result) is float


@pytest.mark.parametrize(
    ("value", "unit", "message"),
    [
        ("8 m", "m/s", "'8 m' is a length, expected a speed in m/s"),
        ("8 s", "m", "'8 s' is a time, expected a length in m"),
        ("8 m/s", "m/s^2", "'8 m/s' is a speed, expected an acceleration in m/s^2"),
        ("8 m/s", "rad/s", "'8 m/s' is a speed, expected an angular speed in rad/s"),
        ("8 deg", "m", "'8 deg' is an angle, expected a length in m"),
        ("8 %", "s", "'8 %' is a number, expected a time in s"),
        ("8 kg", "N", "'8 kg' is a mass, expected a force in N"),
        ("8 m^2", "K", "'8 m^2' is an area, expected a temperature in K"),
        ("8 1/s", "rad/s^2", "'8 1/s' is a rate, expected an angular acceleration in rad/s^2"),
        ("8 Hz", "rad/s", "'8 Hz' is a frequency, expected an angular speed in rad/s"),
        ("8 deg/s", "Hz", "'8 deg/s' is an angular speed, expected a frequency in Hz"),
        ("8 m^5", "m/s", "'8 m^5' is a quantity in m^5, expected a speed in m/s"),
        ("8 s", "m^5", "'8 s' is a time, expected a quantity in m^5"),
        ("8 mps", "m/s", "'8 mps' has the unknown unit 'mps', did you mean 'm/s'?"),
        ("8 KM", "m", "'8 KM' has the unknown unit 'KM', did you mean 'km'?"),
        ("8 seconds", "s", "'8 seconds' has the unknown unit 'seconds', did you mean 's'?"),
        ("3 mice", "m", "'3 mice' has the unknown unit 'mice'"),
        ("8 m//s", "m/s", "'8 m//s' has an unreadable unit 'm//s': a unit is missing before '/'"),
        ("8 m/", "m/s", "'8 m/' has an unreadable unit 'm/': a unit is missing at the end"),
        ("8 (m", "m", "'8 (m' has an unreadable unit '(m': a '(' is not closed"),
        ("8 m)", "m", "'8 m)' has an unreadable unit 'm)': ')' is not allowed there"),
        (
            "8 m s",
            "m*s",
            "'8 m s' has an unreadable unit 'm s': 's' is not allowed there, write * between units",
        ),
        ("8,5 m", "m", "'8,5 m' has an unreadable unit ',5 m': ',' is not allowed in a unit"),
        ("8 m^99", "m", "'8 m^99' has an unreadable unit 'm^99': the exponent 99 is too large"),
        ("8 (m^9)^9", "m", "'8 (m^9)^9' has an unreadable unit '(m^9)^9': its powers are too large"),
        (
            "1 (((((%)^20)^20)^20)^20)^20",
            "1",
            (
                "'1 (((((%)^20)^20)^20)^20)^20' has an unreadable unit '(((((%)^20)^20)^20)^20)^20': "
                "its powers are too large"
            ),
        ),
        ("fast", "m/s", "'fast' is not a number with a unit, expected a speed in m/s"),
        ("", "m", "'' is not a number with a unit, expected a length in m"),
        ("x" * 101, "m", "'" + "x" * 55 + "...' is not a number with a unit, expected a length in m"),
        ("1e999999999 m", "m", "'1e999999999 m' is not a number with a unit, expected a length in m"),
        ("1e400 m", "m", "'1e400 m' is too large for a float"),
        (10**400, "m", "a number of more than 40 digits is too large for a float"),
        (True, "m", "True is not a number, expected a length in m"),
    ],
)
def test_convert_explains_what_does_not_fit(value: str | int | float, unit: str, message: str) -> None:
    with pytest.raises(UnitError) as caught:
        convert(value, unit)
    assert str(caught.value) == message
    assert isinstance(caught.value, EpicycleError)
    assert str(pickle.loads(pickle.dumps(caught.value))) == message


def test_a_unit_may_be_too_long_to_be_read() -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit("m*s/" * 25 + "m")
    assert str(caught.value) == "unreadable unit 'm*s/m*s/m*s/m*s/m*s/...': it is longer than 100 characters"
    assert parse_unit("m*m/" * 24 + "m") == parse_unit("m")


def test_parse_unit() -> None:
    assert parse_unit("m/s^2") == Unit(Fraction(1), 0, (1, 0, -2, 0, 0, 0))
    assert parse_unit("km/h").factor == 1 / 3.6
    assert parse_unit("deg").factor == math.pi / 180
    assert parse_unit("rad") == parse_unit("1") == Unit()
    assert parse_unit("N*m") == parse_unit("J") == parse_unit("kg*m^2/s^2") == parse_unit("W*s")
    assert parse_unit("1/(m*s)") == parse_unit("1/m/s")
    for text in ("", " ", "m^", "10", "^2", "m%m", "x" * 101, "(" * 99):
        with pytest.raises(UnitError):
            parse_unit(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("8 m/s", (8.0, "m/s")), ("8m/s", (8.0, "m/s")), ("-1.5e3 ms", (-1500.0, "ms")),
        ("50 %", (50.0, "%")),
        ("8", (8.0, "")), ("5 1/s", (5.0, "1/s")), ("3 mice", (3.0, "mice")), ("fast", None),
        ("", None),
        ("m 8", None), ("1e999 m", None), ("1e400 m", None), ("٣ m", None), ("${a} m", None),
    ],
)  # fmt: skip
def test_quantity(text: str, expected: tuple[float, str] | None) -> None:
    assert quantity(text) == expected


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_in_its_own_unit_is_kept_exactly(number: float) -> None:
    assert convert(f"{number!r} m/s", "m/s") == number


@given(st.text(max_size=30))
def test_only_unit_errors_come_out(text: str) -> None:
    try:
        convert(text, "m")
        convert("1 " + text, "m")
    except UnitError:
        pass


@pytest.mark.parametrize(
    ("unit", "kind"),
    [
        ("m", "a length"), ("m^2", "an area"), ("m^3", "a volume"), ("s", "a time"), ("m/s", "a speed"),
        ("m/s^2", "an acceleration"), ("m/s^3", "a jerk"), ("kg", "a mass"), ("A", "a current"),
        ("kg*m^2", "a moment of inertia"), ("N", "a force"), ("J", "an energy or a torque"), ("W", "a power"),
        ("N*m", "an energy or a torque"), ("V", "a voltage"), ("V/A", "a resistance"), ("N/m^2", "a pressure"),
        ("bit", "an amount of data"), ("bit/s", "a data rate"), ("deg", "an angle"),
        ("rad/s", "an angular speed"), ("Hz", "a frequency"), ("1/s", "a rate"), ("rad/s^2", "an angular acceleration"),
        ("m^2/s^2", "a quantity in m^2/s^2"),
    ],
)  # fmt: skip
def test_kinds_of_quantities_in_messages(unit: str, kind: str) -> None:
    with pytest.raises(UnitError) as caught:
        convert(f"1 {unit}", "K")
    assert str(caught.value) == f"'1 {unit}' is {kind}, expected a temperature in K"


@pytest.mark.parametrize(
    ("number", "words"), [(0, "0 ports"), (1, "1 port"), (2, "2 ports"), (-1, "-1 ports"), (12_345, "12,345 ports")]
)
def test_counted(number: int, words: str) -> None:
    assert counted(number, "port") == words
