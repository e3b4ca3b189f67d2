"""The way into kernels: by their address in the compiled core, by numba's own otherwise."""

from __future__ import annotations

import copy
import importlib
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors.compiled import CORE
from tests.actors.robotics.numerics.numerics_parts import PREFIX, information, reachability

warm_up = importlib.import_module(PREFIX + "warm_up")
compiled = importlib.import_module(PREFIX + "compiled")

needs_addresses = pytest.mark.skipif(
    CORE != "compiled" or not compiled.IS_READY,
    reason="kernels are called by their address in the compiled core, once they are compiled",
)


def as_python(kernel: Any) -> Any:
    """The function that a kernel is made of."""
    _, (module, name) = kernel.__reduce__()
    return next(function for function in compiled.KERNELS[module] if function.__name__ == name)


@needs_addresses
def test_python_gives_the_same(random: np.random.Generator) -> None:
    points, ends = random.normal(size=(9, 2)), random.normal(size=(3, 4, 2))
    found = information.pairwise_distance(points, ends, 2.0)
    assert found.tobytes() == as_python(information.pairwise_distance)(points, ends, 2.0).tobytes()
    assert found.flags.c_contiguous
    assert found.flags.writeable
    assert found.flags.owndata
    plans, radius = random.normal(size=(2, 7)), random.uniform(size=5)
    plans[:, 1:3] = 2, 0  # dimensions and controls
    given = plans, 0.3, 0.1, radius, 0.4, 1.0, 1.0, 2
    for one, other in zip(reachability.peer_tubes(*given), as_python(reachability.peer_tubes)(*given), strict=True):
        assert (one.shape, one.tobytes()) == (other.shape, other.tobytes())


@pytest.mark.parametrize("count", [0, 1, 3])
def test_numbers_that_lie_elsewhere(random: np.random.Generator, count: int) -> None:
    """Slices, columns, read-only arrays, and NumPy's numbers."""
    points, ends = random.normal(size=(9, 2)), random.normal(size=(3, 4, 2))[:count]
    usual = information.pairwise_distance(points, ends, 2.0).tolist()
    columns = np.asfortranarray(points)
    columns.setflags(write=False)
    wide = np.repeat(ends, 2, axis=1)[:, ::2]
    assert information.pairwise_distance(columns, wide, np.float64(2.0)).tolist() == usual


@needs_addresses
@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((np.zeros((2, 2)),), "a kernel of 3 arguments is given 1"),
        ((np.zeros(2), np.zeros((1, 2, 2)), 1.0), "argument 0 of a kernel has 1 dimensions"),
    ],
)
def test_what_a_kernel_is_not_given(given: tuple[Any, ...], said: str) -> None:
    with pytest.raises(TypeError) as error:
        information.pairwise_distance(*given)
    assert str(error.value) == said


def test_kernels_are_copied_by_name() -> None:
    """As actors hold them, of which snapshots are made."""
    kernel = reachability.standing_plan
    assert pickle.loads(pickle.dumps(kernel)) is kernel
    assert copy.deepcopy([kernel])[0] is kernel


def test_a_second_process_only_where_nothing_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[Any] = []

    def start(command: Any, **_: Any) -> Any:
        started.append(command)
        raise OSError

    monkeypatch.setattr(warm_up, "folder", lambda: tmp_path)
    monkeypatch.setattr(warm_up.subprocess, "Popen", start)
    for cores, made, expected in ((1, False, 0), (2, False, 1), (2, True, 1)):
        monkeypatch.setattr(warm_up.os, "cpu_count", lambda cores=cores: cores)
        if made:
            (tmp_path / "a.nbc").touch()
        with warm_up._others_meanwhile():
            pass
        assert len(started) == expected
