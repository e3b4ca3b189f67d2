"""What a study varies: every form of a dimension gives the conditions that it declares."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.runner.model.language.dimensions import Dimension
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
        ("drift: {from: 1, to: 1, step: 1e-30}", [{"drift": 1.0}]),
        (f"drift: {{from: {10**17}, to: {10**17 + 2}, step: 1}}", [{"drift": 10**17 + each} for each in range(3)]),
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


def test_the_levels_of_a_claim_are_looked_up_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not anew for each level that the claim names, of which there may be thousands."""
    made: list[int] = []
    monkeypatch.setattr(Dimension, "level", lambda self, at, level=Dimension.level: made.append(at) or level(self, at))
    few = ", ".join(map(str, range(100)))
    claims = f"claims: {{c: {{less: place, at: {{drift: [{few}]}}}}}}\n"
    plan_of(write(tmp_path, f"{HEAD}metrics: [place]\nvary: {{drift: {{from: 0, to: 199, step: 1}}}}\n{claims}"))
    assert len(made) < 2000


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


@pytest.mark.parametrize("form", ["sobol: {size: 8", "morris: {size: 8"])
def test_points_of_a_design_lie_in_their_ranges_and_depend_on_the_seed_alone(form: str, tmp_path: Path) -> None:
    text = f"vary: {{box: {{{form}, seed: 3, ranges: {{drift: [1 m/s, 3 m/s], pause: [0, 1.0]}}}}}}}}\n"
    found = values(tmp_path, text)
    assert all(1.0 <= each["drift"] <= 3.0 and 0.0 <= each["pause"] <= 1.0 for each in found)
    assert values(tmp_path, text) == found
    assert values(tmp_path, text.replace("seed: 3", "seed: 4")) != found


def test_sobol_points_meet_every_slice_once(tmp_path: Path) -> None:
    text = "vary: {box: {sobol: {size: 16, seed: 3, ranges: {drift: [1 m/s, 3 m/s], pause: [0, 1.0]}}}}\n"
    plan = plan_of(write(tmp_path, HEAD + text))
    design = plan.study.dimensions[0].design
    for at in (0, -1):  # A and B
        points = [plan.condition(block[at]).values for block in design.blocks]
        for name, low, width in (("drift", 1.0, 2.0), ("pause", 0.0, 1.0)):
            assert sorted(np.floor([(each[name] - low) / width * 16 for each in points])) == list(range(16))
