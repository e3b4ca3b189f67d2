"""What ``import epicycle`` offers: a run, a study, a comparison, pictures, and what is saved of them."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, get_args

import pytest

import epicycle
from epicycle.actors import EpicycleError
from epicycle.runner import Model, ModelError, Simulation, load_model
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.metrics import TAKES, MetricOptions, MetricSpec, TakeName
from epicycle.runner.model.catalogue.reference import describe
from epicycle.runner.search.comparing import Comparison
from epicycle.runner.show.figures import TimeSeries
from epicycle.runner.study.inference import paired_difference


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


# -- the face ---------------------------------------------------------------------------------------------------------


def test_the_face_offers_what_it_says_and_waits_for_nothing() -> None:
    script = "import sys, epicycle; print(sorted({'numpy', 'simpy', 'yaml', 'rich', 'argparse'} & {*sys.modules}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert all(getattr(epicycle, name) is not None for name in epicycle.__all__)
    assert {*epicycle.__all__, "actors", "aspects", "runner"} <= {*dir(epicycle)}
    assert epicycle.actors.Clock.__name__ == "Clock"
    with pytest.raises(AttributeError, match="module 'epicycle' has no attribute 'rum'"):
        epicycle.rum  # noqa: B018


def test_the_package_is_the_command() -> None:
    done = subprocess.run([sys.executable, "-m", "epicycle", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith(f"epicycle {epicycle.__version__}, ")


def test_types_say_what_declarations_say() -> None:
    assert list(get_args(TakeName)) == list(TAKES)
    options = [each.name for each in describe("metric", MetricSpec).parameters if each.name != "take"]
    assert list(MetricOptions.__annotations__) == options


# -- runs -------------------------------------------------------------------------------------------------------------


def test_a_run_is_that_of_a_simulation_and_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    results = epicycle.run("mm1", seed=3, until="5 min", set={"load": 0.9})
    assert results.digest == Simulation(load_model("mm1", set=["load=0.9"]), seed=3).run(until=300.0).digest
    assert main(["run", "mm1", "--seed", "3", "--until", "300", "--set", "load=0.9", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["digest"] == results.digest
    assert list(Path().iterdir()) == []


def test_a_run_writes_what_it_is_asked_for() -> None:
    results = epicycle.run(epicycle.load("mm1"), until=50, keep_log=True, out="a")
    assert len(results.log.records) == results.events
    epicycle.run("mm1", until=50, log="log.csv")
    assert len(Path("log.csv").read_text().splitlines()) == results.events + 1
    assert sorted(path.name for path in Path("a").iterdir()) == [
        "manifest.json",
        "number.png",
        "signals.parquet",
        "wait.png",
    ]
    saved = epicycle.save(results, "b")
    assert {path.name for path in saved} == {
        "log.parquet",
        "manifest.json",
        "number.png",
        "signals.parquet",
        "wait.png",
    }
    assert Path("a/signals.parquet").read_bytes() == Path("b/signals.parquet").read_bytes()


def test_a_folder_says_by_which_command_the_run_is_made_again(capsys: pytest.CaptureFixture[str]) -> None:
    changes = {"load": 0.9, "mean_service": "500 ms"}
    aspect = "loss=PacketLoss,probability=0.1,at=server.input"
    results = epicycle.run("mm1", seed=3, until="5 min", set=changes, aspects=[aspect], disturb=(), out="a")
    command = json.loads(Path("a/manifest.json").read_text())["command"]
    words = [
        "--set",
        "load=0.9",
        "--set",
        'mean_service="500 ms"',
        "--aspect",
        aspect,
        "--seed",
        "3",
        "--until",
        "5 min",
    ]
    assert command == ["epicycle", "run", "mm1", *words]
    assert main([*command[1:], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["digest"] == results.digest


def test_a_model_that_is_made_takes_no_changes() -> None:
    with pytest.raises(EpicycleError) as caught:
        epicycle.run(epicycle.load("mm1"), set={"load": 0.9}, disturb="wifi_burst")
    assert str(caught.value) == (
        "the model mm1 exists already and takes no set, disturb\n"
        "   help: give the name or file of the model instead, or pass them to load"
    )
    with pytest.raises(EpicycleError, match=r"^until -1: expected a time from 0 s to 1e9 s$"):
        epicycle.run("mm1", until=-1)


# -- studies ----------------------------------------------------------------------------------------------------------

STUDY = {"study": "load", "model": "mm1", "vary": {"load": [0.5, 0.9]}, "replications": 3, "metrics": ["mean_wait"]}


def test_a_study_is_a_mapping_and_shows_its_table() -> None:
    results = epicycle.study(STUDY, set={"mean_service": "500 ms"}, replications=2, seed=5, jobs=1)
    assert repr(results) == "<StudyResults: load: 4 of 4 runs (4 ok), in results/load>"
    caption, _, head, first, _ = str(results).splitlines()
    assert caption == "load: 4 of 4 runs (4 ok), in results/load"
    assert head.split() == ["load", "mean_wait", "(s)", "runs"]
    values = [
        epicycle.run("mm1", seed=seed, set={"load": 0.5, "mean_service": 0.5}).metrics["mean_wait"] for seed in (5, 6)
    ]
    assert list(results.values("mean_wait")[0].values()) == values
    assert first.split()[0] == "0.5"
    assert first.split()[-1] == "2"
    assert "<td>0.9</td>" in results._repr_html_()
    pictures = epicycle.plot(results)
    assert list(pictures) == ["mean_wait_mean", "mean_wait_runs"]
    epicycle.save(pictures["mean_wait_mean"], "mean.png")
    assert Path("mean.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(EpicycleError, match=r"^figure mean_wait_mean cannot be written to mean.gif"):
        pictures["mean_wait_mean"].save("mean.gif")
    assert Path("report/report.html") in epicycle.save(results, "report")


def test_mistakes_in_a_study_are_told_with_their_place() -> None:
    with pytest.raises(ModelError) as caught:
        epicycle.study({**STUDY, "vary": {"lod": [0.5]}})
    assert str(caught.value).startswith("<python>:4:3: error: 'lod' matches no parameter, did you mean 'load'?\n")
    assert not Path("results").exists()


# -- comparisons ------------------------------------------------------------------------------------------------------


def test_variants_run_with_the_same_seeds() -> None:
    found = epicycle.compare("mm1", {"a": {}, "b": {"set": {"load": 0.5}}}, replications=4, until=1000)
    assert found.seeds == range(1, 5)
    assert repr(found) == "<Comparison: mm1: a, b; seeds 1 to 4>"
    alone = epicycle.run("mm1", seed=4, until=1000, set={"load": 0.5})
    assert found.runs["b"][4].digest == alone.digest
    test = paired_difference(found.values("a", "mean_wait"), found.values("b", "mean_wait"))
    both = [each for each in found.differences() if each.name == "mean_wait"]
    assert [(each.variant, each.difference) for each in both] == [("a", None), ("b", test.estimate)]
    assert test.p <= both[1].p <= 5 * test.p  # five metrics
    assert "<th>difference from a</th>" in found._repr_html_()
    epicycle.save(found, "runs.csv")
    rows = list(csv.DictReader(Path("runs.csv").read_text().splitlines()))
    assert [row["variant"] + row["seed"] for row in rows] == ["a1", "b1", "a2", "b2", "a3", "b3", "a4", "b4"]
    assert float(rows[-1]["mean_wait"]) == alone.metrics["mean_wait"]


def test_runs_that_fail_are_told_and_left_out() -> None:
    Path("m.yaml").write_text("""
model: m
parameters: {last: 3}
actors:
  ramp: {type: Clock, period: 1 s, values: [1, 2, "${last}"]}
  inverse: {type: Expression, expression: 1 / x}
connections: [ramp.output -> inverse.x]
run: {stop: 4 s}
metrics: {least: {of: inverse.output, take: min}}
""")
    found = epicycle.compare("m.yaml", {"a": {}, "b": {"set": {"last": 0}}, "c": {"set": {"last": 4}}}, replications=2)
    assert list(found.failures) == [("b", 0), ("b", 1)]
    assert found.metrics == []  # there is no number of b
    assert str(found).splitlines()[0] == "m: a, b, c; seeds 0 to 1; 2 runs failed"
    assert found.values("c", "least") == {0: 0.25, 1: 0.25}
    with pytest.raises(EpicycleError, match=r"^m has no metric 'last', did you mean 'least'"):
        found.values("c", "last")


def test_a_list_names_disturbances() -> None:
    found = epicycle.compare("collision_avoidance", ["none", "wifi_burst"], replications=1, until=0.3)
    assert isinstance(found, Comparison)
    (plain,), (burst,) = (each.values() for each in found.runs.values())
    assert {*burst.aspects} - {*plain.aspects} >= {"wifi_loss"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"variants": {"a": {}}}, "a comparison needs at least two variants"),
        (
            {"variants": ["wifi_brust", "none"]},
            "error: there is no packaged disturbance 'wifi_brust', did you mean 'wifi_burst'?",
        ),
        (
            {"variants": ["none", "wifi_burst"], "replications": 0},
            "replications: '0' is not a whole number from 1 to 1e9",
        ),
    ],
)
def test_what_is_no_comparison(options: dict[str, object], message: str) -> None:
    with pytest.raises(EpicycleError) as caught:
        epicycle.compare("collision_avoidance", **options)  # type: ignore[arg-type]
    assert str(caught.value).splitlines()[0] == message


# -- pictures ---------------------------------------------------------------------------------------------------------


def test_figures_and_signals_of_a_run() -> None:
    results = Simulation(load_model("mm1")).run(until=50.0)
    pictures = epicycle.plot(results)
    assert list(pictures) == ["number", "wait"]
    assert repr(pictures) == "<Pictures number, wait>"
    shown = pictures._repr_html_()
    assert shown.count('<img src="data:image/svg+xml;base64,') == 2
    assert epicycle.plot(results, "wait").svg() == pictures["wait"].svg()
    assert epicycle.plot(results, "*.size").svg() == epicycle.plot(results, TimeSeries(signals="*.size")).svg()
    assert epicycle.plot(results, "number").save("n.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(EpicycleError) as caught:
        epicycle.plot(results, "nmber")
    assert str(caught.value) == (
        "mm1 has no figure and no recorded signal 'nmber', did you mean 'number'?\n"
        "   help: it has number, wait, wait.output, server.size"
    )


def test_a_model_shows_its_drawing_and_its_tables() -> None:
    shown = epicycle.load("mm1")._repr_html_()
    assert shown.startswith('<img src="data:image/svg+xml;base64,')
    assert "<details><summary>mm1: 5 actors, 5 connections, 0 aspects, stops at 4000 s</summary>" in shown
    assert "<td>PoissonClock</td>" in shown
    assert "<img" in Model("<script>")._repr_html_()
    assert "<script>" not in Model("<script>")._repr_html_()
    assert epicycle.draw("mm1", depth=0).svg() == epicycle.draw(epicycle.load("mm1"), depth=0).svg()
    assert repr(epicycle.draw("thermostat", machine="room")) == "<Picture thermostat: room>"


def test_a_simulation_says_how_far_it_is() -> None:
    simulation = Simulation(load_model("mm1"), seed=3)
    assert repr(simulation) == "<Simulation of mm1, seed 3: at 0 s of 4000 s, not started>"
    simulation.advance(10.0)
    assert repr(simulation).endswith("of 4000 s, paused>")
    before = simulation.snapshot()
    assert "<td>customers</td>" in simulation._repr_html_()
    assert "longest_wait" in str(simulation)
    looked_at = simulation.run().digest  # to look at it has changed nothing
    simulation = Simulation(load_model("mm1"), seed=3)
    assert simulation.run().digest == looked_at
    assert before.tag.seconds <= 10.0
    assert repr(simulation) == f"<Simulation of mm1, seed 3: at {simulation.tag.seconds:g} s of 4000 s, over>"


# -- pages ------------------------------------------------------------------------------------------------------------


def test_a_page_of_a_run_and_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    page = epicycle.view("mm1", until=50.0, seed=3, progress=False)
    assert repr(page) == "<Page of mm1>"
    assert page.recordings[0].results is not None
    assert page.recordings[0].results.digest == epicycle.run("mm1", seed=3, until=50.0).digest
    assert page.save("one.html") == Path("one.html")
    shown = page._repr_html_()
    assert shown.startswith('<iframe sandbox="allow-scripts" srcdoc="&lt;!DOCTYPE html&gt;')
    assert "<script" not in shown
    two = epicycle.view("mm1", epicycle.load("mm1", set={"load": 0.9}), until=50.0, names=["calm", "busy"])
    assert repr(two) == "<Page of calm and busy>"
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    path = two.open()
    assert opened == [path.as_uri()]
    assert path.name == "mm1.html"


def test_a_page_of_a_run_that_fails_says_why() -> None:
    Path("failing.yaml").write_text(
        "model: failing\nactors:\n  clock: {type: Clock, period: 1}\n"
        "  inverse: {type: Expression, expression: 1 / (2 - x)}\nconnections: [clock.output -> inverse.x]\n"
        "run: {stop: 5}\n"
    )
    page = epicycle.view("failing.yaml")
    assert [str(error).splitlines()[0] for error in page.errors] == [
        "inverse failed in fire() at (2 s, 1): '1 / (2 - x)': 1 / (2 - x) divides by zero, with x = 2"
    ]
    assert page.recordings[0].firings > 3


def test_a_page_of_none_or_three() -> None:
    with pytest.raises(EpicycleError) as caught:
        epicycle.view()
    assert str(caught.value) == "a page shows one run or two, not 0"
    with pytest.raises(EpicycleError) as caught:
        epicycle.view("mm1", "mg1", names=["one"])
    assert str(caught.value) == "names: 1 given for 2 models"


def test_compare_writes_a_page_of_the_first_two(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "mm1", "--vary", "load=0.9", "--until", "50", "--replications", "2", "--page"]) == 0
    names = [f"results/mm1/comparison/comparison.{kind}" for kind in ("json", "csv", "html")]
    assert capsys.readouterr().out.endswith("".join(f"\nwrote {name}" for name in names) + "\n")
    assert Path(names[2]).stat().st_size > 30_000


def test_a_comparison_continues() -> None:
    changes: dict[str, Any] = {"a": {}, "b": {"set": {"load": 0.5}}}
    first = epicycle.compare("mm1", changes, replications=2, until=100, jobs=1)
    kept = {path: path.read_text() for path in Path("results/mm1/comparison").glob("tried-*.jsonl")}
    assert len(kept) == 2
    more = epicycle.compare("mm1", {**changes, "c": {"set": {"load": 0.7}}}, replications=3, until=100, jobs=1)
    assert [more.runs[name][seed] for name in "ab" for seed in (1, 2)] == [
        first.runs[name][seed] for name in "ab" for seed in (1, 2)
    ]
    for path, text in kept.items():
        now = path.read_text()
        assert now.startswith(text)
        assert now.count("\n") == text.count("\n") + 1


def test_a_search_refuses_classes_that_its_processes_do_not_know() -> None:
    with pytest.raises(EpicycleError) as caught:
        epicycle.search("mm1", epicycle.Minimise("mean_wait"), vary={"load": "0.1..0.5"}, types=[epicycle.actors.Clock])  # type: ignore[list-item]
    assert str(caught.value) == (
        "types: the processes of a search do not know the class Clock of this program\n"
        "   help: write it to a file, and name that: types=['my_types.py']"
    )
