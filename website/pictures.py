"""Renews the README's picture: `python -m website.pictures`, with the development tools and a Chromium.

It shows the page of `epicycle view collision_avoidance --disturb wifi_burst` at the moment when a plan is lost.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from epicycle.runner.interface.cli import main

PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "view.png"
WIDTH, HEIGHT, COLOURS = 1440, 760, 255
LOST = """() => (({state, views}) => {
  const {run} = state;
  const loss = run.losses.find(({record}) =>
      run.portPath(run.record_port[record]) === "main.peer_plan" && run.times[run.record_tag[record]] > 2.2e9);
  const tag = run.record_tag[loss.record];
  state.setByTag(true); state.setTag(tag); state.show(tag - 6, tag + 10);
  views.chart.scrollBy(views.chart.rows().at.get(loss.actor) * 19 - 60);
  views.chart.paint();
  return views.chart.hits.find(([, , what]) => what.record === loss.record).slice(0, 2);
})(epicycle)"""  # the place in the sequence chart of the first plan after 2.2 s that the main robot did not get


def screenshot(page: Path) -> bytes:
    """The page with a lost message selected, as a PNG."""
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light")
        tab.goto(page.as_uri())
        tab.wait_for_selector("#page[data-ready]", timeout=60_000)
        x, y = tab.evaluate(LOST)
        chart = tab.locator("canvas[data-view=chart]").bounding_box()
        assert chart is not None
        tab.mouse.click(chart["x"] + x, chart["y"] + y)
        tab.wait_for_timeout(500)
        taken = tab.screenshot()
        browser.close()
    return taken


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder, "view.html")
        main(["view", "collision_avoidance", "--disturb", "wifi_burst", "-o", str(page)])
        picture = Image.open(io.BytesIO(screenshot(page))).convert("RGB")
    PICTURE.parent.mkdir(exist_ok=True)
    picture.quantize(COLOURS).save(PICTURE, optimize=True)
    print(f"wrote {PICTURE}, {PICTURE.stat().st_size:,} bytes")
