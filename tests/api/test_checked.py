"""What programs give to calls is refused where the command line refuses it, before anything is made."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import epicycle
from epicycle.actors import EpicycleError

STUDY = {"study": "load", "model": "mm1", "vary": {"load": [0.5, 0.7]}, "metrics": ["mean_wait"]}
VARY = {"load": "0.5..0.9"}


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def study(**given: Any) -> object:
    return epicycle.study(STUDY, show_progress=False, **given)


def searched(goal: Any, **given: Any) -> object:
    return epicycle.search("mm1", goal, vary=VARY, progress=False, **given)


def rare(**given: Any) -> object:
    return epicycle.rare("mm1", "always server.size < 3", progress=False, **given)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: study(replications=0), "replications: '0' is not a whole number from 1 to 1e9"),
        (lambda: study(seed=1.5), "seed: '1.5' is not a whole number from 0 to 9223372035854775807"),
        (lambda: study(jobs=-1), "jobs: '-1' is not a whole number from 1 to 1e9"),
        (lambda: study(run_timeout=float("nan")), "run_timeout: 'nan' is not a number of seconds greater than 0"),
        (lambda: study(executor="dusk"), "executor: 'dusk' is none of 'local', 'dask'"),
        (lambda: study(scheduler="tcp://here:8786"), "the scheduler tcp://here:8786 is for the executor 'dask'"),
        (lambda: study(merge=3), "merge: 3 is not a list"),
        (
            lambda: epicycle.study({**STUDY, "vary": {"load": range(1)}}),
            "a study is made of numbers, texts, lists and mappings, not of range(0, 1)",
        ),
        (
            lambda: searched(epicycle.Minimise("mean_wait", points=0)),
            "points: '0' is not a whole number from 1 to 100,000",
        ),
        (lambda: searched(epicycle.Minimise("mean_wait"), seed=-1), "seed: '-1' is not a whole number from 0 to "),
        (lambda: searched("mean_wait"), "goal: 'mean_wait' is none of Break, Minimise, Maximise, Match"),
        (lambda: rare(runs=2.5), "runs: '2.5' is not a whole number from 1 to 1e9"),
        (lambda: rare(seed=-1), "seed: '-1' is not a whole number from 0 to 9223372036854775807"),
    ],
)
def test_what_is_refused(call: Callable[[], object], message: str) -> None:
    with pytest.raises(EpicycleError) as error:
        call()
    assert str(error.value).startswith(message)
    assert not [*Path().iterdir()]


def test_one_value_stands_for_a_list_of_one() -> None:
    with pytest.raises(EpicycleError, match=r"^there is no folder nowhere$"):
        study(merge="nowhere", out="out")


def test_numbers_of_numpy_are_numbers() -> None:
    assert epicycle.run("mm1", seed=np.int64(3), until=1.0, progress=False).seed == 3
