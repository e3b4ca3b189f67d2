"""What if in the studio: from a run that is shown, in two clicks, to both futures."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import epicycle
from tests.studio.studio_parts import PATIENCE, Served, Writer, asking, served

MODELS = Path(__file__).parents[2] / "models"

LINE = """model: line
parameters: {size: 2}
actors:
  clock: {type: Clock, period: 1 s}
  count: {type: Ramp}
  gain: {type: Scale, factor: "${size}"}
  heard: {type: Recorder}
connections: [clock.output -> count.trigger, count.output -> gain.input, gain.output -> heard.input]
aspects: {lossy: {type: PacketLoss, probability: 0.5, at: gain.input}}
run: {stop: 20 s, seed: 1, record: [gain.output]}
metrics: {heard: {of: gain.output, take: count}}
"""


def click(writer: Writer, view: str, place: str) -> None:
    """Click in a canvas, at a place that the page says."""
    x, y = writer.tab.evaluate(
        "([view, place]) => { const { views } = epicycle.studio, { state } = views, found = views.known[view],"
        " box = found.canvas.getBoundingClientRect();"
        " const [x, y] = new Function('view', 'run', 'state', `return ${place}`)(found, state.run, state);"
        " return [box.left + x, box.top + y]; }",
        [view, place],
    )
    writer.tab.mouse.click(x, y)


@pytest.mark.slow
def test_a_lost_plan_is_let_through_by_two_clicks(studio: Callable[..., Writer], tmp_path: Path) -> None:
    path = tmp_path / "collision_avoidance.yaml"
    text = (MODELS / path.name).read_text(encoding="utf-8")
    path.write_text(text.replace("stop: 30 s", "stop: 5 s"), encoding="utf-8")
    shutil.copytree(MODELS / "robots", tmp_path / "robots")
    epicycle.run(path, until=0.1, progress=False)  # the kernels are compiled, which may take longer than a run may
    writer = studio(path)
    tab = writer.tab
    tab.locator("input[type=file]").set_input_files(MODELS / "disturbances" / "wifi_burst.yaml")
    writer.until("() => epicycle.studio.editor.text.includes('wifi_loss')")
    writer.until_run()
    tab.locator(".tabs [data-view=sequence]").click()
    writer.until("() => epicycle.studio.views.known.sequence.hits?.length")
    # Scroll to the plans of half a second.
    tab.evaluate(
        "() => { const { state, known } = epicycle.studio.views; state.setTime(3.2e9); state.show(3.2e9, 3.5e9);"
        " known.sequence.reveal(state.run.placeOf.get('main.controller')); }"
    )
    tab.evaluate("() => new Promise((done) => setTimeout(() => requestAnimationFrame(done), 200))")
    assert tab.locator(".whatif .through").is_disabled()

    # The first click: a lost plan.  The second: let it through.
    port = "run.portPath(run.record_port[what.record])"
    click(writer, "sequence", f"view.hits.find(([,, what]) => what.record >= 0 && {port} === 'main.peer_plan')")
    assert "wifi_loss: dropped at main.peer_plan" in tab.locator(".whatif .through").get_attribute("title")
    tab.locator(".whatif .through").click()
    tab.locator(".futures").wait_for(timeout=PATIENCE * 1000)
    told = tab.locator(".futures .story").all_inner_texts()
    assert told[:2] == [
        "From 3.401 s on, wifi_loss lets token 105 at main.peer_plan through.",
        "The first firing that changes is main.controller at (3.40497088 s, 1).",
    ]
    runs = tab.evaluate(
        "() => epicycle.studio.whatIf.viewer.state.runs.map((run) => [run.name, run.firstChange >= 0, run.digest])"
    )
    # As the command finds it.
    found = epicycle.what_if(path, 3.3, disturb="wifi_burst", let_through="wifi_loss@main.peer_plan", progress=False)
    assert runs == [["as it was", False, found.before.digest], ["what if", True, found.after.digest]]
    tab.locator(".futures button.changed").last.click()
    assert "fired at 3.40497088 s" in tab.locator(".futures .details").inner_text()
    tab.keyboard.press("Escape")  # nothing is selected any more
    tab.keyboard.press("Escape")
    assert tab.locator(".futures").count() == 0
    assert writer.text().startswith("# yaml-language-server")


@pytest.mark.slow
def test_another_one_is_lost_and_a_parameter_and_an_aspect_change(
    studio: Callable[..., Writer], tmp_path: Path
) -> None:
    path = tmp_path / "line.yaml"
    path.write_text(LINE, encoding="utf-8")
    writer = studio(path)
    tab = writer.tab
    heard = int(writer.until_run()["heard"])
    tab.evaluate("() => epicycle.studio.views.state.setTime(5e9)")
    bar = tab.locator(".whatif")
    note = bar.locator(".note")

    def choose(menu: str, value: str) -> None:
        bar.get_by_label(menu, exact=True).focus()
        bar.get_by_label(menu, exact=True).select_option(value)

    def futures() -> tuple[str, list[str]]:
        """What the page says of both futures, and the values of their first metric; closes them."""
        tab.locator(".futures .story").first.wait_for(timeout=PATIENCE * 1000)
        found = tab.locator(".futures .story").first.inner_text()
        cells = tab.locator(".futures .compared tr").nth(1).locator("td").all_inner_texts()
        tab.locator(".futures button.close").click()
        return found, cells[:2]

    choose("lose a token", "gain.output")
    assert futures() == ("From 5 s on, the next token at gain.output is lost.", [str(heard), str(heard - 1)])
    choose("remove an aspect", "lossy")
    said, (before, after) = futures()
    assert said == "From 5 s on, lossy is removed."
    assert int(after) > int(before) == heard
    for change, told in (("size=5", "gain.factor is 5"), ("gain.factor=7", "gain.factor is 7")):
        bar.locator("input").fill(change)
        bar.locator("input").press("Enter")
        assert futures()[0] == f"From 5 s on, {told}."
    bar.locator("input").fill("siz=5")
    bar.locator("input").press("Enter")
    writer.until("() => document.querySelector('.whatif .note').textContent.includes('error')")
    assert note.inner_text().startswith("command line:1:10: error: 'siz' matches no parameter, did you mean 'size'?")

    # A list of what aspects did is a way to a lost token, too.
    menu = bar.get_by_label("what aspects did", exact=True)
    menu.focus()
    lost = menu.locator("option").nth(1)
    time = re.match(r"([\d.]+) s lossy: dropped at gain.input", lost.inner_text())
    assert time is not None
    menu.select_option(lost.get_attribute("value"))
    bar.locator(".through").click()
    said, values = futures()
    assert said == f"From {time[1]} s on, lossy lets token {int(time[1]) + 1} at gain.input through."
    assert values == [str(heard), str(heard + 1)]
    assert writer.text() == LINE


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    path = tmp_path_factory.mktemp("studio") / "line.yaml"
    path.write_text(LINE, encoding="utf-8")
    with served(path, "--events", "20000") as found:
        yield found


@pytest.mark.slow
def test_what_cannot_change_is_said(line: Served) -> None:
    wrong: dict[str, dict[str, Any]] = {
        "this question cannot be read (KeyError)": {},
        "this question cannot be read (TypeError)": {"at": 5},
        "this question cannot be read (ValueError)": {"at": ["x", 1]},
        "this change cannot be read": {"at": [0, 0], "lose": "gain.input"},
        "line has no aspect 'losy', did you mean 'lossy'?\n   help: its aspects: lossy": {
            "at": [0, 0],
            "remove": ["losy"],
        },
        "lossy acts 7 times at 0 s or later: the last time is 17 s": {
            "at": [0, 0],
            "let_through": ["lossy#99"],
        },
    }
    with asking(line) as page:
        for message, asked in wrong.items():
            assert page.ask(ask="what_if", text=LINE, **asked) == {"error": message}
        assert page.ask(ask="what_if", text="model: [\n", at=[0, 0])["error"] == "the model is not valid"
        same = page.ask(ask="what_if", text=LINE, at=[0, 0])
        assert same == {"sentence": "From 0 s on, nothing is changed. Both futures have the same log.", "view": None}
        endless = LINE.replace("1 s}", "1 us}").replace("stop: 20 s, ", "")
        assert page.ask(ask="what_if", text=endless, at=[0, 0], lose=["gain.input"]) == {
            "error": "ended after 20,000 events: a run in the studio has no more (--events)"
        }
