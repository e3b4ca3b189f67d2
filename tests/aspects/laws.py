"""What tests of laws have in common: their confidence, tokens with fields, and what was lost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.aspects.bench import Bench

SURE = 0.999


@dataclass
class Reading:
    """A token with fields."""

    name: str
    value: Any
    valid: bool = True


def runs(lost: np.ndarray) -> np.ndarray:
    """Lengths of the runs of true values, those at the ends left out."""
    edges = np.flatnonzero(np.diff(lost.astype(int)))
    lengths = np.diff(edges)
    return lengths[0::2] if not lost[0] else lengths[1::2]


def lost_of(bench: Bench, count: int) -> np.ndarray:
    lost = np.ones(count, bool)
    lost[bench.tokens] = False
    return lost


COUNT = 40_000
