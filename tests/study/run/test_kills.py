"""`kill -9` of a study and of its workers, at any moment: nothing is lost, the table is as without the kill."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.runner.study.judge.study_results import open_study
from epicycle.runner.study.session import run_study
from tests.study.study_parts import STUDY, THIS, command, plan_of, write

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="finds processes in /proc")


def members(session: int) -> list[int]:
    """The processes of a session, its leader left out."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal() and int(entry.name) != session:
            try:
                state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
                if os.getsid(int(entry.name)) == session and state != "Z":
                    found.append(int(entry.name))
            except OSError:
                continue
    return sorted(found)


def rows(folder: Path) -> set[str]:
    """The runs that are finished."""
    if not (folder / "manifest.json").is_file():
        return set()
    return set(open_study(folder).table()["run"].to_pylist())


def written(folder: Path) -> int:
    """The number of bytes of all rows, which changes with progress."""
    total = 0
    for path in (*folder.glob("journals/*"), *folder.glob("parts/*")):
        with suppress(FileNotFoundError):
            total += path.stat().st_size
    return total


def wait_for_rows(folder: Path, process: subprocess.Popen[Any]) -> None:
    """Until something is written, or the process has ended."""
    before, start = written(folder), time.monotonic()
    while written(folder) == before and process.poll() is None and time.monotonic() - start < 60:
        time.sleep(0.01)


def kill_and_resume(
    tmp_path: Path, *options: object, kills: int, replications: int, seed: int, others: Callable[[], list[int]] = list
) -> None:
    """Kill a study that often, the whole group, one of its processes, or one of ``others`` that work for it.

    Then compare it with one that was left alone.
    """
    pause = "pause=0.05"
    write(tmp_path, STUDY.replace("replications: 5", f"replications: {replications}"))
    run_study(plan_of(tmp_path / "walks.yaml", set=(pause,)), tmp_path / "calm", jobs=2)
    random = np.random.default_rng(seed)
    out = tmp_path / "out"

    def next_command() -> list[str]:
        if (out / "manifest.json").is_file():
            return command("study", out, *options)
        return command("study", tmp_path / "walks.yaml", "--types", THIS, "--set", pause, "--out", out, *options)

    done = 0
    finished: set[str] = set()
    while done < kills:
        process = subprocess.Popen(next_command(), start_new_session=True, stdout=subprocess.DEVNULL)
        try:
            while done < kills and process.poll() is None:
                if random.random() < 0.8:  # most of the time while it works, not while it starts
                    wait_for_rows(out, process)
                time.sleep(float(random.uniform(0.0, 0.2)))
                victims = [*members(process.pid), *others()]
                done += 1
                if random.random() < 0.5 or not victims:
                    break
                with suppress(ProcessLookupError):
                    os.kill(victims[int(random.integers(len(victims)))], signal.SIGKILL)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        now = rows(out)
        assert finished <= now
        finished = now
    assert 0 < len(finished) < 2 * replications
    assert subprocess.run(next_command(), check=False, stdout=subprocess.DEVNULL).returncode == 0
    assert (out / "table.parquet").read_bytes() == (tmp_path / "calm" / "table.parquet").read_bytes()
    assert len(rows(out)) == 2 * replications


@pytest.mark.slow
def test_nothing_is_lost(tmp_path: Path) -> None:
    kill_and_resume(tmp_path, "--jobs", 2, kills=2, replications=15, seed=2)


def interrupted(out: Path, jobs: int, pause: float, wait: Callable[[subprocess.Popen[str]], object]) -> int:
    """Interrupt a study after a wait, as a terminal does; its process."""
    write(out.parent)
    arguments = ("--types", THIS, "--set", f"pause={pause}", "--out", out, "--jobs", jobs)
    started = command("study", out.parent / "walks.yaml", *arguments)
    process = subprocess.Popen(started, start_new_session=True, stderr=subprocess.PIPE, text=True)
    wait(process)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    assert said == f"interrupted; finished runs are kept: 'epicycle study {out}' continues\n"
    return process.pid


def until(is_so: Callable[[], bool], seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while not is_so() and time.monotonic() < deadline:
        time.sleep(0.05)


@pytest.mark.slow
def test_an_interrupt_ends_it_with_a_word(tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = interrupted(out, 1, 0.5, lambda process: wait_for_rows(out, process))
    assert 0 < len(rows(out)) < 10
    until(lambda: not members(process), 30)
    assert members(process) == []


@pytest.mark.slow
def test_an_interrupt_does_not_wait_for_runs(tmp_path: Path) -> None:
    def wait(process: subprocess.Popen[str]) -> None:
        until(lambda: len(members(process.pid)) >= 2, 60)
        time.sleep(5.0)  # until both of them make a run

    assert members(interrupted(tmp_path / "out", 2, 1000, wait)) == []


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("executor", ["local", "dask"])
def test_nothing_is_lost_in_twenty_kills(executor: str, jobs: int, tmp_path: Path) -> None:
    if executor == "dask":
        pytest.importorskip("distributed")
    kill_and_resume(tmp_path, "--executor", executor, "--jobs", jobs, kills=20, replications=200, seed=jobs)


@pytest.mark.slow
def test_nothing_is_lost_in_twenty_kills_on_a_cluster(tmp_path: Path) -> None:
    """The workers of a scheduler are killed, too, and the processes that make runs for them."""
    pytest.importorskip("distributed")
    from tests.study.dask_cluster import a_cluster

    with a_cluster(tmp_path / "cluster") as cluster:
        nannies = [cluster.add_worker("--nanny") for _ in range(2)]  # which start new workers

        def others() -> list[int]:
            return [each for nanny in nannies for each in members(nanny.pid)]

        options = ("--executor", "dask", "--scheduler", cluster.address)
        kill_and_resume(tmp_path, *options, kills=20, replications=200, seed=3, others=others)
