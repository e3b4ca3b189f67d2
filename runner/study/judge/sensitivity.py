"""How much each parameter matters for a metric: Sobol's indices, and Morris's elementary effects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from ...model.language.sampling import SOBOL, Design
from ..inference import LEVEL, Estimate, deviation, in_range, mean, resampled_sums
from .samples import Levels, Samples, has_enough

FIRST, TOTAL = "first_order", "total"
MU, MU_STAR, SIGMA = "mu", "mu_star", "sigma"
RESAMPLES = 999
_UNKNOWN = Estimate(math.nan, math.nan, math.nan, math.nan, 0)


@dataclass(frozen=True)
class Index:
    """One index of one parameter; ``missing`` blocks of the design have a point without a number."""

    where: Levels  # of the factors beside the design
    factor: str
    index: str
    estimate: Estimate
    missing: int


def sensitivity(samples: Samples, metric: str, level: float = LEVEL) -> list[Index]:
    """The indices for the metric's means over replications, for each design at every combination of other factors."""
    found = []
    for home, dimension in enumerate(samples.dimensions):
        if dimension.design is None:
            continue
        others = [at for at in range(len(samples.dimensions)) if at != home]
        for place in samples.places(samples.choices({}), [home]):
            where = samples.values(place, others)
            found += _indices(samples, metric, dimension.design, home, place, where, level)
    return found


def _indices(
    samples: Samples, metric: str, design: Design, home: int, place: tuple[int, ...], where: Levels, level: float
) -> list[Index]:
    @cache
    def value(at: int) -> float | None:
        """The mean at a level of the design, if all of its runs are over and enough of them have a number."""
        condition = samples.at((*place[:home], at, *place[home + 1 :]))
        over, numbers = len(samples.over(condition)), list(samples.numbers(condition, metric).values())
        missing = max(over, samples.study.replications if samples.study.until is None else 0) - len(numbers)
        return mean(numbers).value if numbers and (not missing or has_enough(len(numbers), missing)) else None

    blocks = [[value(at) for at in block] for block in design.blocks]
    whole = [at for at, block in enumerate(blocks) if None not in block]
    known = [[number for number in blocks[at] if number is not None] for at in whole]
    missing = len(blocks) - len(known)
    indices: list[tuple[str, dict[str, Estimate]]]
    if not has_enough(len(known), missing):
        names = (FIRST, TOTAL) if design.form == SOBOL else (MU_STAR, MU, SIGMA)
        indices = [(path, dict.fromkeys(names, _UNKNOWN)) for path in design.paths]
    elif design.form == SOBOL:
        indices = list(zip(design.paths, _shares(known, level), strict=True))
    else:
        steps = [design.steps[at] for at in whole]
        indices = list(zip(design.paths, _effects(known, steps, level), strict=True))
    return [Index(where, path, name, estimate, missing) for path, each in indices for name, estimate in each.items()]


def _shares(blocks: Sequence[Sequence[float]], level: float) -> list[dict[str, Estimate]]:
    """The first-order and total index of each parameter, with percentile intervals of a bootstrap over blocks.

    Sources: A. Saltelli et al., Computer Physics Communications 181, 2010 (first order); M. J. W. Jansen, Computer
    Physics Communications 117, 1999 (total).
    """
    count = len(blocks)
    values, _ = in_range([number for block in blocks for number in block])  # shares are the same in every unit
    middle, width = math.fsum(values) / len(values), len(blocks[0])
    centred = [[number - middle for number in values[at : at + width]] for at in range(0, len(values), width)]
    ends = [(block[0], block[-1]) for block in centred]
    sums = _with_resamples([a + b for a, b in ends])
    squares = _with_resamples([a * a + b * b for a, b in ends])
    variances = [
        square / (2 * count) - (each / (2 * count)) * (each / (2 * count))
        for each, square in zip(sums, squares, strict=True)
    ]
    if min(values) == max(values) or not min(variances) > 0.0:
        return [{FIRST: _UNKNOWN, TOTAL: _UNKNOWN} for _ in blocks[0][2:]]
    found = []
    for at in range(1, len(blocks[0]) - 1):
        first = _with_resamples([block[-1] * (block[at] - block[0]) for block in centred])
        total = _with_resamples([(block[at] - block[0]) * (block[at] - block[0]) / 2.0 for block in centred])
        shares = {
            name: [each / count / variance for each, variance in zip(sums, variances, strict=True)]
            for name, sums in ((FIRST, first), (TOTAL, total))
        }
        found.append({name: _percentiles(each, level, count) for name, each in shares.items()})
    return found


def _with_resamples(values: Sequence[float]) -> list[float]:
    """The sum, and the sums of bootstrap samples, which are drawn alike for all values of the same blocks."""
    [sums] = resampled_sums([values], RESAMPLES)
    return [math.fsum(values), *sums.tolist()]


def _percentiles(values: Sequence[float], level: float, count: int) -> Estimate:
    first, resampled = values[0], sorted(values[1:])
    outside = round((1.0 - level) / 2.0 * (len(resampled) + 1))
    return Estimate(first, deviation(resampled), resampled[max(outside, 1) - 1], resampled[-max(outside, 1)], count)


def _effects(
    blocks: Sequence[Sequence[float]], steps: Sequence[Sequence[tuple[int, float]]], level: float
) -> list[dict[str, Estimate]]:
    """Mean, mean size and deviation of the elementary effects of each parameter: changes over its whole range."""
    effects: dict[int, list[float]] = {}
    for block, taken in zip(blocks, steps, strict=True):
        for at, (parameter, share) in enumerate(taken):
            effects.setdefault(parameter, []).append((block[at + 1] - block[at]) / share)
    found = []
    for _, each in sorted(effects.items()):
        signed, sizes = mean(each, level), mean([abs(effect) for effect in each], level)
        deviation = signed.error * math.sqrt(signed.count)
        sigma = Estimate(deviation, math.nan, math.nan, math.nan, signed.count)
        found.append({MU_STAR: sizes, MU: signed, SIGMA: sigma})
    return found
