"""Somebody writes a model in the browser, from an empty page."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.studio.studio_parts import Writer

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
MODEL = next(
    each for each in re.findall(r"```yaml\n(.*?)```", README, re.DOTALL) if each.startswith("model: two_bodies")
)

# The model of the README and two comments, as somebody types it: what stands behind | is completed.
TYPED = """# Two bodies, and a clock.
«mod|el: »two_bodies
«par|ameters: »
  loss: {«val|ue: »0.2, «mi|n: »0, «ma|x: »1, «do|c: »probability that a tick is lost}
«acto|rs: »
  clock: {«ty|pe: »«Cloc|k», «peri|od: »500 ms}
  left: {«ty|pe: »«Circ|ularMotion», «sta|rt: »[0, 1]}
  right: {«ty|pe: »«Circ|ularMotion», «sta|rt: »[0, -1]}
«conn|ections: »
  - «cloc|k».«outp|ut» -> «lef|t».«trig|ger»
  - {«fr|om: »clock.output, «t|o: »right.trigger, «del|ay: »100 ms}
«asp|ects: »
  lossy: {«ty|pe: »«Packe|tLoss», «prob|ability: »"${«los|s»}", «a|t: »"*.trigger"}
«ru|n: »{«st|op: »10 s, «se|ed: »1, «rec|ord: »[left.state, right.state]}
«met|rics: »
  heard: {«o|f: »left.state, «tak|e: »«coun|t», «do|c: »ticks that came through}
# the end"""
PLAIN = re.sub(r"«(.*?)\|(.*?)»", r"\1\2", TYPED).replace(": \n", ":\n")


def test_what_is_typed_is_the_model_of_the_readme() -> None:
    assert "\n".join(line for line in PLAIN.splitlines() if not line.startswith("#")) + "\n" == MODEL


@pytest.mark.slow
def test_a_model_is_written_run_disturbed_and_saved(studio: Callable[..., Writer], tmp_path: Path) -> None:
    path = tmp_path / "my_model.yaml"
    writer = studio(path)
    tab = writer.tab
    tab.locator(".cm-content").click()
    for number, line in enumerate(TYPED.split("\n")):
        if number:
            writer.begin_line(line[: len(line) - len(line.lstrip())])
        writer.write(line.lstrip())
    assert writer.text() == PLAIN
    # It runs by itself.
    assert writer.until_run() == {"heard": "17"}
    assert tab.locator(".summary").inner_text() == "no problems"
    assert not path.exists()

    # An aspect by a switch, and its slider.
    tab.locator(".attach .type").fill("PacketLoss")
    tab.locator(".attach .at").fill("left.trigger")
    tab.locator(".attach .switch input").click()
    line = "  packet_loss: {type: PacketLoss, probability: 0.1, at: left.trigger}\n"
    writer.until("(line) => epicycle.studio.editor.text.includes(line)", line)
    few = int(writer.until_run()["heard"])
    assert few <= 17
    slider = tab.locator("[data-aspect=packet_loss] input[type=range]")
    slider.fill("0.9")
    writer.until("(line) => epicycle.studio.editor.text.includes(line)", line.replace("0.1", "0.9"))
    assert int(writer.until_run()["heard"]) < few
    assert tab.locator(".digest b").inner_text() == "another run than before"
    assert tab.locator("[data-metric=heard] .change").inner_text().startswith("−")
    tab.locator("[data-aspect=packet_loss] .switch input").click()
    writer.until("() => epicycle.studio.editor.text.includes('at: left.trigger, enabled: false}')")
    assert writer.until_run() == {"heard": "17"}

    # An actor, and a connection that is drawn.
    tab.locator(".addrow input").nth(0).fill("Merge")
    tab.locator(".addrow input").nth(1).fill("sum")
    tab.locator(".addrow button").click()
    writer.until("() => epicycle.studio.diagram.ports.has('sum.input')")
    assert tab.locator(".problems span").inner_text() == "sum.input is not connected, but Merge needs it"
    writer.drag("sum.input", "left.state")
    writer.until("() => epicycle.studio.editor.text.includes('  - left.state -> sum.input\\n')")
    assert writer.until_run() == {"heard": "17"}

    # Everything that was not typed is taken back, and what was typed is saved.
    for _ in range(20):
        if writer.text() == PLAIN:
            break
        tab.get_by_role("button", name="Undo").click()
    assert writer.text() == PLAIN
    tab.get_by_role("button", name="Save").click()
    writer.until("() => document.querySelector('.message').textContent === 'saved'")
    assert path.read_bytes() == PLAIN.encode()
    # And taken back to the empty page.
    for _ in range(1000):
        if tab.get_by_role("button", name="Undo").is_disabled():
            break
        tab.get_by_role("button", name="Undo").click()
    assert writer.text() == ""
