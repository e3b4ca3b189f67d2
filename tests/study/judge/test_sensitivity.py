"""Sensitivity indices: against closed forms and SALib, with numbers missing, and beside other factors."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import epicycle
from epicycle.runner.model.language.sampling import Design
from epicycle.runner.model.language.study import Study, study_of_text
from epicycle.runner.study.judge.samples import Samples
from epicycle.runner.study.judge.sensitivity import Index, sensitivity
from epicycle.runner.study.judge.study_results import open_study
from tests.study.study_commands import study as study_command
from tests.study.study_parts import write

A, B = 7.0, 0.1
PI = math.pi
SHARES = {"x1": (0.3139, 0.5576), "x2": (0.4424, 0.4424), "x3": (0.0, 0.2437)}  # of Ishigami's function


def ishigami(x: dict[str, float]) -> float:
    return math.sin(x["x1"]) + A * math.sin(x["x2"]) ** 2 + B * x["x3"] ** 4 * math.sin(x["x1"])


def designed(form: str, more: str = "") -> Study:
    ranges = ", ".join(f"{name}: [{-PI}, {PI}]" for name in SHARES)
    text = f"study: s\nmodel: mm1\nvary: {{box: {{{form}, ranges: {{{ranges}}}}}}}{more}}}\n"
    return study_of_text(text, Path("s.yaml"))


def design_of(study: Study) -> Design:
    design = study.dimensions[0].design
    assert design is not None
    return design


def samples(study: Study, function: Callable[[dict[str, Any]], float | None]) -> Samples:
    """What a table would hold, if the model were a function."""
    import pyarrow as pa

    rows, index = [], 0
    last = study.dimensions[1] if len(study.dimensions) > 1 else None
    for at in range(study.dimensions[0].size):
        for each in range(1 if last is None else last.size):
            values = study.dimensions[0].level(at).values | ({} if last is None else last.level(each).values)
            rows.append({"condition": index, "replication": 0, "status": "ok", "y": function(values)})
            index += 1
    return Samples(study, pa.Table.from_pylist(rows))


def by_name(found: list[Index]) -> dict[tuple[str, str], Index]:
    return {(each.factor, each.index): each for each in found}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_sobol_indices_of_ishigamis_function(seed: int) -> None:
    found = by_name(sensitivity(samples(designed(f"sobol: {{size: 2048, seed: {seed}"), ishigami), "y"))
    assert len(found) == 6
    for name, shares in SHARES.items():
        for index, expected in zip(("first_order", "total"), shares, strict=True):
            estimate = found[name, index].estimate
            assert estimate.low - 0.01 < expected < estimate.high + 0.01
            assert estimate.value == pytest.approx(expected, abs=0.05)
            assert (estimate.count, found[name, index].missing) == (2048, 0)


def test_sobol_indices_are_those_of_salib() -> None:
    sobol = pytest.importorskip("SALib.analyze.sobol")
    made = designed("sobol: {size: 256, seed: 3")
    values = [ishigami(made.dimensions[0].level(at).values) for block in design_of(made).blocks for at in block]
    problem = {"num_vars": 3, "names": list(SHARES), "bounds": [[-PI, PI]] * 3}
    theirs = sobol.analyze(problem, np.array(values), calc_second_order=False, num_resamples=999, seed=1)
    ours = by_name(sensitivity(samples(made, ishigami), "y"))
    for at, name in enumerate(SHARES):
        for index, key in (("first_order", "S1"), ("total", "ST")):
            estimate = ours[name, index].estimate
            assert estimate.value == pytest.approx(theirs[key][at], abs=1e-9)
            assert 1.96 * estimate.error == pytest.approx(theirs[f"{key}_conf"][at], rel=0.2)


def test_elementary_effects_are_those_of_salib() -> None:
    morris = pytest.importorskip("SALib.analyze.morris")
    made = designed("morris: {size: 40, seed: 3, levels: 6")
    levels = [made.dimensions[0].level(at).values for block in design_of(made).blocks for at in block]
    problem = {"num_vars": 3, "names": list(SHARES), "bounds": [[-PI, PI]] * 3, "groups": None}
    points = np.array([[float(each[name] or 0) for name in SHARES] for each in levels])
    values = np.array([ishigami(each) for each in levels])
    theirs = morris.analyze(problem, points, values, num_levels=6, seed=1)
    ours = by_name(sensitivity(samples(made, ishigami), "y"))
    for at, name in enumerate(SHARES):
        for index in ("mu", "mu_star", "sigma"):
            assert ours[name, index].estimate.value == pytest.approx(theirs[index][at], abs=1e-9)
        assert ours[name, "mu_star"].estimate.count == 40


def test_elementary_effects_of_a_plane_are_its_slopes() -> None:
    made = designed("morris: {size: 10")
    found = by_name(sensitivity(samples(made, lambda x: 3 * x["x1"] - x["x2"] + 7), "y"))
    width = 2 * PI
    for name, slope in (("x1", 3.0), ("x2", -1.0), ("x3", 0.0)):
        assert found[name, "mu"].estimate.value == pytest.approx(slope * width)
        assert found[name, "mu_star"].estimate.value == pytest.approx(abs(slope) * width)
        assert found[name, "sigma"].estimate.value == pytest.approx(0.0, abs=1e-9)


def test_every_step_of_a_trajectory_changes_one_parameter() -> None:
    made = designed("morris: {size: 30, levels: 4")
    design, level = design_of(made), made.dimensions[0].level
    changed = set()
    for block, steps in zip(design.blocks, design.steps, strict=True):
        assert sorted(parameter for parameter, _ in steps) == [0, 1, 2]
        for before, after, (parameter, share) in zip(block, block[1:], steps, strict=False):
            one, other = level(before).values, level(after).values
            assert [name for name in SHARES if one[name] != other[name]] == [design.paths[parameter]]
            path = design.paths[parameter]
            assert float(other[path] or 0) - float(one[path] or 0) == pytest.approx(share * 2 * PI)
            changed.add((parameter, share > 0))
    assert len(changed) == 6  # each parameter rises and falls
    assert made.dimensions[0].size < sum(map(len, design.blocks))  # what comes twice is run once


def test_points_with_missing_numbers_are_left_out_with_their_blocks() -> None:
    made = designed("sobol: {size: 128")
    known = samples(made, ishigami)
    bad = [made.dimensions[0].level(block[2]).values for block in design_of(made).blocks[:7]]

    def holed(number: int) -> Samples:
        return samples(made, lambda x: None if x in bad[:number] else ishigami(x))

    few = by_name(sensitivity(holed(6), "y"))["x1", "total"]
    assert (few.estimate.count, few.missing) == (122, 6)
    assert few.estimate.value != by_name(sensitivity(known, "y"))["x1", "total"].estimate.value
    many = by_name(sensitivity(holed(7), "y"))["x1", "total"]
    assert (many.estimate.count, many.missing) == (0, 7)
    assert math.isnan(many.estimate.value)


@pytest.mark.parametrize("exponent", [-900, 900])
def test_shares_do_not_depend_on_the_unit(exponent: int) -> None:
    study = designed("sobol: {size: 64, seed: 1")
    usual = sensitivity(samples(study, ishigami), "y")
    assert sensitivity(samples(study, lambda x: math.ldexp(ishigami(x), exponent)), "y") == usual


def test_a_metric_that_does_not_vary_has_no_shares() -> None:
    found = sensitivity(samples(designed("sobol: {size: 16"), lambda x: 0.1), "y")
    assert all(math.isnan(each.estimate.value) for each in found)


def test_indices_at_each_level_of_the_other_factors() -> None:
    made = designed("sobol: {size: 512", ", gain: [1, 0]")
    found = sensitivity(samples(made, lambda x: x["x1"] + x["gain"] * x["x2"]), "y")
    shares = {(each.where["gain"], each.factor): each.estimate.value for each in found if each.index == "total"}
    expected = {(1, "x1"): 0.5, (1, "x2"): 0.5, (0, "x1"): 1.0, (0, "x2"): 0.0, (1, "x3"): 0.0, (0, "x3"): 0.0}
    assert shares == pytest.approx(expected, abs=0.03)


STUDY = """
study: walks
model: ./walk.yaml
vary:
  box: {FORM: {size: 8, seed: 1, ranges: {drift: [-1 m/s, 1 m/s], scale.factor: [1, 3]}}}
replications: 2
metrics: {place: place}
"""


@pytest.mark.slow
@pytest.mark.parametrize(("form", "index", "runs"), [("sobol", "total", 64), ("morris", "mu_star", None)])
def test_a_study_gives_indices_and_its_report_shows_them(
    form: str, index: str, runs: int | None, tmp_path: Path
) -> None:
    write(tmp_path, STUDY.replace("FORM", form))
    assert study_command(tmp_path, "--jobs", 2) == 0
    results = open_study(tmp_path / "out")
    assert runs is None or results.counts() == {"ok": runs}
    found = {row["factor"]: row for row in results.sensitivity("place") if row["index"] == index}
    assert found["drift"]["value"] > 0.5
    assert found["scale.factor"]["value"] == pytest.approx(0.0, abs=1e-9)
    assert found["drift"]["low"] <= found["drift"]["value"] <= found["drift"]["high"]
    [report] = [path for path in epicycle.save(results, tmp_path / "report") if path.name == "report.html"]
    page = report.read_text(encoding="utf-8")
    assert "<h2>Sensitivity</h2>" in page
    assert index.replace("_", " ") in page
    with pytest.raises(
        epicycle.EpicycleError, match=r"out has no metric 'plaec', did you mean 'place'\?; it has place$"
    ):
        results.sensitivity("plaec")


def test_a_study_without_a_design_has_no_indices(done: Path) -> None:
    assert open_study(done / "out").sensitivity("place") == []
