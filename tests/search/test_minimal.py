"""The smallest set that breaks something, against every set there is."""

from __future__ import annotations

import random  # noqa: TID251 (what to try, and not what a model draws)

import pytest

from epicycle.runner.search.minimal import minimal


@pytest.mark.parametrize("seed", range(200))
def test_the_set_breaks_and_no_set_without_one_of_it_does(seed: int) -> None:
    draw = random.Random(seed)
    things = list(range(draw.randrange(1, 9)))
    # Whatever breaks, monotone or not; nothing does not, everything does.
    breaking = {frozenset(each for each in things if number >> each & 1) for number in range(2 ** len(things))}
    breaking = {each for each in breaking if draw.random() < draw.choice([0.1, 0.5])}
    breaking = (breaking | {frozenset(things)}) - {frozenset()}
    found = minimal(things, lambda some: some in breaking)
    assert found == sorted(found)
    assert frozenset(found) in breaking
    assert not any(frozenset(found) - {each} in breaking for each in found)


def test_three_of_a_thousand_are_found_in_few_tries() -> None:
    tried = 0

    def breaks(some: frozenset[int]) -> bool:
        nonlocal tried
        tried += 1
        return {17, 400, 999} <= some

    assert minimal(range(1_000), breaks) == [17, 400, 999]
    assert tried < 250


@pytest.mark.parametrize("seed", range(50))
def test_what_is_said_to_be_idle_is_not_believed(seed: int) -> None:
    draw = random.Random(seed)
    needed = frozenset(draw.sample(range(60), draw.randrange(1, 8)))
    some = draw.choice([0.3, 0.9])

    def active(part: frozenset[int]) -> frozenset[int]:
        return frozenset(each for each in sorted(part) if draw.random() < some)

    assert minimal(range(60), lambda part: needed <= part, active) == sorted(needed)
