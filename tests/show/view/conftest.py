"""Pages of runs, opened from their files in a browser that is offline; and runs for files of other viewers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from epicycle.runner import load_model
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.view.pages import Page
from epicycle.runner.show.view.recording import Recording

from .exported import VARIED, Varied, recorded


class Opened:
    """A page in a tab, and what it said and asked for since."""

    def __init__(self, browser: Any, path: Path, width: int, height: int, scheme: str) -> None:
        context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme, offline=True)
        self.tab = context.new_page()
        self.said: list[str] = []
        self.asked: list[str] = []
        self.tab.on("console", lambda message: self.said.append(message.text))
        self.tab.on("pageerror", lambda error: self.said.append(str(error)))
        self.tab.on("dialog", lambda dialog: self.said.append(dialog.message))
        self.tab.on("request", lambda request: self.asked.append(request.url))
        self.tab.goto(path.as_uri())
        self.tab.wait_for_selector("#page[data-ready]", timeout=30_000)

    def do(self, script: str) -> Any:
        """What a function of ``state`` and ``views`` returns; the page is drawn after it."""
        found = self.tab.evaluate(f"() => (({{state, views, details}}) => {{ {script} }})(epicycle)")
        self.tab.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        return found

    def words(self, place: str = ".details") -> str:
        """What stands somewhere, without empty lines."""
        self.do("")
        return "\n".join(line for line in self.tab.locator(place).inner_text().splitlines() if line)

    def ink(self, view: str) -> int:
        """How many pixels of a canvas are painted."""
        count: int = self.tab.evaluate(
            "(name) => { const c = document.querySelector(`canvas[data-view=${name}]`);"
            "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            "let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n }",
            view,
        )
        return count


@pytest.fixture
def opened(browser: Any) -> Iterator[Callable[..., Opened]]:
    """Opens a page; in the end it must have said nothing and asked for nothing but itself."""
    pages: list[tuple[Opened, Path]] = []

    def open_page(path: Path, width: int = 1280, height: int = 900, scheme: str = "light") -> Opened:
        page = Opened(browser, path, width, height, scheme)
        pages.append((page, path))
        return page

    yield open_page
    for page, path in pages:
        said, asked = page.said, page.asked
        page.tab.context.close()
        assert said == []
        assert asked == [path.as_uri()]


def written(
    path: Path, *runs: tuple[str, dict[str, Any]], until: float | None = None, names: tuple[str, ...] = ()
) -> Path:
    """The page of a run, or of two."""
    recordings = []
    for model, given in runs:
        loaded = load_model(model, **given)
        recordings.append(Recording(loaded, figures_of(loaded, Problems()), is_compared=len(runs) > 1))
        recordings[-1].run(until=until)
    return Page(recordings, names).save(path)


@pytest.fixture(scope="session")
def wifi() -> Recording:
    return recorded(load_model("collision_avoidance", disturb=["wifi_burst"]))


@pytest.fixture
def varied(tmp_path: Path) -> Recording:
    path = tmp_path / "varied.yaml"
    path.write_text(VARIED, encoding="utf-8")
    return recorded(load_model(path, types=[Varied]))


@pytest.fixture(scope="module")
def wifi_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of a run with bursts of lost messages."""
    path = tmp_path_factory.mktemp("view") / "wifi.html"
    return written(path, ("collision_avoidance", {"disturb": ["wifi_burst"]}))
