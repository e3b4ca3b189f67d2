"""What declared parameters take, what becomes of it, and what they say of the rest."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors import (
    Configurable,
    MappingParameter,
    Parameter,
    ParameterError,
    any_parameter,
    array_parameter,
    did_you_mean,
    texts_parameter,
)
from epicycle.actors.core.messages import nearest

LARGE = 2**53


@pytest.mark.parametrize(
    ("parameter", "given", "value"),
    [
        (Parameter(float), 2, 2.0),
        (Parameter(float), np.float32(0.5), 0.5),
        (Parameter(float, unit="m"), "250 cm", 2.5),
        (Parameter(float, min=0.0, max=1.0), 0, 0.0),
        (Parameter(float, min=0.0, max=1.0), 1, 1.0),
        (Parameter(float, None), None, None),
        (Parameter(int), 3.0, 3),
        (Parameter(int), LARGE + 1, LARGE + 1),
        (Parameter(int), np.int64(7), 7),
        (Parameter(int | float), 3, 3),
        (Parameter(int | float), 3.0, 3.0),
        (Parameter(bool), np.bool_(True), True),
        (Parameter(str, choices=("a", "b")), "b", "b"),
        (Parameter(Path), "a/b", Path("a/b")),
        (Parameter(object), [1, {"x": None}], [1, {"x": None}]),
        (texts_parameter(), "a", ("a",)),
        (texts_parameter(), ["a", "b"], ("a", "b")),
        (texts_parameter(None), None, None),
        (Parameter(object, shape=(None,)), [1, "a"], (1, "a")),
        (MappingParameter(Parameter(float, unit="m")), {"a": "1 km", "b": 2}, {"a": 1000.0, "b": 2.0}),
        (MappingParameter(Parameter(float), None), None, None),
    ],
)
def test_values(parameter: Parameter[Any], given: object, value: object) -> None:
    found = parameter.convert(given)
    assert (type(found), found) == (type(value), value)


@pytest.mark.parametrize(
    ("parameter", "given", "message"),
    [
        (Parameter(float), None, "a value is missing, expected a number"),
        (Parameter(float), True, "true is not a number"),
        (Parameter(float), [1], "[1] is not a number"),
        (Parameter(float), float("nan"), "nan is not a number"),
        (Parameter(float, min=0.0), -1e-9, "-1e-09 is out of bounds, expected a number >= 0"),
        (Parameter(float, max=2.0, unit="s"), "2001 ms", "2.001 is out of bounds, expected a number in s <= 2"),
        (Parameter(float, min=-1.0, max=1.0), 1.5, "1.5 is out of bounds, expected a number from -1 to 1"),
        (Parameter(float, above=0), 0, "0 is out of bounds, expected a number > 0"),
        (Parameter(float, above=0, max=9), -1, "-1 is out of bounds, expected a number > 0 and <= 9"),
        (
            Parameter(float, above=0, unit="s"),
            9e-10,
            "9e-10 s is shorter than a nanosecond, the shortest time",
        ),
        (array_parameter((None,), above=0), [1.0, 0.0], "0 is out of bounds, expected a list of n numbers > 0"),
        (Parameter(int), 2.5, "2.5 is not an integer"),
        (Parameter(int), float("inf"), "inf is not an integer"),
        (Parameter(int), "3 m", "'3 m' is not an integer"),
        (Parameter(bool), 1, "1 is not true or false"),
        (Parameter(str), 1, "1 is not a text"),
        (Parameter(str, choices=("slow", "fast")), "fats", "'fats' is not one of slow, fast, did you mean 'fast'?"),
        (Parameter(str, choices=("fast",), renamed={"quick": "fast"}), "quick", "'quick' is now called 'fast'"),
        (Parameter(Path), "", "'' is not a file"),
        (Parameter(Path), "a\0b", "'a\\x00b' is not a file"),
        (MappingParameter(Parameter(float)), None, "None is not a mapping of names to number"),
        (MappingParameter(Parameter(float)), {1: 2.0}, "{1: 2.0} is not a mapping of names to number"),
        (MappingParameter(Parameter(float)), {"a": "b"}, "a: 'b' is not a number"),
        (array_parameter((2,)), [1.0], "[1.0] is not a list of 2 numbers"),
        (array_parameter((2,)), 1.0, "1.0 is not a list of 2 numbers"),
        (array_parameter((None, 2)), [[1.0, 2.0], [3.0]], "[[1.0, 2.0], [3.0]] is not a list of n x 2 numbers"),
        (array_parameter((None,), min=0.0), [1.0, -1.0], "-1 is out of bounds, expected a list of n numbers >= 0"),
        (array_parameter((None,), max=0.0), [1.0, -1.0], "1 is out of bounds, expected a list of n numbers <= 0"),
        (array_parameter((None,)), [1.0, float("nan")], "nan is not a list of n numbers"),
        (texts_parameter(), 3, "3 is not a list of texts"),
        (texts_parameter(), ["a", 3], "3 is not a list of texts"),
    ],
)
def test_what_is_refused(parameter: Parameter[Any], given: object, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        parameter.convert(given)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("shape", "given", "expected"),
    [
        ((2,), [1, np.int64(2)], [1.0, 2.0]),
        ((None,), [1, 2.5], [1.0, 2.5]),
        ((None,), (), []),
        ((None,), [LARGE + 2], [LARGE + 2.0]),
        ((None, 2), [[1, 2], (3, 4)], [[1.0, 2.0], [3.0, 4.0]]),
        ((None, 2), [], np.empty((0, 2)).tolist()),
        ((2, None), [[], []], np.empty((2, 0)).tolist()),
    ],
)
def test_arrays(shape: tuple[int | None, ...], given: Any, expected: Any) -> None:
    found = array_parameter(shape).convert(given)
    assert isinstance(found, np.ndarray)
    assert (found.dtype, found.tolist(), found.ndim) == (np.dtype(float), expected, len(shape))
    assert found.shape[1:] == tuple(size or 0 for size in shape[1:])
    assert not found.flags.writeable


class Part(Configurable):
    """Base of parts."""


class Wheel(Part):
    """One part."""

    size = Parameter(float, 1.0)
    name = Parameter(str, "w")


class _Secret(Part):
    """Not offered."""


class Whole(Configurable):
    """Has a part, and parameters named as no name in Python may be."""

    from_ = Parameter(float)
    part: Parameter[Part] = Parameter(Part, Wheel(), unit="m")
    list = array_parameter((None,), (1.0,))


def test_a_part_is_made_from_a_mapping_and_counts_in_the_unit_around_it() -> None:
    whole = Whole(part={"type": "Wheel", "size": "50 cm"}, **{"from": 3})
    assert isinstance(whole.part, Wheel)
    assert (whole.part.size, whole.part.name, whole.from_) == (0.5, "w", 3.0)
    assert repr(whole) == "Whole(from=3.0, part=Wheel(size=0.5))"
    assert repr(Whole(**{"from": 3})) == repr(Whole(from_=3)) == "Whole(from=3.0)"
    assert Whole(part=whole.part, **{"from": 1}).part is whole.part


@pytest.mark.parametrize(
    ("values", "kind", "meant"),
    [
        ({"fro": 1}, "parameter", "from"),
        ({"from": 1, "part": {"type": "Whel"}}, "type", "Wheel"),
        ({"from": 1, "part": {"type": "Wheel", "size": "0 meters"}}, "unit", "0 m"),
        ({"from": 1, "part": {"type": "Wheel", "size": "1 s"}}, "unit", "1 m"),
        ({"from": 1, "part": {"type": "Wheel", "size": "wide"}}, "unit", ""),
        ({"from": 1, "part": 3}, "", ""),
    ],
)
def test_what_a_program_may_write_instead(values: dict[str, Any], kind: str, meant: str) -> None:
    with pytest.raises(ParameterError) as caught:
        Whole(**values)
    [fault] = caught.value.faults
    assert (fault.kind, fault.meant) == (kind, meant)


@pytest.mark.parametrize(
    ("values", "message", "keys"),
    [
        ({}, "Whole needs a value for 'from'", ()),
        ({"fro": 1}, "Whole has no parameter 'fro', did you mean 'from'? valid parameters: from, part, list", ("fro",)),
        ({"zzz": 1}, "Whole has no parameter 'zzz'; valid parameters: from, part, list", ("zzz",)),
        ({"from": "x"}, "Whole.from: 'x' is not a number", ("from",)),
        (
            {"from": 1, "part": {"type": "Wheel", "self": 1}},
            "Whole.part: Wheel has no parameter 'self'; valid parameters: size, name",
            ("part", "self"),
        ),
        ({"from": 1, "part": 3}, "Whole.part: 3 is not a mapping {type: ...} with one of the types Wheel", ("part",)),
        ({"from": 1, "part": {}}, "Whole.part: {} has no 'type'; expected one of Wheel", ("part",)),
        (
            {"from": 1, "part": {"type": "Whel"}},
            "Whole.part: 'Whel' is not one of Wheel, did you mean 'Wheel'?",
            ("part", "type"),
        ),
        ({"from": 1, "part": {"type": "_Secret"}}, "Whole.part: '_Secret' is not one of Wheel", ("part", "type")),
        (
            {"from": 1, "part": {"type": "Wheel", "size": "1 s"}},
            "Whole.part: Wheel.size: '1 s' is a time, expected a length in m",
            ("part", "size"),
        ),
        (
            {"from": 1, "part": {"type": "Wheel", "sise": 1}},
            "Whole.part: Wheel has no parameter 'sise', did you mean 'size'? valid parameters: size, name",
            ("part", "sise"),
        ),
    ],
)
def test_what_is_wrong_with_parts(values: dict[str, Any], message: str, keys: tuple[str, ...]) -> None:
    with pytest.raises(ParameterError) as caught:
        Whole(**values)
    assert (str(caught.value), caught.value.keys) == (message, keys)


def test_reserved_names() -> None:
    for name in ("type", "count", "priority", "tags"):
        with pytest.raises(TypeError) as caught:
            type("Bad", (Configurable,), {name: Parameter(float)})
        assert str(caught.value) == f"Bad: a parameter must not be named {name!r}"


def test_a_parameter_is_read_when_it_is_set() -> None:
    whole = Whole.__new__(Whole)
    with pytest.raises(AttributeError) as caught:
        _ = whole.from_
    assert str(caught.value) == "Whole.from was read before it was set"


@pytest.mark.parametrize(
    ("number", "text"),
    [(2.0, "2"), (-3.0, "-3"), (1e14, "100000000000000"), (1e15, "1e+15"), (0.5, "0.5"), (10**19, "1" + 19 * "0")],
)
def test_numbers_in_messages(number: float, text: str) -> None:
    with pytest.raises(ParameterError) as caught:
        Parameter(int if isinstance(number, int) else float, max=-1e300).convert(number)
    assert str(caught.value).startswith(f"{text} is out of bounds")


def test_the_nearest_of_many_names_is_found_by_its_ends() -> None:
    """Beyond a hundred, only those are compared that share most letters at the start and at the end."""
    others = [f"a{number:03d}" for number in range(300)]
    assert nearest("abcdefgh", [*others, "zbcdefgh"]) == "zbcdefgh"
    assert nearest("abcdefgh", [*others, "abcdefgz"]) == "abcdefgz"
    assert nearest("abcdefgh", [*others, "abcdefgh"]) is None  # it is there, so it was not meant to be another
    assert nearest("Robot", ["robot", "ROBOT"]) == "robot"
    assert nearest("x" * 201, ["x" * 200]) is None
    assert nearest("x" * 200, ["x" * 199]) == "x" * 199
    assert nearest("abcd", ["abxy"]) is None
    assert nearest("abcd", ["abxy"], likeness=0.5) == "abxy"
    assert nearest("abcd", [*[f"n{number}" for number in range(2000)], "abce"]) is None
    assert nearest("abcd", [*[f"n{number}" for number in range(1999)], "abce"]) == "abce"
    assert (did_you_mean("ab", ["abc"]), did_you_mean("ab", ["xyz"])) == (", did you mean 'abc'?", "")


def test_the_name_that_was_meant_is_found_in_good_time_among_many() -> None:
    """Names of the same letters in another order are the dearest to compare."""
    random = np.random.default_rng(3)
    letters = np.array(list("abcdefghijklmnopqrstuvwxyz" * 7))
    asked, *names = ["".join(random.permutation(letters)) for _ in range(1_501)]

    def seconds(some: list[str]) -> float:
        start = time.process_time()
        assert nearest(asked, some) is None
        return time.process_time() - start

    assert seconds(names) < 5 * seconds(names[:100]) + 0.05
    assert nearest(asked, [*names, f"{asked[:-3]}123"]) == f"{asked[:-3]}123"


def test_any_value() -> None:
    assert any_parameter().describe_type() == "any value"
    assert any_parameter((1, "x"), shape=(None,)).default_value == (1, "x")
    assert any_parameter(None).convert(None) is None


@pytest.mark.parametrize("kind", [list[float], np.ndarray, list, dict, complex, float | str, "float"])
def test_types_that_no_parameter_can_have(kind: Any) -> None:
    name = kind.__name__ if type(kind) is type else str(kind)
    with pytest.raises(TypeError) as raised:
        Parameter(kind, None)
    assert str(raised.value) == (
        f"a parameter cannot have the type {name}: take float, int, bool, str, Path, object or a Configurable class; "
        "for a list of numbers Parameter(float, shape=(None,)), for an array array_parameter((None,)), for texts "
        "texts_parameter(), for any list or mapping Parameter(object)"
    )
