"""Small arrays: what NumPy makes of them, in each core."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from epicycle.actors.robotics.arrays import all_finite, array_of, finite, floats, joined, read_only, stacked

GRID = np.arange(6.0).reshape(2, 3)
ARRAYS = [
    np.array([1.5, -0.0]), np.array(2.0), GRID, GRID.T, GRID[:, ::2], np.array([1, 2]),
    np.array([1.0, 2.0], np.float32),
    np.array([1.0, 2.0], ">f8"), np.empty((0, 2)), np.ma.masked_array([1.0, 2.0], mask=True),
]  # fmt: skip


@pytest.mark.parametrize("given", [*ARRAYS, (1.0, 2.0), (1, 2.5), [1.0, 2.0], [[1, 2], [3, 4]], (), np.float64(3.0)])
def test_copies_that_nobody_writes_to(given: Any) -> None:
    made, wanted = read_only(given), np.array(given, np.float64)
    assert (type(made), made.dtype, made.base, made.flags.writeable) == (np.ndarray, wanted.dtype, None, False)
    assert made is not given
    assert made.flags.c_contiguous
    np.testing.assert_array_equal(made, wanted)


@pytest.mark.parametrize("given", [(1.0, -0.0, math.inf), (1, 2.5), (np.float64(1.0),), (), [1.0, 2.0]])
def test_arrays_of_numbers(given: Any) -> None:
    made = array_of(given)
    assert (made.dtype, made.flags.writeable, made.shape) == (np.dtype(float), True, (len(given),))
    assert made.tobytes() == np.array(given, float).tobytes()


@pytest.mark.parametrize("given", [*(each for each in ARRAYS if each.ndim == 1), [1, 2.5], (1.0, 2.0)])
def test_floats(given: Any) -> None:
    assert floats(given) == tuple(np.asarray(given, float).tolist())
    assert all(type(each) is float for each in floats(given))


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("given", ARRAYS[:8])
def test_what_is_finite(given: Any, odd: float) -> None:
    assert finite(given)
    assert all_finite(np.ravel(given).tolist())
    changed = np.array(given, float)
    changed.flat[-1] = odd
    assert not finite(changed)
    assert not all_finite(changed.ravel().tolist())
    assert all_finite([1e308, 1e308, -1e308])


@pytest.mark.parametrize("given", [*ARRAYS[2:7], np.empty((0, 2))])
def test_numbers_before_an_array(given: Any) -> None:
    assert joined((1.0, 2), given).tolist() == [1.0, 2.0, *np.ravel(given).tolist()]


def test_tables() -> None:
    rows = [array_of((1.0, 2.0)), array_of(()), array_of((3.0, 4.0, 5.0))]
    assert stacked(rows, 2).tolist() == [[1.0, 2.0, 0.0], [0.0, 0.0, 0.0], [3.0, 4.0, 5.0]]
    assert stacked(rows[:1], 3).tolist() == [[1.0, 2.0, 0.0]]
    assert stacked([], 4).shape == (0, 4)
