"""Statistics of replications."""

from __future__ import annotations

import math
from collections.abc import Sequence

LEVEL = 0.95


def half_width(values: Sequence[float], level: float = LEVEL) -> float:
    """Half the width of Student's confidence interval of the mean; infinite for fewer than two values.

    Source: A. M. Law, *Simulation Modeling and Analysis*, section 4.5.
    """
    from scipy.stats import t

    count = len(values)
    if count < 2:
        return math.inf
    mean = math.fsum(values) / count
    variance = math.fsum((value - mean) ** 2 for value in values) / (count - 1)
    return float(t.ppf((1 + level) / 2, count - 1)) * math.sqrt(variance / count)
