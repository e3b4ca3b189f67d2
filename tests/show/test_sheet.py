"""Sheets: tips stand where their marks are, in every file, and are text whatever they say."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.colors import to_hex
from PIL import Image

from epicycle.actors import Actor, CircularMotion, Clock, InputPort, OutputPort
from epicycle.runner import Model, Results, Simulation, load_model
from epicycle.runner.show import FigureError
from epicycle.runner.show.canvas import draw, style
from epicycle.runner.show.figures import Histogram, TimeSeries
from epicycle.runner.show.sheet import FEW, MAX_TIPS, PALETTE, Sheet, tips_of
from epicycle.runner.show.trajectories import Trajectories

LEFT = "values that are not {} are left out"
HOSTILE = '<script>alert(1)</script> & "]]>" \'--> \x1b\u202e'


def test_tips_are_where_their_marks_are(tmp_path: Path) -> None:
    paths = [tmp_path / "f.png", tmp_path / "f.svg"]
    places = [(1.0, 10.0), (3.0, 1000.0)]
    with style():
        sheet = Sheet(["one", "two"])
        for axes in sheet.axes:
            axes.plot(*zip(*places, strict=True), "s", color="#ff0000", markersize=6, linestyle="none")
            axes.set_yscale("log")
        sheet.tip(sheet.axes[1], [*places, (9.0, 10.0)], ["low", "high", "out of sight"])
        sheet.axes[1].set_xlim(0, 4)
        sheet.save(paths)
    found = tips_of(paths[1].read_bytes())
    assert found is not None
    assert [tip.text for tip in found.tips] == ["low", "high"]
    with Image.open(paths[0]) as image:
        assert (image.width / 200, image.height / 200) == pytest.approx((found.width / 72, found.height / 72), abs=0.02)
        for tip in found.tips:
            assert image.getpixel((round(tip.x / 72 * 200), round(tip.y / 72 * 200)))[:3] == (255, 0, 0)  # type: ignore[index]


def test_tips_are_text_whatever_they_say(tmp_path: Path) -> None:
    with style():
        sheet = Sheet([""])
        sheet.call_axes(HOSTILE, HOSTILE)  # which matplotlib writes as comments, too
        sheet.tip(sheet.axes[0], [(0.5, 0.5)], [f"{HOSTILE}\nsecond line"])
        sheet.save([tmp_path / "f.svg"])
    written = (tmp_path / "f.svg").read_bytes()
    tags = {element.tag.rpartition("}")[2] for element in ElementTree.fromstring(written).iter()}
    assert "script" not in tags
    assert "\u202e" not in written.decode()  # which viewers would obey
    found = tips_of(written)
    assert found is not None
    assert [tip.text for tip in found.tips] == ['<script>alert(1)</script> & "]]>" \'--> \\x1b\\u202e\nsecond line']


@pytest.mark.parametrize("svg", [b"", b"<svg", b"<svg/>", b"<svg viewBox='0 0 x y'/>", b"\x89PNG"])
def test_pictures_of_others_may_be_anything(svg: bytes) -> None:
    assert tips_of(svg) is None


def test_of_very_many_tips_some_are_kept(tmp_path: Path) -> None:
    with style():
        sheet = Sheet([""])
        sheet.tip(sheet.axes[0], [(n / 9999, 0.5) for n in range(10_000)], map(str, range(10_000)))
        sheet.save([tmp_path / "f.svg"])
    found = tips_of((tmp_path / "f.svg").read_bytes())
    assert found is not None
    assert MAX_TIPS / 2 < len(found.tips) <= MAX_TIPS


# -- figures of runs ----------------------------------------------------------------------------------------------


def fleet(count: int) -> Results:
    """A run of robots on circles."""
    model = Model("fleet", stop=4)
    clock = model.add(Clock("clock", period=0.1))
    for number in range(count):
        robot = model.add(CircularMotion(f"robot[{number}]", start=(0.0, 2.0 + number), speed=1.0, turn_rate=0.5))
        model.connect(clock.output, robot.trigger)
        model.record(robot.state)
    return Simulation(model).run()


@pytest.fixture
def sheets(monkeypatch: pytest.MonkeyPatch) -> list[Sheet]:
    """The sheets that are saved."""
    found: list[Sheet] = []
    monkeypatch.setattr(Sheet, "save", lambda sheet, paths: found.append(sheet))
    return found


def legend(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.get_legend().get_texts()] if axes.get_legend() else []


def test_twenty_robots_have_a_band_in_place_of_a_legend(sheets: list[Sheet], tmp_path: Path) -> None:
    draw("f", Trajectories(robots="robot[*].state"), fleet(20), tmp_path / "f.svg")
    (axes, band) = sheets[0].canvas.axes
    assert band.get_title(loc="left") == "robot[*]"
    assert [text.get_text() for text in band.get_yticklabels()] == [str(number) for number in range(20)]
    assert legend(axes) == ["goal"]
    ways = [line for line in axes.lines if line.get_linestyle() == "-" and len(line.get_xdata()) > 2]
    assert len({line.get_color() for line in ways}) == 20
    draw("f", Trajectories(robots="robot[*].state"), fleet(FEW), tmp_path / "f.svg")
    (axes,) = sheets[1].canvas.axes
    assert legend(axes) == [*(f"robot[{number}]" for number in range(FEW)), "goal"]


def test_trajectories_say_which_way_and_when(sheets: list[Sheet], tmp_path: Path) -> None:
    results = fleet(1)
    draw("f", Trajectories(robots="robot[*].state"), results, tmp_path / "f.svg")
    (axes,) = sheets[0].axes
    times = [text for text in axes.texts if text.get_text()]
    assert [text.get_text() for text in times] == ["0 s", "1 s", "2 s", "3 s", "4 s"]
    state = results["robot[0].state"]
    for text in times:
        moment = float(text.get_text().removesuffix(" s"))
        np.testing.assert_allclose(text.xy, state["position"][round(10 * moment)])
    heads = [text for text in axes.texts if text.arrow_patch is not None]
    assert len(heads) == 2
    for head in heads:  # from an earlier place to a later one
        where = [int(np.argmin(np.hypot(*(state["position"] - place).T))) for place in (head.xyann, head.xy)]
        assert where[0] < where[1]
    np.testing.assert_array_equal(heads[1].xy, state["position"][-1])


def walk(count: int) -> Results:
    """A run that sends very often."""
    model = Model("walk", stop=count)
    model.record(model.add(Clock("clock", period=1)).output)
    return Simulation(model).run()


def test_very_many_samples_are_an_envelope(tmp_path: Path, sheets: list[Sheet]) -> None:
    results = walk(20_000)
    draw("f", TimeSeries(signals="clock.output"), results, tmp_path / "f.svg")
    (axes,) = sheets[0].axes
    (line,) = axes.lines
    assert len(line.get_xdata()) <= 700
    (band,) = axes.collections
    assert band.get_paths()[0].get_extents().y1 == max(results["clock.output"].values)
    assert axes.get_title(loc="left").splitlines()[1] == "Band: least to greatest in each 28.6 s; line: mean"
    draw("f", TimeSeries(signals="clock.output", start=100, end=200), results, tmp_path / "f.svg")
    assert len(sheets[1].axes[0].collections) == 0  # few are in view


def test_lines_may_have_panels_of_their_own(tmp_path: Path, sheets: list[Sheet]) -> None:
    draw("f", TimeSeries(signals="robot[*].state", separate=True), fleet(1), tmp_path / "f.svg")
    names = [axes.get_ylabel().replace("\n", " ") for axes in sheets[0].axes]
    assert "robot[0].state.position[0]" in names
    assert all(len(axes.lines) == 1 for axes in sheets[0].axes)
    assert sheets[0].axes[0].get_xlim() == sheets[0].axes[-1].get_xlim()


class Powers(Actor):
    """Sends powers of ten, and what is not positive."""

    trigger: InputPort[Any] = InputPort(object)
    output: OutputPort[float] = OutputPort(float)
    below: OutputPort[float] = OutputPort(float)

    def fire(self) -> None:
        self.output.send(10.0 ** (round(self.now) % 5))
        self.below.send(-self.now)


def test_logarithmic_axes(tmp_path: Path, sheets: list[Sheet]) -> None:
    model = Model("powers", stop=9)
    clock, powers = model.add(Clock("clock", period=1)), model.add(Powers("powers"))
    model.connect(clock.output, powers.trigger)
    model.record(powers.output)
    model.record(powers.below)
    results = Simulation(model).run()
    draw("f", TimeSeries(signals="powers.output", log_y=True), results, tmp_path / "f.svg")
    draw("f", Histogram(signals="powers.output", log_x=True, log_y=True, bins=4), results, tmp_path / "f.svg")
    assert sheets[0].axes[0].get_yscale() == "log"
    (axes,) = sheets[1].axes
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    np.testing.assert_allclose(axes.patches[0].get_data().edges, [1, 10, 100, 1000, 10_000])
    with pytest.raises(FigureError) as caught:
        draw("f", TimeSeries(signals="powers.below", log_y=True), results, tmp_path / "f.svg")
    said = "figure f cannot be drawn: no value on the vertical axis is positive, so it cannot be logarithmic"
    assert str(caught.value) == said
    with pytest.raises(FigureError) as caught:
        draw("f", Histogram(signals="powers.below", log_x=True), results, tmp_path / "f.svg")
    said = "figure f cannot be drawn: no value is positive, so the horizontal axis cannot be logarithmic"
    assert str(caught.value) == said
    draw("f", Histogram(signals=["powers.below", "powers.output"], log_x=True), results, tmp_path / "f.svg")
    assert sheets[-1].axes[0].get_title(loc="left").endswith("9 s, 10 values that are not positive are left out")


def test_a_histogram_says_what_its_axes_are(tmp_path: Path, sheets: list[Sheet]) -> None:
    draw("f", Histogram(signals="clock.output", label="reading (s)", bins=10), walk(100), tmp_path / "f.svg")
    (axes,) = sheets[0].axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("reading (s)", "share of the values in a bin")
    assert sum(axes.patches[0].get_data().values) == pytest.approx(1.0)
    assert to_hex(axes.patches[0].get_facecolor()) == PALETTE[0]


@pytest.mark.parametrize(
    ("values", "log_x", "said"),
    [
        ("[0.3, 0.30000000000000004]", False, "-0.2 to 0.8, mean 0.3"),
        ("[0.3, 0.30000000000000004]", True, "0.3 to 0.6, mean 0.3"),
        ("[1e20]", False, "1e+20 to 1e+20, mean 1e+20"),
        ("[1, .inf, .nan, 3, -1]", True, f"1 to 3, mean 2, 1 {LEFT.format('positive')}, 2 {LEFT.format('finite')}"),
    ],
)
def test_values_that_have_no_place_in_bins(values: str, log_x: bool, said: str, tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(
        "model: m\nactors:\n  clock: {type: Clock, period: 1 s}\n"
        f"  few: {{type: Sequence, values: {values}}}\n"
        "connections: [clock.output -> few.trigger]\nrun: {stop: 4 s, record: few.output}\n"
    )
    results = Simulation(load_model(path)).run()
    seen: list[str] = []

    class Spied(Histogram):
        def _bins(self, sheet: Sheet, columns: Any) -> None:
            super()._bins(sheet, columns)
            (axes,) = sheet.axes
            seen.append(axes.get_title("left"))
            seen.append(" to ".join(f"{end:.6g}" for end in axes.patches[0].get_data().edges[[0, -1]]))

    draw("f", Spied(signals="few.output", log_x=log_x), results, tmp_path / "f.svg")
    title, ends = seen
    assert f"{ends}, {title.removeprefix('m, seed 0, 4 s, ')}" == said


def test_values_that_are_not_finite_are_gaps_of_which_the_title_tells(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(
        "model: m\nactors:\n  clock: {type: Clock, period: 1 s}\n"
        "  few: {type: Sequence, values: [1, .nan, 2, .inf, 3]}\n"
        "connections: [clock.output -> few.trigger]\nrun: {stop: 4 s, record: few.output}\n"
    )
    draw("f", TimeSeries(signals="few.output"), Simulation(load_model(path)).run(), tmp_path / "f.svg")
    assert "<!-- Gaps: 2 values not finite -->" in (tmp_path / "f.svg").read_text()
