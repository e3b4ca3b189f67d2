"""Which port types go together: shapes of arrays against all arrays that they stand for, and types from text."""

from __future__ import annotations

import pickle
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epicycle.actors import Actor, FaultError, InputPort, Measurement, OutputPort, Vehicle, accepts, shaped, type_name
from epicycle.runner.model.catalogue.port_types import read_type, token_types
from epicycle.runner.model.catalogue.types import built_in

SIZES = (1, 2, 3)
CONCRETE = [shape for length in (0, 1, 2) for shape in product(SIZES, repeat=length)]
shapes = st.lists(st.one_of(st.none(), st.sampled_from(SIZES)), max_size=2).map(tuple)


def stands_for(shape: tuple[int | None, ...]) -> set[tuple[int, ...]]:
    return {
        each
        for each in CONCRETE
        if len(each) == len(shape) and all(size is None or size == n for size, n in zip(shape, each, strict=True))
    }


@given(shapes, shapes)
def test_shapes(wanted: tuple[int | None, ...], given_: tuple[int | None, ...]) -> None:
    one, other = shaped(np.ndarray, wanted), shaped(np.ndarray, given_)
    fits = stands_for(given_) <= stands_for(wanted)
    assert accepts(one, other) is fits
    assert accepts(float | one, other) is fits
    assert accepts(one, other | float) is False
    assert accepts(np.ndarray, other)
    assert accepts(one, np.ndarray)  # it says nothing of its shape
    assert accepts(Any, other)
    assert not accepts(float, other)
    assert not accepts(shaped(list, wanted), other)


def test_declared_on_a_port() -> None:
    class Rows(Actor):
        input = InputPort(np.ndarray, shape=(None, 2))
        output = OutputPort(np.ndarray, shape=(2,))

    assert type_name(Rows.input.type) == "array[n, 2]"
    assert repr(Rows("a").outputs["output"]) == "<output port a.output: array[2]>"
    assert pickle.loads(pickle.dumps(Rows.output.type)) == shaped(np.ndarray, (2,))
    assert type_name(Vehicle.acceleration.type) == "array[n]"


TEXTS: dict[str, Any] = {
    "float": float,
    "any": Any,
    "float | any": Any,
    "int|str | bool": int | str | bool,
    "array": np.ndarray,
    "array[2]": shaped(np.ndarray, (2,)),
    "array[n, 3] | float": shaped(np.ndarray, (None, 3)) | float,
    "list[float]": list[float],
    "dict[str, int | float]": dict[str, int | float],
    "tuple[int, str]": tuple[int, str],
    "Measurement": Measurement,
}


@pytest.mark.parametrize("text", TEXTS)
def test_types_from_text(text: str) -> None:
    found = read_type(text, lambda: token_types(built_in()))
    assert found == TEXTS[text]
    if "any" not in text:
        assert read_type(type_name(found), lambda: token_types(built_in())) == found


@given(st.text("floatin|[],n 2", max_size=30))
def test_no_text_makes_it_crash(text: str) -> None:
    try:
        said = type_name(read_type(text, dict))
    except FaultError as error:
        said = error.message
    assert said
