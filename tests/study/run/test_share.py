"""Shares of a study, made by different machines: together they are the study, bit for bit."""

from __future__ import annotations

import errno
import logging
import os
import platform
import signal
import subprocess
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from epicycle.actors import EpicycleError
from epicycle.runner.interface.cli import main
from epicycle.runner.study.judge.study_results import open_study
from epicycle.runner.study.run import locking
from epicycle.runner.study.run.backlog import OK, Backlog, Done
from epicycle.runner.study.run.locking import lock
from epicycle.runner.study.run.share import Share
from epicycle.runner.study.session import run_study
from tests.study.study_commands import message, study
from tests.study.study_parts import STUDY, THIS, command, plan_of, write


def handed_out(plan: Any, share: Share) -> list[tuple[int, int]]:
    """The runs of a share, all of which get the same number."""
    backlog, found = Backlog(plan, {}, share=share), []
    while (task := backlog.next()) is not None:
        found.append((task.condition, task.replication))
        backlog.finished(task, Done(OK, 1.0))
    assert len(found) == backlog.over == backlog.total
    return found


@pytest.mark.parametrize("rule", ["replications: 5", "until: {metric: place, half_width: 1, batch: 2, at_most: 7}"])
@pytest.mark.parametrize("of", [1, 2, 3, 5, 7, 40])
def test_each_run_is_in_one_share(of: int, rule: str, tmp_path: Path) -> None:
    levels = "{from: 0, to: 10, step: 1}"
    text = STUDY.replace("[0 m/s, 100 cm/s]", levels).replace("replications: 5", rule)
    plan = plan_of(write(tmp_path, text))
    shares = [Share(number, of) for number in range(of)]
    runs = [handed_out(plan, share) for share in shares]
    assert Counter(run for share in runs for run in share) == Counter(handed_out(plan, Share()))
    assert sum(share.size(plan) for share in shares) == plan.size
    if plan.study.until is None:
        assert [len(share) for share in runs] == [share.size(plan) for share in shares]
        assert max(map(len, runs)) - min(map(len, runs)) <= 1 + 5 % of
    else:  # of which the next runs depend on those before
        conditions = [{condition for condition, _ in share} for share in runs]
        assert sum(map(len, conditions)) == 11


def test_more_replications_move_no_run() -> None:
    class Fixed:
        until = None

    class Some:
        study = Fixed

    some: Any = Some
    here = [(c, r) for c in range(4) for r in range(9) if Share(1, 3).has(some, c, r)]
    assert here == [(c, r) for c in range(4) for r in range(9) if (c + r) % 3 == 1]


@pytest.mark.parametrize("text", ["0/4", "5/4", "1/0", "4", "1/4/2", "-1/4", "1 / 4", "1/1000000", "1/100001", "¹/4"])
def test_what_is_no_part(text: str, done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(done / "out"), f"--part={text}"]) == 2
    assert capsys.readouterr().err == f"error: {text!r} is not a part such as 3/16, the third of 16\n"
    with pytest.raises(EpicycleError):
        Share.named(text)


def parts_of(folder: Path) -> list[list[str]]:
    """The commands of four parts in one folder, in any order."""
    found = [
        command("study", folder / "walks.yaml", "--types", THIS, "--set", "pause=0.05", "--out", folder / "out")
        for _ in range(4)
    ]
    return [[*each, "--jobs", "1", "--part", f"{number}/4"] for number, each in enumerate(found, start=1)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_four_parts_in_one_folder_of_which_one_is_killed(
    seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path, STUDY.replace("replications: 5", "replications: 32"))
    run_study(plan_of(tmp_path / "walks.yaml", set=("pause=0.05",)), tmp_path / "calm", jobs=2)
    out, parts = tmp_path / "out", parts_of(tmp_path)
    parts = [parts[int(each)] for each in np.random.default_rng(seed).permutation(4)]
    victim = subprocess.Popen(parts[0], start_new_session=True, stdout=subprocess.DEVNULL)
    others = [subprocess.Popen(each, stdout=subprocess.DEVNULL) for each in parts[1:3]]
    journals = f"journals/{parts[0][-1].replace('/', '-of-')}-*"
    while victim.poll() is None and not any(path.stat().st_size for path in out.glob(journals)):
        time.sleep(0.01)
    os.kill(victim.pid, signal.SIGSTOP)
    assert main(["study", str(out)]) == 2
    said = message(capsys, tmp_path)
    assert said.startswith("error: out is in use: another process is writing to it (part ")
    assert f"/4: pid {victim.pid} on {platform.node()}" in said
    assert main(["status", str(out)]) == 0
    assert "; it is running" in capsys.readouterr().out
    os.killpg(victim.pid, signal.SIGKILL)
    victim.wait()
    assert [each.wait() for each in others] == [0, 0]
    assert subprocess.run(parts[3], check=True, stdout=subprocess.PIPE, text=True).stdout == (
        f"walks: 2 conditions, 16 new runs, 0 already there, in part {parts[3][-1]}\n"
        f"once all parts are over, 'epicycle study {out}' makes what they have left and writes the table\n"
    )
    assert not (out / "table.parquet").exists()
    before = open_study(out).counts()["ok"]
    assert 48 < before < 64
    assert main(["study", str(out), "--jobs", "2"]) == 0
    assert message(capsys, tmp_path, out=True) == (
        f"walks: 2 conditions, {64 - before} new runs, {before} already there\nwrote out/table.parquet\n"
    )
    assert (out / "table.parquet").read_bytes() == (tmp_path / "calm" / "table.parquet").read_bytes()


@pytest.mark.slow
def test_four_parts_in_folders_of_their_own(done: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path)
    for number in (3, 1, 4, 2):
        assert study(tmp_path, "--part", f"{number}/4", "--jobs", 1, out=f"part_{number}") == 0
    # A machine has been lost; and a part that is there twice counts once.
    merged = [argument for number in (2, 4, 1, 2) for argument in ("--merge", tmp_path / f"part_{number}")]
    capsys.readouterr()
    assert study(tmp_path, *merged, "--jobs", 1) == 0
    assert message(capsys, tmp_path, out=True) == (
        "walks: 2 conditions, 2 new runs, 8 already there\nwrote out/table.parquet\n"
    )
    assert (tmp_path / "out" / "table.parquet").read_bytes() == (done / "out" / "table.parquet").read_bytes()
    assert len([*(tmp_path / "out" / "parts").iterdir()]) == 4
    assert study(tmp_path, "--merge", tmp_path / "nothing") == 2
    assert message(capsys, tmp_path) == "error: there is no folder nothing\n"
    (tmp_path / "other").mkdir()
    write(tmp_path / "other", STUDY.replace("study: walks", "study: strolls"))
    assert study(tmp_path / "other", "--part", "1/40", "--jobs", 1, out="strolls") == 0
    assert study(tmp_path, "--merge", tmp_path / "other" / "strolls") == 2
    assert message(capsys, tmp_path) == (
        "error: other/strolls holds results of the study 'strolls', not of 'walks'\n"
        "   help: choose another folder with --out\n"
    )


@pytest.mark.slow
def test_a_part_continues_and_reports_only_its_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, STUDY + "set: {fails: [3]}\n")
    assert study(tmp_path, "--part", "1/4", "--jobs", 1) == 1
    said = message(capsys, tmp_path, out=True)
    assert said.startswith("walks: 2 conditions, 3 new runs, 0 already there, in part 1/4\n")
    manifest = (tmp_path / "out" / "manifest.json").read_bytes()
    assert study(tmp_path, "--part", "4/4", "--jobs", 1) == 1
    told = capsys.readouterr()
    assert told.out.startswith("walks: 2 conditions, 2 new runs, 0 already there, in part 4/4\n")
    assert told.err == f"error: 1 run failed: epicycle status {tmp_path / 'out'}\n"
    assert (tmp_path / "out" / "manifest.json").read_bytes() == manifest
    assert main(["study", str(tmp_path / "out"), "--types", str(THIS), "--part", "4/4"]) == 1
    assert "0 new runs, 2 already there, in part 4/4\n" in capsys.readouterr().out


def test_one_process_for_each_share(tmp_path: Path) -> None:
    with lock(tmp_path, Share(0, 2)), lock(tmp_path, Share(1, 2)):
        for share in (Share(1, 2), Share()):
            with pytest.raises(EpicycleError) as raised, lock(tmp_path, share):
                pass
            node = platform.node()
            assert str(raised.value) == (
                f"{tmp_path} is in use: another process is writing to it (part 1/2: pid {os.getpid()} on {node}, "
                f"part 2/2: pid {os.getpid()} on {node})"
            )
        assert locking.is_running(tmp_path)
    assert not locking.is_running(tmp_path)
    with lock(tmp_path), pytest.raises(EpicycleError, match=f"pid {os.getpid()}"), lock(tmp_path, Share(0, 2)):
        pass


def test_looking_whether_somebody_writes_keeps_nobody_from_writing(tmp_path: Path) -> None:
    """``epicycle status`` holds the lock itself for a moment."""
    fcntl = pytest.importorskip("fcntl")
    with (tmp_path / "lock").open("a+") as looking:
        fcntl.flock(looking, fcntl.LOCK_EX)
        threading.Timer(0.1, looking.close).start()
        with lock(tmp_path):
            assert locking.is_running(tmp_path)


@pytest.mark.skipif(locking.fcntl is None, reason="no locks here")
def test_a_file_system_without_locks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(locking.fcntl, "flock", refuse)
    with caplog.at_level(logging.WARNING, "epicycle"), lock(tmp_path):
        pass
    assert "\n".join(caplog.messages) == (
        f"warning: {tmp_path}/lock cannot be locked (Function not implemented)\n"
        "   help: start nothing twice that writes to this folder"
    )
