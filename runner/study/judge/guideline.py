"""The guideline: which level to choose at every combination of the other factors, and with what certainty.

The levels that are *not worse* contain the true best with the stated confidence: a level is left out if it is worse
than any other in a one-sided paired test at (1 - confidence) / (levels - 1).  This is Bonferroni's form of multiple
comparisons with the best under common random numbers.

Sources: J. C. Hsu, *Multiple Comparisons: Theory and Methods* (1996), chapter 4; B. L. Nelson and F. J. Matejcik,
*Using common random numbers for indifference-zone selection and multiple comparisons in simulation* (1995);
A. M. Law, *Simulation Modeling and Analysis*, 10.4.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from ...model.language.claims import Guideline
from ...model.language.dimensions import Factor
from ...support.shown import finite
from ..inference import LEVEL, Estimate, mean, paired_difference, resampled_sums
from .samples import Levels, Place, Samples, has_enough

RESAMPLES = 9_999
_TELLING = math.ldexp(1.0, 42)  # parts of a cost by which two can be told apart


@dataclass(frozen=True)
class Option:
    """A level that could be chosen: its mean, how much worse it is than the best, and the reasons against it."""

    level: Factor
    estimate: Estimate
    behind: Estimate  # how much worse than the best, over common replications
    missing: int  # runs without a number
    is_fit: bool  # few enough are missing for its mean to be meaningful
    is_not_worse: bool  # than any other, as far as the runs show
    confidence: float  # share of resamples in which it is best


@dataclass(frozen=True)
class Recommendation:
    """What to choose ``where`` the other factors are as given; None if no level has enough numbers.

    ``best`` has the best mean, ``sufficient`` is the first level in the order of the study that is not worse, or within
    the tolerance.
    """

    where: Levels
    choose: str
    metric: str
    best: Factor
    sufficient: Factor
    confidence: float
    options: tuple[Option, ...]

    @property
    def not_worse(self) -> list[Factor]:
        """The levels that contain the true best with the stated confidence."""
        return [option.level for option in self.options if option.is_not_worse]

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file; numbers that are not finite are None."""
        found: dict[str, Any] = finite(asdict(self))
        return {**found, "not_worse": self.not_worse}


def recommend(samples: Samples) -> list[Recommendation]:
    """The recommended level of the factor to choose, for every combination of the others."""
    guideline = samples.study.questions.guideline
    if guideline is None:
        return []
    (home,) = samples.homes([guideline.choose])
    return [_recommended(guideline, home, rest, samples) for rest in samples.places(samples.choices({}), [home])]


def _recommended(guideline: Guideline, home: int, rest: Place, samples: Samples) -> Recommendation:
    indices = range(samples.dimensions[home].size)
    levels = [samples.level(home, index, guideline.choose) for index in indices]
    conditions = [samples.at((*rest[:home], index, *rest[home + 1 :])) for index in indices]
    metric, sign = guideline.metric.text, -1.0 if guideline.greatest else 1.0
    numbers = [samples.numbers(each, metric) for each in conditions]
    costs = [{one: sign * value for one, value in each.items()} for each in numbers]
    missing = [len(samples.over(at)) - len(each) for at, each in zip(conditions, numbers, strict=True)]
    fit = [index for index, each in enumerate(numbers) if has_enough(len(each), missing[index])]
    best = min(fit, key=lambda index: mean(list(costs[index].values())).value, default=None)
    confidence = dict(zip(fit, _confidence([costs[index] for index in fit]), strict=True))
    options = [
        Option(
            factor,
            samples.average(conditions[index], metric),
            mean([]) if best is None else paired_difference(costs[best], costs[index]).estimate,
            missing[index],
            index in fit,
            index in fit and _is_not_worse(index, fit, costs),
            confidence.get(index, 0.0),
        )
        for index, factor in enumerate(levels)
    ]
    enough = [
        option.level
        for option in options
        if option.is_not_worse or (option.is_fit and option.behind.value <= guideline.tolerance)
    ]
    return Recommendation(
        samples.values(rest, [each for each in range(len(rest)) if each != home]),
        guideline.choose,
        metric,
        None if best is None else levels[best],
        enough[0] if enough else None,
        0.0 if best is None else confidence[best],
        tuple(options),
    )


def _is_not_worse(index: int, fit: list[int], costs: list[dict[int, float]]) -> bool:
    """Whether no other level is better in a one-sided test, with the error probability shared by all tests."""
    found = [paired_difference(costs[other], costs[index]) for other in fit if other != index]
    return not any(each.estimate.value > 0 and each.p / 2 * (len(fit) - 1) < 1 - LEVEL for each in found)


def _confidence(costs: list[dict[int, float]]) -> list[float]:
    """How often each is best when the replications that all have in common are resampled; ties are shared.

    Means are equal if they differ by no more than rounding errors, for which costs are brought to at most 1.
    """
    common = sorted(set.intersection(*(set(each) for each in costs))) if costs else []
    if not common:
        return [0.0] * len(costs)
    import numpy as np

    exponent = math.frexp(max(abs(each[one]) for each in costs for one in common))[1]
    sums = resampled_sums([[math.ldexp(each[one], -exponent) for one in common] for each in costs], RESAMPLES)
    means = np.round(sums / len(common) * _TELLING)
    is_best = means == means.min(axis=0)
    ties = np.count_nonzero(is_best, axis=0)
    return [math.fsum((1.0 / ties[best]).tolist()) / RESAMPLES for best in is_best]
