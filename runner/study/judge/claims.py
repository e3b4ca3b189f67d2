"""Judging claims: each is split into comparisons, each with its interval and a corrected test.

A comparison is a contrast, a weighted sum of conditions over common replications: the difference of two conditions, of
two slopes, or of a condition and a number.  Its mean has Student's interval and test, a share Wilson's interval and its
test; the p-values of a claim are corrected together (Holm).

Sources: A. M. Law, *Simulation Modeling and Analysis*, 10.2 (paired comparisons under common random numbers);
S. Holm, *A simple sequentially rejective multiple test procedure* (1979); E. B. Wilson, *Probable inference* (1927).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise, product
from typing import Any

from epicycle.actors.expression import Formula

from ...model.language.claims import ALWAYS, FALLS, GREATER, RISES, Claim, Selection
from ...model.language.dimensions import Factor
from ...support.shown import finite
from ..inference import LEVEL, holm, paired_difference, rate, share_above, without_rounding
from .samples import Levels, Place, Samples, has_enough, value_in

REPRODUCED, NOT_REPRODUCED, UNDECIDED = "reproduced", "not reproduced", "undecided"
CONFIRMED, REVERSED = "confirmed", "reversed"
ALMOST_ALL = 0.9  # the lower Wilson bound required for "in every run", if no run contradicts it

Choices = Sequence[Sequence[int]]  # levels, by dimension


@dataclass(frozen=True)
class ContrastTest:
    """The result of one comparison: how much greater ``metric`` is at ``level`` than ``against`` another, ``where``.

    Compared with a number, it is how much greater than that, and ``against`` is empty.  For a condition that should
    always hold, ``metric`` is the condition, and ``value`` the share of runs in which it holds.  ``count`` runs or
    pairs have a number, ``missing`` have none.  ``outcome`` is ``confirmed``, ``reversed`` or ``undecided``.
    """

    metric: str
    where: Levels
    level: Levels
    against: Levels
    value: float
    error: float
    low: float
    high: float
    count: int
    missing: int
    p: float = math.nan
    p_holm: float = math.nan
    outcome: str = UNDECIDED

    @property
    def has_enough(self) -> bool:
        """Whether few enough numbers are missing for the mean to be meaningful."""
        return has_enough(self.count, self.missing)


@dataclass(frozen=True)
class ClaimVerdict:
    """The outcome of a claim, at one level of each factor that is judged separately (``where``)."""

    claim: Claim
    where: Levels
    verdict: str
    findings: tuple[ContrastTest, ...]

    @property
    def name(self) -> str:
        """The name of the claim."""
        return self.claim.name

    def counts(self, outcome: str) -> int:
        """How many comparisons have this outcome."""
        return sum(finding.outcome == outcome for finding in self.findings)

    @property
    def agreeing(self) -> int:
        """How many means point the claimed way, by chance or not; for conditions, how many hold in all runs."""
        if self.claim.form == ALWAYS:
            return sum(finding.count > 0 and finding.value == 1 for finding in self.findings)
        return sum(_support(self.claim, finding) > 0 for finding in self.findings)

    @property
    def holds_in_means(self) -> bool:
        """Whether as many means agree as the claim requires, by chance or not."""
        return bool(self.findings) and self.agreeing >= self.claim.share * len(self.findings) - 1e-9

    @property
    def missing(self) -> int:
        """How many runs or pairs have no number, over all comparisons."""
        return sum(finding.missing for finding in self.findings)

    @property
    def weakest(self) -> ContrastTest | None:
        """The weakest comparison, in standard errors in favour of the claim; None without comparisons."""
        return min(self.findings, key=lambda each: _support(self.claim, each), default=None)

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file; numbers that are not finite are None."""
        claim, weakest = self.claim, self.weakest
        return {
            "name": claim.name,
            "doc": claim.doc,
            "statement": claim.statement,
            "form": claim.form,
            "where": self.where,
            "verdict": self.verdict,
            **{outcome: self.counts(outcome) for outcome in (CONFIRMED, REVERSED, UNDECIDED)},
            "agreeing": self.agreeing,
            "missing": self.missing,
            "weakest": None if weakest is None else finite(asdict(weakest)),
            "findings": [finite(asdict(finding)) for finding in self.findings],
        }


@dataclass(frozen=True)
class Ranking:
    """The evidence for one level of each factor that claims are judged separately for: the outcomes of all claims."""

    where: Levels
    judgements: tuple[ClaimVerdict, ...]

    @property
    def in_means(self) -> int:
        """How many claims hold in the means, by chance or not."""
        return sum(each.holds_in_means for each in self.judgements)

    def counts(self, verdict: str) -> int:
        """How many claims have that verdict."""
        return sum(each.verdict == verdict for each in self.judgements)

    @property
    def agreeing(self) -> float:
        """The share of a claim's comparisons that agree, averaged over the claims."""
        shares = [each.agreeing / len(each.findings) if each.findings else 0.0 for each in self.judgements]
        return math.fsum(shares) / len(shares)

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        return {
            "where": self.where,
            "in_means": self.in_means,
            "reproduced": self.counts(REPRODUCED),
            "undecided": self.counts(UNDECIDED),
            "not_reproduced": self.counts(NOT_REPRODUCED),
            "agreeing": self.agreeing,
        }


def ranked(judgements: Sequence[ClaimVerdict]) -> list[Ranking]:
    """The levels that claims are judged separately for, best supported first.

    They are ordered by the number of claims refuted, then of claims that hold in the means, of claims reproduced, and
    by the share that agrees.
    """
    apart: dict[tuple[Factor, ...], list[ClaimVerdict]] = {}
    for each in judgements:
        apart.setdefault(tuple(each.where.values()), []).append(each)
    standings = [Ranking(found[0].where, tuple(found)) for found in apart.values()]
    return sorted(
        standings,
        key=lambda each: (-each.counts(NOT_REPRODUCED), each.in_means, each.counts(REPRODUCED), each.agreeing),
        reverse=True,
    )


def judge(samples: Samples) -> list[ClaimVerdict]:
    """Judge all claims of a study in turn; those of another study at each level of the factors that it lacks."""
    questions = samples.study.questions
    return [_judged(claim, apart, samples) for apart in samples.levels(questions.apart) for claim in questions.claims]


def _judged(claim: Claim, apart: Levels, samples: Samples) -> ClaimVerdict:
    where: Selection = {**claim.where, **{factor: (value,) for factor, value in apart.items()}}
    found = (_occurrences if claim.form == ALWAYS else _comparisons)(claim, where, samples)
    findings = [
        replace(each, where={name: value for name, value in each.where.items() if name not in apart}) for each in found
    ]
    return ClaimVerdict(claim, apart, verdict(claim, findings), tuple(findings))


def verdict(claim: Claim, findings: Sequence[ContrastTest]) -> str:
    """What the outcomes of all comparisons mean for their claim."""
    outcomes = [each.outcome for each in findings]
    count, confirmed, turned = len(outcomes), outcomes.count(CONFIRMED), outcomes.count(REVERSED)
    if claim.form in (RISES, FALLS):
        if turned:
            return NOT_REPRODUCED
        is_monotone = all(each.has_enough and _sign(claim) * each.value >= 0 for each in findings)
        return REPRODUCED if confirmed and is_monotone else UNDECIDED
    share = 1.0 if claim.form == ALWAYS else claim.share
    if turned > (1 - share) * count + 1e-9:
        return NOT_REPRODUCED
    return REPRODUCED if count and confirmed >= share * count - 1e-9 else UNDECIDED


# -- comparisons ------------------------------------------------------------------------------------------------------


def _comparisons(claim: Claim, where: Selection, samples: Samples) -> Iterator[ContrastTest]:
    """A comparison counts if it is significant and few numbers are missing."""
    contrasts = list(_contrasts(claim, where, samples))
    limit = claim.than if isinstance(claim.than, float) else 0.0
    findings = [_finding(metric.text, *each, limit, samples) for metric in claim.metrics for each in contrasts]
    for each, p in zip(findings, holm([finding.p for finding in findings]), strict=True):
        outcome = UNDECIDED
        if each.has_enough and p < 1 - LEVEL:
            outcome = CONFIRMED if _sign(claim) * each.value > 0 else REVERSED
        yield replace(each, p_holm=p, outcome=outcome)


def _contrasts(
    claim: Claim, where: Selection, samples: Samples
) -> Iterator[tuple[dict[int, float], tuple[Levels, Levels, Levels]]]:
    """What a claim compares, at every combination of the dimensions that it does not mention.

    Each contrast is a weighted sum of conditions, with their common levels, those of one side, and those of the other.
    """
    choices = samples.choices(where)
    ordered = claim.form in (RISES, FALLS)
    compared = samples.homes([claim.over] if ordered else claim.at)
    slope = _slope(claim, choices, samples) if claim.per else {(): 1.0}
    homes = [*compared, *(samples.homes([claim.per]) if claim.per else ())]
    others = [home for home in range(len(choices)) if home not in homes]
    pairs = list(_steps(claim, choices, samples) if ordered else _pairs(claim, choices, compared, samples))
    for rest in samples.places(choices, homes):
        for this, that in pairs:
            weights = {
                samples.at(_with(rest, homes, (*levels, *inner))): sign * weight
                for sign, levels in ((1.0, this), (-1.0, that))
                if levels is not None
                for inner, weight in slope.items()
                if weight
            }
            here, there = (
                {} if side is None else samples.values(_with(rest, compared, side), compared) for side in (this, that)
            )
            yield weights, (samples.values(rest, others), here, there)


def _pairs(
    claim: Claim, choices: Choices, homes: Sequence[int], samples: Samples
) -> Iterator[tuple[Place, Place | None]]:
    """Each level of ``at`` with each level of ``than``, or with none if that is a number."""

    def levels(selection: Selection) -> list[Place]:
        within = samples.choices(selection)
        return list(product(*([each for each in choices[home] if each in within[home]] for home in homes)))

    these = levels(claim.at)
    those: list[Place | None] = [None]
    if not isinstance(claim.than, float):
        those = [each for each in levels(claim.than or {}) if claim.than or each not in these]
    yield from product(these, those)


def _steps(claim: Claim, choices: Choices, samples: Samples) -> Iterator[tuple[Place, Place]]:
    """Each level of a factor with the one before it."""
    (home,) = samples.homes([claim.over])
    levels = list(choices[home])
    if samples.dimensions[home].columns[claim.over] in ("int", "float"):
        levels.sort(key=lambda index: _number(samples.level(home, index, claim.over)))
    for before, after in pairwise(levels):
        yield (after,), (before,)


def _slope(claim: Claim, choices: Choices, samples: Samples) -> dict[Place, float]:
    """The weights of the values at the levels of a factor whose sum is the slope over the factor."""
    (home,) = samples.homes([claim.per])
    at = {index: _number(samples.level(home, index, claim.per)) for index in choices[home]}
    center = math.fsum(at.values()) / len(at)
    spread = math.fsum((each - center) * (each - center) for each in at.values())
    return {(index,): (each - center) / spread for index, each in at.items()}


def _finding(
    metric: str, weights: dict[int, float], levels: tuple[Levels, Levels, Levels], limit: float, samples: Samples
) -> ContrastTest:
    """The mean of a contrast, less the ``limit``, over the replications in which all its conditions have a number."""
    numbers = {each: samples.numbers(each, metric) for each in weights}
    over = set.intersection(*(set(samples.over(each)) for each in weights))
    pairs = sorted(set.intersection(*(set(each) for each in numbers.values())))
    terms = [[*(weight * numbers[at][each] for at, weight in weights.items()), -limit] for each in pairs]
    values = without_rounding(map(math.fsum, terms), max((abs(term) for each in terms for term in each), default=0.0))
    if len(weights) == 1 and metric in samples.shares:
        found = share_above(limit, [numbers[at][each] for at in weights for each in pairs])
    else:
        found = paired_difference(dict.fromkeys(pairs, 0.0), dict(zip(pairs, values, strict=True)))
    return ContrastTest(
        metric,
        *levels,
        **asdict(found.estimate),
        missing=len(over) - len(pairs),
        p=found.p,
    )


def _occurrences(claim: Claim, where: Selection, samples: Samples) -> Iterator[ContrastTest]:
    """How often a condition holds, at every combination of levels."""
    formula = Formula(claim.condition)
    for place in samples.places(samples.choices(where)):
        rows = samples.rows(samples.at(place), formula.names)
        values = [None if row is None else value_in(formula, row) for row in rows]
        answers = [None if value is None else bool(value) for value in values]
        holds, missing = answers.count(True), answers.count(None)
        found = rate(holds, len(answers) - missing)
        finding = ContrastTest(claim.condition, samples.values(place), {}, {}, **asdict(found), missing=missing)
        yield replace(finding, outcome=_outcome_of_rate(claim, finding, holds))


def _outcome_of_rate(claim: Claim, finding: ContrastTest, holds: int) -> str:
    """One contrary run refutes ``always``, whatever is missing; without any, enough runs are needed to confirm it."""
    if claim.share == 1:
        if holds < finding.count:
            return REVERSED
        is_confirmed = finding.missing == 0 and finding.low >= ALMOST_ALL
    else:
        if finding.high < claim.share:
            return REVERSED if finding.has_enough else UNDECIDED
        is_confirmed = finding.has_enough and finding.low >= claim.share
    return CONFIRMED if is_confirmed else UNDECIDED


def _sign(claim: Claim) -> int:
    return 1 if claim.form in (GREATER, RISES) else -1


def _support(claim: Claim, finding: ContrastTest) -> float:
    """The support of a finding for its claim, in standard errors."""
    if claim.form == ALWAYS:
        return finding.value if finding.count else -math.inf
    if finding.count < 2:
        return -math.inf
    value = _sign(claim) * finding.value
    if finding.error == 0:
        return math.copysign(math.inf, value) if value else 0.0
    return value / finding.error


def _with(place: Place, homes: Sequence[int], levels: Sequence[int]) -> Place:
    found = list(place)
    for home, level in zip(homes, levels, strict=True):
        found[home] = level
    return tuple(found)


def _number(value: Factor) -> float:
    assert isinstance(value, (int, float))
    return float(value)
