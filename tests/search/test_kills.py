"""`kill -9` of each search and of a comparison, at any moment, and bits that flip: the answer is the same."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import epicycle
from tests.study.study_parts import THIS, command

# A walk that a relay repeats; every run takes a while, so that a kill meets one.
TEXT = """
model: line
parameters: {drift: {value: 0.1, unit: m/s}, pause: 0.02}
actors:
  walk: {type: Walk, drift: "${drift}", pause: "${pause}"}
  relay: {type: Scale, factor: 2}
  sink: {type: Recorder}
connections: [walk.output -> relay.input, relay.output -> sink.input]
aspects: {loss: {type: PacketLoss, probability: 0.4, at: relay.input}}
run: {stop: 9 s}
monitors: {alive: always after 1 s eventually within 1.5 s sends relay.output, low: always walk.output < 100}
metrics: {place: {of: walk.output, take: last}, sent: {of: relay.output, take: count}}
"""
SEARCHES = {
    "compare": "compare line.yaml --vary drift=0.2 --replications 30",
    "break": "search line.yaml --break low --vary 'drift=-1 m/s..1 m/s' --runs 60 --run-timeout 20",
    "minimise": "search line.yaml --minimise place --vary 'drift=-1 m/s..1 m/s' --points 20 --replications 3",
    "match": "search line.yaml --match walk.output=measured.csv --vary 'drift=-1 m/s..1 m/s'",
    "explain": "explain line.yaml --monitor alive --seed 1 --no-page",
    "rare": "rare line.yaml --monitor 'always walk.output < 9' --runs 10 --repetitions 6",
}


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("line.yaml").write_text(TEXT, encoding="utf-8")
    rows = "".join(f"{second},{0.3 * second}\n" for second in range(10))
    Path("measured.csv").write_text(f"time,value\n{rows}", encoding="utf-8")


def words(name: str, out: str) -> list[str]:
    return command(*shlex.split(SEARCHES[name]), "--types", THIS, "--jobs", 2, "--out", out, "--json")


def answer(name: str, out: str) -> tuple[int, Any]:
    """What a search says, but for the name of its folder."""
    done = subprocess.run(words(name, out), capture_output=True, check=False, text=True)
    assert "Traceback" not in done.stderr
    facts = json.loads(done.stdout.replace(out, "OUT"))
    return done.returncode, without_count(name, facts)


def without_count(name: str, facts: dict[str, Any]) -> dict[str, Any]:
    """The same without the number of runs that an explanation made now."""
    return {key: value for key, value in facts.items() if (name, key) != ("explain", "runs")}


def written(folder: Path) -> int:
    """The number of bytes of what a search keeps of its runs."""
    total = 0
    for path in (*folder.glob("tried-*"), *folder.glob("journals/*"), *folder.glob("parts/*")):
        with suppress(FileNotFoundError):
            total += path.stat().st_size
    return total


@pytest.mark.slow
@pytest.mark.parametrize("name", SEARCHES)
def test_twenty_kills(name: str) -> None:
    code, calm = answer(name, "calm_runs")
    assert code in (0, 3)
    random = np.random.default_rng(len(name))
    out, met, before = Path("killed_runs"), 0, 0
    for _ in range(20):
        process = subprocess.Popen(
            words(name, "killed_runs"), start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        start = time.monotonic()
        while written(out) <= before and process.poll() is None and time.monotonic() - start < 60:
            time.sleep(0.01)  # until it has kept more than the one before
        time.sleep(float(random.uniform(0.0, 0.1)))
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        met += process.wait() == -signal.SIGKILL
        assert written(out) >= before  # nothing is lost
        before = written(out)
    assert met > 0  # it was killed in the middle, not only at its end
    assert answer(name, "killed_runs") == (code, calm)


QUICK = {"set": {"pause": 0}, "types": [THIS], "jobs": 1}


def found(name: str, out: Path) -> dict[str, Any]:
    """What a call finds, with runs that take no time."""
    if name == "compare":
        changes: dict[str, Any] = {"set": {"pause": 0}, "types": [THIS]}
        variants: Any = {"a": changes, "b": changes | {"set": {"pause": 0, "drift": 0.2}}}
        return epicycle.compare("line.yaml", variants, replications=4, out=out, jobs=1).facts()
    options: dict[str, Any] = {**QUICK, "out": out, "progress": False}
    if name == "explain":
        return without_count(name, epicycle.explain("line.yaml", "alive", seed=1, **options).facts())
    return epicycle.rare("line.yaml", "always walk.output < 9", runs=5, repetitions=3, **options).facts()


@pytest.mark.parametrize("name", ["compare", "explain", "rare"])
@pytest.mark.parametrize("bits", [4, pytest.param(333, marks=pytest.mark.slow)])
def test_flipped_bits_change_no_answer(name: str, bits: int, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    out = tmp_path / "out"
    whole = found(name, out)
    kept = {path: path.read_bytes() for path in out.glob("tried-*.jsonl")}
    random, told = np.random.default_rng(5), 0
    for _ in range(bits):
        for path, data in kept.items():
            path.write_bytes(data)
        path = sorted(kept)[int(random.integers(len(kept)))]
        changed = bytearray(kept[path])
        bit = int(random.integers(8 * len(changed)))
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(bytes(changed))
        caplog.clear()
        assert found(name, out) == whole
        is_told = any(str(path) in each.getMessage() for each in caplog.records)
        # What follows the last end of a line may be of a process that was killed, and is made again without a word.
        assert is_told or bit // 8 == len(changed) - 1
        told += is_told
        assert path.read_bytes().splitlines()[0] == kept[path].splitlines()[0]
    assert told > 0
