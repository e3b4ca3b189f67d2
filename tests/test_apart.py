"""An object in a process of its own."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from epicycle.actors import EpicycleError
from epicycle.runner.study.run.processes import Processes
from epicycle.runner.support import apart
from epicycle.runner.support.apart import DONE, LATE, Apart, Process


class Told:
    """Something that can be asked."""

    def __init__(self, name: str) -> None:
        self.name = name

    def twice(self, number: int) -> int:
        return 2 * number

    def die(self) -> None:
        os._exit(3)

    def sleep(self) -> None:
        time.sleep(60)

    def count(self) -> str:
        """Count until somebody hastens it."""
        apart.say("one")
        while not apart.is_hastened():
            time.sleep(0.01)
        apart.say("two")
        return "three"

    def close(self) -> None:
        Path(self.name).touch()


def test_its_methods_are_called_there_and_it_closes_itself(tmp_path: Path) -> None:
    it = Apart("it", 30.0, Told, str(tmp_path / "closed"))
    assert it.twice(4) == 8
    with pytest.raises(EpicycleError) as raised:
        it.twice(None)
    assert str(raised.value) == "it: unsupported operand type(s) for *: 'int' and 'NoneType'"
    it.close()
    assert (tmp_path / "closed").exists()


def test_it_tells_something_before_its_answer_and_may_be_hastened() -> None:
    it, told = Process(Told, ""), list[str]()

    def hear(said: str) -> None:
        told.append(said)
        it.hasten()

    assert it.begin(30.0) == (DONE, None)
    assert it.call("count", limit=30.0, told=hear) == (DONE, "three")
    assert told == ["one", "two"]
    assert it.call("twice", 4, limit=30.0) == (DONE, 8)  # what came too late is for nobody
    assert not it.is_over
    it.end()
    assert it.is_over


@pytest.mark.parametrize(
    ("method", "limit", "message"),
    [
        ("die", 30.0, "it: its process ended in die, with exit code 3"),
        ("sleep", 0.5, "it: sleep takes longer than 0.5 s; its process was ended"),
    ],
)
def test_it_may_die_or_hang(method: str, limit: float, message: str) -> None:
    it = Apart("it", limit, Told, "")
    with pytest.raises(EpicycleError) as raised:
        getattr(it, method)()
    assert str(raised.value) == message


@pytest.mark.parametrize(
    ("program", "limit", "code"),
    [
        ("raise SystemExit(3)", 30.0, "3"),
        ("import os; os.abort()", 30.0, "-6"),
        ("import time; time.sleep(60)", 0.5, "-9"),
    ],
)
def test_a_process_that_does_not_start_is_told(
    program: str, limit: float, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(apart, "_PROGRAM", program)
    monkeypatch.setattr(apart, "_BEGIN_LIMIT", limit)
    with pytest.raises(EpicycleError) as raised:
        Apart("it", 1.0, Told, "")
    assert str(raised.value) == f"it: its process did not start; it ended with exit code {code}"


def test_no_module_of_the_working_directory_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "secrets.py").write_text("import os; os._exit(7)")
    monkeypatch.chdir(tmp_path)
    it = Apart("it", 30.0, Told, "closed")
    assert it.twice(1) == 2
    it.close()


class Maker:
    """Makes twice a number, once it has slept so long (s)."""

    def __init__(self, seconds: float) -> None:
        time.sleep(seconds)

    def prepare(self, request: int) -> None:
        return

    def make(self, request: int) -> int:
        return 2 * request


def test_a_worker_that_does_not_begin_in_time_is_late() -> None:
    with Processes(Maker, 60.0, patience=3.0) as processes:
        since = time.monotonic()
        assert processes.make(4) == (LATE, None)
        assert time.monotonic() - since < 30.0
    with Processes(Maker, 0.0, patience=60.0) as processes:
        assert processes.make(4) == (DONE, 8)
