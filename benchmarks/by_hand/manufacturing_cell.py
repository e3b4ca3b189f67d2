"""A manufacturing cell: three lathes, then a mill, all loaded and unloaded by one robot; the mill goes first."""

from __future__ import annotations

import random

import simpy

from .measures import Level, mean

DAY, LATHES, HANDLING = 86_400.0, 3, 50.0
NIGHT = -1  # rank


def run(seed: int, stop: float = 5 * DAY) -> dict[str, float]:
    """The metrics of five days."""
    draw = random.Random(seed)
    env = simpy.Environment()
    store, buffer, robot = simpy.Store(env), simpy.Store(env), simpy.PriorityResource(env)
    waiting, busy = Level(env), Level(env)
    times = {name: Level(env) for name in ("lathes", "mill", "mill_waits")}
    stays: list[float] = []

    def blanks() -> simpy.events.ProcessGenerator:
        while True:
            yield env.timeout(draw.expovariate(1 / 420.0))
            store.put(env.now)

    def handle(rank: int) -> simpy.events.ProcessGenerator:
        waiting.add(1)
        with robot.request(rank) as hand:
            yield hand
            waiting.add(-1)
            busy.add(1)
            yield env.timeout(HANDLING)
            busy.add(-1)

    def lathe() -> simpy.events.ProcessGenerator:
        while True:
            came = yield store.get()
            work = draw.gammavariate(4.0, 720.0 / 4.0)
            yield from handle(1)
            times["lathes"].add(1)
            yield env.timeout(work)
            times["lathes"].add(-1)
            yield from handle(1)
            buffer.put(came)

    def mill() -> simpy.events.ProcessGenerator:
        while True:
            came = yield buffer.get()
            work = draw.gammavariate(4.0, 150.0 / 4.0)
            for is_loaded in (True, False):
                times["mill_waits"].add(1)
                with robot.request(0) as hand:
                    waiting.add(1)
                    yield hand
                    waiting.add(-1)
                    times["mill_waits"].add(-1)
                    busy.add(1)
                    yield env.timeout(HANDLING)
                    busy.add(-1)
                if is_loaded:
                    times["mill"].add(1)
                    yield env.timeout(work)
                    times["mill"].add(-1)
            stays.append(env.now - came)

    def night() -> simpy.events.ProcessGenerator:
        while True:
            yield env.timeout(20 * 3600.0)
            with robot.request(NIGHT) as hand:
                yield hand
                yield env.timeout(DAY - env.now % DAY)

    env.process(blanks())
    for _ in range(LATHES):
        env.process(lathe())
    env.process(mill())
    env.process(night())
    env.run(stop)
    return {
        "boxes": len(stays) // 12,
        "stay": mean(stays) / 60,
        "robot": 100 * busy.mean(),
        "waiting": waiting.mean(),
        "lathes": 100 * times["lathes"].mean() / LATHES,
        "mill": 100 * times["mill"].mean(),
        "mill_waits": 100 * times["mill_waits"].mean(),
    }
