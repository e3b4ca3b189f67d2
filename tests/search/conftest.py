"""Searches of tests make their runs in one process, unless they ask for more: starting others takes longer."""

from __future__ import annotations

import pytest

from epicycle.runner.search import calibrating, evaluator


@pytest.fixture(autouse=True)
def _one_core(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (calibrating, evaluator):
        monkeypatch.setattr(module, "available_cores", lambda: 1)
