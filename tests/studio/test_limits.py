"""Runs that do not end, and workers that die: the studio goes on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.studio.studio_parts import MODEL, PATIENCE, Served, asking, served

ENDLESS = MODEL.replace("stop: 10 s, ", "")


@pytest.mark.slow
def test_a_run_that_does_not_end_is_ended(studio_at: tuple[Served, Path]) -> None:
    with asking(studio_at[0]) as page:
        found = page.ask(ask="run", text=ENDLESS)
        assert found["ended"] == "ended after 20,000 events: a run in the studio has no more (--events)"
        assert found["stopped"] == "interrupted"
        assert page.ask(ask="run", text=MODEL)["ended"] == ""


@pytest.mark.slow
def test_a_newer_run_ends_the_one_before(tmp_path: Path) -> None:
    path = tmp_path / "long.yaml"
    path.write_text(ENDLESS)
    with served(path, "--events", "100000000") as studio, asking(studio) as page:
        page.ask(ask="run", text=MODEL)  # the worker is there
        page.socket.send(json.dumps({"id": 100, "ask": "run", "text": ENDLESS}))
        time.sleep(0.5)
        started = time.monotonic()
        page.socket.send(json.dumps({"id": 101, "ask": "run", "text": MODEL}))
        answers = {}
        while 101 not in answers:
            said = json.loads(page.socket.recv(PATIENCE))
            if said.get("done"):
                answers[said["id"]] = said
        assert answers[100] == {"id": 100, "done": True, "stale": True}
        assert answers[101]["stopped"] == "stop time"
        assert time.monotonic() - started < 5


def _children(pid: int) -> list[int]:
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    return [int(each) for each in found.stdout.split()]


@pytest.mark.slow
def test_a_worker_that_dies_takes_nothing_with_it(studio_at: tuple[Served, Path]) -> None:
    studio, _ = studio_at
    with asking(studio) as page:
        assert page.ask(ask="read", text=MODEL)["valid"] is True
        digest = page.ask(ask="run", text=MODEL)["digest"]
        workers = _children(studio.process.pid)
        assert len(workers) == 2
        for each in workers:
            os.kill(each, signal.SIGKILL)
        time.sleep(0.3)
        # What has died is started again, at once or with the next question.
        answers = [page.ask(ask="run", text=MODEL) for _ in range(2)]
        assert answers[-1]["digest"] == digest
        assert [page.ask(ask="read", text=MODEL) for _ in range(2)][-1]["valid"] is True


@pytest.mark.slow
def test_a_worker_that_dies_in_a_run_is_told_of(tmp_path: Path) -> None:
    path = tmp_path / "long.yaml"
    path.write_text(ENDLESS)
    with served(path, "--events", "100000000") as studio, asking(studio) as page:
        page.ask(ask="run", text=MODEL)
        (worker,) = _children(studio.process.pid)
        page.socket.send(json.dumps({"id": 100, "ask": "run", "text": ENDLESS}))
        time.sleep(0.5)
        os.kill(worker, signal.SIGKILL)
        said = {}
        while not said.get("done"):
            said = json.loads(page.socket.recv(PATIENCE))
        assert said == {"id": 100, "done": True, "error": "the run has died; it starts again with the next change"}
        assert page.ask(ask="run", text=MODEL)["stopped"] == "stop time"


def stuck(folder: Path) -> tuple[Path, Path, str]:
    """A file of types, of which one never ends its firing, a model's file, and the text that uses it."""
    types, path = folder / "stuck.py", folder / "stuck.yaml"
    types.write_text(
        "from epicycle.actors import Actor, InputPort\n\n\n"
        "class Stuck(Actor):\n    input = InputPort(object)\n\n"
        "    def fire(self) -> None:\n        while True:\n            pass\n"
    )
    text = MODEL.replace("{type: Scale, factor: 2}", "{type: Stuck}").split("run:")[0] + "run: {stop: 10 s}\n"
    path.write_text(text)
    return types, path, text


@pytest.mark.slow
def test_a_step_that_never_ends_is_ended(tmp_path: Path) -> None:
    types, path, text = stuck(tmp_path)
    with served(path, "--types", str(types), "--seconds", "2") as studio, asking(studio) as page:
        assert page.ask(ask="read", text=text)["valid"] is True
        assert page.ask(ask="run", text=text) == {"error": "the run took longer than 12 s, and was ended"}
        assert page.ask(ask="run", text=MODEL)["stopped"] == "stop time"


@pytest.mark.slow
def test_a_step_that_never_ends_ends_with_the_studio(tmp_path: Path) -> None:
    types, path, text = stuck(tmp_path)
    with served(path, "--types", str(types)) as studio, asking(studio) as page:
        page.ask(ask="run", text=MODEL)  # the worker is there
        page.socket.send(json.dumps({"id": 100, "ask": "run", "text": text}))
        time.sleep(1)
        workers = _children(studio.process.pid)
        assert len(workers) == 1
    for _ in range(100):
        if not any(Path(f"/proc/{each}").exists() for each in workers):
            break
        time.sleep(0.1)
    assert not any(Path(f"/proc/{each}").exists() for each in workers)
