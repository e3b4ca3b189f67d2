"""Figures of studies: what they show of several metrics, of many levels, on logarithmic axes, and in which words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import EpicycleError, Fault
from epicycle.runner import open_study
from epicycle.runner.interface.cli import main
from epicycle.runner.show.canvas import style
from epicycle.runner.show.report.data import Data, Names
from epicycle.runner.show.report.of_table import Distributions, Means
from epicycle.runner.show.sheet import FEW, Sheet

STUDY = """
study: queue
model: ./mm1.yaml
vary: {load: [0.25, 0.5], mean_service: {from: 0.5 s, to: 6 s, step: 0.5 s}}
replications: 3
metrics:
  mean_wait:
  longest: {value: longest_wait, label: longest time in the queue}
  share: mean_wait / longest_wait
"""


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Data:
    folder = tmp_path_factory.mktemp("queue")
    model = (Path(__file__).parents[3] / "models" / "mm1.yaml").read_text().replace("stop: 4000 s", "stop: 600 s")
    model = model.replace("  mean_wait:\n", "  mean_wait:\n    label: time in the queue\n")
    assert "label: time" in model
    (folder / "mm1.yaml").write_text(model)
    (folder / "queue.yaml").write_text(STUDY.replace("mean_wait:\n", "mean_wait: mean_wait\n", 1))
    assert main(["study", str(folder / "queue.yaml"), "--out", str(folder / "out"), "--jobs", "1"]) == 0
    return Data(open_study(folder / "out"))


@pytest.fixture
def sheets(monkeypatch: pytest.MonkeyPatch) -> list[Sheet]:
    """The sheets that are saved."""
    found: list[Sheet] = []
    monkeypatch.setattr(Sheet, "save", lambda sheet, paths: found.append(sheet))
    return found


def drawn(data: Data, figure: Any) -> str:
    with style():
        return str(figure.draw(data, {}, []))


def test_columns_are_called_as_their_declarations_say(data: Data) -> None:
    assert [data.names.axis(name) for name in ("mean_wait", "longest", "share", "mean_service")] == [
        "time in the queue (s)", "longest time in the queue (s)", "share", "mean service (s)",
    ]  # fmt: skip
    assert Names(data.plan, {"longest": "at most"}).axis("longest") == "at most (s)"


def test_several_metrics_have_a_row_each(data: Data, sheets: list[Sheet]) -> None:
    figure = Means(
        metric=["mean_wait", "share"], over="load", panels=["mean_service"], where={"mean_service": [1.0, 2.0]}
    )
    assert drawn(data, figure) == (
        "Mean time in the queue and share with 95 % intervals (Student). 12 runs in 4 conditions."
    )
    (sheet,) = sheets
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in sheet.axes]
    assert labels == [("", "mean time in the queue (s)"), ("", ""), ("load", "mean share"), ("load", "")]
    for axes, (metric, service) in zip(
        sheet.axes, [(metric, service) for metric in ("mean_wait", "share") for service in (1.0, 2.0)], strict=True
    ):
        means = {each["load"]: each["value"] for each in data.results.means(metric) if each["mean_service"] == service}
        (line, *_) = axes.containers[0]
        assert dict(zip(line.get_xdata(), line.get_ydata(), strict=True)) == pytest.approx(means)


def test_metrics_of_one_unit_may_be_lines_of_one_panel(data: Data, sheets: list[Sheet]) -> None:
    figure = Means(metric=["mean_wait", "longest"], together=True, over="load", where={"mean_service": 1.0}, log_y=True)
    assert list(figure.complaints(data.plan)) == []
    drawn(data, figure)
    (sheet,) = sheets
    (axes,) = sheet.axes
    (legend,) = sheet.canvas.legends
    assert [text.get_text() for text in legend.get_texts()] == ["time in the queue", "longest time in the queue"]
    assert (axes.get_ylabel(), axes.get_yscale(), len(axes.containers)) == ("mean (s)", "log", 2)
    short, long = (container[0].get_ydata() for container in axes.containers)
    assert all(short < long)


@pytest.mark.parametrize(
    ("figure", "parameter", "message", "advice"),
    [
        (
            Means(metric=["mean_wait", "share"], together=True),
            "together",
            "metrics in one panel need the same unit",
            "mean_wait in s, share in 1",
        ),
        (
            Means(metric=["mean_wait", "longest"], together=True, lines="load"),
            "lines",
            "the metrics are already its lines",
            "leave out 'lines' or 'together'",
        ),
        (Means(metric=[]), "metric", "it names no metric", "name at least one"),
    ],
)
def test_metrics_that_do_not_go_together(figure: Means, parameter: str, message: str, advice: str, data: Data) -> None:
    assert list(figure.complaints(data.plan)) == [Fault(message, (parameter,), help=(advice,))]


@pytest.mark.parametrize("kind", [Means, Distributions])
def test_many_levels_have_the_colours_of_a_scale(
    kind: type[Means | Distributions], data: Data, sheets: list[Sheet]
) -> None:
    figure = Means(metric="longest", lines="mean_service") if kind is Means else None
    drawn(data, figure or Distributions(metrics="longest", style="curves", lines="mean_service", panels=["load"]))
    (sheet,) = sheets
    assert sheet.canvas.legends == []
    *panels, band = sheet.canvas.axes
    assert panels == sheet.axes
    assert band.get_title(loc="left") == "mean service"
    names = [text.get_text() for text in band.get_yticklabels()]
    assert names == [f"{0.5 * (level + 1):g} s" for level in range(12)]
    lines = panels[0].containers if kind is Means else panels[0].lines
    shades = {line[0].get_color() if kind is Means else line.get_color() for line in lines}
    assert len(shades) == 12 > FEW


def test_levels_that_are_no_numbers_have_no_logarithm(data: Data, tmp_path: Path) -> None:
    folder = data.results.folder.parent
    study = f"study: s\nmodel: {folder / 'mm1.yaml'}\nvary: {{day: {{cases: {{calm: , busy: {{load: 0.9}}}}}}}}\n"
    (tmp_path / "s.yaml").write_text(study)
    assert main(["study", str(tmp_path / "s.yaml"), "--out", str(tmp_path / "out"), "--jobs", "1"]) == 0
    with pytest.raises(EpicycleError) as caught:
        drawn(Data(open_study(tmp_path / "out")), Means(metric="mean_wait", log_x=True))
    assert str(caught.value) == "the levels along the axis are not numbers, so it cannot be logarithmic"


def test_tips_say_what_is_there_in_words(data: Data, sheets: list[Sheet]) -> None:
    drawn(data, Means(metric="longest", over="load", lines="mean_service", where={"mean_service": 2.0}))
    (sheet,) = sheets
    tips = [text for *_, text in sheet._tips]
    assert len(tips) == 2
    mean = next(each for each in data.results.means("longest") if (each["load"], each["mean_service"]) == (0.25, 2.0))
    head, place = tips[0].splitlines()
    assert head.startswith("mean longest time in the queue: ")
    assert head.endswith(" s (3 runs)")
    assert float(head.split(": ")[1].split(" ±")[0]) == pytest.approx(mean["value"], rel=0.2)
    assert place == "load: 0.25, mean service: 2 s"
