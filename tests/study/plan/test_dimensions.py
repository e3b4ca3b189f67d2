"""What a study varies: every form of a dimension gives the conditions that it declares."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.study.study_parts import plan_of, write

HEAD = "study: s\nmodel: ./walk.yaml\n"


def values(tmp_path: Path, text: str) -> list[dict[str, Any]]:
    """The values of the columns in every condition, which identify it."""
    plan = plan_of(write(tmp_path, HEAD + text))
    conditions = list(plan)
    assert [plan.find(each.key, each.values) for each in conditions] == [each.index for each in conditions]
    return [condition.values for condition in conditions]


@pytest.mark.parametrize(
    ("vary", "expected"),
    [
        ("drift: [1, 2]", [{"drift": 1}, {"drift": 2}]),
        ("drift: [1, 2.5]", [{"drift": 1.0}, {"drift": 2.5}]),
        ("drift: [5 cm/s, 1 m/s]", [{"drift": 0.05}, {"drift": 1.0}]),
        ("fails: [[], [1, 2]]", [{"fails": "[]"}, {"fails": "[1, 2]"}]),
        ("drift: {from: 0, to: 0.3, step: 0.1}", [{"drift": each} for each in (0.0, 0.1, 0.2, 0.3)]),
        ("drift: {from: 3, to: 0, step: -2}", [{"drift": 3}, {"drift": 1}]),
        ("drift: {from: 10 cm/s, to: 30 cm/s, step: 10 cm/s}", [{"drift": each} for each in (0.1, 0.2, 0.3)]),
        (
            "both: {zip: {drift: [1, 2], pause: [0.1, 0.2]}}",
            [{"drift": 1, "pause": 0.1}, {"drift": 2, "pause": 0.2}],
        ),
        ("mode: {cases: {calm: , wild: {drift: 3, pause: 0.2}}}", [{"mode": "calm"}, {"mode": "wild"}]),
    ],
)
def test_levels_are_what_the_form_says(vary: str, expected: list[dict[str, Any]], tmp_path: Path) -> None:
    found = values(tmp_path, f"vary: {{{vary}}}\n")
    assert found == expected
    assert [[type(value) for value in each.values()] for each in found] == [
        [type(value) for value in each.values()] for each in expected
    ]


def test_settings_reach_the_model(tmp_path: Path) -> None:
    text = "set: {drift: 7}\nvary: {mode: {cases: {calm: , wild: {drift: 3}}}, walk.pause: [0.25]}\n"
    plan = plan_of(write(tmp_path, HEAD + text))
    walks = [plan.load(condition).graph.actors["walk"] for condition in plan]
    assert [(walk.drift, walk.pause) for walk in walks] == [(7.0, 0.25), (3.0, 0.25)]


def test_every_level_goes_with_every_other_and_the_last_changes_fastest(tmp_path: Path) -> None:
    (tmp_path / "gusts.yaml").write_text("disturbance: gusts\nset: {drift: 9}\n")
    text = "vary: {pause: [0.1, 0.2], fails: [[1], [2], [3]]}\ndisturb: {none: [], gusts: ./gusts.yaml}\n"
    found = [tuple(each.values()) for each in values(tmp_path, text)]
    assert found == [(a, b, c) for a in (0.1, 0.2) for b in ("[1]", "[2]", "[3]") for c in ("none", "gusts")]
    plan = plan_of(tmp_path / "walks.yaml")
    assert [plan.load(plan.condition(at)).graph.actors["walk"].drift for at in (0, 1)] == [0.0, 9.0]


def test_a_study_without_dimensions_has_one_condition(tmp_path: Path) -> None:
    assert values(tmp_path, "") == [{}]


def test_latin_hypercube_meets_every_slice_once(tmp_path: Path) -> None:
    text = "vary: {box: {latin_hypercube: {size: 20, seed: 3, ranges: {drift: [1 m/s, 3 m/s], pause: [0, 1.0]}}}}\n"
    found = values(tmp_path, text)
    for name, low, width in (("drift", 1.0, 2.0), ("pause", 0.0, 1.0)):
        slices = np.floor([(each[name] - low) / width * 20 for each in found])
        assert sorted(slices) == list(range(20))
    assert values(tmp_path, text) == found
    assert values(tmp_path, text.replace("seed: 3", "seed: 4")) != found
