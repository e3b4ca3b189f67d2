"""A pendulum that is kept upright over a network that loses and delays, by Euler's steps of a millisecond."""

from __future__ import annotations

import math
import random

import simpy

from .measures import mean

STEP, PERIOD = 0.001, 0.05  # s


def run(seed: int, stop: float = 60.0) -> dict[str, float]:
    """The metrics of a minute."""
    draw = random.Random(seed)
    env = simpy.Environment()
    theta, omega, u, w = 0.1, 0.0, 0.0, 0.0
    angles: list[float] = []
    last = {"there": 0.0, "back": 0.0}

    def arrival(way: str) -> float:
        """When a message arrives that is sent now: none overtakes another."""
        last[way] = max(last[way], env.now + 0.005 + draw.expovariate(1 / 0.002))
        return last[way] - env.now

    def command(angle: float, speed: float) -> simpy.events.ProcessGenerator:
        nonlocal u
        yield env.timeout(arrival("there"))
        force = -(25 * angle + 7 * speed)
        if draw.random() >= 0.1:
            yield env.timeout(arrival("back"))
            u = force

    def plant() -> simpy.events.ProcessGenerator:
        nonlocal theta, omega, w
        steps = 0
        while abs(theta) <= math.pi / 3:
            if steps % round(PERIOD / STEP) == 0:
                angles.append(theta)
                w = draw.gauss(0.0, 0.5)
                env.process(command(theta, omega))
            yield env.timeout(STEP)
            theta, omega = theta + STEP * omega, omega + STEP * (9.81 * math.sin(theta) + u + w)
            steps += 1

    env.process(plant())
    env.run(stop)
    middle = mean(angles)
    return {
        "swing": math.degrees(math.sqrt(sum((angle - middle) ** 2 for angle in angles) / (len(angles) - 1))),
        "worst": math.degrees(max(angles)),
    }
