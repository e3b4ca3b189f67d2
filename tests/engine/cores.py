"""Do all cores make the same runs?  `python -m tests.engine.cores [--networks 100000]`, or `make cores`."""

from __future__ import annotations

import argparse
import json
import os
import random  # noqa: TID251 (what to try, and not what a model draws)
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.engine.networks import network

ROOT = Path(__file__).parents[2]
CORES = {
    "python": {"EPICYCLE_CORE": "python"},
    "compiled": {"EPICYCLE_CORE": "compiled"},
    "compiled, without native forms": {"EPICYCLE_CORE": "compiled", "EPICYCLE_FORMS": "off"},
}
WAYS = ("run", "run", "steps", "snapshot")
BATCH = 50  # networks per request


class Worker:
    """A process that makes runs with one core."""

    def __init__(self, name: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.engine.networks"],
            cwd=ROOT,
            env={**os.environ, **CORES[name]},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        if self.process.stdout.readline().strip() != CORES[name]["EPICYCLE_CORE"]:
            raise RuntimeError(f"there is no core {name}")

    def ask(self, questions: list[dict[str, Any]]) -> None:
        """Let it make runs."""
        assert self.process.stdin is not None
        self.process.stdin.write("".join(json.dumps(each) + "\n" for each in questions))
        self.process.stdin.flush()

    def answers(self, number: int) -> list[list[str]]:
        """Their results."""
        assert self.process.stdout is not None
        return [json.loads(self.process.stdout.readline()) for _ in range(number)]


@contextmanager
def workers() -> Iterator[dict[str, Worker]]:
    """One for each core."""
    made = {name: Worker(name) for name in CORES}
    try:
        yield made
    finally:
        for each in made.values():
            each.process.kill()
            each.process.wait()


def differences(
    at: dict[str, Worker], questions: list[dict[str, Any]]
) -> list[tuple[dict[str, Any], dict[str, list[str]]]]:
    """The runs that differ, with the result of each core."""
    for each in at.values():
        each.ask(questions)
    answers = {name: each.answers(len(questions)) for name, each in at.items()}
    told = [{name: answers[name][place] for name in at} for place in range(len(questions))]
    return [(asked, each) for asked, each in zip(questions, told, strict=True) if len(set(map(str, each.values()))) > 1]


def main() -> int:
    """Try many; the number of those that differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--networks", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    numbers, wrong, start = random.Random(given.seed), 0, time.perf_counter()
    with workers() as at:
        for done in range(0, given.networks, BATCH):
            questions = [{"model": network(numbers), "way": WAYS[place % len(WAYS)]} for place in range(BATCH)]
            for asked, told in differences(at, questions):
                wrong += 1
                if wrong <= 5:
                    print(json.dumps(asked))
                    for name, lines in told.items():
                        print(f"{name}:", *lines, sep="\n  ")
            if done % 5_000 == 0:
                print(f"{done + BATCH:,} networks, {wrong} differ, {time.perf_counter() - start:.0f} s", flush=True)
    print(f"{given.networks:,} networks, {wrong} differ between {', '.join(CORES)}")
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main()))
