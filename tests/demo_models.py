"""What tests of the packaged models share."""

from __future__ import annotations

from typing import Any

from epicycle.runner import Simulation, load_model
from epicycle.runner.execution.engine import Results

# How long tests of all packaged models let those run in which much happens (s).
DURATIONS = {
    "changing_roles": 1.2,
    "collision_avoidance": 0.5,
    "flying_observers": 1.0,
    "lift_group": 600.0,
    "machine_shop": 40_000.0,
    "many_obstacles": 0.5,
    "pid_loop": 10.0,
    "safe_avoidance": 0.5,
    "switched_network": 1.5,
    "warehouse": 1800.0,
    "waypoints": 20.0,
}


def run(name: str, seed: int = 1, until: float | None = None, keep_log: bool = False, **settings: Any) -> Results:
    model = load_model(name, set=[f"{path}={value}" for path, value in settings.items()])
    return Simulation(model, seed=seed, keep_log=keep_log).run(until=until)
