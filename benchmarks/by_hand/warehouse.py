"""A warehouse: robots fetch what is ordered, each at its own pace, and share three chargers.

In every mode the charge has a closed form, so no robot needs a step but those of its way.
"""

from __future__ import annotations

import math
import random

import simpy

from .measures import Level, mean

ROBOTS, CHARGERS, LOW, FULL = 20, 3, 0.2, 0.9
CHARGING, RESTING, DRIVING, CARRYING = 720.0, 108_000.0, 6_000.0, 3_600.0  # s


class Robot:
    """A robot: its mode, and its charge since it entered this mode."""

    def __init__(self, env: simpy.Environment, charge: float) -> None:
        self.env, self.charge, self.mode, self.since = env, charge, "idle", 0.0
        self.times = dict.fromkeys(("idle", "fetching", "carrying", "waiting", "charging"), 0.0)

    def now(self) -> float:
        """Its charge now."""
        passed = self.env.now - self.since
        if self.mode == "charging":
            return 1 - (1 - self.charge) * math.exp(-passed / CHARGING)
        return self.charge - passed / {"fetching": DRIVING, "carrying": CARRYING}.get(self.mode, RESTING)

    def enter(self, mode: str) -> None:
        """Change the mode."""
        self.charge = self.now()
        self.times[self.mode] += self.env.now - self.since
        self.mode, self.since = mode, self.env.now


def run(seed: int, stop: float = 6 * 3600.0) -> dict[str, float]:
    """The metrics of six hours."""
    draw = random.Random(seed)
    env = simpy.Environment()
    orders, chargers, queue = simpy.Store(env), simpy.Resource(env, CHARGERS), Level(env)
    robots = [Robot(env, LOW + (FULL - LOW) * (index + 1) / ROBOTS) for index in range(ROBOTS)]
    delivered: list[float] = []
    charges: list[float] = []

    def customers() -> simpy.events.ProcessGenerator:
        while True:
            yield env.timeout(draw.expovariate(1 / 40.0))
            orders.put((draw.uniform(40.0, 240.0), env.now))

    def work(robot: Robot, speed: float) -> simpy.events.ProcessGenerator:
        while True:
            way, came = yield orders.get()
            for mode in ("fetching", "carrying"):
                robot.enter(mode)
                yield env.timeout(way / speed)
            delivered.append(env.now - came)
            robot.enter("idle")
            if robot.charge < LOW:
                with chargers.request() as plug:
                    robot.enter("waiting")
                    queue.add(1)
                    yield plug
                    queue.add(-1)
                    robot.enter("charging")
                    yield env.timeout(CHARGING * math.log((1 - robot.charge) / (1 - FULL)))
                    robot.enter("idle")

    def look() -> simpy.events.ProcessGenerator:
        while True:
            charges.extend(robot.now() for robot in robots)
            yield env.timeout(120.0)

    env.process(customers())
    for index, robot in enumerate(robots):
        env.process(work(robot, 1.2 * (1 + 0.5 * index / ROBOTS)))
    env.process(look())
    env.run(stop)
    for robot in robots:
        robot.enter(robot.mode)
    shares = {
        mode: 100 * sum(robot.times[mode] for robot in robots) / stop / ROBOTS for mode in ("charging", "waiting")
    }
    return {
        "orders": len(delivered) / stop * 3600,
        "delivery": mean(delivered) / 60,
        **shares,
        "queue": queue.most,
        "lowest": 100 * min(charges),
    }
