"""The verdicts of a study on its claims, as Markdown for docs/paper.md.

    python benchmarks/claims.py results/table_1 [--into docs/paper.md [--place NAME]]

Prints a table of the claims with their verdicts, and the guideline; or, where claims are judged for each level of
something as in ``readings``, a table of verdicts by level.  ``--into`` replaces the text between ``<!-- NAME: begin
-->`` and ``<!-- NAME: end -->`` in a file, where NAME is that of the study if no other is given.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from epicycle.runner import StudyResults, open_study
from epicycle.runner.model.language.claims import ALWAYS
from epicycle.runner.study.judge.claims import (
    CONFIRMED,
    NOT_REPRODUCED,
    REPRODUCED,
    REVERSED,
    UNDECIDED,
    ClaimVerdict,
    ContrastTest,
    ranked,
)
from epicycle.runner.study.judge.guideline import Recommendation

SHORT = {REPRODUCED: "**yes**", NOT_REPRODUCED: "no", UNDECIDED: "open"}


def said(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def levels(values: dict[str, Any]) -> str:
    return ", ".join(f"{name} {said(value)}" for name, value in values.items())


def row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def head(cells: list[str]) -> Iterator[str]:
    yield row(cells)
    yield row("---" for _ in cells)


def about(results: StudyResults) -> str:
    """The runs, their date and versions."""
    counts = results.counts()
    seeds = results.plan.study.seed
    when = results.manifest["date"].partition("T")[0]
    failed = counts.total() - counts["ok"]
    version, revision = results.manifest["versions"]["epicycle"], results.manifest["git"]
    parts = [f"version {version}" if version else "", f"revision {revision[:10]}" if revision else ""]
    made_with = ", ".join(filter(None, parts)) or "no version"
    return (
        f"Measured on {when} with {made_with}: "
        f"`epicycle study {results.plan.study.name}`, {counts.total():,} runs ({failed or 'none'} failed), "
        f"{results.plan.replications} of each condition, seeds {seeds} to {seeds + results.plan.replications - 1}."
    )


def weakest(judgement: ClaimVerdict, finding: ContrastTest | None) -> str:
    """The weakest comparison of a claim."""
    if finding is None or not finding.count:
        return "-"
    missing = f", {finding.missing} missing" if finding.missing else ""
    where = levels(finding.where)
    if judgement.claim.form == ALWAYS:
        holds = round(finding.value * finding.count)
        return f"{holds} of {finding.count} runs, {finding.low:.3f} to {finding.high:.3f}{missing} ({where})"
    pair = f"{levels(finding.level)} less {levels(finding.against)}{f', {where}' if where else ''}"
    digits = 3 if abs(finding.value) < 0.1 else 2
    value, low, high = (f"{each:+.{digits}f}" for each in (finding.value, finding.low, finding.high))
    p = "" if math.isnan(finding.p_holm) else f", p {'< 0.001' if finding.p_holm < 0.001 else f'{finding.p_holm:.3f}'}"
    return f"{finding.metric} {value} ({low} to {high}{p}{missing}): {pair}"


def claims(found: list[ClaimVerdict]) -> Iterator[str]:
    """One line for each claim."""
    counted = ["confirmed", "undecided", "reversed", "agreeing"]
    yield from head(["claim", "", "verdict", *counted, "weakest comparison"])
    for each in found:
        counts = (str(each.counts(outcome)) for outcome in (CONFIRMED, UNDECIDED, REVERSED))
        about_it = [each.name, each.claim.doc, f"**{each.verdict}**", *counts, str(each.agreeing)]
        yield row([*about_it, weakest(each, each.weakest)])


def by_level(found: list[ClaimVerdict]) -> Iterator[str]:
    """One line for each level that the claims are judged for, the best first."""
    standings = ranked(found)
    yield from head(["", "no", "in means", "yes", *(each.name for each in standings[0].judgements)])
    for standing in standings:
        cells = []
        for each in standing.judgements:
            counts = "/".join(str(each.counts(outcome)) for outcome in (CONFIRMED, UNDECIDED, REVERSED))
            cells.append(f"{SHORT[each.verdict]} {counts}, {each.agreeing}")
        numbers = [standing.counts(NOT_REPRODUCED), standing.in_means, standing.counts(REPRODUCED)]
        yield row([levels(standing.where), *map(str, numbers), *cells])


def guideline(found: list[Recommendation]) -> Iterator[str]:
    """One line for each combination of the other factors."""
    first = found[0]
    options = [said(option.level) for option in first.options]
    means = [f"{first.metric}, {first.choose} {level}" if not index else level for index, level in enumerate(options)]
    yield from head([*first.where, *means, "best", "confidence", "not worse", "sufficient"])
    for each in found:
        cells = [f"{option.estimate.value:.2f} ± {option.estimate.error:.2f}" for option in each.options]
        advice = [
            said(each.best),
            f"{each.confidence:.0%}",
            ", ".join(map(said, each.not_worse)),
            said(each.sufficient),
        ]
        yield row([*map(said, each.where.values()), *cells, *advice])


def text(results: StudyResults) -> str:
    """All of it."""
    judged = results.claims()
    parts = [about(results)]
    if judged and judged[0].where:
        parts.append(
            "A cell says whether a claim is reproduced (yes), not reproduced (no) or undecided (open), how many of its "
            "comparisons are\nconfirmed/undecided/reversed, and how many point the claimed way, by chance or not."
        )
        parts.append("\n".join(by_level(judged)))
        return "\n\n".join(parts)
    if judged:
        parts.append("\n".join(claims(judged)))
    if advice := results.guideline():
        parts.append("\n".join(guideline(advice)))
    return "\n\n".join(parts)


def put(file: Path, place: str, block: str) -> bool:
    """Write the block into its place in a file."""
    begin, end = f"<!-- {place}: begin -->", f"<!-- {place}: end -->"
    whole = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    before = file.read_text(encoding="utf-8")
    after, count = whole.subn(lambda _: f"{begin}\n{block}\n{end}", before)
    file.write_text(after, encoding="utf-8")
    return count == 1


def main() -> int:
    """Print the block, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--into", type=Path, metavar="FILE")
    parser.add_argument("--place", metavar="NAME")
    options = parser.parse_args()
    results = open_study(options.folder)
    block = text(results)
    place = options.place or results.plan.study.name
    if options.into is None:
        print(block)
    elif not put(options.into, place, block):
        print(f"{options.into} has no place for {place}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
