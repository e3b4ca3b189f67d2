"""Metrics of which no statistics can be made: they are infinite, or nearly."""

from __future__ import annotations

from pathlib import Path

import pytest

import epicycle

MODEL = """\
model: huge
parameters: {size: {value: 1.0, doc: what is sent}}
actors:
  one: {type: Const, value: "${size}"}
  kept: {type: Recorder}
connections: [one.output -> kept.input]
run: {stop: 1 s}
metrics: {size: {of: one.output, take: last, doc: what was sent}}
"""


@pytest.mark.parametrize("size", [1e306, -1.7e308, float("inf")])
def test_huge_metrics_count_as_missing(size: float, tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    path.write_text(MODEL, encoding="utf-8")
    variants = {"small": {"set": {"size": 2.0}}, "huge": {"set": {"size": size}}}
    found = epicycle.compare(path, variants, replications=2, out=tmp_path / "out", progress=False)
    assert [*found.values("small", "size").values()] == [2.0, 2.0]
    assert found.values("huge", "size") == {}
