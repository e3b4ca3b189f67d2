"""Claims of whole studies: against queueing theory, of other studies, and in order."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from epicycle.runner import open_study
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.language.claims import Claim
from epicycle.runner.model.language.study import read_study
from epicycle.runner.model.text.problems import Position
from epicycle.runner.show.report.claims import claims
from epicycle.runner.show.report.data import Data
from epicycle.runner.study.judge.claims import (
    NOT_REPRODUCED,
    REPRODUCED,
    UNDECIDED,
    ClaimVerdict,
    ContrastTest,
    ranked,
)
from epicycle.runner.study.plan.plan import Plan
from epicycle.runner.study.session import run_study

QUEUE = """
study: queue
model: ./mm1.yaml
vary: {load: [0.3, 0.5, 0.7]}
replications: 10
seed: 5
metrics: [mean_wait, customers]
"""
ASKED = """
claims:
  true_by_theory:
    doc: The mean wait is load / (1 - load).
    rises: mean_wait
    over: load
  false_by_theory: {less: mean_wait, at: {load: 0.7}}
guideline: {choose: load, least: mean_wait, tolerance: 0.8}
"""


def write(folder: Path, study: str, name: str = "queue") -> Path:
    """A study beside the packaged M/M/1 model, made short."""
    model = packaged_models()["mm1"].read_text(encoding="utf-8")
    (folder / "mm1.yaml").write_text(model.replace("stop: 4000 s", "stop: 600 s"), encoding="utf-8")
    (folder / f"{name}.yaml").write_text(study, encoding="utf-8")
    return folder / f"{name}.yaml"


@pytest.fixture(scope="module")
def queue(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("queue")
    write(folder, QUEUE)
    run_study(Plan.made(read_study(folder / "queue.yaml")), folder / "out", jobs=1)
    return folder


def test_queueing_theory(queue: Path) -> None:
    assert open_study(queue / "out").claims() == []
    assert open_study(queue / "out").guideline() == []
    (queue / "queue.yaml").write_text(QUEUE + ASKED, encoding="utf-8")
    # Queries of results repeat no run.
    outcome = run_study(Plan.made(read_study(queue / "queue.yaml")), queue / "out", jobs=1)
    assert (outcome.made, outcome.there) == (0, 30)
    results = open_study(queue / "out")
    assert [(each.name, each.verdict) for each in results.claims()] == [
        ("true_by_theory", "reproduced"),
        ("false_by_theory", "not reproduced"),
    ]
    assert results.claims()[0].claim.statement == "mean_wait rises over load"
    (found,) = results.guideline()
    # 3/7, 1 and 7/3 s: the second is within 0.8 s, but not before the first.
    assert (found.best, found.sufficient, found.where) == (0.3, 0.3, {})
    assert json.loads(json.dumps(results.claims()[0].as_dict()))["findings"][0]["level"] == {"load": 0.5}


def test_claims_of_another_study_are_judged_at_each_level_of_what_it_has_not(queue: Path, tmp_path: Path) -> None:
    lender = write(tmp_path, QUEUE + ASKED)
    variants = (
        "vary: {load: [0.3, 0.7], variant: {cases: {usual: , slow: {mean_service: 2 s}}}}\nclaims: ./queue.yaml\n"
    )
    text = QUEUE.replace("vary: {load: [0.3, 0.5, 0.7]}\n", variants).replace("study: queue", "study: variants")
    run_study(Plan.made(read_study(write(tmp_path, text, "variants"))), tmp_path / "out", jobs=1)
    lender.unlink()  # the folder has kept it
    found = open_study(tmp_path / "out").claims()
    assert [(each.name, each.where, each.verdict) for each in found] == [
        ("true_by_theory", {"variant": "usual"}, "reproduced"),
        ("false_by_theory", {"variant": "usual"}, "not reproduced"),
        ("true_by_theory", {"variant": "slow"}, "reproduced"),
        ("false_by_theory", {"variant": "slow"}, "not reproduced"),
    ]
    assert all(finding.where == {} for each in found for finding in each.findings)
    # The report shows first which of them survive what.
    html = next(iter(claims(Data(open_study(tmp_path / "out")).names, found)))
    rows = [
        re.findall("<(?:th|td)[^>]*>(.*?)</(?:th|td)>", row) for row in re.findall("<tr>(.*?)</tr>", html, re.DOTALL)
    ]
    assert [[re.sub("<.*?>", "", cell) for cell in row] for row in rows] == [
        ["variant", "not reproduced", "hold in the means", "reproduced", "true_by_theory", "false_by_theory"],
        ["usual", "1", "1", "1", "reproduced1 of 1 agree", "not reproduced0 of 1 agree"],
        ["slow", "1", "1", "1", "reproduced1 of 1 agree", "not reproduced0 of 1 agree"],
    ]


def judged(where: str, *claims: tuple[str, float, int, int]) -> list[ClaimVerdict]:
    """Claims of ten comparisons each: verdict, share that the claim asks for, how many agree, how many more do not."""
    found = []
    for outcome, share, agreeing, against in claims:
        claim = Claim("c", "less", (), Position("", 1, 1, 1, ""), share=share)
        findings = tuple(
            ContrastTest("m", {}, {}, {}, value, 0.1, 0.0, 0.0, 20, 0) for value in [-1.0] * agreeing + [1.0] * against
        )
        found.append(ClaimVerdict(claim, {"variant": where}, outcome, findings))
    return found


def test_the_level_that_most_speaks_for_comes_first() -> None:
    """Refuted claims count first, then those that hold in the means, those reproduced, and what agrees."""
    every = [
        *judged("one is refuted", (REPRODUCED, 1.0, 10, 0), (REPRODUCED, 0.2, 2, 8), (NOT_REPRODUCED, 1.0, 9, 1)),
        *judged("less agrees", (REPRODUCED, 1.0, 10, 0), (UNDECIDED, 1.0, 5, 5), (UNDECIDED, 1.0, 9, 1)),
        *judged("two hold", (REPRODUCED, 1.0, 10, 0), (UNDECIDED, 0.2, 2, 8), (UNDECIDED, 1.0, 0, 10)),
        *judged("more agrees", (REPRODUCED, 1.0, 10, 0), (UNDECIDED, 1.0, 9, 1), (UNDECIDED, 1.0, 9, 1)),
        *judged("nothing decided", (UNDECIDED, 1.0, 10, 0), (UNDECIDED, 1.0, 9, 1), (UNDECIDED, 1.0, 9, 1)),
    ]
    assert [(each.where["variant"], each.in_means, each.counts(REPRODUCED)) for each in ranked(every)] == [
        ("two hold", 2, 1),
        ("more agrees", 1, 1),
        ("less agrees", 1, 1),
        ("nothing decided", 1, 0),
        ("one is refuted", 2, 2),
    ]
    assert ranked(every)[0].as_dict() == {
        "where": {"variant": "two hold"},
        "in_means": 2,
        "reproduced": 1,
        "undecided": 2,
        "not_reproduced": 0,
        "agreeing": pytest.approx((1.0 + 0.2 + 0.0) / 3),
    }
