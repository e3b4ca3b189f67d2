"""Reports of studies: what stands in them, that it is true, and that it hangs on nothing else."""

from __future__ import annotations

import json
import re
import shutil
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.runner import Simulation, load_model, open_study
from epicycle.runner.interface.cli import main
from epicycle.runner.model.language.study import read_study
from epicycle.runner.model.language.study_metric import StudyMetric
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.canvas import style
from epicycle.runner.show.report import figures_of_study
from epicycle.runner.show.report.data import Data
from epicycle.runner.show.report.figure import Layout, roles
from epicycle.runner.show.report.of_signals import over_time
from epicycle.runner.show.report.of_table import Distributions, Means
from epicycle.runner.show.sheet import Sheet
from epicycle.runner.study.inference import half_width
from epicycle.runner.study.plan.columns import Column, si_unit
from epicycle.runner.study.plan.plan import Plan
from epicycle.runner.study.run.manifest import manifest_text
from epicycle.runner.study.run.runner import Replay, ReplayError, repeat
from tests.study.study_parts import STUDY, THIS, moved, write

QUEUE = """
study: queue
doc: How long customers wait.
model: mm1
vary: {load: [0.5, 0.9], mean_service: [500 ms, 1 s, 2 s]}
replications: 4
metrics: [mean_wait, longest_wait]
claims: {load_hurts: {rises: mean_wait, over: load}}
guideline: {choose: mean_service, least: mean_wait}
"""
WHEEL = """
model: wheel
parameters: {speed: {value: 1, unit: m/s, doc: at the rim}, radius: {value: 2, unit: m}}
actors:
  clock: {type: Clock, period: 0.1 s}
  wheel: {type: CircularMotion, start: [0, 2], speed: "${speed}", turn_rate: "${speed / radius}"}
connections: [clock.output -> wheel.trigger]
run: {stop: 2 s, record: [wheel.state]}
metrics: {ticks: {of: clock.output, take: count}}
figures: {way: {type: Trajectories, robots: wheel.state}}
"""
WHEELS = """
study: wheels
model: ./wheel.yaml
vary: {speed: [1 m/s, 200 cm/s]}
replications: 3
figures:
  ways: {type: Tracks, signals: wheel.state, marks: {hub: [0, 0]}, runs: 2}
  height: {type: Series, signal: wheel.state, value: "token.position[1]", label: height (m)}
  one: {type: SingleRun, figure: way, metric: ticks, where: {speed: 2 m/s}}
"""


class Page(HTMLParser):
    """A parsed page: its tables as rows of texts, by the heading before each, and all attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: Counter[str] = Counter()
        self.attributes: list[tuple[str, str, str]] = []
        self.tables: dict[str, list[list[str]]] = {}
        self.heading = ""
        self.text = ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in ("img", "meta", "br"):
            self.open.append(tag)
        if tag in ("h2", "h3"):
            self.heading = ""
        elif tag == "tr":
            self.tables.setdefault(self.heading, []).append([])
        elif tag in ("td", "th"):
            self.tables[self.heading][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data if not {"style", "script"} & {*self.open} else ""
        if {"h2", "h3"} & set(self.open) and "small" not in self.open:
            self.heading = (self.heading + data).strip()
        elif {"td", "th"} & set(self.open):
            self.tables[self.heading][-1][-1] += data


def page(folder: Path) -> Page:
    return Page((folder / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def queue(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a study of a queue, with its report."""
    folder = tmp_path_factory.mktemp("queue")
    model = (Path(__file__).parents[3] / "models" / "mm1.yaml").read_text().replace("stop: 4000 s", "stop: 200 s")
    (folder / "mm1.yaml").write_text(model)
    (folder / "queue.yaml").write_text(QUEUE.replace("model: mm1", "model: ./mm1.yaml"))
    assert main(["study", str(folder / "queue.yaml"), "--out", str(folder / "out"), "--jobs", "2"]) == 0
    assert main(["report", str(folder / "out")]) == 0
    return folder / "out"


# -- what stands in it ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("metric", ["mean_wait", "longest_wait"])
def test_means_are_those_of_the_table(metric: str, queue: Path) -> None:
    head, *rows = page(queue).tables[f"{metric.replace('_', ' ')} (s)"]
    assert head == ["load", *(f"mean service {level} s" for level in ("0.5", "1", "2"))]
    shown = {(float(row[0]), level): cell for row in rows for level, cell in zip((0.5, 1.0, 2.0), row[1:], strict=True)}
    means = open_study(queue).means(metric)
    assert len(means) == len(shown) == 6
    for each in means:
        found = re.fullmatch(r"([\d.,]+) ± ([\d.,]+)", shown[each["load"], each["mean_service"]])
        assert found is not None
        value, half = (float(number.replace(",", "")) for number in found.groups())
        true_half = (each["high"] - each["low"]) / 2
        assert abs(half - true_half) <= 0.05 * true_half
        assert abs(value - each["value"]) <= 0.05 * true_half


def test_page_tells_of_the_study_and_of_nothing_else(queue: Path) -> None:
    found = page(queue)
    assert found.tables["Study"][1:] == [
        ["load", "0.5, 0.9", "", "share of the time in which the server is busy"],
        ["mean_service", "0.5, 1, 2", "s", "mean service time"],
    ]
    assert found.tables["Runs"] == [["status", "runs"], ["ok", "24"]]
    facts = dict(map(tuple, found.tables["Provenance"][1:]))
    manifest = json.loads((queue / "manifest.json").read_text())
    assert facts["date"] == manifest["date"]
    assert facts["SHA-256 of the table"] == open_study(queue).digest()
    for word in ("robot", "obstacle", "observer", "arrival"):
        assert word not in found.text.lower()
    assert sorted(path.name for path in (queue / "figures").iterdir()) == sorted(
        f"{metric}_{what}.{ending}"
        for metric in ("mean_wait", "longest_wait")
        for what in ("mean", "runs")
        for ending in ("png", "svg")
    )


def test_claims_and_guideline(queue: Path) -> None:
    results, found = open_study(queue), page(queue)
    (judgement,) = results.claims()
    claims = json.loads((queue / "claims.json").read_text())
    assert claims["claims"] == [json.loads(json.dumps(judgement.as_dict()))]
    assert claims["table"] == results.digest()
    assert found.tables["Claims"][1][:3] == ["load_hurts", judgement.verdict, " mean wait rises over load"]
    rows = [row for row in found.tables["Claims"] if row[0].startswith("mean wait (s), load: 0.9 less load: 0.5; ")]
    assert len(rows) == len(judgement.findings) == 3
    (weakest,) = (row for row, each in zip(rows, judgement.findings, strict=True) if each == judgement.weakest)
    assert found.tables["Claims"][1][-1] == f"{weakest[1]} ({weakest[2]}) {weakest[0]}"
    for row, finding in zip(rows, judgement.findings, strict=True):
        assert float(row[1]) == pytest.approx(finding.value, abs=0.05 * (finding.high - finding.low))
        assert row[-1] == finding.outcome
    best = [(row[0], row[1], row[5]) for row in found.tables["Guideline"][1:]]
    assert best == [
        (f"{each.where['load']:g}", f"{each.best:g}", f"{each.sufficient:g}") for each in results.guideline()
    ]


@pytest.mark.slow
def test_same_table_same_report_that_needs_nothing_else(queue: Path, tmp_path: Path) -> None:
    for name in ("first", "second"):
        assert main(["report", str(queue), "--out", str(tmp_path / name)]) == 0
    files = sorted(path.relative_to(tmp_path / "first") for path in (tmp_path / "first").rglob("*.*"))
    assert len(files) == 10
    for file in files:
        assert (tmp_path / "first" / file).read_bytes() == (tmp_path / "second" / file).read_bytes(), file
    found = page(tmp_path / "first")
    links = [value for _, name, value in found.attributes if name in ("href", "src", "srcset", "data", "action")]
    assert len(links) > 4
    assert all(re.match(r"#\w|data:image/svg\+xml;base64,", value) for value in links)
    assert not found.tags.keys() & {"link", "iframe", "object", "base"}
    assert not [name for _, name, _ in found.attributes if name.startswith("on") or name == "style"]
    assert not re.search(
        r"url\(|@import|://(?!www\.w3\.org/2000/svg)", (tmp_path / "first" / "report.html").read_text()
    )


# -- studies that are not as they should be ---------------------------------------------------------------------------


def test_unfinished_and_failed_runs_and_hostile_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hostile = "<script>alert('&\"')</script>"
    study = STUDY.replace("study: walks", f"study: walks\ndoc: {json.dumps(hostile)}\nset: {{fails: [1]}}")
    study = study.replace(
        "  drift: [0 m/s, 100 cm/s]", f"  wind: {{cases: {{{json.dumps(hostile)}: , calm: {{drift: 1}}}}}}"
    )
    study += 'figures: {a: {type: Means, metric: place, doc: "<img src=x>", labels: {wind: "<b>"}}}\n'
    write(tmp_path, study)
    out = tmp_path / "out"
    command = ["study", str(tmp_path / "walks.yaml"), "--types", str(THIS), "--out", str(out), "--replications", "3"]
    assert main(command) == 1
    manifest = json.loads((out / "manifest.json").read_text())
    (out / "manifest.json").write_text(manifest_text({**manifest, "replications": 5}))
    capsys.readouterr()
    assert main(["report", str(out)]) == 0
    found = page(out)
    assert (found.tags["script"], found.tags["b"]) == (1, 1)  # the page's own, and what stands before each caption
    assert all(value.startswith("data:") for tag, name, value in found.attributes if (tag, name) == ("img", "src"))
    assert hostile in found.text
    assert found.tables["Runs"] == [["status", "runs"], ["ok", "4"], ["failed", "2"], ["missing", "4"]]
    assert "The study is not finished: 4 runs missing." in found.text
    failures = open_study(out).failures()
    shown = found.tables["Runs without a result"][1:]
    assert shown == [
        ["failed", f"wind: {row['wind']}", "21", row["error"], f"epicycle run {out}/{row['run'][:12]}"]
        for row in failures
    ]
    assert "6 runs in 2 conditions, 2 of them failed." in found.text
    assert "Set in all runs: fails = [1]" in found.text
    assert "pre" in found.tags  # errors keep their lines
    # One factor: a row for each condition; and what is there is said beside each mean.
    assert [row[0] for row in found.tables["Means"][1:3]] == [hostile, "calm"]
    assert all(cell.endswith("2 of 3") for cell in found.tables["Means"][1][1:4])


def test_nothing_there_yet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, STUDY.replace("drift: [0 m/s, 100 cm/s]", "fails: [[0, 1, 2, 3, 4]]"))
    out = tmp_path / "out"
    assert main(["study", str(tmp_path / "walks.yaml"), "--types", str(THIS), "--out", str(out)]) == 1
    capsys.readouterr()
    assert main(["report", str(out)]) == 1
    problem = "figure place_mean: none of the runs that it shows has been made"
    assert f"error: {problem}\n" in capsys.readouterr().err
    assert "This figure could not be drawn: none of the runs that it shows has been made" in page(out).text
    assert main(["report", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"error: {tmp_path} holds no results of a study: it has no manifest.json\n"


def test_bad_figures_are_told_before_anything_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, STUDY + "figures: {a: {type: Series, signal: walk.outptu}}\n")
    for command in (["study", "--out", str(tmp_path / "out")], ["validate"]):
        assert main([command[0], str(path), "--types", str(THIS), *command[1:]]) == 2
        message = "figure a: 'walk.outptu' matches no output port, did you mean 'walk.output'?"
        assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


# -- figures of signals -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a study whose figures need signals."""
    folder = tmp_path_factory.mktemp("wheels")
    (folder / "wheel.yaml").write_text(WHEEL)
    (folder / "wheels.yaml").write_text(WHEELS)
    assert main(["study", str(folder / "wheels.yaml"), "--out", str(folder / "out")]) == 0
    return folder / "out"


@pytest.mark.slow
def test_repeated_runs_give_the_signals_of_single_ones(wheels: Path) -> None:
    data = Data(open_study(wheels))
    figures = figures_of_study(data.plan, Problems())
    readers = tuple((name, figure) for name, figure in figures.items())
    row = next(row for row in data.rows if row["condition"] == 1)
    (found,) = repeat(data.plan, [Replay(1, 0, row["seed"], row["digest"], readers)], 1)  # type: ignore[arg-type]
    model = load_model(wheels.parent / "wheel.yaml", set={"speed": 2.0})
    model.record("wheel.state")
    state = Simulation(model, seed=row["seed"]).run()["wheel.state"]
    times, heights, end = found[1]["height"]
    np.testing.assert_array_equal(times, state.times)
    np.testing.assert_array_equal(heights, state["position"][:, 1])
    np.testing.assert_allclose(heights, 2 * np.cos(times), atol=1e-9)  # a radius of 2 m, and 2 m/s
    assert end == pytest.approx(2.0)
    (way,) = found[1]["ways"]["ways"]
    assert way.signal == "wheel.state"
    np.testing.assert_array_equal(way.times, state.times)
    np.testing.assert_array_equal(way.points, state["position"])
    assert found[1]["one"]["svg"].startswith(b"<?xml")
    with pytest.raises(ReplayError) as caught:
        list(repeat(data.plan, [Replay(1, 0, row["seed"], "0" * 64, ())], 1))
    assert str(caught.value) == (
        f"run 0 of condition 1 (seed 0) gave a different result: its digest is {row['digest'][:16]}..., "
        "but was 0000000000000000...; something has changed since"
    )


@pytest.mark.slow
def test_report_repeats_runs(wheels: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(wheels), "--jobs", "2"]) == 0
    found = page(wheels)
    assert "The first 2 runs of each condition; dots are 0.5 s apart." in found.text
    assert "Replication 0 (speed: 2 m/s, seed 0), which has the most ticks: 21." in found.text
    shutil.copytree(wheels.parent, tmp_path / "copy")
    manifest = json.loads((tmp_path / "copy" / "out" / "manifest.json").read_text())
    manifest = moved(manifest, tmp_path / "copy" / "wheels.yaml")
    (tmp_path / "copy" / "out" / "manifest.json").write_text(manifest_text(manifest))
    (tmp_path / "copy" / "wheel.yaml").write_text(WHEEL + "# changed\n")
    capsys.readouterr()
    assert main(["report", str(tmp_path / "copy" / "out")]) == 1
    out = tmp_path / "copy" / "out"
    assert capsys.readouterr().err.splitlines()[0] == (
        f"error: figure ways: the model has changed since {out} was made: wheel.yaml"
    )
    assert "This figure could not be drawn: the model has changed since" in page(out).text


def test_mean_over_time() -> None:
    """Between two tokens the first one holds; a run that is over is known no more, and half of them are needed."""
    runs = [
        (np.array([0.0, 2.0]), np.array([1.0, 5.0]), 3.0),
        (np.array([1.0]), np.array([3.0]), 1.5),
        (np.array([0.0]), np.array([2.0]), 3.0),
    ]
    times, means, halves = over_time(runs)
    assert times.tolist() == [0.0, 1.0, 2.0]
    assert means.tolist() == [1.5, 2.0, 3.5]
    assert halves.tolist() == pytest.approx(
        [half_width([1.0, 2.0]), half_width([1.0, 3.0, 2.0]), half_width([5.0, 2.0])]
    )
    assert over_time([])[0].size == 0
    assert over_time([(np.arange(5000.0), np.arange(5000.0), 5000.0)])[0].size == 400


# -- what stands where ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fixed", "over", "lines", "panels", "expected"),
    [
        ({}, None, None, (), ("load", "day", ("mean_service", "a"))),
        ({"load": 0.5}, None, None, (), ("mean_service", "day", ("a",))),
        ({"load": [0.5, 0.9]}, "day", None, (), ("day", "load", ("mean_service", "a"))),
        ({}, None, "load", ("day",), ("mean_service", "load", ("day", "a"))),
        ({"load": 0.5, "mean_service": 1.0, "day": "calm", "b": 1}, None, None, (), (None, None, ())),
    ],
)
def test_every_factor_is_shown_somewhere(
    fixed: dict[str, object],
    over: str | None,
    lines: str | None,
    panels: tuple[str, ...],
    expected: tuple[str | None, str | None, tuple[str, ...]],
    tmp_path: Path,
) -> None:
    (tmp_path / "s.yaml").write_text(
        "study: s\nmodel: mm1\nvary: {day: {cases: {calm: , busy: }}, load: [0.5, 0.9], mean_service: [1.0, 2.0],"
        " both: {zip: {a: [1, 2], b: [1, 2]}}}\n"
    )
    plan = Plan(read_study(tmp_path / "s.yaml"), [], {}, [{}, {}, {}, {}], {}, {}, "0")
    assert roles(plan, fixed, over, lines, panels, has_axis=True) == expected


@pytest.mark.parametrize(
    ("vary", "figures"),
    [
        ("", ["one_runs"]),
        ("vary: {load: [0.5, 0.9]}", ["one_mean", "one_runs"]),
        ("vary: {day: {cases: {calm: , busy: {load: 0.9}}}}", ["one_mean", "one_runs"]),
        (
            "vary: {box: {latin_hypercube: {size: 4, ranges: {load: [0.1, 0.9], mean_service: [1 s, 2 s]}}}}",
            ["one_mean_1", "one_mean_2"],
        ),
    ],
)
def test_figures_of_a_study_that_names_none(vary: str, figures: list[str], tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text(f"study: s\nmodel: mm1\n{vary}\n")
    study = read_study(tmp_path / "s.yaml")
    plan = Plan(study, [StudyMetric("one", "1")], {}, [{} for _ in study.dimensions], {}, {}, "0")
    problems = Problems()
    found = figures_of_study(plan, problems)
    assert list(found) == figures
    assert [complaint for figure in found.values() for complaint in figure.complaints(plan)] == []
    assert len(problems) == 0


def test_panels_and_lines_keep_apart_what_differs(queue: Path) -> None:
    data = Data(open_study(queue))
    figure = Means(metric="mean_wait", where={"mean_service": [2.0, 0.5]})
    arranged = Layout(data, figure, roles(data.plan, figure.where, "load", None, (), has_axis=True))
    assert arranged.levels == [2.0, 0.5]  # as it is written
    places = [each.index for panel in arranged.panels for line in panel.lines.values() for each in line]
    assert sorted(places) == [0, 2, 3, 5]
    by_panel = Layout(data, figure, roles(data.plan, {}, "load", "", ("mean_service",), has_axis=True))
    assert [panel.title for panel in by_panel.panels] == ["mean service: 2 s", "mean service: 0.5 s"]


@pytest.mark.slow
def test_names_of_levels_stand_along_the_axis_however_many_there_are(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    days = ", ".join(f"day_{day}: {{load: 0.{day + 10}}}" for day in range(20))
    model = (Path(__file__).parents[3] / "models" / "mm1.yaml").read_text().replace("stop: 4000 s", "stop: 200 s")
    (tmp_path / "mm1.yaml").write_text(model)
    (tmp_path / "s.yaml").write_text(
        f"study: s\nmodel: ./mm1.yaml\nvary: {{day: {{cases: {{{days}}}}}}}\nmetrics: [customers]\nreplications: 1\n"
    )
    assert main(["study", str(tmp_path / "s.yaml"), "--out", str(tmp_path / "out")]) == 0
    data, drawn = Data(open_study(tmp_path / "out")), list[Any]()
    monkeypatch.setattr(Sheet, "save", lambda sheet, paths: drawn.extend(sheet.axes))
    for figure in (Means(metric="customers"), Distributions(metrics="customers")):
        with style():
            figure.draw(data, {}, [])
    for axes in drawn:
        assert [text.get_text() for text in axes.get_xticklabels()] == [f"day_{day}" for day in range(0, 20, 2)]


def test_units_of_columns(queue: Path) -> None:
    plan = open_study(queue).plan
    assert plan.columns["mean_service"] == Column("s", "mean service time")
    assert plan.columns["load"].unit == "1"
    units = {"cm": "m", "km/h": "m/s", "deg/s": "rad/s", "%": "1", "Hz": "Hz", "N": "N", "kW": "m^2 kg/s^3", "min": "s"}
    assert {unit: si_unit(unit) for unit in units} == units


def test_signals_that_are_infinite_leave_gaps_in_their_means() -> None:
    times = np.array([0.0, 1.0, 2.0])
    runs = [(times, np.array([1.0, end, 3.0]), 2.0) for end in (np.inf, -np.inf)]
    at, means, halves = over_time(runs)
    assert (at.tolist(), means.tolist(), halves.tolist()) == ([0.0, 2.0], [1.0, 3.0], [0.0, 0.0])
