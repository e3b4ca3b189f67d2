"""How long it takes to validate large models: `python benchmarks/validation.py`.

Prints the size of each model and the user CPU time of `epicycle validate` in a new process, start-up included: the best
of three.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

HEAD = """\
model: flat
parameters:
  period: {value: 100 ms, unit: s}
  speed: {value: 2, unit: m/s, min: 0}
  goals: [0, 10, 20, 30]
"""
CELL = """\
  clock_{n}:
    type: Clock
    period: ${{period}}
    offset: {offset} ms
  leader_{n}:
    type: CircularMotion
    start: [{n} m, 2 m]
    speed: ${{1.5 * speed}}
    turn_rate: 0.6 rad/s
  follower_{n}:
    type: CircularMotion
    start: [{n}, -2]
    speed: ${{speed}}
  gap_{n}:
    type: DistanceMonitor
  arrival_{n}:
    type: GoalMonitor
    goal: ${{[goals[{n} % 4], 0]}}
    tolerance: 50 cm
"""
WIRES = """\
  - clock_{n}.output -> leader_{n}.trigger, follower_{n}.trigger
  - leader_{n}.state -> gap_{n}.a, arrival_{n}.state
  - {{from: follower_{n}.state, to: gap_{n}.b, delay: 10 ms}}
"""
ASPECT = "  loss_{n}: {{type: PacketLoss, probability: 0.1, at: [gap_{n}.a, gap_{n}.b]}}\n"
METRIC = "  gap_{n}: {{of: gap_{n}.distance, take: min, unit: m}}\n"
RECORD = "    - leader_{n}.state\n"


def flat(actors: int) -> str:
    """A model of so many actors, each written out: five of them take 25 lines."""
    cells = range(actors // 5)
    sections = {
        "actors": CELL,
        "connections": WIRES,
        "aspects": ASPECT,
        "metrics": METRIC,
        'run:\n  stop: 10 s\n  record:\n    - "**.distance"\n': RECORD,
    }
    text = HEAD
    for heading, piece in sections.items():
        text += heading if "\n" in heading else f"{heading}:\n"
        text += "".join(piece.format(n=n, offset=n % 100) for n in cells)
    return text


def replicated(count: int) -> str:
    """A model of a few lines with `count` instances of a composite of two actors."""
    return f"""\
model: replicated
parameters: {{n: {count}}}
composites:
  Robot:
    parameters: {{speed: {{value: 2, unit: m/s}}}}
    inputs: [tick]
    outputs: [distance]
    actors:
      body: {{type: CircularMotion, speed: "${{speed}}", start: "${{[index, 0]}}"}}
      arrival: {{type: GoalMonitor}}
    connections: [tick -> body.trigger, body.state -> arrival.state, arrival.distance -> distance]
actors:
  clock: {{type: Clock, period: 1 s}}
  robot: {{type: Robot, count: "${{n}}", speed: "${{1 + index / n}}"}}
connections: ["clock.output -> robot[*].tick"]
aspects: {{loss: {{type: PacketLoss, probability: 0.1, at: "robot[*].arrival.state"}}}}
run: {{stop: 1 s, record: "robot[*].distance"}}
"""


def user_seconds(path: Path) -> tuple[float, str]:
    """The user CPU time of `epicycle validate`, and what it prints."""
    before = os.times().children_user
    command = [sys.executable, "-m", "epicycle.runner.interface.cli", "validate", str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return os.times().children_user - before, done.stdout.strip()


def main() -> None:
    models = {"flat, 2,000 actors": flat(2_000), "count: 6,000": replicated(6_000)}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        for name, text in models.items():
            path.write_text(text, encoding="utf-8")
            best, said = min(user_seconds(path) for _ in range(3))
            print(f"{name}: {text.count(chr(10)):,} lines, {best:.2f} s user CPU; {said.partition(': ')[2]}")


if __name__ == "__main__":
    main()
