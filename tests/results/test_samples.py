"""Samples keep tokens of all kinds as they came, and can be sent elsewhere."""

from __future__ import annotations

import pickle
from array import array
from typing import Any

import pytest

from epicycle.actors import Tag
from epicycle.runner.execution.results import Signal


@pytest.mark.parametrize(
    ("tokens", "kept_in"),
    [
        ([1.5, -0.0, 2.5], array),
        ([3, -(2**63), 2**63 - 1], array),
        ([3, 2**63], list),
        ([1.5, 2], list),
        ([2, 1.5], list),
        ([True, 1.5], list),
        (["a", None, 1.5], list),
    ],
)
def test_tokens_stay_what_they_are(tokens: list[Any], kept_in: type) -> None:
    tags = [Tag(2**62 - place, place + 1) for place in range(len(tokens))]
    for signal in (made := Signal("a.output", tags, tokens), pickle.loads(pickle.dumps(made))):
        assert repr(signal.tokens) == repr(tokens)
        assert signal.tags == tags
        assert isinstance(signal.samples.tokens, kept_in)
