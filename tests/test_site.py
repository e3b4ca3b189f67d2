"""The site has a page for every document, and builds without a warning and without the network."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

import epicycle
import epicycle.runner
from epicycle.runner.model.catalogue.packaged import packaged_models
from tests.plugins import ABSENT
from website.reference import FOLDER, reference

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "website" / "mkdocs.yml"
ABOVE = {"index.md": "README.md", "contributing.md": "CONTRIBUTING.md", "changelog.md": "CHANGELOG.md"}
if "ptolemy" not in ABSENT:
    ABOVE["ptolemy_room.md"] = "ptolemy/README.md"
REFERENCE = (ROOT / "docs" / "reference.md").read_text(encoding="utf-8")
SPLIT = reference(REFERENCE)
MADE = {
    "gallery/index.md",
    "truth.md",
    "tutorial/14_notebook.md",
    *(f"{FOLDER}/{name}" for name in SPLIT.pages),
}  # by website/


def pages(nav: list[Any]) -> Iterator[str]:
    """The files that a part of `nav` names."""
    for entry in nav:
        (found,) = entry.values()
        yield from pages(found) if isinstance(found, list) else [found]


def test_nav_names_every_document_once() -> None:
    documents = [path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")]
    named = list(pages(yaml.safe_load(CONFIG.read_text(encoding="utf-8"))["nav"]))
    named = [each for each in named if not any(each == f"{name}_room.md" for name in ABSENT)]
    assert sorted(named) == sorted([*documents, *ABOVE, *MADE])


def test_the_pages_of_the_reference_have_all_of_it_once() -> None:
    def entries(text: str) -> list[str]:
        return sorted(line.lstrip("# ") for line in text.splitlines() if re.match("##+ ", line))

    whole = [
        each for each in entries(REFERENCE) if each not in ("Actors", "Aspects", "Keys", "Monitors")
    ]  # with their own pages
    assert sorted(each for page in SPLIT.pages.values() for each in entries(page)) == whole
    lines = {line for line in REFERENCE.splitlines() if line and not line.startswith(("#", "**", "| ["))}
    assert lines - set("\n".join([SPLIT.overview, *SPLIT.pages.values()]).splitlines()) == set()


def test_links_to_the_reference_lead_to_its_pages() -> None:
    assert SPLIT.linked("[](../reference.md#clock) [](reference.md#keys) [](reference.md) [](#clock)") == (
        "[](../reference/sources.md#clock) [](reference/keys.md#keys) [](reference.md) [](#clock)"
    )
    assert "| [Clock](reference/sources.md#clock) | " in SPLIT.overview
    assert "| [Histogram](sinks.md#histogram) | " in SPLIT.pages["sinks.md"]  # a figure has the same name
    with pytest.raises(ValueError, match=r"^no purpose lists other$"):
        reference("# R\n\n## Actors\n\n**A.** B.\n\n| [C](#c) | d |\n\n### C\n\n### Other\n")


def headings(path: Path) -> set[str]:
    """What a link to a place in a document may say after `#`."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    titles = re.findall(r"^#+ (.+)$", text, re.M)
    slugs = {re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", title).strip().lower()) for title in titles}
    return slugs | set(re.findall(r'id="([^"]+)"', text)) | set(re.findall(r"^- `(epicycle[.\w]+)`", text, re.M))


def test_links_to_places_in_documents_hold() -> None:
    found = 0
    for path in [*(ROOT / "docs").rglob("*.md"), *(ROOT / name for name in ABOVE.values())]:
        for target, place in re.findall(r"\]\(([^)#:]*)#([^)]+)\)", path.read_text(encoding="utf-8")):
            other = path.parent / target if target else path
            if other.parent.name in ABSENT:
                continue
            assert place in headings(other), f"{path.name} links to {target}#{place}"
            found += 1
    assert found > 5


def test_the_page_of_the_python_api_has_all_that_is_offered() -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    shown = re.findall(r"^- `epicycle\.(?:runner\.|actors\.)?(?:calls\.)?(\w+)`", page, re.M)
    assert {*epicycle.__all__, *epicycle.runner.__all__} <= set(shown)
    assert len(shown) == len(set(shown))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as `make docs` does, and strictly: a warning is an error."""
    pytest.importorskip("mkdocstrings_handlers.python")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(CONFIG), "-d", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stderr
    return folder


@pytest.mark.slow
def test_the_site_has_all_pages_and_the_gallery_all_models(site: Path) -> None:
    for page in pages(yaml.safe_load(CONFIG.read_text(encoding="utf-8"))["nav"]):
        assert (site / page).with_suffix(".html").is_file()
    for name in packaged_models():
        shown = (site / "gallery" / f"{name}.html").read_text(encoding="utf-8")
        pictures = re.findall(rf'src="({name}/[^"]+)"', shown)
        assert f"{name}/graph.svg" in pictures
        assert all((site / "gallery" / each).is_file() for each in [*pictures, f"{name}/view.html"])


@pytest.mark.slow
def test_pages_ask_for_nothing_outside_and_fit_a_phone(site: Path) -> None:
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("there is no Chromium: install the distribution's package chromium")
    driver = pytest.importorskip("playwright.sync_api")
    with driver.sync_playwright() as browsers:
        browser = browsers.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_page(viewport={"width": 390, "height": 844})
        said: list[str] = []
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.on("request", lambda request: said.append(request.url) if not request.url.startswith("file:") else None)
        for page in sorted(site.rglob("*.html")):
            if page.name not in ("404.html", "view.html"):
                tab.goto(page.as_uri())
                assert tab.evaluate("document.documentElement.scrollWidth") == 390, page.name
                assert [each for each in said if not each.startswith(("data:", "blob:"))] == [], page.name
        tab = browser.new_page(viewport={"width": 1280, "height": 900})
        tab.goto((site / "index.html").as_uri())
        tab.locator("input.md-search__input").click()
        tab.keyboard.type("PacketLoss")
        tab.wait_for_selector(".md-search-result__item", timeout=20_000)
        browser.close()
