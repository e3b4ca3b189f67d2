"""An emergency room: patients wait for a bed by urgency, or leave; in it, for a doctor and a nurse together."""

from __future__ import annotations

import random

import simpy

from .measures import Level, mean

MINUTE = 60.0


def run(seed: int, stop: float = 24 * 60 * MINUTE) -> dict[str, float]:
    """The metrics of a day."""
    draw = random.Random(seed)
    env = simpy.Environment()
    beds, doctors, nurses = (simpy.PriorityResource(env, number) for number in (7, 5, 6))
    queue, busy = Level(env), Level(env)
    waits: dict[int, list[float]] = {1: [], 2: [], 3: []}
    count = {"came": 0, "treated": 0, "left": 0}

    def patient() -> simpy.events.ProcessGenerator:
        came = env.now
        severity = draw.choices((1, 2, 3), (0.2, 0.3, 0.5))[0]
        work = draw.expovariate(1 / (25 * MINUTE))
        with beds.request(severity) as bed:
            if not bed.triggered:
                queue.add(1)
                patience = env.timeout(draw.expovariate(1 / (90 * MINUTE)))
                yield bed | patience
                queue.add(-1)
            if not bed.triggered:
                count["left"] += 1
                return
            with doctors.request(severity) as doctor, nurses.request(severity) as nurse:
                doctor.callbacks.append(lambda _: busy.add(1))
                yield doctor & nurse
                waits[severity].append(env.now - came)
                yield env.timeout(work)
                busy.add(-1)
        count["treated"] += 1

    def door() -> simpy.events.ProcessGenerator:
        while True:
            yield env.timeout(draw.expovariate(1 / (6 * MINUTE)))
            count["came"] += 1
            env.process(patient())

    env.process(door())
    env.run(stop)
    of_class = dict(zip(("wait_urgent", "wait_normal", "wait_light"), waits.values(), strict=True))
    return {
        **count,
        "wait": mean([wait for each in waits.values() for wait in each]) / MINUTE,
        **{name: mean(each) / MINUTE for name, each in of_class.items()},
        "queue": queue.mean(),
        "busy": busy.mean(),
    }
