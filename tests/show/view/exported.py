"""Runs that tests write into files for other viewers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.runner.execution.results import Results
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.build.model import Model
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.view.recording import Recording


@dataclass(frozen=True)
class Pose:
    """A token with all that makes viewers stumble."""

    matrix: Any
    mode: str | None
    mixed: Any
    limit: float
    rest: tuple[Any, ...] = ()
    is_on: bool = True


SENT = [
    Pose(np.eye(2), None, 1.5, math.inf),
    Pose(np.full((2, 2), 2.0), "slow \ud800", "high", 4.0, is_on=False),
    Pose(np.zeros((2, 2)), "fast", [1, "x"], math.nan),
]


class Varied(Actor):
    """Sends these poses at its first three firings, each twice."""

    trigger: InputPort[Any] = InputPort(Any)
    pose = OutputPort(Any)
    number = OutputPort(float)
    count = OutputPort(int)

    def initialize(self) -> None:
        self.sent = 0

    def fire(self) -> None:
        for _ in range(2):
            self.pose.send(SENT[self.sent])
        self.number.send(self.sent / 4)
        self.sent += 1
        self.count.send(self.sent)


VARIED = """
model: varied
actors:
  clock: {type: Clock, period: 1 ns, offset: 100000.000000001 s}
  it: {type: Varied}
connections: [clock.output -> it.trigger]
run: {stop: 100000.000000003 s, record: ["it.*"]}
"""


def recorded(model: Model, **given: Any) -> Recording:
    recording = Recording(model, figures_of(model, Problems()), **given)
    recording.run()
    return recording


def results_of(recording: Recording) -> Results:
    assert recording.results is not None
    return recording.results
