"""The page of what if: both futures, with a mark at the first firing that changes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main

from .conftest import Opened


@pytest.mark.slow
def test_a_lost_plan_is_let_through_by_one_command(
    tmp_path: Path, opened: Callable[..., Opened], capsys: pytest.CaptureFixture[str]
) -> None:
    told = ["what-if", "collision_avoidance", "--disturb", "wifi_burst", "--at", "3", "--until", "5"]
    told += ["--let-through", "wifi_loss@main.peer_plan", "--out", str(tmp_path)]
    assert main(told) == 0
    assert "The first firing that changes is main.controller at (3.40497088 s, 1)." in capsys.readouterr().out
    page = opened(tmp_path / "what_if.html", 1400, 900)
    assert page.words().splitlines()[:3] == [
        "What if",
        "From 3 s on, wifi_loss lets token 105 at main.peer_plan through.",
        "The first firing that changes is main.controller at (3.40497088 s, 1).",
    ]
    marked = page.do("return state.runs.map((run) => run.firstChange >= 0)")
    assert marked == [False, True]
    assert page.do("return state.active") == 1
    page.tab.locator("button.changed").last.click()
    assert page.words().splitlines()[:2] == ["main.controller", "fired at 3.40497088 s"]
