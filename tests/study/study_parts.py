"""A small model for studies, whose runs can fail, hang, and take their time; and what the tests share."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from epicycle.actors import Actor, OutputPort, Parameter
from epicycle.runner.study.plan.plan import sealed
from epicycle.runner.study.plan.seal import seal

THIS = Path(__file__)


class Walk(Actor):
    """Ten random steps, one a second; of every ten seeds some may fail, hang, or end the process."""

    is_source: ClassVar[bool] = True
    output: OutputPort[float] = OutputPort(float)
    drift = Parameter(float, 0.0, unit="m/s", doc="mean step")
    pause = Parameter(float, 0.0, doc="real seconds that a run takes")
    fails = Parameter(float, (), shape=(None,))
    hangs = Parameter(float, (), shape=(None,))
    dies = Parameter(float, (), shape=(None,))

    def initialize(self) -> None:
        digit = self.context.seed % 10
        self.at = 0.0
        time.sleep(self.pause)
        if digit in self.fails:
            raise ValueError(f"seed {self.context.seed} is unlucky")
        if digit in self.hangs:
            time.sleep(1000)
        if digit in self.dies:
            os._exit(3)
        for second in range(10):
            self.wake_at(second)

    def fire(self) -> None:
        self.at += float(self.random.normal(self.drift, 1.0))
        self.output.send(self.at)


MODEL = """
model: walk
parameters: {drift: {value: 0, unit: m/s}, pause: 0.0, fails: [], hangs: [], dies: []}
actors:
  walk: {type: Walk, drift: "${drift}", pause: "${pause}", fails: "${fails}", hangs: "${hangs}", dies: "${dies}"}
  scale: {type: Scale, factor: 2}
connections: [walk.output -> scale.input]
aspects: {loss: {type: PacketLoss, probability: 0.3, at: scale.input}}
run: {record: [walk.output]}
metrics: {place: {of: walk.output, take: last}, highest: {of: walk.output, take: max}}
"""

STUDY = """
study: walks
model: ./walk.yaml
vary:
  drift: [0 m/s, 100 cm/s]
replications: 5
seed: 20
metrics:
  place: place
  lost: aspects['loss']['dropped']
  mean_place: sum(signals['walk.output']['value']) / len(signals['walk.output']['value'])
"""


def write(folder: Path, study: str = STUDY, model: str = MODEL) -> Path:
    """A study and its model as files."""
    folder.mkdir(exist_ok=True)
    (folder / "walk.yaml").write_text(model, encoding="utf-8")
    path = folder / "walks.yaml"
    path.write_text(study, encoding="utf-8")
    return path


def command(*arguments: object) -> list[str]:
    """The command line in a process of its own."""
    return [sys.executable, "-m", "epicycle.runner.interface.cli", *map(str, arguments)]


def plan_of(path: Path, **changes: Any) -> Any:
    """A study that has been tried."""
    from epicycle.runner.model.language.study import read_study
    from epicycle.runner.study.plan.plan import Plan

    return Plan.made(read_study(path, types=[THIS], **changes))


def moved(manifest: Mapping[str, Any], study: Path) -> dict[str, Any]:
    """The manifest of a study that this user has made elsewhere."""
    file = str(study)
    return {**manifest, "file": file, "seal": seal(sealed(file, manifest["text"], manifest.get("code", {})))}
