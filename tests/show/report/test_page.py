"""The page of a report in a browser: nothing is asked of anybody, tips and pictures come up, and names are text."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from epicycle.runner.interface.cli import main

HOSTILE = "</title></svg><script>document.title='no'</script><img src=x onerror=a()>'\"&"
LEVEL = "<img src=x onerror=alert(1)>"
MODEL = """\
model: wheel
parameters:
  speed: {value: 1, unit: m/s, doc: DOC}
actors:
  clock: {type: Clock, period: 0.1 s}
  wheel: {type: CircularMotion, start: [0, 2], speed: "${speed}", turn_rate: 0.5}
connections: [clock.output -> wheel.trigger]
run: {stop: 2 s, record: [wheel.state]}
metrics: {ticks: {of: clock.output, take: count, label: LABEL, doc: DOC}}
figures: {way: {type: Trajectories, robots: wheel.state}}
"""
STUDY = """\
study: wheels
doc: DOC
model: ./wheel.yaml
vary:
  case: {cases: {LEVEL: {speed: 1}, calm: {speed: 2}}}
replications: 3
claims: {ticks: {doc: DOC, always: ticks > 0}}
guideline: {choose: case, least: ticks}
figures:
  mean: {type: Means, metric: ticks, doc: DOC, labels: {case: LABEL}}
  ways: {type: Tracks, signals: wheel.state, runs: 2}
  height: {type: Series, signal: wheel.state, value: "token.position[1]", label: LABEL}
  one: {type: SingleRun, figure: way, metric: ticks}
"""


def written(text: str) -> str:
    for name, said in {"LABEL": HOSTILE, "LEVEL": LEVEL, "DOC": f"about {HOSTILE}"}.items():
        text = text.replace(name, json.dumps(said))
    return text


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report in which all that somebody may write would rather be a script."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "wheel.yaml").write_text(written(MODEL), encoding="utf-8")
    (folder / "wheels.yaml").write_text(written(STUDY), encoding="utf-8")
    assert main(["study", str(folder / "wheels.yaml"), "--out", str(folder / "out"), "--jobs", "1"]) == 0
    assert main(["report", str(folder / "out"), "--jobs", "1"]) == 0
    return folder / "out" / "report.html"


Open = Callable[..., Any]


@pytest.fixture
def opened(page: Path, browser: Any) -> Iterator[Open]:
    """Opens the page; in the end it must have said nothing and asked for nothing but itself."""
    tabs: list[tuple[Any, list[str], list[str]]] = []

    def open_page(width: int = 1280, scheme: str = "light") -> Any:
        viewport = {"width": width, "height": 900}
        tab = browser.new_context(viewport=viewport, color_scheme=scheme, offline=True).new_page()
        said: list[str] = []
        asked: list[str] = []
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.on("dialog", lambda dialog: said.append(dialog.message))
        tab.on("request", lambda request: asked.append(request.url))
        tab.goto(page.as_uri())
        tabs.append((tab, said, asked))
        return tab

    yield open_page
    for tab, said, asked in tabs:
        tab.context.close()
        assert said == []
        assert [url for url in asked if not url.startswith("data:")] == [page.as_uri()]


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280, 3840])
def test_a_page_loads_by_itself_at_any_width(width: int, scheme: str, opened: Open) -> None:
    tab = opened(width, scheme)
    assert tab.title() == "wheels: report"
    assert tab.locator("script").count() == 1
    assert tab.evaluate("document.documentElement.scrollWidth") <= width  # what is wider is scrolled by itself
    assert tab.evaluate("[...document.images].map(image => image.naturalWidth > 0)") == [True] * 4
    shown = tab.evaluate("[...document.images].map(image => image.offsetWidth)")
    assert shown[0] == shown[1] == shown[2] <= width
    rooms = tab.evaluate("[...document.images].map(image => image.closest('.scroll').offsetWidth)")
    # The last picture is wide: it is that of a single run, with a legend beside it.
    assert [wide > room for wide, room in zip(shown, rooms, strict=True)] == [False, False, False, width == 390]
    # Letters of 8.5 points are 8 pixels high or more, though one picture grows with its names.
    assert min(tab.evaluate("[...document.images].map(image => image.offsetWidth / image.naturalWidth)")) > 0.7
    assert HOSTILE in tab.evaluate("document.body.textContent")
    background = tab.evaluate("getComputedStyle(document.body).backgroundColor")
    assert background == ("rgb(25, 26, 28)" if scheme == "dark" else "rgb(255, 255, 255)")
    order = ["Claims", "Guideline", "Figures", "Means", "Study", "Runs", "Provenance"]
    assert tab.locator("h2").all_inner_texts() == order


@pytest.mark.slow
def test_the_policy_lets_nothing_else_run(page: Path, browser: Any) -> None:
    tab = browser.new_page()
    said: list[str] = []
    tab.on("console", lambda message: said.append(message.text))
    tab.goto(page.as_uri())
    tab.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"document.title=1\">')")
    tab.evaluate("document.body.append(Object.assign(document.createElement('script'), {text: 'document.title=2'}))")
    tab.evaluate("fetch('https://example.org/').catch(() => 0)")
    assert tab.title() == "wheels: report"
    tab.close()
    assert sum("Content Security Policy" in text for text in said) >= 3


WHERE = """figure => {
  const frames = document.querySelectorAll('figure')[figure].querySelectorAll('.frame');
  const frame = [...frames].find(each => each.offsetParent);
  const dot = frame.querySelector('circle');
  dot.scrollIntoView({block: 'center', inline: 'center'});
  const box = frame.getBoundingClientRect(), view = frame.querySelector('svg').viewBox.baseVal;
  return [box.left + dot.getAttribute('cx') * box.width / view.width,
          box.top + dot.getAttribute('cy') * box.height / view.height];
}"""


@pytest.mark.slow
@pytest.mark.parametrize("figure", range(4))
@pytest.mark.parametrize("width", [390, 1280])
def test_a_tip_comes_up_where_the_pointer_is(figure: int, width: int, opened: Open) -> None:
    tab = opened(width)
    where = tab.evaluate(WHERE, figure)
    tab.wait_for_timeout(200)  # until it is scrolled
    tab.mouse.move(*where)
    tip = tab.locator(".tip")
    starts = ("mean", "wheel.state, replication 0", "0 s: 2", "wheel.state\n0 s at (0, 2) m")
    said = tip.inner_text()
    assert said.startswith(starts[figure])
    assert (HOSTILE in said, LEVEL in said) == ((True, True), (False, True), (False, True), (False, False))[figure]
    box = tip.bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= width
    assert box["y"] >= 0
    tab.mouse.move(1, 1)
    assert not tip.is_visible()


@pytest.mark.slow
def test_a_picture_is_enlarged_and_closed_again(opened: Open) -> None:
    tab = opened()
    stage, tip = tab.locator("dialog"), tab.locator(".tip")
    small = tab.locator("figure img").first.bounding_box()["width"]
    tab.locator("figure .enlarge").first.click()
    assert stage.is_visible()
    assert stage.locator("img").bounding_box()["width"] > 1.1 * small
    tab.keyboard.press("ArrowRight")
    assert stage.locator(".tip").inner_text().startswith("mean")  # above the dialog, not below it
    stage.locator(".close").click()
    stage.wait_for(state="hidden")
    tip.wait_for(state="hidden")
    tab.locator("figure .frame").first.focus()
    tab.keyboard.press("Enter")
    assert stage.is_visible()
    tab.keyboard.press("Escape")
    stage.wait_for(state="hidden")
