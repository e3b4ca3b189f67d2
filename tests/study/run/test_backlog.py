"""The backlog: every run once, the runs left, and the display of progress."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from epicycle.runner.study.run import progress as progress_module
from epicycle.runner.study.run.backlog import OK, Backlog, Done
from tests.study.study_parts import STUDY, plan_of, write


def test_backlog_gives_every_run_once_and_keeps_only_open_conditions(tmp_path: Path) -> None:
    plan = plan_of(write(tmp_path, STUDY.replace("[0 m/s, 100 cm/s]", "{from: 0, to: 40, step: 1}")))
    known = {plan.key(plan.condition(3), 2): Done(OK)}
    backlog = Backlog(plan, known)
    running = []
    given: Counter[tuple[int, int]] = Counter()
    random = np.random.default_rng(1)
    while (task := backlog.next()) is not None or running:
        if task is not None:
            running.append(task)
        if task is None or len(running) > 3:
            over = running.pop(int(random.integers(len(running))))
            if random.random() < 0.1:
                backlog.again(over)
            else:
                given[over.condition, over.replication] += 1
                backlog.finished(over, Done(OK))
        assert len(backlog._open) <= 5
    assert set(given.values()) == {1}
    assert set(given) == {(c, r) for c in range(41) for r in range(5)} - {(3, 2)}
    assert (backlog.there, backlog.made) == (Counter({OK: 1}), Counter({OK: 204}))


def test_progress_is_a_line_a_minute_without_a_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    backlog = Backlog(plan_of(write(tmp_path)), {})
    tasks = [backlog.next() for _ in range(10)]
    now = 1000.0
    monkeypatch.setattr(progress_module.time, "monotonic", lambda: now)
    with progress_module.progress("walks") as tell:
        for number, task in enumerate(tasks):
            assert task is not None
            backlog.finished(task, Done("failed" if number == 2 else OK))
            now += 12.0
            tell(backlog)
    lines = [line.partition(" ")[2] for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        "walks: 5 of 10 runs, 1 failed, 0.0833 runs/s, 60 s left",
        "walks: 10 of 10 runs, 1 failed, 0.0833 runs/s, 0 s left",
    ]


def test_what_is_left_is_only_what_has_to_be_made(tmp_path: Path) -> None:
    """A study continues with more replications: half of its runs exist, and not only at the beginning."""
    plan = plan_of(write(tmp_path))
    keys = [plan.key(plan.condition(each), one) for each in range(2) for one in range(5)]
    there = {key: Done(OK) for key in (*keys[:2], *keys[5:8], "a run of another model")}
    backlog, elapsed = Backlog(plan, there), 0.0
    lines = []
    while (task := backlog.next()) is not None:
        elapsed += 12.0
        backlog.finished(task, Done(OK))
        lines.append(progress_module.line(backlog, elapsed))
    assert lines == [
        "3 of 10 runs, 0.0833 runs/s, 48 s left",
        "4 of 10 runs, 0.0833 runs/s, 36 s left",
        "5 of 10 runs, 0.0833 runs/s, 24 s left",
        "9 of 10 runs, 0.0833 runs/s, 12 s left",
        "10 of 10 runs, 0.0833 runs/s, 0 s left",
    ]


@pytest.mark.parametrize(
    ("seconds", "shown"), [(3, "3 s"), (600, "10 min"), (7200, "2 h"), (864_000, "10 days"), (1e10, "317 years")]
)
def test_duration_is_readable(seconds: float, shown: str) -> None:
    assert progress_module.duration(seconds) == shown
