"""The modelling tasks: reference solutions pass, and for each task a wrong one fails."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from .tasks.__main__ import main
from .tasks.judging import judge, tasks

TASKS = tasks()


def test_there_are_twenty() -> None:
    assert len(TASKS) == 20


@pytest.mark.parametrize("name", TASKS)
def test_the_reference_solution_passes_and_a_wrong_one_fails(name: str, tmp_path: Path) -> None:
    task, path = TASKS[name], tmp_path / f"{name}.yaml"
    path.write_text(task.solution, encoding="utf-8")
    assert judge(task, path) == []
    path.write_text(task.wrong_solution, encoding="utf-8")
    faults = judge(task, path)
    assert faults
    assert not any("error:" in fault for fault in faults), faults  # it can be run, and does something else


def test_the_words_name_no_check() -> None:
    for task in TASKS.values():
        assert not any(text in task.words for check in task.checks for text in check.get("monitors", ())), task.name


def test_anybody_can_measure_an_assistant(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second = [*TASKS][:2]
    (tmp_path / f"{first}.yaml").write_text(TASKS[first].solution, encoding="utf-8")
    (tmp_path / f"{second}.yaml").write_text("model: [", encoding="utf-8")
    assert main([os.fspath(tmp_path)]) == 1
    said = capsys.readouterr().out.splitlines()
    assert said[0] == f"{first}: solved"
    assert said[1].startswith(f"{second}: check 1: ")
    assert said[-1] == "1 of 20 tasks are solved"
    assert main([]) == 0
    assert capsys.readouterr().out.startswith(f"{first}.yaml: ")
