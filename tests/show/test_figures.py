"""Figures of a run: what they show of signals of any type, and that they hang on nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar

import pytest

from epicycle.actors import Actor, OutputPort
from epicycle.runner import Simulation, load_model
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.catalogue.packaged import packaged_models
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show import FigureError
from epicycle.runner.show.canvas import draw
from epicycle.runner.show.sheet import PALETTE, Sheet
from epicycle.runner.show.trajectories import Trajectories
from tests.demo_models import DURATIONS


class Light(Enum):
    RED = "stop"
    GREEN = "go"


@dataclass(frozen=True)
class Pose:
    at: Any
    mode: str
    ready: bool


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(packaged_models()))
@pytest.mark.parametrize(("ending", "start"), [("svg", b"<?xml"), ("png", b"\x89PNG")])
def test_figures_of_packaged_models_are_the_same_whatever_a_user_has_set(
    name: str, ending: str, start: bytes, tmp_path: Path
) -> None:
    import matplotlib

    model = load_model(name)
    results = Simulation(model).run(until=DURATIONS.get(name, 100.0))
    figures = figures_of(model, Problems())
    assert list(figures) == list(model.figures)
    for figure_name, figure in figures.items():
        draw(figure_name, figure, results, tmp_path / f"one.{ending}")
        written = (tmp_path / f"one.{ending}").read_bytes()
        with matplotlib.rc_context({"font.size": 20, "axes.facecolor": "black", "lines.linewidth": 7}):
            draw(figure_name, figure, results, tmp_path / f"other.{ending}")
        assert (tmp_path / f"other.{ending}").read_bytes() == written
        assert written.startswith(start)


def test_lines_have_colours_that_everyone_can_tell_apart(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    lines, _ = drawn(monkeypatch, tmp_path)["both"]
    assert [line.get_color() for line in lines.lines] == list(PALETTE[:2])


def test_trajectories_of_what_has_no_position(tmp_path: Path) -> None:
    model = load_model("mm1")
    with pytest.raises(FigureError) as caught:
        draw("way", Trajectories(robots="server.size"), Simulation(model).run(until=100.0), tmp_path / "way.png")
    told = "the tokens of server.size have no 'position' and are not pairs x, y"
    assert str(caught.value) == f"figure way cannot be drawn: {told}"


class Talk(Actor):
    """Sends states of all kinds, one a second."""

    is_source: ClassVar[bool] = True
    text: OutputPort[str] = OutputPort(str)
    flag: OutputPort[bool] = OutputPort(bool)
    light: OutputPort[Any] = OutputPort(object)
    pose: OutputPort[Any] = OutputPort(object)

    def initialize(self) -> None:
        for second in range(5):
            self.wake_at(second)

    def fire(self) -> None:
        second = round(self.now)
        if second == 4:
            return  # only the run goes on until then
        self.text.send(["idle", "$\\frac{", "_x", "idle"][second])
        self.flag.send(second < 2)
        self.light.send([Light.RED, None, 3.0, Light.GREEN][second])
        self.pose.send(Pose(0.5 * second, "go", True))


FIGURES = """
model: talk
actors: {t: {type: Talk}}
run: {stop: 4, record: ["t.*"]}
figures:
  states: {type: TimeSeries, signals: t.text}
  both: {type: TimeSeries, signals: [t.flag, t.light, t.pose], label: speed}
  often: {type: Histogram, signals: t.text}
"""


def drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, list[Any]]:
    """The axes of all figures of the model."""
    (tmp_path / "m.yaml").write_text(FIGURES, encoding="utf-8")
    model = load_model(tmp_path / "m.yaml", types=[Talk])
    results = Simulation(model).run()
    found: dict[str, list[Any]] = {}
    monkeypatch.setattr(Sheet, "save", lambda sheet, paths: found.update({paths[0].stem: sheet.axes}))
    for name, figure in figures_of(model, Problems()).items():
        draw(name, figure, results, tmp_path / f"{name}.png")
    return found


def bars(axes: Any) -> dict[str, list[tuple[str, float, float]]]:
    """The name of each strip, with the states that it shows, and from when to when."""
    from matplotlib.colors import to_hex

    legend = axes.get_legend()
    names = {
        to_hex(patch.get_facecolor()): text.get_text()
        for patch, text in zip(legend.get_patches(), legend.get_texts(), strict=True)
    }
    found: dict[str, list[tuple[str, float, float]]] = {}
    for bar in axes.collections:
        for path in bar.get_paths():
            (begin, low), (end, high) = path.vertices.min(0), path.vertices.max(0)
            strip = axes.get_yticklabels()[round((low + high) / 2)].get_text()
            found.setdefault(strip, []).append((names[to_hex(bar.get_facecolor()[0])], float(begin), float(end)))
    return {strip: sorted(spans, key=lambda span: span[1]) for strip, spans in found.items()}


def test_a_text_is_a_strip_of_states(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    axes = drawn(monkeypatch, tmp_path)
    [states] = axes["states"]
    assert bars(states) == {
        "t.text": [("idle", 0.0, 1.0), ("$\\frac{", 1.0, 2.0), ("'_x'", 2.0, 3.0), ("idle", 3.0, 4.0)]
    }
    assert (states.get_xlabel(), states.get_title("left")) == ("time (s)", "talk, seed 0, 4 s")


def test_lines_are_above_strips(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    lines, strips = drawn(monkeypatch, tmp_path)["both"]
    assert [line.get_label() for line in lines.lines] == ["t.light", "t.pose.at"]
    assert lines.lines[1].get_ydata().tolist() == [0.0, 0.5, 1.0, 1.5, 1.5]
    assert bars(strips) == {
        "t.flag": [("true", 0.0, 2.0), ("false", 2.0, 4.0)],
        "t.light": [("RED", 0.0, 1.0), ("GREEN", 3.0, 4.0)],
        "t.pose.mode": [("go", 0.0, 4.0)],
        "t.pose.ready": [("true", 0.0, 4.0)],
    }
    assert (lines.get_ylabel(), strips.get_xlabel()) == ("speed", "time (s)")
    assert lines.get_xlim() == strips.get_xlim()


def test_a_histogram_of_states_counts_them(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    [often] = drawn(monkeypatch, tmp_path)["often"]
    assert [text.get_text() for text in often.get_yticklabels()] == ["idle", "$\\frac{", "'_x'"]
    assert [bar.get_width() for bar in often.patches] == [2, 1, 1]
    assert (often.get_ylabel(), often.get_xlabel()) == ("t.text", "how often")


def test_figures_of_states_are_files(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(FIGURES, encoding="utf-8")
    model = load_model(tmp_path / "m.yaml", types=[Talk])
    results = Simulation(model).run()
    for name, figure in figures_of(model, Problems()).items():
        draw(name, figure, results, tmp_path / f"{name}.svg")
        assert (tmp_path / f"{name}.svg").read_bytes().startswith(b"<?xml")
