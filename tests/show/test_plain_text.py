"""What stands in figures and drawings of the graph is text, whatever it looks like."""

from __future__ import annotations

import warnings
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from epicycle.actors import Clock, Parameter
from epicycle.runner import Model, Results, Simulation
from epicycle.runner.interface.cli import main
from epicycle.runner.show import Figure, FigureError
from epicycle.runner.show.canvas import draw, style
from epicycle.runner.show.graph import outline, write_graph
from epicycle.runner.show.outcome import draw_figures
from epicycle.runner.show.report.data import shown
from epicycle.runner.show.sheet import Sheet

TEXTS = ["$\\left $\\frac{a}{", "$x^" + "{" * 40, "a $b$ \x1b[31m\u202e & #1_2"]


@pytest.mark.parametrize("text", TEXTS)
def test_a_figure_of_a_study(text: str, tmp_path: Path) -> None:
    paths = [tmp_path / "f.svg"]
    with style():
        sheet = Sheet([text, text])
        (line,) = sheet.axes[0].plot([1, 2], [3, 4])
        sheet.axes[0].set_xticks([1, 2], [text, text])
        sheet.call_axes(text, text)
        sheet.legend([line], [text], title=text)
        sheet.save(paths)
    assert all(path.stat().st_size > 5_000 for path in paths)
    ElementTree.parse(paths[0])  # no character in it breaks the file


class _Broken(Figure):
    """Fails when it is drawn; by its name it is no type that others see."""

    line = Parameter(str, "first\nsecond\x1b")

    def signal_patterns(self) -> tuple[str, ...]:
        return ()

    def draw(self, results: Results, path: Path) -> None:
        raise ArithmeticError(self.line)


def a_run() -> Results:
    model = Model("$\\left \x1b", stop=3)
    model.record(model.add(Clock("clock", period=1)).output)
    return Simulation(model).run()


def test_a_figure_that_fails_says_where(tmp_path: Path) -> None:
    with pytest.raises(FigureError) as caught:
        draw("one", _Broken(), a_run(), tmp_path / "f.png")
    head, second, at, line, carets = str(caught.value).splitlines()
    assert (head, second) == ("figure one cannot be drawn: ArithmeticError: first", "second\\x1b")
    assert at.startswith("   raised at ")
    assert line[carets.index("^") :] == "raise ArithmeticError(self.line)"
    assert isinstance(caught.value.__cause__, ArithmeticError)


@pytest.mark.parametrize("kind", ["svg", "png", "mmd"])
def test_a_drawing_of_the_graph(kind: str, tmp_path: Path) -> None:
    model = Model("$\\left \x1b", stop=3)
    model.add(Clock("clock", period=1))
    write_graph(outline(model), tmp_path / f"g.{kind}")
    assert (tmp_path / f"g.{kind}").stat().st_size > 50
    if kind == "svg":
        ElementTree.parse(tmp_path / "g.svg")


LONG = "x" * 50_000
METRIC = "m" * 1_500
NAME = "n" * 300
CUT = "n" * 51 + "...230b07"
MODEL = {
    "model": "m",
    "doc": LONG,
    "parameters": {"period": 1.0, "note": {"value": "short", "doc": LONG}},
    "actors": {"clock": {"type": "Clock", "period": "${period}"}, "note": {"type": "Const", "value": "${note}"}},
    "run": {"stop": 5},
    "metrics": {METRIC: {"of": "clock.output", "take": "last"}},
}
STUDY = {
    "study": "s",
    "doc": "$\\left " * 9_000,
    "model": "./m.yaml",
    "vary": {
        "case": {"cases": {"$\\left": {"period": 1}, f"{LONG}1": {"period": 2}, f"{LONG}2": {"period": 3}}},
        "note": ["$\\frac{a}{", "[/b] \x1b[31m", "y" * 9_000],
    },
    "figures": {
        "f": {"type": "Means", "metric": METRIC, "doc": LONG, "labels": {METRIC: "$\\left" * 3_000}},
        NAME: {"type": "Distributions", "metrics": [METRIC], "labels": {"case": LONG}},
    },
}


@pytest.mark.slow
def test_a_report_on_texts_that_are_long_or_look_like_formulas(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It took a minute and then all memory; texts in it are cut, those that begin alike differ all the same."""
    monkeypatch.chdir(tmp_path)
    Path("m.yaml").write_text(yaml.safe_dump(MODEL))
    Path("s.yaml").write_text(yaml.safe_dump(STUDY))
    assert main(["study", "s.yaml", "--out", "out", "--jobs", "1"]) == 0
    capsys.readouterr()
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # what matplotlib says of labels that leave no place for a panel
        assert main(["report", "out"]) == 0
    written = [f"out/figures/{name}.{ending}" for name in ("f", CUT) for ending in ("png", "svg")]
    assert capsys.readouterr() == ("".join(f"wrote {name}\n" for name in [*written, "out/report.html"]), "")
    assert all(5_000 < Path(name).stat().st_size < 500_000 for name in written)
    page = Path("out/report.html").read_text()
    for level in ("$\\left", "x" * 31 + "...d04670", "x" * 31 + "...4aa52a", "$\\frac{a}{", "[/b] \\x1b[31m"):
        assert f"{level}</th>" in page, level  # of a row, or of a column with "note" before it
    assert len(page) < 1_000_000


def test_levels_of_a_report() -> None:
    values = (None, True, 2, 0.25, 1e-9, "calm", "a\nb", "z" * 40, "z" * 41)
    assert [shown(value) for value in values] == [
        "none", "yes", "2", "0.25", "1e-09", "calm", "a\\nb", "z" * 40, "z" * 31 + "...32f639",
    ]  # fmt: skip


class _Written(_Broken):
    """Writes what it is drawn of."""

    def draw(self, results: Results, path: Path) -> None:
        path.write_text(results.model)


def test_figures_of_a_run_with_long_names(tmp_path: Path) -> None:
    written, failed = draw_figures(tmp_path, a_run(), {NAME: _Written(), f"{NAME}2": _Broken()})
    assert [path.name for path in written] == [f"{CUT}.png"]
    assert [each.name for each in failed] == [f"{NAME}2"]
    assert [path.name for path in tmp_path.iterdir()] == [f"{CUT}.png"]
