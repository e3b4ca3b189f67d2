"""Small matrices as tuples."""

import importlib

import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import PREFIX

vectors = importlib.import_module(PREFIX + "vectors")


@pytest.mark.parametrize("d", [2, 3])
def test_inverses_and_who_is_positive_definite(random: np.random.Generator, d: int) -> None:
    found = []
    for _ in range(200):
        matrix = random.normal(size=(d, d))
        matrix = random.normal() * np.eye(d) + matrix + matrix.T
        is_definite, inverse = vectors.inverse_of(tuple(matrix[np.triu_indices(d)].tolist()), (0.0,) * d * d)
        assert np.reshape(inverse, (d, d)) == pytest.approx(np.linalg.inv(matrix), rel=1e-6)
        assert is_definite == (np.linalg.eigvalsh(matrix).min() > 0.0)
        found.append((is_definite, np.linalg.eigvalsh(matrix).max() < 0.0))
    assert set(found) == {(True, False), (False, True), (False, False)}
