"""How soon a text under work is read and drawn: `python -m benchmarks.desk [--edits 40]`.

What a worker of the studio does after a change: problems, then the graph of what is valid, and the fields. Of five
edits, two change a value, one a comment, one adds an actor, and one leaves a bracket open, as somebody does who types.
"""

from __future__ import annotations

import argparse
import gc
import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.measure import Row, of_the_pace, pace, table
from epicycle.runner.desk import editing
from epicycle.runner.interface.studio.worker import Worker
from epicycle.runner.support.collection import keep_for_good, seldom_collecting

ROOT = Path(__file__).parents[1]
ACTORS = 2_000
GOALS = {"collision_avoidance": 0.15, f"{ACTORS:,} actors": 1.0}
HOW = "CPU time of problems, graph and fields as JSON in a worker; median and 95th percentile of edits"


def pipeline() -> str:
    """A clock and so many actors in a row, each written out."""
    lines = ["model: pipeline", "actors:", "  clock: {type: Clock, period: 1 s}"]
    lines += [f"  scale{number}: {{type: Scale, factor: 2}}" for number in range(ACTORS)]
    lines += ["connections:", "  - clock.output -> scale0.input"]
    lines += [f"  - scale{number}.output -> scale{number + 1}.input" for number in range(ACTORS - 1)]
    return "\n".join([*lines, "run: {stop: 10 s}", ""])


def edited(text: str, count: int) -> Iterator[str]:
    """The text after each of some edits."""
    for number in range(count):
        match number % 5:
            case 0 | 2:
                yield re.sub(r"stop: \d+ s", f"stop: {number + 3} s", text)
            case 1:
                yield f"{text}# {number}\n"
            case 3:
                yield text.replace("  clock: {", f"  half{number}: {{\n  clock: {{", 1)
            case _:
                yield editing.change(text, "add_part", "", "actors", f"new{number}", "Clock", {"period": "1 s"})


def latencies(path: Path, text: str, edits: int) -> list[float]:
    """CPU seconds from a question to the end of its answer, after a first one."""
    said: list[str] = []
    worker = Worker(path, 60.0, 1_000_000, (), lambda message: said.append(json.dumps(message)))
    texts = [text, *edited(text, edits)]
    found = []
    keep_for_good()
    with seldom_collecting():
        for each in texts:
            began = time.process_time()
            answer: dict[str, Any] = worker.make({"ask": "read", "text": each})
            said.append(json.dumps(answer))
            found.append(time.process_time() - began)
            assert "graph" in answer, answer
            gc.collect()  # as a worker does when nobody waits
    return found[1:]


def rows(edits: int = 40) -> Iterator[Row]:
    own = ROOT / "models" / "collision_avoidance.yaml"
    for name, path, text in (
        ("collision_avoidance", own, own.read_text(encoding="utf-8")),
        (f"{ACTORS:,} actors", ROOT / "models" / "pipeline.yaml", pipeline()),
    ):
        before = pace()
        found = sorted(latencies(path.resolve(), text, edits if name == "collision_avoidance" else edits // 2))
        middle, high = found[len(found) // 2], found[int(len(found) * 0.95)]
        goal, work = GOALS[name], f"an edit of {name} in the studio"
        yield Row(
            work,
            "-",
            f"{1e3 * middle:.0f} ms, 95th percentile {1e3 * high:.0f} ms",
            f"{1e3 * goal:.0f} ms",
            middle <= goal,
            HOW,
            of_the_pace(work, 1e3 * middle, "ms", (before, pace())),
        )


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--edits", type=int, default=40)
    print(table(list(rows(options.parse_args().edits))))
