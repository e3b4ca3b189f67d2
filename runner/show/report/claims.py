"""The part of a report that answers the questions of a study: the verdicts of its claims, and its guideline."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from epicycle.actors import counted

from ...model.language.claims import ALWAYS
from ...study.inference import with_interval
from ...study.judge.claims import (
    CONFIRMED,
    NOT_REPRODUCED,
    REPRODUCED,
    REVERSED,
    UNDECIDED,
    ClaimVerdict,
    ContrastTest,
    ranked,
)
from ...study.judge.guideline import Recommendation
from ...support.html import Content, Html, note, tag, wide_table
from ...support.shown import rounded
from .data import Data, Names, mean_of, shown


def claims(names: Names, judgements: Sequence[ClaimVerdict]) -> Iterable[Html]:
    """The verdict of each claim, and all comparisons behind it."""
    if not judgements:
        return
    apart = list(judgements[0].where)
    if apart:
        yield _by_level(names, judgements)
        yield note(
            "The best comes first: it has the fewest claims not reproduced; then the most that hold in the means, by "
            "chance or not; then the most reproduced; then the largest share of agreeing comparisons."
        )
    head = [*map(names.axis, apart), "claim", "verdict", "", "confirmed", "reversed", "undecided", "agreeing"]
    rows = [
        [
            *map(shown, each.where.values()),
            tag("b", each.name),
            _verdict(each),
            [each.claim.doc, " ", tag("small", each.claim.stated(names.words))],
            *(str(each.counts(outcome)) for outcome in (CONFIRMED, REVERSED, UNDECIDED)),
            str(each.agreeing),
            _weakest(names, each),
        ]
        for each in judgements
    ]
    yield wide_table([*head, "weakest comparison"], rows, names=len(apart) + 1, class_="words")
    yield note(
        "A comparison is a mean of differences between runs of the same replication, or a mean less a number, with "
        "Student's 95 % interval (of shares Wilson's); "
        "the p-values of one claim are corrected together (Holm). It is confirmed or reversed if the corrected "
        "p-value is below 0.05, and at most one run in twenty is missing; otherwise it is undecided. Agreeing "
        "comparisons point the claimed way, by chance or not."
    )
    for each in judgements:
        place = names.place(each.where)
        title = f"{each.name}{f' ({place})' if place else ''}: {each.verdict}"
        summary = tag("summary", f"{title}, {counted(len(each.findings), 'comparison')}")
        yield tag("details", summary, _findings(names, each))


def class_of(verdict: str) -> str:
    """The style class of a verdict."""
    return verdict.replace(" ", "-")


def _by_level(names: Names, judgements: Sequence[ClaimVerdict]) -> Html:
    """Which claims hold at which level of the factors for which they are judged separately, the best first."""
    standings = ranked(judgements)
    claims = [each.name for each in standings[0].judgements]
    return wide_table(
        [*map(names.axis, judgements[0].where), NOT_REPRODUCED, "hold in the means", REPRODUCED, *claims],
        [
            [
                *map(shown, each.where.values()),
                str(each.counts(NOT_REPRODUCED)),
                str(each.in_means),
                str(each.counts(REPRODUCED)),
                *(
                    [_verdict(one), tag("small", f"{one.agreeing} of {len(one.findings)} agree")]
                    for one in each.judgements
                ),
            ]
            for each in standings
        ],
        names=len(judgements[0].where),
    )


def _verdict(judgement: ClaimVerdict) -> Html:
    return tag("b", judgement.verdict, class_=class_of(judgement.verdict))


def _findings(names: Names, judgement: ClaimVerdict) -> Html:
    is_rate = judgement.claim.form == ALWAYS
    head = ["comparison", "share of runs" if is_rate else "difference", "95 % interval", "runs" if is_rate else "pairs"]
    rows = [
        [
            _compared(names, judgement, each),
            *_value(each),
            f"{each.count}{f' ({each.missing} missing)' if each.missing else ''}",
            *([] if is_rate else ["–" if math.isnan(each.p_holm) else f"{each.p_holm:.2g}"]),
            tag("span", each.outcome, class_={CONFIRMED: "reproduced", REVERSED: "not-reproduced"}.get(each.outcome)),
        ]
        for each in judgement.findings
    ]
    return wide_table([*head, *([] if is_rate else ["p (Holm)"]), "outcome"], rows)


def _weakest(names: Names, judgement: ClaimVerdict) -> Content:
    finding = judgement.weakest
    if finding is None or not finding.count:
        return "–"
    value, interval = _value(finding)
    return [f"{value} ({interval}) ", tag("small", _compared(names, judgement, finding))]


def _compared(names: Names, judgement: ClaimVerdict, finding: ContrastTest) -> str:
    claim, where = judgement.claim, names.place(finding.where)
    if claim.form == ALWAYS:
        return where or "all runs"
    what = names.axis(finding.metric)
    if claim.per:
        what = f"slope of {names.words(finding.metric)} over {names.words(claim.per)}"
    if isinstance(claim.than, float):
        here = ", ".join(each for each in (names.place(finding.level), where) if each)
        return f"{what} less {claim.than:g}{f'; {here}' if here else ''}"
    pair = f"{what}, {names.place(finding.level)} less {names.place(finding.against)}"
    return f"{pair}; {where}" if where else pair


def _value(finding: ContrastTest) -> tuple[str, str]:
    """The value of a comparison, and its interval."""
    width = finding.high - finding.low
    value = rounded(finding.value, width) if finding.count else "–"
    return value, "–" if math.isnan(finding.low) else f"{rounded(finding.low, width)} to {rounded(finding.high, width)}"


def guideline(data: Data, found: Sequence[Recommendation]) -> Iterable[Html]:
    """What to choose in each case, and with what confidence."""
    if not found:
        return
    names = data.names
    asked = data.plan.study.questions.guideline
    choose, metric = names.words(found[0].choose), names.words(found[0].metric)
    which = "greatest" if asked is not None and asked.greatest else "least"
    tolerance = asked.tolerance if asked is not None else 0.0
    unit = names.unit(found[0].metric)
    yield tag("p", f"The {choose} with the {which} {mean_of(metric)}:", class_="label")
    head = [*map(names.axis, found[0].where), f"best {choose}", mean_of(names.axis(found[0].metric))]
    yield wide_table(
        [*head, "confidence", "not worse", "enough"], [_row(each) for each in found], names=len(found[0].where)
    )
    close = f", or of those within {tolerance:g}{f' {unit}' if unit else ''} of the best." if tolerance else "."
    yield note(
        f"best: the {which} mean. confidence: how often it is the best when the replications are resampled. not worse: "
        "no other is significantly better, and the truly best is among these with a confidence of 95 %. enough: the "
        f"first of these in the order of the study{close}"
    )


def _row(each: Recommendation) -> list[Content]:
    best = next((option for option in each.options if option.is_fit and option.level == each.best), None)
    where = [shown(level) for level in each.where.values()]
    if best is None:
        return [*where, "–", "too few runs have a value", "", "", ""]
    return [
        *where,
        tag("b", shown(each.best)),
        with_interval(best.estimate),
        f"{each.confidence:.0%}",
        ", ".join(map(shown, each.not_worse)),
        shown(each.sufficient),
    ]
