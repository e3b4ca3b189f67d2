"""Values as people and programs are shown them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from epicycle.runner.support.shown import finite, in_time, in_words, rounded, short, six_digits


@dataclass(frozen=True)
class Point:
    x: float
    name: str = "p"


@pytest.mark.parametrize(
    ("value", "words"),
    [(None, "none"), (True, "yes"), (False, "no"), (3, "3"), (2.5, "2.5"), (1 / 3, "0.333333"), ("a b", "a b")],
)
def test_values_in_words(value: object, words: str) -> None:
    assert in_words(value) == words


def test_values_in_words_to_some_digits() -> None:
    assert [in_words(value, digits=4) for value in (1 / 3, 99_999.0, 123_456.0)] == ["0.3333", "1e+05", "123456"]
    assert in_words(None, nothing="-") == "-"


@pytest.mark.parametrize(
    ("value", "line"),
    [
        (1 / 3, "0.333333"),
        ([1.0, np.array([2, 3])], "[1, [2, 3]]"),
        (Point(0.1), "Point(x=0.1, name=p)"),
        ("two\n lines", "two lines"),
        ("x" * 101, "x" * 97 + "..."),
        (None, "None"),
    ],
)
def test_values_in_a_short_line(value: object, line: str) -> None:
    assert short(value) == line


def test_plain_data_for_programs() -> None:
    value = {"a": [math.nan, 1 / 3, (math.inf, True)], "b": "nan"}
    assert finite(value) == {"a": [None, 1 / 3, [None, True]], "b": "nan"}
    assert six_digits([1 / 3, 2, "x"]) == [0.333333, 2, "x"]


def test_numbers_have_the_digits_of_their_interval() -> None:
    assert rounded(4.8123, 2 * 0.0567) == "4.812"
    assert rounded(4.8123, 2 * 0.567) == "4.81"
    assert rounded(1234.5, 2 * 56.7) == "1,234"
    assert rounded(4.8123, 0.0) == "4.8123"
    assert rounded(4.8123, math.inf) == "4.8123"
    assert rounded(math.nan, 1.0) == "–"


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (0.0, "0 s"), (1e-9, "1e-09 s"), (40.25, "40.25 s"), (119.5, "119.5 s"), (120.0, "2 min"), (425.4, "7 min 5 s"),
        (28_800.0, "8 h"), (3_659.6, "1 h 1 min"), (90_061.0, "1 d 1 h 1 min 1 s"), (math.inf, "inf s"), (-3.0, "-3 s"),
    ],
)  # fmt: skip
def test_durations(seconds: float, told: str) -> None:
    assert in_time(seconds) == told
