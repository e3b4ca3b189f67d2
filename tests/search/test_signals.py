"""Searches that vary lists of numbers, such as the values of an input one after the other."""

from __future__ import annotations

from collections.abc import Callable
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


def test_signals_begin_constant_at_the_ends_the_best_corner_first() -> None:
    for seed in range(8):
        batches = proposing.proposals([4, 1], seed, guided=False)
        first, spread = next(batches)
        assert len(set(spread)) == 5
        corners = [first]
        for _ in range(3):  # least where the first signal is 1 and the second 0
            corners += batches.send([1.0 - point[0] + point[4] for point in (corners[-1], spread)][: len(corners)])
        assert sorted(corners) == [(one,) * 4 + (two,) for one in (0.0, 1.0) for two in (0.0, 1.0)]
        assert corners.index((1.0, 1.0, 1.0, 1.0, 0.0)) < 3
        assert corners[0] == next(proposing.proposals([4, 1], seed, guided=True))[0]
    assert len({next(proposing.proposals([4, 1], seed, guided=False))[0] for seed in range(8)}) > 1


def _searched(widths: list[int], robustness: Callable[[proposing.Point], float]) -> list[proposing.Point]:
    """Points of a search, without the corners, with which it begins."""
    batches, found = proposing.proposals(widths, 0, guided=False), list[proposing.Point]()
    points = next(batches)
    for _ in range(100):
        if len(points) == proposing.SMALL:
            found += points
        points = batches.send(list(map(robustness, points)))
    return found


def test_signals_are_as_different_as_can_be_where_robustness_tells_nothing() -> None:
    found = [point for point in _searched([6, 6], lambda point: 0.0) if not set(point) <= {0.0, 1.0}]
    assert {len(set(point)) for point in found} == {12}
    assert len(found) > 250


def test_signals_are_guided_where_robustness_differs() -> None:
    def distance(point: proposing.Point) -> float:
        return sum(abs(share - 0.3) for share in point)

    assert min(map(distance, _searched([3, 2], distance))) < 0.2


def test_signals_are_oftener_of_a_kind_that_was_good() -> None:
    found = _searched([8, 8], lambda point: sum(abs(share - 0.5) for share in point))
    assert sum(set(point) <= {0.0, 1.0} for point in found[200:]) < 30
