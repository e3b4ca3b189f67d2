"""The page of a studio in a browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.show.conftest import browser
from tests.studio.studio_parts import MODEL, PATIENCE, Served, Writer, served

__all__ = ["browser"]


@pytest.fixture
def studio(browser: Any) -> Iterator[Callable[..., Writer]]:
    """Opens a model; in the end its page must have said nothing, and asked nobody but its server."""
    said: list[str] = []
    asked: list[str] = []
    origins: list[str] = []
    with ExitStack() as stack:

        def open_model(path: Path, width: int = 1400, height: int = 900, scheme: str = "light") -> Writer:
            found = stack.enter_context(served(path))
            origins.append(found.address)
            context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
            stack.callback(context.close)
            tab = context.new_page()
            tab.on("console", lambda message: said.append(message.text))
            tab.on("pageerror", lambda error: said.append(str(error)))
            tab.on("dialog", lambda dialog: said.append(dialog.message))
            tab.on("request", lambda request: asked.append(request.url))
            tab.goto(found.address)
            tab.wait_for_selector("#page[data-ready]", timeout=PATIENCE * 1000)
            return Writer(tab, said)

        yield open_model
        assert said == []
        assert [url for url in asked if not url.startswith((*origins, "data:"))] == []


@pytest.fixture(scope="module")
def studio_at(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Served, Path]]:
    """A studio of a small model, and the model's file."""
    path = tmp_path_factory.mktemp("studio") / "safe.yaml"
    path.write_text(MODEL)
    with served(path, "--seconds", "30", "--events", "20000") as found:
        yield found, path
