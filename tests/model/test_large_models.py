"""Large models load; benchmarks/validation.py tells how quickly."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import validation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.patterns import PathIndex, matches


@pytest.mark.slow
def test_two_thousand_actors_in_ten_thousand_lines(tmp_path: Path) -> None:
    text = validation.flat(2_000)
    assert text.count("\n") > 10_000
    (tmp_path / "m.yaml").write_text(text)
    model = load_model(tmp_path / "m.yaml")
    assert (len(model.graph.actors), sum(1 for _ in model.graph.wires())) == (2_000, 2_000)
    assert (len(model.aspects), len(model.output.metrics), len(model.output.recorded)) == (400, 400, 1_200)
    assert model.aspects[399].ports == ["gap_399.a", "gap_399.b"]


def test_many_instances(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(validation.replicated(1_000))
    model = load_model(tmp_path / "m.yaml")
    assert len(model.graph.actors) == 2_001
    assert model.output.recorded == [f"robot[{index}].distance" for index in range(1_000)]
    assert model.aspects[0].ports == [f"robot[{index}].arrival.state" for index in range(1_000)]


PATHS = ["a.x", "a[0].x", "a[0].b.x", "a[1].b.x", "a[1].b[2].x", "ab.x", "c.a.x", "c[0].a[1].x", "x"]
PATTERNS = [
    "x", "a.x", "*", "*.x", "**", "**.x", "a[*].x", "a[0].*", "a[*].b.x", "a[*].b[*].x", "a[1].**", "a.*", "a.**",
    "a[*].**", "c[0].a[*].x", "c.*.x", "*[*].x", "*.b.*", "**.b[2].x", "nothing[*].x", "a[0].b.*", "a[10].*", "**.a.x",
]  # fmt: skip


@pytest.mark.parametrize("pattern", PATTERNS)
def test_an_index_selects_what_matches(pattern: str) -> None:
    assert PathIndex(PATHS).select(pattern) == [path for path in PATHS if matches(pattern, path)]
