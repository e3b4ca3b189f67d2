"""The solver under problems that no scenario poses; `make robust` tries 100,000 of them."""

from collections import Counter

import numpy as np
import pytest

from tests.actors.robotics.numerics.robustness import BOUND, KINDS, run


@pytest.mark.parametrize(("count", "seed"), [(2_000, 2), pytest.param(100_000, 1, marks=pytest.mark.slow)])
def test_whatever_is_asked_the_answer_is_a_plan_within_the_limits(count: int, seed: int) -> None:
    found = [(answer.posed[0], answer.wrong, answer.steps) for answer in run(count, seed)]
    assert Counter((kind, wrong) for kind, wrong, _ in found if wrong) == {}
    assert {kind for kind, _, _ in found} == set(KINDS)
    steps = [each[2] for each in found]
    assert max(steps) <= BOUND * np.median(steps)
