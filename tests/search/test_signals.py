"""Searches that vary lists of numbers, such as the values of an input one after the other."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main
from epicycle.runner.search import proposals as proposing

SIGNALS = """
model: driven
parameters: {push: {value: [0, 0, 0, 0], unit: N}, wind: [0.5, 0.5]}
actors:
  push: {type: Clock, period: 1 s, values: "${push}"}
  wind: {type: Clock, period: 2 s, values: "${wind}"}
  way: {type: ODE, initial: {x: 0}, derivatives: {x: push - wind}}
  seen: {type: Clock, period: 0.5 s, offset: 0.5 s}
connections: [push.output -> way.push, wind.output -> way.wind, seen.output -> way.trigger]
run: {stop: 4 s}
monitors: {near: always way.x < 7, there: always way.x < 1000}
"""


def test_a_range_of_a_list_is_that_of_each_of_its_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("driven.yaml").write_text(SIGNALS, encoding="utf-8")
    given = ["--vary", "push=0 N..2 N", "--vary", "wind=0..1", "--out", "out", "--jobs", "1"]
    assert main(["search", "driven.yaml", "--break", "near", *given]) == 3
    said = capsys.readouterr().out.splitlines()[0]
    assert said == (
        'Run 4, with push=["2.0 N", "2.0 N", "2.0 N", "2.0 N"], wind=[0.0, 0.0] and seed 3, breaks near (always '
        "way.x < 7): broken at 3.5 s, where way.x = 7. Tried: 4 runs, seeds 0 to 3, push with 4 numbers from 0 to 2 N, "
        "wind with 2 numbers from 0 to 1."
    )


def test_signals_begin_constant_at_the_ends_and_then_rarely_change() -> None:
    batches = proposing.proposals([4, 1], 0, guided=False)
    corners = next(batches)
    assert sorted(corners) == [(one,) * 4 + (two,) for one in (0.0, 1.0) for two in (0.0, 1.0)]
    assert corners == next(proposing.proposals([4, 1], 0, guided=True))
    assert corners != next(proposing.proposals([4, 1], 1, guided=False))
    seen, points = set(), corners
    for _ in range(20):
        points = batches.send([1.0] * len(points))
        assert len(points) == proposing.SMALL
        for place, point in enumerate(points):
            values = set(point)
            assert (values <= {0.0, 1.0}) is (place % 2 == 1)
            seen.add(sum(one != other for one, other in pairwise(point[:4])))
    assert seen == {0, 1, 2, 3}


def test_signals_are_guided_where_margins_differ() -> None:
    pytest.importorskip("cma")
    batches = proposing.proposals([3, 2], 0, guided=True)
    points = next(batches)
    for number in range(3):  # no slope
        points = batches.send([0.0] * len(points))
        assert points == proposing.stepped([3, 2], 0, number)
    for _ in range(25):
        points = batches.send([sum(abs(share - 0.3) for share in point) for point in points])
    assert all(abs(share - 0.3) < 0.2 for point in points for share in point)
    assert len(points) == proposing.SMALL
