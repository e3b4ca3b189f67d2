"""What tests of the packaged demo models share."""

from __future__ import annotations

from typing import Any

from epicycle.runner import Simulation, load_model
from epicycle.runner.engine import Results


def run(name: str, seed: int = 1, until: float | None = None, keep_log: bool = False, **settings: Any) -> Results:
    model = load_model(name, set=[f"{path}={value}" for path, value in settings.items()])
    return Simulation(model, seed=seed, keep_log=keep_log).run(until=until)
