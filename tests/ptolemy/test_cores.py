"""The compiled core and the Python core make the same runs under ``like: ptolemy``, too."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.engine.cores import WAYS, Worker, differences, workers
from tests.engine.networks import network
from tests.engine.test_cores import is_there

RULES = [{"like": "ptolemy"}, {"like": "ptolemy"}, {"like": "epicycle"}]


@pytest.fixture(scope="module")
def at() -> Iterator[dict[str, Worker]]:
    if not is_there():
        pytest.skip("the core is not compiled here")
    with workers() as found:
        yield found


@pytest.mark.slow
@settings(max_examples=40, suppress_health_check=list(HealthCheck))
@given(numbers=st.randoms(use_true_random=False), way=st.sampled_from(WAYS))
def test_networks(at: dict[str, Worker], numbers: Any, way: str) -> None:
    assert differences(at, [{"model": network(numbers, RULES), "way": way}]) == []
