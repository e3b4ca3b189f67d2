"""The page of a report in a browser: nothing is asked of anybody, tips and pictures come up, and names are text."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from epicycle.runner.cli import main
from tests.show.browser import CHROMIUM, Browser, browser

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")

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


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile")) as made:
        yield made


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [390, 1280, 3840])
def test_a_page_loads_by_itself_at_any_width(width: int, dark: bool, page: Path, chromium: Browser) -> None:
    chromium.open(page, width, 900, dark=dark)
    assert chromium.complaints() == []
    assert chromium.run("document.title") == "wheels: report"
    assert chromium.run("document.querySelectorAll('script').length") == 1
    assert chromium.run("document.documentElement.scrollWidth") <= width  # what is wider is scrolled by itself
    images = "[...document.images].map(image => [image.complete, image.naturalWidth > 0])"
    assert chromium.run(images) == [[True, True]] * 4
    assert HOSTILE in chromium.run("document.body.textContent")
    background = chromium.run("getComputedStyle(document.body).backgroundColor")
    assert background == ("rgb(25, 26, 28)" if dark else "rgb(255, 255, 255)")
    order = chromium.run("[...document.querySelectorAll('h2')].map(heading => heading.textContent)")
    assert order == ["Claims", "Guideline", "Figures", "Means", "Study", "Runs", "Provenance"]


def test_the_policy_lets_nothing_else_run(page: Path, chromium: Browser) -> None:
    chromium.open(page)
    chromium.run("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"document.title=1\">')")
    chromium.run("document.body.append(Object.assign(document.createElement('script'), {text: 'document.title=2'}))")
    chromium.run("fetch('https://example.org/').catch(() => 0)")
    assert chromium.run("document.title") == "wheels: report"
    told = [each["params"]["entry"]["text"] for each in chromium.events if each.get("method") == "Log.entryAdded"]
    assert sum("Content Security Policy" in text for text in told) >= 3


WHERE = """(() => {
  const frame = document.querySelectorAll('figure')[FIGURE].querySelector('.frame');
  const dot = frame.querySelector('circle');
  dot.scrollIntoView({block: 'center', inline: 'center'});
  const box = frame.getBoundingClientRect();
  const view = frame.querySelector('svg').viewBox.baseVal;
  return [box.left + dot.getAttribute('cx') * box.width / view.width,
          box.top + dot.getAttribute('cy') * box.height / view.height];
})()"""
SETTLED = "new Promise(done => setTimeout(done, 200))"
TIP = "(() => { const tip = document.querySelector('.tip'); return tip && !tip.hidden ? tip.textContent : null })()"


@pytest.mark.parametrize("figure", range(4))
@pytest.mark.parametrize("width", [390, 1280])
def test_a_tip_comes_up_where_the_pointer_is(figure: int, width: int, page: Path, chromium: Browser) -> None:
    chromium.open(page, width, 900)
    where = chromium.run(WHERE.replace("FIGURE", str(figure)))
    chromium.run(SETTLED)  # until it is scrolled
    chromium.move(*where)
    starts = ("Mean", "wheel.state, replication 0", "0 s: 2", "wheel.state\n0 s at (0, 2) m")
    said = chromium.run(TIP)
    assert said.lower().startswith(starts[figure].lower())
    assert (HOSTILE in said, LEVEL in said) == ((True, True), (False, True), (False, True), (False, False))[figure]
    left, right, top = chromium.run(
        "(box => [box.left, box.right, box.top])(document.querySelector('.tip').getBoundingClientRect())"
    )
    assert left >= 0
    assert right <= width
    assert top >= 0
    chromium.move(1, 1)
    assert chromium.run(TIP) is None
    assert chromium.complaints() == []


def test_a_picture_is_enlarged_and_closed_again(page: Path, chromium: Browser) -> None:
    chromium.open(page)
    small = chromium.run("document.querySelector('figure img').getBoundingClientRect().width")
    chromium.run("document.querySelector('figure .enlarge').click()")
    is_open = "document.querySelector('dialog').open"
    assert chromium.run(is_open)
    assert chromium.run("document.querySelector('dialog img').getBoundingClientRect().width") > 1.1 * small
    chromium.press("ArrowRight")
    assert chromium.run(TIP).lower().startswith("mean")
    assert chromium.run("document.querySelector('dialog .tip') !== null")  # above the dialog, not below it
    chromium.run("document.querySelector('dialog .close').click()")
    assert not chromium.run(is_open)
    chromium.run(SETTLED)
    assert chromium.run(TIP) is None
    chromium.run("document.querySelector('figure .frame').focus()")
    chromium.press("Enter")
    assert chromium.run(is_open)
    chromium.press("Escape")
    assert not chromium.run(is_open)
    assert chromium.complaints() == []
