"""Digests are those in the repository, here and with the libraries of another machine; ``make portable`` tries more."""

from __future__ import annotations

import json

import pytest

from epicycle.actors.core import elementary

from .digests import ONE_ARGUMENT, TWO_ARGUMENTS, digests, functions, parts, tutorials
from .portable import GOLDEN, Setting, differences, old_libraries, outcome

# Their kernels, which no other model has, take long to compile for another processor.
OWN_KERNELS = ("model flying_observers", "model many_obstacles", "model safe_avoidance")
# What other tests compare: function by function, and with what tutorials show.
ELSEWHERE = ("functions, compiled", "tutorial ")


def test_every_part_has_a_digest_in_the_repository() -> None:
    assert list(json.loads(GOLDEN.read_text())) == [name for name in parts() if name not in tutorials()]


def test_every_function_is_in_it() -> None:
    assert {*ONE_ARGUMENT, *TWO_ARGUMENTS, "distance"} <= set(elementary.__all__)
    assert {*elementary.__all__} - {*ONE_ARGUMENT, *TWO_ARGUMENTS} <= {"distance", "power", "total", "log_gamma"}


@pytest.mark.slow  # tests/actors/core/elementary compares each function by itself
def test_compiled_functions_have_the_same_bits() -> None:
    assert functions(compiled=True) == functions()


@pytest.mark.parametrize("name", [name for name in parts() if not name.startswith(ELSEWHERE)])
def test_digests_hold(name: str) -> None:
    assert dict(digests([name])) == {name: json.loads(GOLDEN.read_text())[name]}


@pytest.mark.slow  # which compiles all kernels for another processor
def test_digests_hold_with_the_libraries_of_an_old_processor() -> None:
    golden = json.loads(GOLDEN.read_text())
    # The rest is compared as it is: above, and with what tutorials show.  `make portable` does it all.
    parts = tuple(name for name in golden if name not in OWN_KERNELS)
    found, wrong, _ = outcome(Setting("old", {**old_libraries(), "PYTHONHASHSEED": "2"}, parts=parts))
    assert wrong == ""
    assert tuple(found) == parts
    assert differences(found, golden) == []
