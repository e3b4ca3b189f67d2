"""A model that searches look for a broken run of."""

from __future__ import annotations

from epicycle.runner.interface.cli import main

# How far a point is from one that nobody knows; and a source of noise, so that no two runs are the same.
TEXT = """
model: far
parameters: {x: 0.0, y: {value: 0, unit: m}, n: 3, policy: fifo, noise: 0.0}
actors:
  clock: {type: Clock, period: 1 s}
  noise: {type: Random, distribution: {type: Uniform, low: 0, high: "${noise}"}}
  far:
    type: Expression
    expression: (${x} - 0.71)**2 + (${y} - 0.13)**2 + ${n} + (1 if '${policy}' == 'fifo' else 0) + noise
  sink: {type: Recorder}
connections:
  - clock.output -> noise.trigger
  - noise.output -> far.noise
  - far.output -> sink.input
run: {stop: 3 s}
monitors:
  away: always far.output > 0.0001
"""


def falsify(*arguments: object) -> int:
    return main(["search", "far.yaml", "--break", "away", "--jobs", "1", *map(str, arguments)])
