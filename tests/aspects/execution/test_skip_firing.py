"""Firings that do not happen."""

from __future__ import annotations

import pytest
from scipy.stats import binom

from tests.aspects.execution.execution_parts import CHAIN, PARTS, acts, chain, sent
from tests.engine.engine_parts import simulate


@pytest.mark.parametrize("probability", [0.0, 0.1, 0.5, 1.0])
def test_skipping(probability: float) -> None:
    text = CHAIN.format(f"type: SkipFiring, probability: {probability}, at: '**'").replace("1 s", "1 ms")
    _, results = simulate(text, seed=5)
    skipped = {actor: [time for time, event, who, _ in acts(results) if who == actor] for actor in ("t", "a", "probe")}
    low, high = binom.interval(0.999, 5001, probability)
    assert low <= len(skipped["a"]) <= high
    after = len({round(time * 1000) for time in skipped["a"]} & {round(time * 1000) + 1 for time in skipped["a"]})
    low, high = binom.interval(0.999, 5000, probability**2)
    assert low <= after <= high
    assert skipped["t"] == []  # it wakes itself
    assert len(sent(results)) == 5001 - len(skipped["a"])
    low, high = binom.interval(0.999, len(sent(results)), probability)
    assert low <= len(skipped["probe"]) <= high


def test_skipping_wake_ups_ends_a_source() -> None:
    _, results = chain("type: SkipFiring, probability: 1, wakes: true, at: t, from: 2.5 s")
    assert sent(results, "t") == [(0, 0), (1, 1), (2, 2)]
    assert acts(results) == [(3.0, "skipped", "t", None)]


def test_streams_belong_to_actors() -> None:
    both = PARTS.format('type: SkipFiring, probability: 0.5, at: "**"').replace("9 ms", "99 ms")
    one = both.replace('"**"', '"pair[1].one"')

    def skips(text: str) -> list[float]:
        return [time for time, _, actor, _ in acts(simulate(text)[1]) if actor == "pair[1].one"]

    assert skips(both) == skips(one) != []
