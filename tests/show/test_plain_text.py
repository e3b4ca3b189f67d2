"""What stands in figures and drawings of the graph is text, whatever it looks like."""

from __future__ import annotations

from pathlib import Path

import pytest

from epicycle.actors import Clock, Parameter
from epicycle.runner import Model, Results, Simulation
from epicycle.runner.show import Figure, FigureError, draw
from epicycle.runner.show.graph import outline, write_graph
from epicycle.runner.show.report.style import Sheet, style

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
