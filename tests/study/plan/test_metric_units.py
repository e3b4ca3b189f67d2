"""Metrics of studies have units: declared or the model's, converted on demand, and shown with their values."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from epicycle.runner import ModelError, open_study
from epicycle.runner.interface.cli import main
from epicycle.runner.study.plan.plan import Plan
from epicycle.runner.study.run.manifest import read_manifest
from epicycle.runner.study.session import run_study
from tests.study.study_parts import MODEL, STUDY, plan_of, write

UNITS = MODEL.replace("{of: walk.output, take: last}", "{of: walk.output, take: last, unit: m, doc: where it ends}")
METRICS = """
metrics:
  place: place
  in_km: {value: place, to: km}
  highest: {value: highest, unit: m, to: cm, doc: the farthest point}
  speed: {value: place / end, unit: m/s, to: km/h}
  pure: {value: place / highest}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write(tmp_path, STUDY[: STUDY.index("metrics:")] + METRICS.lstrip(), UNITS)
    return tmp_path


def test_table_holds_numbers_in_the_units_that_are_asked_for(folder: Path) -> None:
    plan = plan_of(folder / "walks.yaml")
    run_study(plan, folder / "out", jobs=1)
    rows = open_study(folder / "out").table().to_pylist()
    assert len(rows) == 10
    for row in rows:
        assert row["status"] == "ok"
        assert row["in_km"] == pytest.approx(row["place"] / 1000, rel=1e-15)
        assert row["speed"] == pytest.approx(row["place"] / 9 * 3.6, rel=1e-15)
        assert row["pure"] == pytest.approx(row["place"] / row["highest"] * 100, rel=1e-15)
    assert plan.columns["place"].unit == "m"
    assert plan.columns["in_km"].doc == "where it ends"
    # Read from the folder alone, it continues in the same units.
    again = Plan.of_manifest(read_manifest(folder / "out"))
    assert [(each.unit, each.to) for each in again.metrics] == [(each.unit, each.to) for each in plan.metrics]
    assert [again.condition(index).key for index in range(2)] == [plan.condition(index).key for index in range(2)]


def test_parquet_says_what_the_columns_are(folder: Path) -> None:
    run_study(plan_of(folder / "walks.yaml"), folder / "out", jobs=1)
    schema = pq.read_schema(folder / "out" / "table.parquet")
    found = {
        name: {key.decode(): text.decode() for key, text in metadata.items() if not key.startswith(b"PARQUET")}
        for name in schema.names
        if (metadata := schema.field(name).metadata)
    }
    assert {name: said for name, said in found.items() if said} == {
        "drift": {"unit": "m/s", "doc": "mean step"},
        "place": {"unit": "m", "doc": "where it ends"},
        "in_km": {"unit": "km", "doc": "where it ends"},
        "highest": {"unit": "cm", "doc": "the farthest point"},
        "speed": {"unit": "km/h"},
    }
    assert open_study(folder / "out").table().schema.field("speed").metadata == {b"unit": b"km/h"}


@pytest.mark.slow
def test_report_shows_the_units(folder: Path) -> None:
    run_study(plan_of(folder / "walks.yaml"), folder / "out", jobs=1)
    assert main(["report", str(folder / "out")]) == 0
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    for heading in ("in km (km)", "highest (cm)", "speed (km/h)", "place (m)"):
        assert heading in page
    assert "the farthest point" in page


def test_another_unit_makes_other_runs(folder: Path) -> None:
    before = plan_of(folder / "walks.yaml").condition(0).key
    path = folder / "walks.yaml"
    for old, new in (("to: cm", "to: mm"), ("unit: m, to: mm, ", "")):
        path.write_text(path.read_text().replace(old, new))
        assert plan_of(path).condition(0).key != before


def problems_of(path: Path, study: str) -> str:
    """The errors of a study."""
    path.write_text(study)
    with pytest.raises(ModelError) as caught:
        plan_of(path)
    return str(caught.value).replace(f"{path.parent}/", "")


def test_what_is_wrong_is_told(folder: Path) -> None:
    path = folder / "walks.yaml"
    metrics = """
metrics:
  a: {value: place, unit: s}
  b: {value: highest, to: km}
  c: {value: place, to: s}
  d: {value: place * 2, unit: m, to: mk}
  e: {unit: m}
  f: {value: [place], docs: x}
"""
    study = STUDY[: STUDY.index("metrics:")] + metrics.lstrip()
    assert problems_of(path, study) == (
        "walks.yaml:13:3: error: metric 'e' has no value\n"
        "   13 |   e: {unit: m}\n"
        "      |   ^\n"
        "   help: add 'value: ...', an expression\n"
        "\n"
        "walks.yaml:14:14: error: metric 'f' is not an expression\n"
        "   14 |   f: {value: [place], docs: x}\n"
        "      |              ^^^^^^^\n"
        "\n"
        "walks.yaml:14:23: error: metric 'f' has no key 'docs', did you mean 'doc'?\n"
        "   14 |   f: {value: [place], docs: x}\n"
        "      |                       ^^^^\n"
        "   help: valid keys: value, unit, to, doc, label\n"
        "3 errors in walks.yaml"
    )
    assert problems_of(path, "\n".join(line for line in study.splitlines() if line[:4] not in ("  e:", "  f:"))) == (
        "walks.yaml:9:27: error: metric a: place has the unit m, not s\n"
        "    9 |   a: {value: place, unit: s}\n"
        "      |                           ^\n"
        "   help: leave 'unit' out; 'to: ...' converts\n"
        "\n"
        "walks.yaml:10:27: error: metric b: without a unit, it cannot be converted to km\n"
        "   10 |   b: {value: highest, to: km}\n"
        "      |                           ^^\n"
        "   help: add 'unit: ...', the unit of the tokens\n"
        "\n"
        "walks.yaml:11:25: error: metric c: '1 m' is a length, expected a time in s\n"
        "   11 |   c: {value: place, to: s}\n"
        "      |                         ^\n"
        "\n"
        "walks.yaml:12:38: error: metric d: unknown unit 'mk', did you mean 'm'?\n"
        "   12 |   d: {value: place * 2, unit: m, to: mk}\n"
        "      |                                      ^^\n"
        "4 errors in walks.yaml"
    )


def test_the_end_is_the_stop_time_of_a_run_that_came_to_it(tmp_path: Path) -> None:
    model = MODEL.replace("record: [walk.output]", "record: [walk.output], stop: 40 s")
    model = model.replace("  scale:", "  clock: {type: Clock, period: 15 s}\n  scale:")
    write(tmp_path, STUDY.replace("place: place", "end: {value: end, unit: s}"), model)
    run_study(plan_of(tmp_path / "walks.yaml"), tmp_path / "out", jobs=1)
    assert {row["end"] for row in open_study(tmp_path / "out").table().to_pylist()} == {40.0}
