"""How long searches take with two processes if each run takes one second: by a clock that only counts."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

import epicycle
from epicycle.runner.search import calibrating, explaining
from epicycle.runner.search.evaluator import Evaluator
from epicycle.runner.search.explaining import _Worker
from tests.search.test_evaluator import MODEL


class Clocked(Evaluator):
    """Works here, and counts when two processes would have made what is expected and asked for."""

    latest: Clocked

    def __enter__(self) -> Clocked:
        Clocked.latest = self
        self.now, self.free, self.made = 0.0, [0.0, 0.0], 0
        self.over: dict[Hashable, float] = {}
        self.wanted: Iterator[tuple[Hashable, object]] = iter(())
        return self

    def begin(self, key: Hashable) -> None:
        """The first free process makes it."""
        self.free.sort()
        self.free[0] = max(self.free[0], self.now) + 1.0
        self.over[key] = self.free[0]

    def go_on(self, until: float) -> None:
        """What the processes begin on their own before a time."""
        while min(self.free) < until and (following := next(self.wanted, None)) is not None:
            self.now = max(self.now, min(self.free))
            if following[0] not in self.over:
                self.begin(following[0])

    def expect(self, requests: Iterable[tuple[Hashable, object]]) -> None:
        self.wanted = iter(requests)
        self.go_on(self.now + 1e-9)

    def make(self, key: Hashable, request: object) -> Any:
        if key not in self.over:
            self.begin(key)
        over = self.over[key]
        self.go_on(over)
        self.now = over
        self.made += 1
        return self._worker.make(request)


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("line.yaml").write_text(MODEL, encoding="utf-8")
    rows = "".join(f"{time},{1.5 * time - 0.5 + 0.01 * (time % 3)}\n" for time in range(1, 9))
    Path("measured.csv").write_text(f"time,value\n{rows}", encoding="utf-8")
    monkeypatch.setattr(explaining, "Evaluator", Clocked)
    monkeypatch.setattr(calibrating, "Evaluator", Clocked)


def share() -> float:
    """The time with two processes, relative to that with one."""
    return Clocked.latest.now / Clocked.latest.made


def test_an_explanation(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = _Worker.results

    def results(self: _Worker, exactly: Any, **given: Any) -> Any:
        if not Clocked.latest.made:  # the whole run, which is made here, beside two processes
            Clocked.latest.now, Clocked.latest.made = 1.0, 1
        return whole(self, exactly, **given)

    monkeypatch.setattr(_Worker, "results", results)
    found = epicycle.explain("line.yaml", "enough", seed=1)
    assert len(found.effects) > 1
    assert share() < 0.58


def test_a_calibration() -> None:
    epicycle.search(
        "line.yaml", epicycle.Match({"f.output": "measured.csv"}), vary={"slope": "0..3", "offset": "-2..2"}
    )
    assert share() < 0.56
